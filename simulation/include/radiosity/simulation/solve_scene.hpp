// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/scene_settings.hpp"
#include "radiosity/simulation/accuracy.hpp"
#include "radiosity/simulation/choose_method.hpp"
#include "radiosity/simulation/elements.hpp"
#include "radiosity/simulation/error_estimate.hpp"
#include "radiosity/simulation/probe.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

struct SolvedScene;

enum class SolveStage { patches, method, form_factors, solve, error, elements };

/// Bytes: what was asked for, or where that is 0 the memory of this machine, beyond which a program is not told but killed.
std::size_t memory_limit(std::size_t asked);

/// What a caller may want beside what a scene file says. Every function is called on the calling thread.
struct SolveOptions {
  bool close = true;           ///< restore reciprocity and closure
  bool estimate_error = true;  ///< solve cheaper problems too, to tell how far the result is off
  /// Where the error is estimated: take off what larger patches tell of that of the patches (see estimate_error). It always is on the
  /// way to an accuracy.
  bool extrapolate = false;
  /// Largest error that is wanted, as ErrorEstimate::total. Patches, samples, tolerance, and the method where it is "auto" or not
  /// given, are then found in rounds, and those of the settings are not used.
  std::optional<double> accuracy = {};
  double seconds =
      std::numeric_limits<double>::infinity();  ///< wall time after which the work stops with what there is
  std::size_t memory_limit_bytes = 0;           ///< of F, on each rank; 0: the memory of this machine
  /// Share the work, null: this process does all of it. All ranks solve the same scene with the same settings, and each gets all of the
  /// solution, to the bits of one process. Of clocks that of rank 0 is believed, of limits of memory the least. Not by solvers that
  /// read rows.
  std::shared_ptr<const Ranks> ranks = {};
  /// In place of the one that the settings name.
  std::function<std::unique_ptr<Solver>()> make_solver = {};

  /// The fraction of a stage that is done. False asks to stop: what has been reached is returned.
  std::function<bool(SolveStage, double fraction)> progress = {};
  /// A stage has ended; of the scene, what it and those before it found is filled in. Not called of the rounds of an accuracy.
  std::function<void(SolveStage, const SolvedScene&)> ended = {};
  /// F, of several ranks the rows that this one owns, and what was found of it, where it is not to be computed: for the patches that
  /// it is called with. Method and settings are then those that made it. Not of an accuracy.
  std::function<AssembledFormFactors(const PatchMesh&)> form_factors = {};
  /// State of an earlier run of the same that did not come to its end, and where this one's goes: see AssemblyOptions, ProbeOptions and
  /// SolverOptions. The bits are those of a run that was not ended. Shots are those of rows on demand, where nobody looks at steps; other
  /// solves, and the error estimate, begin anew. Not of an accuracy.
  std::shared_ptr<const PartialRows> partial_rows = {};
  std::shared_ptr<const ShootingState> partial_shots = {};
  std::shared_ptr<const PartialProbe> partial_elements = {};
  std::function<void(Index done, const std::function<PartialRows()>& state)> save_rows = {};
  std::function<void(Index shots, const std::function<ShootingState()>& state)> save_shots = {};
  std::function<void(Index done, const std::function<PartialProbe()>& state)> save_elements = {};
  /// SolverOptions::step. Not called of the rounds of an accuracy.
  std::function<void(Index iteration, const BandArray& radiosity)> step = {};
  /// Of an accuracy: a round has ended; the next one is about to begin.
  std::function<void(const AccuracyRound&)> round_ended = {};
  std::function<void(const AccuracyPlan&)> round_planned = {};
};

/// What the scene did not need, and why: a sentence each.
struct Modelled {
  Index bands = 0;
  bool occlusion = true;
  std::vector<std::string> left_out = {};
  /// Counted, not timed; absent where the run does not tell.
  struct Saved {
    /// Columns of B that F was not multiplied with: bands left out × iterations.
    std::optional<std::uint64_t> band_products;
    std::optional<std::uint64_t> radiosity_bytes;  ///< of B: 8 × patches × bands left out
    /// Pairs not asked whether anything stands between them.
    std::optional<std::uint64_t> visibility_tests;
    /// Pairs without a factor to compute, as they face away.
    std::optional<std::uint64_t> pairs_behind;
  } saved = {};
  Symmetry symmetry = {};  ///< of which one cell was solved
};

