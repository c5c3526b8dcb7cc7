// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/progress.hpp"
#include "radiosity/simulation/traced_reference.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity {

struct CompareOptions {
  double budget_s = 120;  ///< s of wall time for the whole comparison
  std::uint64_t seed = 1;
  std::size_t memory_limit_bytes = 0;  ///< of each F; 0: the memory of this machine
  Progress progress = {};              ///< fraction of the budget spent
  std::function<void(const Patches&)> meshed =
      {};  ///< called with the user's patches before anything is solved
  /// An independent judge of all that is solved on the user's patches, in a tenth of the budget; empty: none.
  TraceIrradiance trace = {};
};

/// Error of a radiosity B against a reference R, relative to the reflected radiosity R − E:
struct RelativeError {
  double rms = 0;  ///< √(Σ A_i (B_i − R_i)² / Σ A_i (R_i − E_i)²), in the band where it is largest
  double largest = 0;  ///< |B_i − R_i| / (R_i − E_i) at most, where R_i − E_i is 1 % of its mean or more
};
/// All arrays are n × bands, W/m². Patches where the reference is not a number (see restrict_to) do not count. Throws InputError on
/// other shapes.
RelativeError relative_error(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference);

struct CostAndError {
  double cost, error;
};
/// Indices of the points that no other undercuts in one of cost and error without exceeding them in the other, by rising cost; the
/// first of equals.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);
/// Index of the cheapest point whose error is `error` or less; the first of equals.
std::optional<std::size_t> cheapest(std::span<const CostAndError> points, double error);

/// The settings at which a method is compared, by rising work: 1/16, 1/4, 1, 4 and 16 times its default number of samples. For the
/// hemicube 1, 4 and 16 viewpoints (4 is the default), each at 1/4, 1/2, 1 and 2 times the default number of cells along an edge.
std::vector<FormFactorOptions> ladder(const FormFactorMethodInfo& method);

struct ComparedMesh {
  PatchOptions options;
  double size = 0;       ///< m, the patch size; where no face had to be divided, the longest edge
  Index patches = 0;     ///< unknowns: clusters where there are any
  double seconds = 0;    ///< for the patches and their visibility
  double own_noise = 0;  ///< ComparedReference::noise of the finer reference, on these patches
};

/// A method at one setting on one mesh.
struct ComparedRun {
  std::size_t mesh = 0;  ///< index into Comparison::meshes
  std::string method;
  FormFactorOptions settings;
  bool standard = false;      ///< the method's default setting
  double predicted_s = 0;     ///< for F, extrapolated from a few rows
  std::string left_out = {};  ///< why it did not run; empty: it did
  double seconds = 0;         ///< for patches, form factors and solution
  double bytes = 0;           ///< of F
  std::uint64_t rays = 0;
  /// Against the reference on the same patches: the error of the form factors. Only on the user's mesh.
  std::optional<RelativeError> factors = {};
  /// Against the finer reference: the error of form factors and patches.
  std::optional<RelativeError> total = {};
  /// By CompareOptions::trace: the error of form factors and patches. Only on the user's mesh.
  std::optional<TracedError> traced = {};
  /// n: max over the bands of |B_i − R_i| / mean(R − E) against the reference on the same patches. Only on the user's mesh, and
  /// for one run of each method: the default setting, or where that did not run the finest that did.
  Eigen::ArrayXd where = {};
};

/// A solver at the first iteration whose residual is within a tolerance. All solvers have the same F.
struct SolverRun {
  std::string solver;
  double tolerance = 0;
  std::string left_out = {};  ///< why it was not reached; empty: it was
  double products = 0;        ///< passes over F; a shot reads one row of n
  double seconds = 0;
  double residual = 0;                     ///< the solver's own estimate
  double error = 0;                        ///< RelativeError::rms against the solution of the same F to 1e-12
  std::optional<TracedError> traced = {};  ///< by CompareOptions::trace: F, patches and solver together
};

/// A solution that runs are judged by.
struct ComparedReference {
  std::string method;
  FormFactorOptions settings;
  int solves = 1;   ///< 2: the mean of two solutions of different seeds
  double size = 0;  ///< m, of its patches
  Index patches = 0;
  double seconds = 0;
  /// Error of its form factors, measured: relative as RelativeError::rms, on the user's patches.
  double noise = 0;
  /// Error of its patches, and the order p at which it falls with their size (see compare). Only of the finer reference.
  std::optional<double> patch_error = {}, order = {};
  bool order_assumed =
      false;  ///< p could not be measured, or not within [1, 2]: 1, the least that is expected
  std::optional<TracedError> traced = {};  ///< by CompareOptions::trace, on the user's patches

