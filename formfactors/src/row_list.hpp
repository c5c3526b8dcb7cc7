// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Sparse rows of a matrix while it is being assembled, columns ascending.
struct Entry {
  Index column;
  float value;
};
using Row = std::vector<Entry>;
using RowList = std::vector<Row>;

std::size_t count_entries(const RowList& rows);

/// Mᵀ of a matrix M with so many columns.
RowList transpose(const RowList& rows, std::size_t columns);
/// Of a square M that several ranks hold, each some of its rows, the rows of Mᵀ that this one owns; the others are empty.
RowList transpose(const RowList& rows, const Ranks* ranks);

/// Rows [0, n) of which each is on one of several ranks, whichever, sent entry by entry. entries(i, send) calls send(rank, column, value) of
/// row i, at most `most(i)` times; take(i, column, value) gets what was sent to this rank, rows ascending, and the entries of one in the
/// order in which they were sent. A quarter of a million entries are on their way at a time, of each rank.
template <class Value, class Most, class Entries, class Take>
void exchange_entries(const Ranks& ranks, Index n, const Most& most, const Entries& entries,
                      const Take& take) {
  struct Sent {
    Index row, column;
    Value value;
  };
  constexpr std::size_t kAtOnce = 1 << 18;
  const auto count = static_cast<std::size_t>(ranks.count());
  for (Index first = 0; first < n;) {
    Index last = first;  // what the fullest of them sends at once
    for (std::size_t sent = 0; last < n; ++last) {
      sent += most(last);
      if (sent > kAtOnce && last > first) break;
    }
    last = static_cast<Index>(std::ranges::min(of_all(&ranks, last)));
    std::vector<std::vector<std::byte>> to(count);
    std::vector<Sent> own;
    for (Index i = first; i < last; ++i)
      entries(i, [&](int rank, Index column, Value value) {
        const Sent sent{i, column, value};
        if (rank == ranks.rank()) {
          own.push_back(sent);
          return;
        }
        const auto bytes = std::as_bytes(std::span(&sent, 1));
        auto& queue = to[static_cast<std::size_t>(rank)];
        queue.insert(queue.end(), bytes.begin(), bytes.end());
      });
    const std::vector<std::byte> bytes = ranks.exchange(to);
    std::vector<Sent> received(bytes.size() / sizeof(Sent));
    if (!received.empty()) std::memcpy(received.data(), bytes.data(), bytes.size());
    // Of each rank one after the other, its rows ascending: merged.
    std::vector<std::span<const Sent>> runs{own};
    for (auto at = received.begin(); at != received.end();) {
      const auto end =
          std::adjacent_find(at, received.end(), [](const Sent& a, const Sent& b) { return a.row > b.row; });
      const auto next = end == received.end() ? end : end + 1;
      runs.emplace_back(at, next);
      at = next;
    }
    for (Index i = first; i < last; ++i)
      for (std::span<const Sent>& run : runs)
        for (; !run.empty() && run.front().row == i; run = run.subspan(1))
          take(i, run.front().column, run.front().value);
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
