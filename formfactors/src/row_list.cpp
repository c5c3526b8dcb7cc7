// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_list.hpp"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>
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

namespace {

struct Sent {
  Index row, column;
  float value;
};

// Entries that are on their way at a time, of each rank.
constexpr std::size_t kSentAtOnce = 1 << 21;

}  // namespace

RowList transpose(const RowList& rows, const Ranks* ranks) {
  if (ranks == nullptr) return transpose(rows, rows.size());
  const std::size_t n = rows.size();
  std::vector<std::uint64_t> counts(n, 0);
  for (const Row& row : rows)
    for (const Entry& e : row) ++counts[e.column];
  ranks->sum(counts);
  RowList t(n);
  for (std::size_t j = 0; j < n; ++j)
    if (ranks->owns(static_cast<Index>(j))) t[j].reserve(counts[j]);
  const auto others = static_cast<std::size_t>(ranks->count());
  const std::size_t stretch =
      others * std::max<std::size_t>(Ranks::kBlock, kSentAtOnce / std::max<std::size_t>(n, 1));
  for (std::size_t first = 0; first < n; first += stretch) {
    std::vector<std::vector<std::byte>> to(others);
    for (std::size_t i = first; i < std::min(n, first + stretch); ++i)
      for (const Entry& e : rows[i]) {
        const Sent sent{static_cast<Index>(i), e.column, e.value};
        const auto bytes = std::as_bytes(std::span(&sent, 1));
        auto& queue = to[static_cast<std::size_t>(ranks->owner(e.column))];
        queue.insert(queue.end(), bytes.begin(), bytes.end());
      }
    const std::vector<std::byte> received = ranks->exchange(to);
    for (std::size_t at = 0; at < received.size(); at += sizeof(Sent)) {
      Sent sent;
      std::memcpy(&sent, received.data() + at, sizeof sent);
      t[sent.column].push_back({sent.row, sent.value});
    }
  }
  for_each_row(static_cast<Index>(n), [&](Index j) { std::ranges::sort(t[j], {}, &Entry::column); });
  return t;
}

void release_freed([[maybe_unused]] std::size_t entries) {
#ifdef __GLIBC__
  constexpr std::size_t kMany = 1 << 21;
  if (entries >= kMany) malloc_trim(0);
#endif
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

Eigen::ArrayXd row_sums(const RowList& rows, const Ranks* ranks) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[i]); });
  gather(ranks, sums);
  return sums;
}

}  // namespace radiosity
