// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/form_factor_matrix.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "row_list.hpp"

namespace radiosity {
FormFactorMatrix::FormFactorMatrix(Rows rows) : rows_(std::move(rows)) {
  const auto n = static_cast<std::size_t>(rows_.n);
  const std::size_t stored =
      rows_.place.empty() ? n : n - static_cast<std::size_t>(std::ranges::count(rows_.place, -1));
  const bool fits = sparse() ? rows_.start.size() == n + 1 && rows_.columns.size() == rows_.values.size() &&
                                   rows_.start.back() == rows_.values.size()
                             : rows_.values.size() == stored * n && rows_.columns.empty();
  if (!fits || rows_.escaped.size() != n || (!rows_.diagonal.empty() && rows_.diagonal.size() != n) ||
      (!rows_.place.empty() && rows_.place.size() != n)) {
    throw InputError(
        fmt::format("form factor matrix: {} values, {} columns, {} row starts, {} diagonal entries and {} "
                    "escaped fractions do not make {} rows",
                    rows_.values.size(), rows_.columns.size(), rows_.start.size(), rows_.diagonal.size(),
                    rows_.escaped.size(), rows_.n));
  }
  require_rows();
  if (rows_.values.size() <= static_cast<std::size_t>(std::numeric_limits<Index>::max()))
    outer_.assign(rows_.start.begin(), rows_.start.end());
}

void FormFactorMatrix::require_rows() const {
  const auto n = static_cast<std::size_t>(rows_.n);
  if (sparse() && (rows_.start[0] != 0 || !std::is_sorted(rows_.start.begin(), rows_.start.end())))
    throw InputError("form factor matrix: the row starts do not ascend from 0");
  std::vector<std::string> wrong(n);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    if (rows_.place.empty() || rows_.place[i] >= 0) wrong[i] = fault_of(static_cast<Index>(i));
  });
  const auto first =
      std::find_if(wrong.begin(), wrong.end(), [](const std::string& w) { return !w.empty(); });
  if (first != wrong.end())
    throw InputError(fmt::format("form factor matrix, row {}: {}", first - wrong.begin(), *first));
}

std::string FormFactorMatrix::fault_of(Index i) const {
  const FormFactorRow r = row(i);
  for (std::size_t k = 0; k < r.columns.size(); ++k) {
    if (r.columns[k] < 0 || r.columns[k] >= rows_.n)
      return fmt::format("column {} is not one of the {} patches", r.columns[k], rows_.n);
    if (k > 0 && r.columns[k] <= r.columns[k - 1])
      return fmt::format("column {} follows column {}; they do not ascend", r.columns[k], r.columns[k - 1]);
  }
  const double total = sum(r.values);
  std::uint32_t signs = 0;
  for (const float f : r.values) signs |= std::bit_cast<std::uint32_t>(f);
  if (!std::isfinite(total) || signs >> 31 != 0)
    for (const float f : r.values)
      if (!(f >= 0 && std::isfinite(f))) return fmt::format("{} is not a share of light", f);
  const double escaped = rows_.escaped[i];
  if (std::abs(1 - total - r.diagonal - escaped) <= tolerance::kNotLost) return {};
  return fmt::format("factors {}, diagonal {} and escaped {} do not add up to 1", total, r.diagonal, escaped);
}

FormFactorRow FormFactorMatrix::row(Index i) const {
  const auto r = static_cast<std::size_t>(i);
  const double diagonal = rows_.diagonal.empty() ? 0 : rows_.diagonal[r];
  const auto n = static_cast<std::size_t>(rows_.n);
  if (!rows_.place.empty() && rows_.place[r] < 0) return {};
  if (!sparse()) {
    const std::size_t place = rows_.place.empty() ? r : rows_.place[r];
    return {{}, std::span(rows_.values).subspan(place * n, n), diagonal};
  }
  const std::size_t first = rows_.start[r];
  const std::size_t count = rows_.start[r + 1] - first;
  return {std::span(rows_.columns).subspan(first, count), std::span(rows_.values).subspan(first, count),
          diagonal};
}

std::size_t FormFactorMatrix::nonzeros() const {
  return rows_.values.size() -
         static_cast<std::size_t>(std::count(rows_.values.begin(), rows_.values.end(), 0.0F));
}

std::size_t FormFactorMatrix::bytes() const {
  return rows_.start.size() * sizeof(std::size_t) + rows_.columns.size() * sizeof(Index) +
         rows_.values.size() * sizeof(float) +
         (rows_.diagonal.size() + rows_.escaped.size()) * sizeof(double);
}

FormFactorMatrix::SparseMap FormFactorMatrix::as_sparse() const {
  if (outer_.empty())
    throw InputError(fmt::format("form factor matrix: {}, so there is no sparse matrix of Eigen's of it",
                                 sparse() ? "it has more entries than an index counts" : "it is dense"));
  return {rows_.n, rows_.n, outer_.back(), outer_.data(), rows_.columns.data(), rows_.values.data()};
}

FormFactorMatrix::DenseMap FormFactorMatrix::as_dense() const {
  if (sparse()) throw InputError("form factor matrix: it is sparse, so there is no dense matrix of it");
  if (!rows_.place.empty())
    throw InputError("form factor matrix: other ranks have rows of it, so there is no dense matrix of it");
  return {rows_.values.data(), rows_.n, rows_.n};
}

Eigen::ArrayXd FormFactorMatrix::escaped() const {
  return Eigen::Map<const Eigen::ArrayXd>(rows_.escaped.data(), rows_.n);
}

Eigen::ArrayXd FormFactorMatrix::diagonal() const {
  if (rows_.diagonal.empty()) return Eigen::ArrayXd::Zero(rows_.n);
  return Eigen::Map<const Eigen::ArrayXd>(rows_.diagonal.data(), rows_.n);
}

double FormFactorMatrix::operator()(Index i, Index j) const {
  const FormFactorRow r = row(i);
  if (r.dense()) return static_cast<double>(r.values[j]);
  const auto found = std::lower_bound(r.columns.begin(), r.columns.end(), j);
  if (found == r.columns.end() || *found != j) return 0;
  return static_cast<double>(r.values[found - r.columns.begin()]);
}

}  // namespace radiosity
