// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/meshing/types.hpp"
#include "row_memory.hpp"

namespace radiosity {

/// Sparse rows of a matrix while it is being assembled, columns ascending.
struct Entry {
  Index column;
  float value;
};
using Row = std::vector<Entry, RowMemory<Entry>>;
using RowList = std::vector<Row>;

std::size_t count_entries(const RowList& rows);

/// Mᵀ of a matrix M with so many columns. Of several ranks each has some rows of M, and gets those of Mᵀ that it owns; the others are
/// empty. `numbers`: ascending, those of the rows in Mᵀ, where they are not 0, 1, 2, …
RowList transpose(const RowList& rows, std::size_t columns, const Ranks* ranks,
                  std::span<const Index> numbers = {});

/// Rows [0, n) of which each is on one of several ranks, whichever, sent entry by entry. entries(i, send) calls send(rank, column, value) of
/// row i, at most `most(i)` times; take(i, column, value) gets what was sent to this rank, rows ascending, and the entries of one in the
/// order in which they were sent. A quarter of a million entries are on their way at a time, of each rank.
template <class Value, class Most, class Entries, class Take>
void exchange_entries(const Ranks& ranks, Index n, const Most& most, const Entries& entries,
                      const Take& take) {
  struct Sent {
    Index column;  // or −1 − i: what follows is of row i
    Value value;
  };
  constexpr std::size_t kAtOnce = 1 << 18;
  const auto count = static_cast<std::size_t>(ranks.count());
  std::vector<std::vector<Sent>> to(count);
  std::vector<std::span<const Sent>> from(count);
  std::vector<std::vector<std::byte>> received;
  for (Index first = 0; first < n;) {
    Index last = first;  // what the fullest of them sends at once
    for (std::size_t sent = 0; last < n; ++last) {
      sent += most(last);
      if (sent > kAtOnce && last > first) break;
    }
    last = static_cast<Index>(std::ranges::min(of_all(&ranks, last)));
    std::vector<Index> begun(count, -1);
    for (auto& queue : to) queue.clear();
    for (Index i = first; i < last; ++i)
      entries(i, [&](int rank, Index column, Value value) {
        const auto r = static_cast<std::size_t>(rank);
        if (std::exchange(begun[r], i) != i) to[r].push_back({-1 - i, {}});
        to[r].push_back({column, value});
      });
    std::vector<std::span<const std::byte>> bytes;
    for (const auto& queue : to) bytes.push_back(std::as_bytes(std::span(queue)));
    ranks.exchange(bytes, received);
    for (std::size_t r = 0; r < count; ++r)
      from[r] = {reinterpret_cast<const Sent*>(received[r].data()), received[r].size() / sizeof(Sent)};
    from[static_cast<std::size_t>(ranks.rank())] = to[static_cast<std::size_t>(ranks.rank())];
    for (Index i = first; i < last; ++i)
      for (std::span<const Sent>& run : from) {
        if (run.empty() || run.front().column != -1 - i) continue;
        std::size_t k = 1;
        for (; k < run.size() && run[k].column >= 0; ++k) take(i, run[k].column, run[k].value);
        run = run.subspan(k);
      }
    first = last;
  }
}

/// Gives back to the system what rows of so many entries were freed of, where that is much: pages between others that are still in use
/// stay with the process otherwise.
void release_freed(std::size_t entries);

/// f(i) of rows [0, n), in parallel.
template <class F>
void for_each_row(Index n, F&& f) {
  tbb::parallel_for(tbb::blocked_range<Index>(0, n, 64), [&](const tbb::blocked_range<Index>& block) {
    for (Index i = block.begin(); i != block.end(); ++i) f(i);
  });
}

/// Calls f(j, a_j, b_j) for every column of either row, ascending, with 0 where one has no entry.
template <class F>
void merge(const Row& a, const Row& b, F&& f) {
  constexpr Index kEnd = std::numeric_limits<Index>::max();
  auto p = a.begin();
  auto q = b.begin();
  while (p != a.end() || q != b.end()) {
    const Index ja = p != a.end() ? p->column : kEnd;
    const Index jb = q != b.end() ? q->column : kEnd;
    f(std::min(ja, jb), ja <= jb ? static_cast<double>(p->value) : 0,
      jb <= ja ? static_cast<double>(q->value) : 0);
    p += ja <= jb ? 1 : 0;
    q += jb <= ja ? 1 : 0;
  }
}

/// Σ term(e) in four chains: one alone would wait for each of its additions.
template <class F>
double sum(const Row& row, F&& term) {
  std::array<double, 4> s{};
  std::size_t k = 0;
  for (; k + 4 <= row.size(); k += 4)
    for (std::size_t chain = 0; chain < 4; ++chain) s[chain] += term(row[k + chain]);
  for (; k < row.size(); ++k) s[0] += term(row[k]);
  return (s[0] + s[1]) + (s[2] + s[3]);
}

inline double sum(const Row& row) {
  return sum(row, [](const Entry& e) { return static_cast<double>(e.value); });
}

/// The same of a dense row, in sixteen.
double sum(std::span<const float> row);
/// What the sum of a dense row of n values is, to the bit.
double sum_as_dense(const Row& row, Index n);

Eigen::ArrayXd row_sums(const RowList& rows, const Ranks* ranks);

}  // namespace radiosity
