// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_list.hpp"

#include <cstdint>
#include <utility>

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

Eigen::ArrayXd row_sums(const RowList& rows) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[i]); });
  return sums;
}

}  // namespace radiosity
