// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <limits>
#include <memory>

#include "radiosity/formfactors/form_factor_matrix.hpp"
#include "radiosity/simulation/compare.hpp"
#include "watch.hpp"

namespace radiosity {

/// Room for the error of a predicted time: work starts where kSafety times its prediction fits.
constexpr double kSafety = 1.5;
/// Of the whole time, for each of the two references.
constexpr double kReferenceShare = 0.25;

/// The time and memory of a comparison, and whether the caller lets it go on. Points in time are seconds since its start.
class Budget {
 public:
  explicit Budget(const CompareOptions& options) : options_(options) {}

  double seconds() const { return options_.budget_s; }
  double elapsed() const { return clock_.elapsed(); }
  double end() const { return (1 - kWritingShare) * seconds(); }
  double left() const { return end() - elapsed(); }
  std::size_t bytes() const { return bytes_; }
  /// Whether F has room: 8 bytes for each entry, no more of which are in a row than there are patches.
  bool holds(double patches, double entries_per_row) const {
    return 8 * patches * std::min(patches, entries_per_row) <= static_cast<double>(bytes_);
  }
  bool interrupted() const { return interrupted_; }  ///< by the caller's progress function
  /// Reports the progress. False: the work under way should stop, because it is past `until` or `end`, or interrupted.
  bool go_on(double until = std::numeric_limits<double>::infinity()) {
    if (options_.progress && !options_.progress(std::min(1.0, elapsed() / seconds()))) interrupted_ = true;
    return !interrupted_ && elapsed() < std::min(until, end());
  }

 private:
  static constexpr double kWritingShare = 0.06;  // kept for whoever writes the results

  const CompareOptions& options_;
  Stopwatch clock_;
  std::size_t bytes_ = memory_limit(options_.memory_limit_bytes);
  bool interrupted_ = false;
};

/// One of the meshes compared, with what it takes to solve on it.
struct PreparedMesh {
  ComparedMesh facts;
  std::unique_ptr<Patches> patches;  ///< on the heap: the visibility refers to the mesh
  std::unique_ptr<const Visibility> visibility;

  const PatchMesh& mesh() const { return patches->mesh; }
};
PreparedMesh prepare(const Scene& scene, const PatchOptions& options);
/// `watch` has run since the work on the patches began.
PreparedMesh prepare(Patches patches, const PatchOptions& options, const Stopwatch& watch);

struct SolvedRun {
  BandArray radiosity;                ///< of each patch, alike in a cluster
  std::optional<FormFactorMatrix> f;  ///< to be released by whoever does not read it
  double seconds = 0;
  std::uint64_t rays = 0;
  std::optional<std::string> failure;  ///< of the solver to converge
};
/// By conjugate gradients. Nothing where the budget or `until` ended it. Throws InputError where F has no room in memory.
std::optional<SolvedRun> solve_on(const PreparedMesh& mesh, const FormFactorMethodInfo& info,
                                  const FormFactorOptions& settings, double tolerance, Budget& budget,
                                  double until = std::numeric_limits<double>::infinity());

/// s that F would take, extrapolated from a few rows.
double predict_seconds(const PreparedMesh& mesh, const FormFactorMethodInfo& info,
                       const FormFactorOptions& settings, const Budget& budget);

}  // namespace radiosity
