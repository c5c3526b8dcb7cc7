// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/progress.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity {

struct CompareOptions {
  double budget_s = 120;  ///< bounds the whole comparison
  std::uint64_t seed = 1;
  std::size_t memory_limit_bytes = 0;  ///< of each F; 0: the memory of this machine
  Progress progress = {};
  std::function<void(const Patches&)> meshed =
      {};  ///< told of the user's patches before anything is compared
};

/// How far B is from a reference, over all patches and bands:
struct RelativeError {
  double rms = 0;  ///< √(Σ A_i (B_i − R_i)² / Σ A_i (R_i − E_i)²), in the band where it is largest
  double largest = 0;  ///< largest |B_i − R_i| / (R_i − E_i) where R_i − E_i is 1 % of its mean or more
};
/// All arrays are n × bands. Patches where the reference is not a number (see restrict_to) do not count.
RelativeError relative_error(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference);

/// What something costs and what it errs by.
struct CostAndError {
  double cost, error;
};
/// Indices of those that no other beats in one respect without losing in the other, by rising cost.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);
/// The index of the cheapest that errs by no more; the first of equals.
std::optional<std::size_t> cheapest(std::span<const CostAndError> points, double error);

/// The settings of a method that are compared, by rising work: its default, and the number of samples times 4 and 16 and divided
/// by them. A method with cells: 1, 4 and 16 viewpoints where 4 is the default, each at ¼, ½, 1 and 2 times the default
/// number of cells along an edge.
std::vector<FormFactorOptions> ladder(const FormFactorMethodInfo& method);

/// One of the meshes that are compared.
struct ComparedMesh {
  PatchOptions options;  ///< that make it
  double size = 0;       ///< m, the longest edge that was allowed, or that there is where nothing was divided
  Index patches = 0;
  double seconds = 0;    ///< to make it, and to prepare its visibility
  double own_noise = 0;  ///< of the finer reference on these patches, relative as RelativeError::rms
};

/// A method at one setting on one mesh.
struct ComparedRun {
  std::size_t mesh = 0;  ///< of Comparison::meshes
  std::string method;
  FormFactorOptions settings;  ///< in force
  bool standard = false;       ///< the method's default
  double predicted_s = 0;
  std::string left_out;  ///< why it did not run; empty: it did
  double seconds = 0;    ///< patches, form factors and solution
  double bytes = 0;      ///< of F
  std::uint64_t rays = 0;
  /// Against the same patches with better factors; only on the user's mesh.
  std::optional<RelativeError> factors;
  /// Against a finer mesh with better factors: all that is wrong.
  std::optional<RelativeError> total;
  /// n: largest of the bands of |B_i − R_i| over the mean of R − E, against the same patches. On the user's mesh, for one
  /// run per method: that of the default setting, or the finest there is without it.
  Eigen::ArrayXd where;
};

/// A solver when its residual first was below a tolerance, on one and the same F.
struct SolverRun {
  std::string solver;
  double tolerance = 0;
  std::string left_out;
  double products = 0;  ///< passes over F; a shot reads one row of n
  double seconds = 0;
  double residual = 0;  ///< the solver's own estimate
  double error = 0;     ///< RelativeError::rms against the solution of the same F to 1e-12
};

/// What the runs are held against.
struct ComparedReference {
  std::string method;
  FormFactorOptions settings;
  int solves = 1;  ///< averaged, with different seeds; or the better of two resolutions
  double size = 0;
  Index patches = 0;
  double seconds = 0;
  double noise =
      0;  ///< error of its factors, measured; relative as RelativeError::rms, on the user's patches
  /// Error of its own patches, and the order at which it falls with their size; by Richardson's extrapolation.
  std::optional<double> patch_error;
  std::optional<double> order;
  bool order_assumed =
      false;  ///< no mesh of twice the size tells one within [1, 2]: 1, the least that is expected
  double own_error() const;  ///< √(noise² + patch_error²)
};

struct Comparison {
  std::vector<ComparedMesh> meshes;  ///< coarse to fine
  std::size_t own = 0;            ///< the user's mesh among them
  std::optional<PatchMesh> mesh;  ///< that mesh; always there
  BandArray radiosity;            ///< the reference there, n × bands, W/m²
  ComparedReference factors;         ///< same patches
  std::optional<ComparedReference> finer;
  std::vector<ComparedRun> runs;  ///< by mesh, method and setting
  std::vector<SolverRun> solvers;
  std::vector<std::string> notes;
  double seconds = 0, budget_s = 0;
  bool completed = true;  ///< false: `progress` asked to stop; what had been measured is here
  /// max |B_i − R_i| / mean(R − E) on the user's patches from patches alone, n: their reference against the finer one.
  Eigen::ArrayXd where_patches;
};

/// What a run errs by at most: what was measured, plus what the reference errs by itself. Against the finer reference where there
/// is one, otherwise of the factors alone; nothing where neither was measured.
std::optional<double> error_at_most(const Comparison& comparison, const ComparedRun& run);

/// Those of `runs` that were measured, with `error_at_most`; `index` tells which.
struct Measured {
  std::vector<std::size_t> index;
  std::vector<CostAndError> by_seconds, by_bytes;
};
Measured measured(const Comparison& comparison);

/// Runs every method at its ladder of settings, on meshes of four, two, one and half times the patch size, and every solver at
/// tolerances 1e-1 … 1e-8, and measures how far they are off.
///
/// References: the user's patches, and patches of a quarter (or half) the size averaged over the coarser ones, each in about a
/// quarter of the budget. Where no patch hides another they are analytic, exact in one solution, if both fit into half of the
/// budget, on patches of a third or half the size if those of a quarter do not. Elsewhere, the analytic method with 16 times the default
/// number of points if its quarter suffices, and otherwise as many rays as that allows: two solutions
/// of different seeds, averaged. Their own noise is measured: half their difference; of the points, whose error falls as 1/N,
/// a third of the difference to a quarter as many. A rung that has more than a tenth of the rays or points of a reference is left
/// out, and so are those that would not end within the budget. Default settings on the user's patches run first where they take no
/// more than a quarter of what is left, then the cheapest.
///
/// The finer reference has patches, too: with an error C h^p of patches of size h and a reference of size h/k,
///   e(h) = C h^p (1 − k^−p),  e(2h) = C h^p (2^p − k^−p),
/// whose ratio tells p, or it is taken to be 1 where that is not within [1, 2]; the reference errs by e(h)/(k^p − 1).
///
/// Times are wall time, so which rungs fit depends on the machine and the hour; the errors of those that ran do not.
/// Throws InputError where the budget does not even suffice for a reference with 256 rays a patch. Where `progress` stops before
/// there is a reference, nothing is compared: `runs` is empty and `completed` false.
Comparison compare(const Scene& scene, const PatchOptions& patches, const CompareOptions& options = {});

}  // namespace radiosity
