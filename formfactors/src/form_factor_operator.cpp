// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/form_factor_operator.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "vector_clones.hpp"

namespace radiosity {
namespace {

// F is read at the speed of memory only where eight products are taken at a time.
constexpr std::size_t kWide = 8;
using Floats [[gnu::vector_size(kWide * sizeof(float))]] = float;
using Doubles [[gnu::vector_size(kWide * sizeof(double))]] = double;

constexpr std::size_t kRowsAtOnce = 4;   // x comes from the cache once for four rows of F
constexpr std::size_t kBandsAtOnce = 4;  // 4 × 4 sums stay in registers
constexpr std::size_t kStrip = 512;      // columns

// y_rb += Σ_j f_rj x_bj over columns [from, to), for kRows dense rows of F and kBands bands of x, `n` values apart; y has
// `stride` bands.
template <std::size_t kRows, std::size_t kBands>
RADIOSITY_INLINE void dense_tile(const float* const* f, const double* x, std::size_t n, std::size_t from,
                                 std::size_t to, double* y, std::size_t stride) {
  Doubles sum[kRows][kBands] = {};
  std::size_t j = from;
  for (; j + kWide <= to; j += kWide) {
    Doubles values[kBands];
    for (std::size_t b = 0; b < kBands; ++b) std::memcpy(&values[b], x + b * n + j, sizeof(Doubles));
    for (std::size_t r = 0; r < kRows; ++r) {
      Floats single;
      std::memcpy(&single, f[r] + j, sizeof single);
      const Doubles factors = __builtin_convertvector(single, Doubles);
      for (std::size_t b = 0; b < kBands; ++b) sum[r][b] += factors * values[b];
    }
  }
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t b = 0; b < kBands; ++b) {
      double total = 0;
      for (std::size_t k = 0; k < kWide; ++k) total += sum[r][b][k];
      for (std::size_t rest = j; rest < to; ++rest)
        total += static_cast<double>(f[r][rest]) * x[b * n + rest];
      y[r * stride + b] += total;
    }
}

template <std::size_t kRows>
RADIOSITY_INLINE void dense_bands(const float* const* f, const double* x, std::size_t n, std::size_t from,
                                  std::size_t to, double* y, std::size_t bands) {
  std::size_t b = 0;
  for (; b + kBandsAtOnce <= bands; b += kBandsAtOnce)
    dense_tile<kRows, kBandsAtOnce>(f, x + b * n, n, from, to, y + b, bands);
  if (b + 3 <= bands) {
    dense_tile<kRows, 3>(f, x + b * n, n, from, to, y + b, bands);
  } else if (b + 2 <= bands) {
    dense_tile<kRows, 2>(f, x + b * n, n, from, to, y + b, bands);
  } else if (b < bands) {
    dense_tile<kRows, 1>(f, x + b * n, n, from, to, y + b, bands);
  }
}

// x holds one band after the other, y one row after the other.
RADIOSITY_CLONES
void dense_rows(const float* const* f, std::size_t rows, const double* x, std::size_t n, std::size_t bands,
                double* y) {
  std::fill_n(y, rows * bands, 0.0);
  // With many bands x is larger than the cache; a strip of it is not.
  const std::size_t strip = bands > kBandsAtOnce ? kStrip : n;
  for (std::size_t from = 0; from < n; from += strip) {
    const std::size_t to = std::min(n, from + strip);
    std::size_t r = 0;
    for (; r + kRowsAtOnce <= rows; r += kRowsAtOnce)
      dense_bands<kRowsAtOnce>(f + r, x, n, from, to, y + r * bands, bands);
    for (; r < rows; ++r) dense_bands<1>(f + r, x, n, from, to, y + r * bands, bands);
  }
}

// y_b = Σ_k F_k x_{c_k b} for kBands bands that lie side by side in rows of `stride` values: their sums stay in registers.
template <std::size_t kBands>
void sparse_tile(const FormFactorRow& row, const double* x, std::size_t stride, double* y) {
  std::array<double, kBands> sum{};
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    const double* xj = x + static_cast<std::size_t>(row.columns[k]) * stride;
    for (std::size_t b = 0; b < kBands; ++b) sum[b] += static_cast<double>(row.values[k]) * xj[b];
  }
  std::copy(sum.begin(), sum.end(), y);
}

void sparse_row(const FormFactorRow& row, const double* x, std::size_t bands, double* y) {
  std::size_t b = 0;
  for (; b + 3 <= bands; b += 3) sparse_tile<3>(row, x + b, bands, y + b);
  for (; b < bands; ++b) sparse_tile<1>(row, x + b, bands, y + b);
}

