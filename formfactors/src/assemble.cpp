// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/assemble.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "assembly_steps.hpp"
#include "methods.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

// Of rows of so many entries.
void require_memory(const FormFactorMethod& method, Index n, double entries, const AssemblyOptions& options) {
  const std::size_t limit = options.memory_limit_bytes;
  if (limit == 0) return;
  const double all = assembly_bytes(n, entries);
  const double needed = options.ranks ? all / options.ranks->count() : all;
  if (needed <= static_cast<double>(limit)) return;
  const double per_row = needed / n;
  const auto gigabytes = [](double bytes) { return bytes / 1e9; };
  if (options.ranks)
    throw MemoryLimitError(fmt::format(
        "memory limit: F of {} patches may need {:.3g} GB on each of {} ranks with this method, the limit is "
        "{:.3g} GB; {:.0f} ranks would fit for certain",
        n, gigabytes(needed), options.ranks->count(), gigabytes(static_cast<double>(limit)),
        std::ceil(all / static_cast<double>(limit))));
  throw MemoryLimitError(fmt::format(
      "memory limit: F of {} patches may need {:.3g} GB with this method, the limit is {:.3g} GB; {} patches "
      "would fit "
      "for certain, as would the progressive solver, which does not store F",
      n, gigabytes(needed), gigabytes(static_cast<double>(limit)),
      method.max_entries_per_row() < n ? static_cast<Index>(static_cast<double>(limit) / per_row)
                                       : static_cast<Index>(std::sqrt(static_cast<double>(limit) / 24))));
}

// 1 − e, or 0 where nothing but the rounding of the sum e is left.
double not_lost(double e) {
  return 1 - e > tolerance::kNotLost ? 1 - e : 0;
}

// Share of the directions from each of n patches that is lost through open sides or on the backs of patches.
Eigen::ArrayXd escape_seen_by(const FormFactorMethod& probe, Index n, const Ranks* ranks) {
  Eigen::ArrayXd escaped(n);
  const FormFactorMethod::Sink keep = [&](Index i, auto, auto, std::optional<double> e) { escaped[i] = *e; };
  for_each_block(n, kRowsPerTask, [&](Index first, Index last) {
    if (owns(ranks, first)) probe.rows(first, last, false, keep);
  });
  gather(ranks, escaped);
  return escaped;
}

// Light that leaves the patches that see any other, where `escaped` of it is lost, stays in the scene.
bool is_closed(const Eigen::ArrayXd& sums, const Eigen::ArrayXd& escaped, const Eigen::ArrayXd& areas) {
  const Eigen::ArrayXd seeing = (sums > 0).cast<double>() * areas;
  return seeing.sum() > 0 && (escaped * seeing).sum() <= tolerance::kClosedScene * seeing.sum();
}

// What the rows should sum to.
struct RowTargets {
  Eigen::ArrayXd sums;
  bool closed_scene = false;
  std::uint64_t rays = 0;  // cast to find out
};
RowTargets row_targets(const FormFactorMethod& method, const Visibility& visibility,
                       const ComputedRows& computed, const ReplacedRows& replaced, bool close,
                       const Ranks* ranks) {
  const Eigen::ArrayXd& areas = visibility.mesh().cluster_areas();
  RowTargets out{computed.packed ? computed.packed->measured.sums
                 : computed.sums ? *computed.sums
                                 : row_sums(computed.rows, ranks)};
  Eigen::ArrayXd& target = out.sums;
  const Eigen::ArrayXd whole = (target > 0).cast<double>();
  if (method.exact() && computed.completed) {  // such rows tell themselves whether anything is missing
    out.closed_scene = (whole > 0).any() && (target - whole).abs().maxCoeff() <=
                                                std::max(tolerance::kNoEscape, method.options().tolerance);
  } else if (computed.escaped) {
    out.closed_scene = is_closed(target, *computed.escaped, areas);
  } else if (close) {
    const auto probe = make_hemisphere(visibility, {.samples = 256});
    out.closed_scene =
        is_closed(target, escape_seen_by(*probe, visibility.mesh().cluster_count(), ranks), areas);
    out.rays = total(ranks, probe->rays());
  }
  if (out.closed_scene) {
    target = whole;
  } else if (computed.escaped) {  // pairs know better than directions
    for (Index i = 0; i < target.size(); ++i)
      if (target[i] > 0)
        target[i] = replaced.has(i) ? std::min(1.0, target[i]) : not_lost((*computed.escaped)[i]);
  }
  return out;
}

}  // namespace

double assembly_bytes(double patches, double entries) {
  return 24 * patches * std::min(patches, entries);
}

