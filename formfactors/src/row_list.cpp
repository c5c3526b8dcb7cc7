// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_list.hpp"

#include <cstdint>
#include <utility>

#include "vector_clones.hpp"

namespace radiosity {

std::size_t count_entries(const RowList& rows) {
  std::size_t count = 0;
  for (const Row& row : rows) count += row.size();
  return count;
}

// Blocks of rows are counted, then scattered, each on its own.
RowList transpose(const RowList& rows, std::size_t columns) {
  constexpr std::size_t kBlocks = 16;
  const auto first = [&](std::size_t block) { return rows.size() * block / kBlocks; };
  std::vector<std::vector<std::uint32_t>> place(kBlocks, std::vector<std::uint32_t>(columns, 0));
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i)
      for (const Entry& e : rows[i]) ++place[block][e.column];
  });
  RowList t(columns);
  for_each_row(static_cast<Index>(columns), [&](Index j) {
    std::uint32_t sum = 0;
    for (auto& block : place) sum += std::exchange(block[j], sum);
    t[j].resize(sum);
  });
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i)
      for (const Entry& e : rows[i]) t[e.column][place[block][e.column]++] = {static_cast<Index>(i), e.value};
  });
  return t;
}

RADIOSITY_CLONES static double sum_of(const float* values, std::size_t count) {
  std::array<double, 16> s{};
  std::size_t k = 0;
  for (; k + s.size() <= count; k += s.size())
    for (std::size_t chain = 0; chain < s.size(); ++chain) s[chain] += static_cast<double>(values[k + chain]);
  for (; k < count; ++k) s[0] += static_cast<double>(values[k]);
  for (std::size_t half = s.size() / 2; half > 0; half /= 2)
    for (std::size_t chain = 0; chain < half; ++chain) s[chain] += s[chain + half];
  return s[0];
}

double sum(std::span<const float> row) {
  return sum_of(row.data(), row.size());
}

Eigen::ArrayXd row_sums(const RowList& rows) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[i]); });
  return sums;
}

}  // namespace radiosity
