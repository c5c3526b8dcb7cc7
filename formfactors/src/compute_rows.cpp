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
      full.push_back({e.column, rounded_down(static_cast<double>(e.value) * areas[e.column] / areas[j])});
    full.insert(full.end(), row.begin(), row.end());
    row = std::move(full);
  });
}

}  // namespace

ComputedRows compute_rows(const FormFactorMethod& method, const Eigen::ArrayXd& areas,
                          const Progress& progress) {
  const auto n = static_cast<Index>(areas.size());
  const bool upper = method.reciprocal();
  ComputedRows out{RowList(n), Eigen::ArrayXd::Zero(n)};
  std::atomic<bool> told = n > 0;
  const auto compute = [&](Index first, Index last) {
    method.rows(first, last, upper,
                [&](Index i, std::span<const Index> columns, std::span<const double> values,
                    std::optional<double> escaped) {
                  require_factors(i, columns, values);
                  Row& row = out.rows[i];
                  row.resize(values.size());
                  for (std::size_t k = 0; k < row.size(); ++k) row[k] = {columns[k], rounded_down(values[k])};
                  if (escaped)
                    (*out.escaped)[i] = *escaped;
                  else
                    told = false;
                });
  };
  const auto watch = [&](Index done) {
    if (!progress) return true;
    // With `upper`, the first rows hold the share 1 − (1 − done/n)² of the entries.
    const double share = static_cast<double>(done) / n;
    return progress(upper ? 1 - (1 - share) * (1 - share) : share);
  };
  out.completed = for_each_block(n, kRowsPerTask, compute, watch);
  if (!told) out.escaped.reset();
  if (upper) mirror(out.rows, areas);
  return out;
}

}  // namespace radiosity