AssembledFormFactors assemble(const FormFactorMethod& method, const Visibility& visibility,
                              const AssemblyOptions& options) {
  const Eigen::ArrayXd& areas = visibility.mesh().cluster_areas();
  const Index n = visibility.mesh().cluster_count();
  const Ranks* const ranks = options.ranks.get();
  AssemblyReport report;
  require_memory(method, n, method.max_entries_per_row(), options);

  ComputedRows computed = compute_rows(method, areas, options);
  RowList& rows = computed.rows;
  report.completed = computed.completed;
  report.rays = computed.rays;
  report.pairs = computed.pairs;

  if (!method.reciprocal() && report.completed) {
    report.pair_rows = options.pair_rows;
    if (!report.pair_rows) {
      const Eigen::ArrayXd sums = row_sums(rows, ranks);
      PairwisePatches chosen = pairwise_patches(method, visibility, std::span(sums.data(), n));
      // Pairs stand in a row and in a column.
      require_memory(
          method, n,
          (static_cast<double>(total(ranks, count_entries(rows))) + 2 * chosen.pairs) / std::max<Index>(n, 1),
          options);
      report.pair_rows = compute_pairs(chosen, areas, options.progress, ranks);
      if (chosen.factors) report.rays += total(ranks, chosen.factors->rays());
      report.warnings = std::move(chosen.warnings);
      report.unreliable = std::move(chosen.unreliable);
      report.completed = report.pair_rows != nullptr;
    }
  }
  release_freed(count_entries(rows));  // of what pairs took
  ReplacedRows replaced(n);
  if (report.pair_rows) {
    drop_hidden(rows, report.pair_rows->hidden);
    replaced = replace_by_pairs(rows, *report.pair_rows, ranks);
    report.lamps = report.pair_rows->lamps;
    report.pairwise = static_cast<Index>(replaced.patches.size());
    // Where nothing stands between two patches the rows of all of them are exact: cells may miss a narrow gap.
    if (computed.escaped)
      for (const Index i : visibility.convex() ? replaced.patches : report.pair_rows->misjudged)
        (*computed.escaped)[i] = std::max(0.0, 1 - sum(rows[i]));
    if (computed.escaped) gather(ranks, *computed.escaped);
  }

  const bool close = options.close && !method.exact() && report.completed;
  const RowTargets targets = row_targets(method, visibility, computed, replaced, close, ranks);
  const Eigen::ArrayXd& target = targets.sums;
  report.closed_scene = targets.closed_scene;
  report.rays += targets.rays;

  // A method that looks at pairs knows the row sums of an open scene better than a sample of directions does.
  report.closed_rows = close && (report.closed_scene || computed.escaped);
  PackedRows packed;
  if (report.closed_rows) {
    drop_isolated(rows, target);
    report.before = quality_of(measure(rows, areas, true, ranks), target, areas);
    packed =
        pack_scaled(rows, scaling_to_row_sums(rows, target, areas, std::move(replaced), ranks), areas, ranks);
    report.after = quality_of(packed.measured, target, areas);
  } else if (options.close && (target > 1).any()) {  // at most 1, even where the right sum is not known
    if (computed.packed) rows = unpack(computed.packed->rows);
    report.before = quality_of(measure(rows, areas, true, ranks), target, areas);
    packed = pack_scaled(rows, scaling_to_at_most_one(target, std::move(replaced)), areas, ranks);
    report.after = quality_of(packed.measured, target.min(1.0), areas);
  } else {
    packed = computed.packed ? std::move(*computed.packed) : pack(rows, areas, ranks);
    if (computed.packed) shrink(packed.rows);
    if (computed.sums) packed.measured.sums = *computed.sums;
    report.before = report.after = quality_of(packed.measured, target, areas);
  }

  const Eigen::ArrayXd& sums = packed.measured.sums;
  report.isolated_patches = static_cast<Index>((sums == 0).count());
  const bool known_sums = report.closed_rows || (report.completed && report.closed_scene && method.exact());
  if (known_sums) {
    const Eigen::ArrayXd remainder = target - sums;
    packed.rows.diagonal.assign(remainder.begin(), remainder.end());
  }
  const Eigen::ArrayXd lost = 1 - (known_sums ? target : sums);
  packed.rows.escaped.assign(lost.begin(), lost.end());
  const Eigen::ArrayXd seeing = (sums != 0).cast<double>() * areas;
  report.escaped_mean = seeing.sum() > 0 ? (lost * seeing).sum() / seeing.sum() : 0;
  if (report.closed_rows && report.after.closure_error_mean > 1e-3) {
    report.warnings.push_back(
        fmt::format("patches do not agree on what they exchange: {:.2g} % of what leaves them, on average, "
                    "could not be placed and stays where it is; the error estimate takes it into account",
                    100 * report.after.closure_error_mean));
  }
  return {FormFactorMatrix(std::move(packed.rows)), std::move(report)};
}

}  // namespace radiosity