// The numbers follow the least patch of each set.
std::vector<Index> numbered(DisjointSets& sets, Index n) {
  std::vector<Index> out(static_cast<std::size_t>(n));
  Index count = 0;
  for (Index i = 0; i < n; ++i) {
    const Index root = sets.root(i);
    out[i] = root == i ? count++ : out[root];
  }
  return out;
}

}  // namespace

void FormFactorOperator::apply(const BandArray& x, BandArray& y) const {
  if (x.rows() != columns())
    throw InputError(
        fmt::format("F has {} columns, the array that it is applied to has {} rows", columns(), x.rows()));
  y.resize(rows(), x.cols());
  multiply(x, y);
}

Eigen::ArrayXd FormFactorOperator::escaped() const {
  BandArray sums;
  apply(BandArray::Ones(columns(), 1), sums);
  const Eigen::ArrayXd e = 1 - sums.col(0);
  return (e.abs() > tolerance::kNotLost).select(e, 0.0);
}

// A connected room is known to be one after a few rows.
std::vector<Index> FormFactorRows::component() const {
  const Index n = size();
  if (!stored()) return FormFactorOperator::component();
  DisjointSets sets(n);
  RowBuffer buffer;
  Index left = n;
  for (Index i = 0; i < n && left > 1; ++i)
    for_each_entry(row(i, buffer), [&](Index j, float value) {
      if (value > 0 && sets.root(i) != sets.root(j)) {
        sets.unite(i, j);
        --left;
      }
    });
  return numbered(sets, n);
}

DistributedFormFactors::DistributedFormFactors(const FormFactorRows& own, std::shared_ptr<const Ranks> ranks)
    : own_(own), ranks_(std::move(ranks)) {}

void DistributedFormFactors::multiply(const BandArray& x, BandArray& y) const {
  own_.apply(x, y);
  ranks_->gather(y);
}

// What the rows of each rank connect, one rank at a time.
std::vector<Index> DistributedFormFactors::component() const {
  const Index n = own_.size();
  const std::vector<Index> mine = own_.component();
  const std::vector<double> sent(mine.begin(), mine.end());
  std::vector<double> received(sent.size());
  DisjointSets sets(n);
  for (int r = 0; r < ranks_->count(); ++r) {
    std::vector<int> counts(static_cast<std::size_t>(ranks_->count()), 0);
    counts[static_cast<std::size_t>(r)] = n;
    const bool is_mine = r == ranks_->rank();
    ranks_->all_gather(is_mine ? std::span(sent) : std::span<const double>{}, counts, received);
    std::vector<Index> least;
    for (Index i = 0; i < n; ++i) {
      const auto c = static_cast<std::size_t>(received[i]);
      if (c == least.size()) least.push_back(i);
      sets.unite(least[c], i);
    }
  }
  return numbered(sets, n);
}

void FormFactorRows::multiply(const BandArray& x, BandArray& y) const {
  const auto n = static_cast<std::size_t>(size());
  const auto bands = static_cast<std::size_t>(x.cols());
  const BandArray by_band = x.transpose();
  constexpr Index kBlock = 64;
  const auto multiply_block = [&](const tbb::blocked_range<Index>& block) {
    RowBuffer buffer;
    std::array<double, kBlock> diagonal;
    std::array<const float*, kBlock> dense;  // F is stored dense: rows that follow one another
    std::size_t count = 0;
    const auto multiply_dense = [&](Index end) {
      if (count > 0)
        dense_rows(dense.data(), count, by_band.data(), n, bands, &y(end - static_cast<Index>(count), 0));
      count = 0;
    };
    for (Index i = block.begin(); i != block.end(); ++i) {
      const FormFactorRow r = row(i, buffer);
      diagonal[i - block.begin()] = r.diagonal;
      const float* const f = r.values.data();
      if (!r.dense()) {
        multiply_dense(i);
        sparse_row(r, x.data(), bands, &y(i, 0));
      } else if (stored()) {
        dense[count++] = f;
      } else {
        dense_rows(&f, 1, by_band.data(), n, bands, &y(i, 0));
      }
    }
    multiply_dense(block.end());
    for (Index i = block.begin(); i != block.end(); ++i) y.row(i) += diagonal[i - block.begin()] * x.row(i);
  };
  tbb::parallel_for(tbb::blocked_range<Index>(0, size(), kBlock), multiply_block, tbb::simple_partitioner());
}

}  // namespace radiosity
