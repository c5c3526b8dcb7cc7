// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "assembly_steps.hpp"
#include "vector_clones.hpp"

namespace radiosity {

namespace {

bool sparse_is_smaller(std::size_t n, std::size_t entries) {
  return entries * (sizeof(float) + sizeof(Index)) + (n + 1) * sizeof(std::size_t) < n * n * sizeof(float);
}

}  // namespace

std::vector<float> zeros(std::size_t count) {
  std::vector<float> values;
  values.reserve(count);
  advise_large_pages(values.data(), count * sizeof(float));
  values.resize(count);
  return values;
}

namespace {

RADIOSITY_CLONES std::uint64_t store_rounded(const double* values, std::size_t count, float* row) {
  std::uint64_t wrong = 0;
  for (std::size_t k = 0; k < count; ++k) {
    row[k] = rounded_down(values[k]);
    wrong |= values[k] >= 0 && values[k] <= std::numeric_limits<double>::max() ? 0 : 1;
  }
  return wrong;
}

}  // namespace

bool store_factors(std::span<const double> values, float* row) {
  return store_rounded(values.data(), values.size(), row) == 0;
}

FormFactorMatrix::Rows store(RowList& rows, const Ranks* ranks,
                             const std::function<void(Index, Row&)>& finish) {
  FormFactorMatrix::Rows out;
  out.n = static_cast<Index>(rows.size());
  const std::size_t n = rows.size();
  const std::size_t entries = count_entries(rows);
  const bool sparse = sparse_is_smaller(n, total(ranks, entries));
  std::size_t stored = n;
  if (ranks != nullptr) {
    stored = 0;
    out.place.assign(n, -1);
    for (Index i = 0; i < out.n; ++i)
      if (ranks->owns(i)) out.place[i] = static_cast<Index>(stored++);
  }
  if (sparse) {
    out.start.assign(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) out.start[i + 1] = out.start[i] + rows[i].size();
    out.columns.reserve(entries);
    out.values.reserve(entries);
    advise_large_pages(out.columns.data(), entries * sizeof(Index));
    advise_large_pages(out.values.data(), entries * sizeof(float));
  } else {
    out.values = zeros(stored * n);
  }
  // Some rows at a time, whose memory goes back before that of the next is touched.
  constexpr std::size_t kTimes = 16;
  const std::size_t stretch = (n + kTimes - 1) / kTimes;
  for (std::size_t first = 0; first < n; first += stretch) {
    const std::size_t last = std::min(n, first + stretch);
    if (sparse) {
      out.columns.resize(out.start[last]);
      out.values.resize(out.start[last]);
    }
    for_each_row(static_cast<Index>(last - first), [&](Index k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (!owns(ranks, static_cast<Index>(i))) return;
      const std::size_t place = out.place.empty() ? i : out.place[i];
      Row& row = rows[i];
      if (finish) finish(static_cast<Index>(i), row);
      for (std::size_t e = 0; e < row.size(); ++e) {
        const float f = row[e].value;
        if (sparse) {
          out.columns[out.start[i] + e] = row[e].column;
          out.values[out.start[i] + e] = f;
        } else {
          out.values[place * n + row[e].column] = f;
        }
      }
      row = Row();  // {} would keep its memory
    });
    release_freed(entries);
  }
  return out;
}

PackedRows pack(RowList& rows, const Eigen::ArrayXd& areas, const Ranks* ranks) {
  PackedRows out{{}, measure(rows, areas, false, ranks)};
  out.rows = store(rows, ranks);
  return out;
}

namespace {

constexpr Index kTile = 64;

// F_ji = F_ij A_i / A_j of a piece of row i, and what the two differ by, as A_i F_ij − A_j F_ji.
RADIOSITY_CLONES void mirror_piece(const float* f_ij, double area_i, const double* areas,
                                   const double* inverse, Index count, float* f_ji, double* difference) {
  for (Index k = 0; k < count; ++k) {
    const double exchanged = static_cast<double>(f_ij[k]) * area_i;
    f_ji[k] = rounded_down(exchanged * inverse[k]);
    difference[k] = std::abs(exchanged - static_cast<double>(f_ji[k]) * areas[k]);
  }
}

}  // namespace

// By tiles, which become as many pieces of rows below, in cache.
MeasuredRows mirror_dense(std::vector<float>& values, const Eigen::ArrayXd& areas) {
  const auto n = static_cast<Index>(areas.size());
  const auto row_of = [&](Index i) {
    return values.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(n);
  };
  const Eigen::ArrayXd inverse = 1 / areas;
  const Index blocks = (n + kTile - 1) / kTile;
  Eigen::ArrayXXd differences = Eigen::ArrayXXd::Zero(n, blocks);  // of each block of rows with all
  tbb::parallel_for(Index{0}, blocks, [&](Index block) {
    const Index first = block * kTile, last = std::min(n, first + kTile);
    std::array<std::array<float, kTile>, kTile> tile;
    std::array<float, kTile> mirrored;
    std::array<double, kTile> difference;
    for (Index column = first; column < n; column += kTile) {
      const Index end = std::min(n, column + kTile);
      for (Index i = first; i < last; ++i) {
        const Index from = std::max(column, i + 1);
        if (from >= end) continue;
        mirror_piece(row_of(i) + from, areas[i], &areas[from], &inverse[from], end - from, mirrored.data(),
                     difference.data());
        double sum = 0;
        for (Index j = from; j < end; ++j) {
          const auto k = static_cast<std::size_t>(j - from);
          tile[static_cast<std::size_t>(j - column)][static_cast<std::size_t>(i - first)] = mirrored[k];
          differences(j, block) += difference[k];
          sum += difference[k];
        }
        differences(i, block) += sum;
      }
      for (Index j = std::max(column, first + 1); j < end; ++j)
        std::copy_n(tile[static_cast<std::size_t>(j - column)].begin(), std::min(last, j) - first,
                    row_of(j) + first);
    }
  });
  MeasuredRows out{Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
  for_each_row(n, [&](Index i) {
    out.sums[i] = sum(std::span(row_of(i), static_cast<std::size_t>(n)));
    out.reciprocity[i] = differences.row(i).sum() * inverse[i] / 2;
  });
  return out;
}

Row dense_row(const FormFactorMatrix::Rows& dense, Index i, Index first) {
  const float* const values =
      dense.values.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(dense.n);
  Row row;
  row.reserve(static_cast<std::size_t>(
      std::count_if(values + first, values + dense.n, [](float f) { return f > 0; })));
  for (Index j = first; j < dense.n; ++j)
    if (values[j] > 0) row.push_back({j, values[j]});
  return row;
}

RowList unpack(const FormFactorMatrix::Rows& dense) {
  RowList rows(dense.n);
  for_each_row(dense.n, [&](Index i) { rows[i] = dense_row(dense, i, 0); });
  return rows;
}

void shrink(FormFactorMatrix::Rows& dense) {
  std::vector<std::size_t> entries(static_cast<std::size_t>(dense.n));
  for_each_row(dense.n, [&](Index i) {
    const std::span row(dense.values.data() + static_cast<std::size_t>(i) * entries.size(), entries.size());
    entries[i] = entries.size() - static_cast<std::size_t>(std::ranges::count(row, 0.0F));
  });
  if (!sparse_is_smaller(entries.size(), std::reduce(entries.begin(), entries.end()))) return;
  RowList rows = unpack(dense);
  dense = store(rows, nullptr);
}

PackedRows pack_scaled(RowList& symmetric, const RowScaling& scaling, const Eigen::ArrayXd& areas,
                       const Ranks* ranks) {
  PackedRows out{{}, {Eigen::ArrayXd::Zero(areas.size()), Eigen::ArrayXd::Zero(areas.size())}};
  const Eigen::ArrayXd inverse = 1 / areas;
  out.rows = store(symmetric, ranks, [&](Index i, Row& row) {
    double error = 0;
    for (Entry& e : row) {
      const double s = scaling(i, e.column) * static_cast<double>(e.value);
      const float f_ij = rounded_down(s * inverse[i]);
      const float f_ji =
          rounded_down(s * inverse[e.column]);  // what row j stores: S and its scaling are the same there
      error +=
          reciprocity_error(static_cast<double>(f_ij), static_cast<double>(f_ji), areas[i], areas[e.column]);
      e.value = f_ij;
    }
    out.measured.sums[i] = sum(row);
    out.measured.reciprocity[i] = error;
  });
  gather(ranks, out.measured.sums);
  gather(ranks, out.measured.reciprocity);
  return out;
}

}  // namespace radiosity
