// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/form_factor_matrix.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// y_b = Σ_j F_ij x_jb + d_i x_ib for kBands bands that lie side by side in rows of `stride` values: the compiler keeps their
// sums in registers.
template <std::size_t kBands>
void multiply_row(const FormFactorRow& row, Index i, const double* x, std::ptrdiff_t stride, double* y) {
  std::array<double, kBands> sum;
  for (std::size_t b = 0; b < kBands; ++b)
    sum[b] = row.diagonal * x[i * stride + static_cast<std::ptrdiff_t>(b)];
  for_each_entry(row, [&](Index j, float f) {
    const double* xj = x + j * stride;
    for (std::size_t b = 0; b < kBands; ++b) sum[b] += static_cast<double>(f) * xj[b];
  });
  std::copy(sum.begin(), sum.end(), y + i * stride);
}

}  // namespace

void FormFactors::multiply(const BandArray& x, BandArray& y) const {
  if (x.rows() != size()) {
    throw InputError(fmt::format("F has {} rows, the array to multiply has {}", size(), x.rows()));
  }
  y.resize(x.rows(), x.cols());
  const std::ptrdiff_t stride = x.cols();
  tbb::parallel_for(tbb::blocked_range<Index>(0, size(), 64), [&](const tbb::blocked_range<Index>& block) {
    RowBuffer buffer;
    for (Index i = block.begin(); i != block.end(); ++i) {
      const FormFactorRow r = row(i, buffer);
      Index band = 0;
      for (; band + 3 <= stride; band += 3) multiply_row<3>(r, i, x.data() + band, stride, y.data() + band);
      for (; band < stride; ++band) multiply_row<1>(r, i, x.data() + band, stride, y.data() + band);
    }
  });
}

FormFactorMatrix::FormFactorMatrix(Rows rows) : rows_(std::move(rows)) {
  const auto n = static_cast<std::size_t>(rows_.n);
  const bool fits = sparse() ? rows_.start.size() == n + 1 && rows_.columns.size() == rows_.values.size() &&
                                   rows_.start.back() == rows_.values.size()
                             : rows_.values.size() == n * n && rows_.columns.empty();
  if (!fits || rows_.escaped.size() != n || (!rows_.diagonal.empty() && rows_.diagonal.size() != n)) {
    throw InputError(
        fmt::format("form factor matrix: {} values, {} columns, {} row starts, {} diagonal entries and {} "
                    "escaped fractions do not make {} rows",
                    rows_.values.size(), rows_.columns.size(), rows_.start.size(), rows_.diagonal.size(),
                    rows_.escaped.size(), rows_.n));
  }
}

FormFactorRow FormFactorMatrix::row(Index i) const {
  const auto r = static_cast<std::size_t>(i);
  const double diagonal = rows_.diagonal.empty() ? 0 : rows_.diagonal[r];
  const auto n = static_cast<std::size_t>(rows_.n);
  if (!sparse()) return {{}, std::span(rows_.values).subspan(r * n, n), diagonal};
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

double FormFactorMatrix::operator()(Index i, Index j) const {
  const FormFactorRow r = row(i);
  if (r.columns.empty())
    return r.values.empty() ? 0 : static_cast<double>(r.values[static_cast<std::size_t>(j)]);
  const auto found = std::lower_bound(r.columns.begin(), r.columns.end(), j);
  if (found == r.columns.end() || *found != j) return 0;
  return static_cast<double>(r.values[static_cast<std::size_t>(found - r.columns.begin())]);
}

}  // namespace radiosity