  double own_error() const;  ///< √(noise² + patch_error²)
};

/// What CompareOptions::trace was asked: its own noise is a share of the reflected light of a patch.
struct ComparedTracing {
  Index patches = 0, rounds = 0, paths = 0;  ///< traced; times; paths of each in a round
  double seconds = 0, noise = 0;             ///< TracedReference::noise
};

struct Comparison {
  std::vector<ComparedMesh> meshes;        ///< from coarse to fine
  std::size_t own = 0;                     ///< index of the user's mesh
  std::optional<PatchMesh> mesh;           ///< the user's mesh; always there
  BandArray radiosity;                     ///< the reference on it, n × bands, W/m²
  ComparedReference factors;               ///< on the user's patches
  std::optional<ComparedReference> finer;  ///< on finer patches; nothing where the budget does not allow it
  std::optional<ComparedTracing> tracing;  ///< nothing where it was not wanted or did not fit
  std::vector<ComparedRun> runs;           ///< by mesh, method and setting
  std::vector<SolverRun> solvers;
  std::vector<std::string> notes;
  double seconds = 0, budget_s = 0;
  bool completed = true;  ///< false: `progress` asked to stop; what had been measured is here
  /// n: ComparedRun::where of the reference on the user's patches against the finer one, i.e. of the patches alone.
  Eigen::ArrayXd where_patches;
};

/// Upper bound of a run's error, relative as RelativeError::rms: that measured, plus that of the reference. Against the finer
/// reference where there is one, otherwise by path tracing, and without that of the form factors alone; nothing where the run was not
/// measured.
std::optional<double> error_at_most(const Comparison& comparison, const ComparedRun& run);

/// Costs and errors (error_at_most) of the runs that were measured; `index` is that into Comparison::runs.
struct Measured {
  std::vector<std::size_t> index;
  std::vector<CostAndError> by_seconds, by_bytes;
};
Measured measured(const Comparison& comparison);

/// Measures the time, memory and error of every method at the settings of its ladder, on meshes of four, two, one and half times the
/// patch size, and of every solver at tolerances 1e-1 … 1e-8.
///
/// Where small faces are joined to clusters, patches are clusters below: errors are those of means over them.
///
/// Errors are against two references of about a quarter of the budget each: one on the user's patches, one on patches of a quarter
/// (or half) their size (nested in the user's but where these are clusters), averaged over the coarser ones. Their form factors are
/// - analytic where no patch hides another, exact in one solution, if both references fit into half of the budget; the finer one on
///   patches of a third or half the size if a quarter takes too long;
/// - elsewhere analytic with 16 times the default number of points, if that fits. The error falls as 1/N with the number of points, so
///   the noise is a third of the difference to a quarter as many;
/// - otherwise by as many rays as fit: the mean of two solutions of different seeds. The noise is half their difference.
///
/// Where there is CompareOptions::trace, it judges the references, and all runs on the user's patches and the solvers, on up to 256
/// patches (see TracedReference).
///
/// Left out are runs that have more than a tenth of the rays or points of a reference, which could not judge them, and those that do
/// not fit into the budget. Default settings on the user's patches run first if they take no more than a quarter of what is left of
/// it, then the cheapest.
///
/// The error of the finer reference's patches follows from that of the user's. If patches of size h have an error C h^p, the errors
/// against a reference of size h/k are
///   e(h) = C h^p (1 − k^−p),  e(2h) = C h^p (2^p − k^−p).
/// Their ratio gives p; where that is not within [1, 2], p = 1. The reference then has the error e(h)/(k^p − 1).
///
/// Times are wall time: the load of the machine decides which runs fit, but not the errors of those that do. Throws InputError on a
/// budget that is not positive, or too short for a reference with 256 rays per patch. Where `progress` stops the comparison before
/// there is a reference, `runs` is empty and `completed` false.
Comparison compare(const Scene& scene, const PatchOptions& patches, const CompareOptions& options = {});

}  // namespace radiosity
