// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <atomic>
#include <cmath>

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

// Adds the lower triangle of a reciprocal F: F_ji = F_ij A_i / A_j.
void mirror(RowList& upper, const Eigen::ArrayXd& areas) {
  const RowList lower = transpose(upper, upper.size());
  for_each_row(static_cast<Index>(upper.size()), [&](Index j) {
    const Row& left = lower[j];
    Row& row = upper[j];
    Row full;
    full.reserve(left.size() + row.size());
    for (const Entry& e : left)
      if (e.column != j)
        full.push_back({e.column, rounded_down(static_cast<double>(e.value) * areas[e.column] / areas[j])});
    full.insert(full.end(), row.begin(), row.end());
    row = std::move(full);
  });
}

void take(const PartialRows& partial, ComputedRows& out) {
  const auto done = static_cast<std::size_t>(partial.done);
  if (partial.done < 0 || done > out.rows.size() || partial.start.size() != done + 1 ||
      partial.start.back() != partial.values.size() || partial.columns.size() != partial.values.size() ||
      (!partial.escaped.empty() && partial.escaped.size() != done))
    throw InputError(fmt::format("{} rows of an earlier run, of {} entries, do not fit {} patches",
                                 partial.done, partial.values.size(), out.rows.size()));
  for (std::size_t i = 0; i < done; ++i) {
    for (std::size_t k = partial.start[i]; k < partial.start[i + 1]; ++k) {
      if (out.packed)
        out.dense_row(static_cast<Index>(i))[partial.columns[k]] = partial.values[k];
      else
        out.rows[i].push_back({partial.columns[k], partial.values[k]});
    }
    if (!partial.escaped.empty()) (*out.escaped)[static_cast<Eigen::Index>(i)] = partial.escaped[i];
  }
}

PartialRows first_rows(const ComputedRows& computed, Index done, bool told) {
  PartialRows out{.done = done, .start = {0}, .columns = {}, .values = {}, .escaped = {}};
  for (Index i = 0; i < done; ++i) {
    for (const Entry& e : computed.packed ? dense_row(computed.packed->rows, i, i) : computed.rows[i]) {
      out.columns.push_back(e.column);
      out.values.push_back(e.value);
    }
    out.start.push_back(out.values.size());
  }
  if (told) out.escaped.assign(computed.escaped->begin(), computed.escaped->begin() + done);
  out.rays = computed.rays;
  out.pairs = computed.pairs;
  return out;
}

// Between two calls of `save`. All threads wait for the last task before each.
constexpr Index kRowsToSave = 64 * kRowsPerTask;

}  // namespace

ComputedRows compute_rows(const FormFactorMethod& method, const Eigen::ArrayXd& areas,
                          const AssemblyOptions& options) {
  const auto n = static_cast<Index>(areas.size());
  const bool upper = method.reciprocal();
  ComputedRows out{RowList(n), {}, Eigen::ArrayXd::Zero(n)};
  if (upper && method.exact()) {
    FormFactorMatrix::Rows& dense = out.packed.emplace().rows;
    dense.n = n;
    dense.values = zeros(out.rows.size() * out.rows.size());
  }
  std::atomic<bool> told = n > 0;
  Index first_row = 0;
  if (options.partial) {
    take(*options.partial, out);
    first_row = options.partial->done;
    told = first_row == 0 || !options.partial->escaped.empty();
  }
  const auto compute = [&](Index first, Index last) {
    method.rows(first, last, upper,
                [&](Index i, std::span<const Index> columns, std::span<const double> values,
                    std::optional<double> escaped) {
                  require_factors(i, columns, values);
                  if (out.packed) {
                    float* const row = out.dense_row(i);
                    for (std::size_t k = 0; k < values.size(); ++k) row[columns[k]] = rounded_down(values[k]);
                  } else {
                    Row& row = out.rows[i];
                    row.resize(values.size());
                    for (std::size_t k = 0; k < row.size(); ++k)
                      row[k] = {columns[k], rounded_down(values[k])};
                  }
                  if (escaped)
                    (*out.escaped)[i] = *escaped;
                  else
                    told = false;
                });
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
      first_row, n, options.save ? kRowsToSave : n, kRowsPerTask, compute, watch, [&](Index done) {
        if (!options.save) return;
        count();
        options.save(done, [&] { return first_rows(out, done, told); });
      });
  count();
  if (!told) out.escaped.reset();
  if (out.packed)
    out.packed->measured = mirror_dense(out.packed->rows.values, areas);
  else if (upper)
    mirror(out.rows, areas);
  return out;
}

}  // namespace radiosity
