// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

/// How far B is from the radiosities of the scene, averaged over each patch. Parts and total are relative to the light that was
/// reflected, √(Σ A_i e_i² / Σ A_i (B_i − E_i)²), in the band where that is largest: what the lamps emit is no result.
struct ErrorEstimate {
  std::optional<double>
      form_factors;               ///< noise and visibility of F, and what could not be restored of its rows
  std::optional<double> patches;  ///< B is constant on each patch; absent where no larger patches tell
  double unsampled = 0;           ///< of `form_factors`: what no samples mend, pair by pair or near others
  double solver = 0;              ///< what the residual leaves
  std::optional<double> gather;   ///< noise of the elements; absent where light is told of the patches
  double known = 0;  ///< √(sum of squares) of what is known of the parts: a lower bound where not all is
  std::optional<double> total;  ///< the same where all of it is known, absent where it is not
  /// Largest error of a patch over what it reflects, of those that reflect 1 % of the mean or more; absent where the total is.
  std::optional<double> largest;
  std::optional<double> order;  ///< p, measured: the error of the patches falls as size^p
  BandArray per_patch;          ///< n × bands, W/m²; of the parts that are known
  /// What larger patches tell of the error of the patches, to be added to H (see add_irradiance): n × bands, W/m². Empty where that was not
  /// asked for, or they tell nothing.
  BandArray correction;
  std::vector<std::string> notes;  ///< what could not be estimated, and why
};

/// What was solved, and how: enough to solve it again with other settings.
struct SolvedProblem {
  const Scene& scene;
  const Patches& patches;
  const Visibility& visibility;
  const FormFactorMethodInfo& method;
  FormFactorOptions form_factor_options;
  AssemblyOptions assembly;  ///< its progress may stop the estimate too
  const Solver& solver;
  SolverOptions solver_options;
  const Solution& solution;
  Index lamps = 0;                                        ///< AssemblyReport::lamps
  double unrestored = 0;                                  ///< AssemblyReport::unrestored()
  std::vector<std::pair<Index, double>> unreliable = {};  ///< AssemblyReport::unreliable
  /// AssemblyReport::pair_rows: what was computed pair by pair has no noise of directions, and no other rows are spared it.
  std::shared_ptr<const PairRows> pair_rows = {};
  bool extrapolate = false;  ///< what the error of the patches would be once its `correction` is added
};

/// Estimates the error of a solution by solving cheaper problems:
///
/// Form factors: the same mesh with fewer samples. Where the method samples, the two are independent; if the cheaper one has r
/// times the variance, the rms of the difference D is √(1 + r) times the error of the better one. Where it is
/// deterministic and its error falls as 1/N with the number of points, D is N/N' − 1 times that error. Methods that are exact
/// have none. Hemicubes over fewer than four points are compared with four on patches of twice the size instead, and D is halved, as
/// their error falls with the size (unless lamps are computed pair by pair on only one of the two meshes).
///
/// Patches: joined to patches of about two and four times their size h, of g₂ and g₄ times where some have few others beside them
/// (see coarsen), B being constant on these (see aggregate), compared with the means of B over them. With an error C h^p
///   E₂ = C h^p (g₂^p − 1),  E₄ = C h^p (g₄^p − 1)  (Richardson: E₄/E₂ tells the order p, kept within [1.15, 3/2]).
/// The error of B is then E₂ / (g₂^p − 1). The form factors are those of the solution, so that what they are wrong by is in neither.
/// On patches twice as large B was B₂, so H without what B does within them is F B₂, and with it F B = H. Patches half as large would
/// add to H a share of what that made of it:
///   H' = H + c F (B − B₂),  c = 1 / (2^p − 1) = 0.45 for p = 1.7,
/// of each patch half of H at most. What is then left of the error is taken to be 0.65 of it where E₄ is twice E₂, 1.2 where it is
/// no larger (docs/calibration.md).
///
/// Solver: the residual, a share of the power emitted, is amplified at most as much as that power is: the relative error
/// of the total radiosity is the residual.
///
/// Factors that were computed pair by pair: with the solution's B, what some clusters receive by them is compared with four times their
/// points or shadow rays (see pair_errors).
///
/// Factors that are known to be wrong, of a share s of a patch: as if what that share reflects should be nothing, and others had got it
/// instead of the right light: e² = Σ A (s R)² / Σ A R² + (Σ A s R / Σ A R)², R = B − E.
///
/// A part is not known, and a note says why, where its cheaper problem cannot be solved, for want of memory or because it breaks a
/// rule, or where hardly a patch has others beside it to be joined with.
/// F is that of the solution; it is freed as soon as it has been read. Nothing where the progress function asked to stop.
std::optional<ErrorEstimate> estimate_error(const SolvedProblem& problem,
                                            std::unique_ptr<const FormFactorMatrix> form_factors);

}  // namespace radiosity