enum class FormFactorStorage { dense, sparse, rows };
/// As it is written.
std::string_view name_of(FormFactorStorage storage);

struct FormFactorFacts {
  std::string method, why;    ///< why it was chosen; empty where it was given
  FormFactorOptions options;  ///< in force
  bool reciprocal = false;    ///< pairs, not directions
  bool exact = false;
  FormFactorStorage storage = FormFactorStorage::dense;
  std::size_t nonzeros = 0, bytes = 0;  ///< of what is stored, on all ranks
  std::size_t own_bytes = 0;            ///< on this one
  AssemblyReport assembly;
};

/// How an accuracy was reached, or was not.
struct AccuracyReport {
  double goal = 0;
  bool reached = false;
  std::string why_not;  ///< words; empty where it was reached
  std::vector<AccuracyRound> rounds;
};

/// A scene, its solution, and what is known of both. Where the scene has set-ups of its lamps, the bands of patches and solution are
/// those of the scene as it is, then those of each set-up.
struct SolvedScene {
  Patches patches;
  Index bands = 0;  ///< of one set-up
  Modelled modelled;
  FormFactorFacts form_factors = {};
  std::vector<std::string> warnings = {};

  std::string solver = {};
  SolverOptions solver_options = {};  ///< in force, but without its functions
  Solution solution = {};
  std::optional<ErrorEstimate> error =
      {};  ///< absent where it was not asked for, or nothing converged, or it was stopped
  std::optional<AccuracyReport> accuracy = {};
  std::optional<Elements> elements =
      {};  ///< absent where none were asked for, or the work was stopped before all were lit

  struct Seconds {
    double mesh = 0, form_factors = 0, solve = 0, error = 0, elements = 0;
  } seconds = {};

  bool converged() const { return solution.report.status == SolveStatus::converged; }
  /// Those of set-up `k`, counted from 1; 0: the scene as it is.
  PatchMesh mesh_of_setup(Index k) const;
  Solution solution_of_setup(Index k) const;
  EnergyBalance energy_of_setup(Index k) const;
  /// n × bands, W/m²; nothing where a part of the error is not known.
  std::optional<BandArray> error_of_setup(Index k) const;

  /// Where light is told: on the elements, or else on the patches.
  struct Told {
    PatchMesh mesh;
    Solution solution;
    std::optional<BandArray> error;  ///< that of the patch and the noise of the element together
    std::vector<Index>
        patch;  ///< of each cell, the patch or cluster that it is a piece of; empty where all are patches
  };
  Told told_of_setup(Index k) const;
};

/// Divides a scene into patches, computes their form factors, solves (I − ρF)B = E for all bands and set-ups, and estimates the error.
/// Bands that are equal in every material are solved once. Without a method, one is chosen (see choose_method). Throws InputError on
/// settings that have no effect, a scene without a lamp, and what the parts refuse; MemoryLimitError where F does not fit.
///
/// With a size of elements, light is gathered once more in the end, for pieces of the patches (see gather_elements), and the error
/// takes their noise in. So it is for the members of clusters, as they are, where nothing is said of elements.
///
/// With an accuracy, first rounds are cheap and show what this scene costs and errs by; plan_accuracy says what comes next, until the
/// estimate is low enough or cannot be brought down further. The result is that of the best round.
SolvedScene solve_scene(const Scene& scene, const SceneSettings& settings = {},
                        const SolveOptions& options = {}, std::span<const LightingSetup> setups = {});

/// The form factors alone. `accuracy`, and what concerns the solver, is not used.
struct SceneFormFactors {
  SolvedScene scene;  ///< without a solution; its assembly is not `completed` where the work was stopped
  FormFactorMatrix matrix;
};
SceneFormFactors scene_form_factors(const Scene& scene, const SceneSettings& settings = {},
                                    const SolveOptions& options = {});

}  // namespace radiosity
