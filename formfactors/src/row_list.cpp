// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_list.hpp"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <cstddef>
#include <cstdint>
#include <utility>

#include "vector_clones.hpp"

namespace radiosity {

std::size_t count_entries(const RowList& rows) {
  std::size_t count = 0;
  for (const Row& row : rows) count += row.size();
  return count;
}

RowList transpose(const RowList& rows, std::size_t columns, const Ranks* ranks,
                  std::span<const Index> numbers) {
  const auto number = [&](std::size_t i) { return numbers.empty() ? static_cast<Index>(i) : numbers[i]; };
  RowList t(columns);
  if (ranks != nullptr) {
    std::vector<std::uint64_t> counts(columns, 0);
    for (const Row& row : rows)
      for (const Entry& e : row) ++counts[e.column];
    ranks->sum(counts);
    std::vector<int> owner(columns);
    for (std::size_t j = 0; j < columns; ++j) {
      owner[j] = ranks->owner(static_cast<Index>(j));
      if (owner[j] == ranks->rank()) t[j].reserve(counts[j]);
    }
    exchange_entries<float>(
        *ranks, static_cast<Index>(rows.size()), [&](Index i) { return rows[i].size(); },
        [&](Index i, const auto& send) {
          for (const Entry& e : rows[i]) send(owner[e.column], e.column, e.value);
        },
        [&](Index i, Index j, float value) {
          t[j].push_back({number(static_cast<std::size_t>(i)), value});
        });
    return t;
  }
  // Blocks of rows are counted, then scattered, each on its own.
  constexpr std::size_t kBlocks = 16;
  const auto first = [&](std::size_t block) { return rows.size() * block / kBlocks; };
  std::vector<std::vector<std::uint32_t>> place(kBlocks, std::vector<std::uint32_t>(columns, 0));
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i)
      for (const Entry& e : rows[i]) ++place[block][e.column];
  });
  for_each_row(static_cast<Index>(columns), [&](Index j) {
    std::uint32_t sum = 0;
    for (auto& block : place) sum += std::exchange(block[j], sum);
    t[j].resize(sum);
  });
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i)
      for (const Entry& e : rows[i]) t[e.column][place[block][e.column]++] = {number(i), e.value};
  });
  return t;
}

void release_freed([[maybe_unused]] std::size_t entries) {
#ifdef __GLIBC__
  constexpr std::size_t kMany = 1 << 21;
  if (entries >= kMany) malloc_trim(0);
#endif
}

namespace {

// Chains of sums.
using Chains = std::array<double, 16>;

double united(Chains s) {
  for (std::size_t half = s.size() / 2; half > 0; half /= 2)
    for (std::size_t chain = 0; chain < half; ++chain) s[chain] += s[chain + half];
  return s[0];
}

RADIOSITY_CLONES double sum_of(const float* values, std::size_t count) {
  Chains s{};
  std::size_t k = 0;
  for (; k + s.size() <= count; k += s.size())
    for (std::size_t chain = 0; chain < s.size(); ++chain) s[chain] += static_cast<double>(values[k + chain]);
  for (; k < count; ++k) s[0] += static_cast<double>(values[k]);
  return united(s);
}

}  // namespace

double sum(std::span<const float> row) {
  return sum_of(row.data(), row.size());
}

double sum_as_dense(const Row& row, Index n) {
  Chains s{};
  constexpr auto kChains = static_cast<Index>(std::tuple_size_v<Chains>);
  const Index whole = n / kChains * kChains;
  for (const Entry& e : row)
    s[static_cast<std::size_t>(e.column < whole ? e.column % kChains : 0)] += static_cast<double>(e.value);
  return united(s);
}

Eigen::ArrayXd row_sums(const RowList& rows, const Ranks* ranks) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[i]); });
  gather(ranks, sums);
  return sums;
}

}  // namespace radiosity
