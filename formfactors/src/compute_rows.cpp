// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// What a method must never give; found here and not in the light.
void require_factors(Index i, std::span<const Index> columns, std::span<const double> values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!(values[k] >= 0 && std::isfinite(values[k])))
      throw InputError(fmt::format(
          "form factor from patch {} to patch {}: {} is not a share of light; the shape of one of "
          "them is beyond what double precision tells",
          i, columns[k], values[k]));
}

// Adds the lower triangle of a reciprocal F: F_ji = F_ij A_i / A_j, rounded as mirror_dense does.
void mirror(RowList& upper, const Eigen::ArrayXd& areas, const Ranks* ranks) {
  const RowList lower = transpose(upper, upper.size(), ranks);
  for_each_row(static_cast<Index>(upper.size()), [&](Index j) {
    const Row& left = lower[j];
    Row& row = upper[j];
    Row full;
    full.reserve(left.size() + row.size());
    for (const Entry& e : left)
      if (e.column != j)
        full.push_back(
            {e.column, rounded_down(static_cast<double>(e.value) * areas[e.column] * (1 / areas[j]))});
    full.insert(full.end(), row.begin(), row.end());
    row = std::move(full);
  });
}

// Marks them in `have`.
void take(const PartialRows& partial, ComputedRows& out, std::vector<std::uint8_t>& have) {
  const auto done = static_cast<std::size_t>(partial.done);
  const std::size_t n = out.rows.size();
  if (partial.done < 0 || done > n || partial.start.size() != done + 1 ||
      partial.start.back() != partial.values.size() || partial.columns.size() != partial.values.size() ||
      (!partial.escaped.empty() && partial.escaped.size() != done) ||
      (!partial.rows.empty() && partial.rows.size() != done) ||
      std::ranges::any_of(partial.rows, [&](Index i) { return i < 0 || static_cast<std::size_t>(i) >= n; }))
    throw InputError(fmt::format("{} rows of an earlier run, of {} entries, do not fit {} patches",
                                 partial.done, partial.values.size(), n));
  for (std::size_t r = 0; r < done; ++r) {
    const Index i = partial.rows.empty() ? static_cast<Index>(r) : partial.rows[r];
    have[i] = 1;
    if (!out.packed) out.rows[i].reserve(partial.start[r + 1] - partial.start[r]);
    for (std::size_t k = partial.start[r]; k < partial.start[r + 1]; ++k) {
      if (out.packed)
        out.dense_row(i)[partial.columns[k]] = partial.values[k];
      else
        out.rows[i].push_back({partial.columns[k], partial.values[k]});
    }
    if (!partial.escaped.empty()) (*out.escaped)[i] = partial.escaped[r];
  }
}

// Those that are there; `told`: with what escapes.
PartialRows rows_so_far(const ComputedRows& computed, const std::vector<std::uint8_t>& have, bool told) {
  PartialRows out;
  out.start = {0};
  for (Index i = 0; i < static_cast<Index>(have.size()); ++i) {
    if (have[i] == 0) continue;
    out.rows.push_back(i);
    for (const Entry& e : computed.packed ? dense_row(computed.packed->rows, i, i) : computed.rows[i]) {
      out.columns.push_back(e.column);
      out.values.push_back(e.value);
    }
    out.start.push_back(out.values.size());
    if (told) out.escaped.push_back((*computed.escaped)[i]);
  }
  out.done = static_cast<Index>(out.rows.size());
  if (out.done == 0 || out.rows.back() == out.done - 1) out.rows.clear();  // the first
  out.rays = computed.rays;
  out.pairs = computed.pairs;
  return out;
}

// Between two calls of `save`. All threads wait for the last task before each.
constexpr Index kRowsToSave = 256 * kRowsPerTask;

}  // namespace

ComputedRows compute_rows(const FormFactorMethod& method, const Eigen::ArrayXd& areas,
                          const AssemblyOptions& options) {
  const auto n = static_cast<Index>(areas.size());
  const bool upper = method.reciprocal();
  ComputedRows out{.rows = RowList(n), .packed = {}, .escaped = Eigen::ArrayXd::Zero(n)};
  const Ranks* const ranks = options.ranks.get();
  if (upper && method.exact() && ranks == nullptr) {
    FormFactorMatrix::Rows& dense = out.packed.emplace().rows;
    dense.n = n;
    dense.values = zeros(out.rows.size() * out.rows.size());
  }
  std::atomic<bool> told = n > 0;
  std::vector<std::uint8_t> have(out.rows.size(), 0);
  if (options.partial) {
    take(*options.partial, out, have);
    told = told && (options.partial->done == 0 || !options.partial->escaped.empty());
  }
  const auto compute = [&](Index first, Index last) {
    if (!owns(ranks, first) || have[first] != 0) return;
    method.rows(first, last, upper,
                [&](Index i, std::span<const Index> columns, std::span<const double> values,
                    std::optional<double> escaped) {
                  const std::size_t count = values.size();
                  const bool side_by_side =
                      count > 0 && static_cast<std::size_t>(columns.back() - columns.front()) + 1 == count;
                  const bool stored =
                      out.packed && side_by_side && store_factors(values, out.dense_row(i) + columns[0]);
                  if (!stored) require_factors(i, columns, values);
                  if (!stored && out.packed) {
                    float* const row = out.dense_row(i);
                    for (std::size_t k = 0; k < count; ++k) row[columns[k]] = rounded_down(values[k]);
                  } else if (!out.packed) {
                    Row& row = out.rows[i];
                    row.resize(count);
                    for (std::size_t k = 0; k < count; ++k) row[k] = {columns[k], rounded_down(values[k])};
                  }
                  if (escaped)
                    (*out.escaped)[i] = *escaped;
                  else
                    told = false;
                });
    std::fill(have.begin() + first, have.begin() + last, std::uint8_t{1});
  };
  const auto watch = [&](Index done) {
    if (!options.progress) return true;
    // With `upper`, the first rows hold the share 1 − (1 − done/n)² of the entries.
    const double share = static_cast<double>(done) / n;
    return options.progress(upper ? 1 - (1 - share) * (1 - share) : share);
  };
  const auto count = [&] {
    out.rays = method.rays();
    out.pairs = method.pairs();
    if (!options.partial) return;
    out.rays += options.partial->rays;
    out.pairs += options.partial->pairs;
  };
  out.completed = for_each_block_in_stretches(
      0, n, options.save ? kRowsToSave : n, kRowsPerTask, compute, watch,
      [&](Index done) {
        if (!options.save) return;
        count();
        options.save(done, [&] { return rows_so_far(out, have, told); });
      },
      ranks);
  count();
  if (ranks != nullptr) {
    std::vector<std::uint64_t> counts = {out.rays};
    for_each_count(out.pairs, [&](const char*, std::uint64_t own) { counts.push_back(own); });
    ranks->sum(counts);
    out.rays = counts[0];
    for_each_count(out.pairs, [&, k = 0](const char*, std::uint64_t& all) mutable { all = counts[++k]; });
  }
  gather(ranks, *out.escaped);
  if (!on_all(ranks, told)) out.escaped.reset();
  if (out.packed)
    out.packed->measured = mirror_dense(out.packed->rows.values, areas);
  else if (upper)
    mirror(out.rows, areas, ranks);
  if (upper && method.exact() && ranks != nullptr) {
    out.sums.emplace(n);
    for_each_row(n, [&](Index i) { (*out.sums)[i] = sum_as_dense(out.rows[i], n); });
    gather(ranks, *out.sums);
  }
  return out;
}

}  // namespace radiosity
