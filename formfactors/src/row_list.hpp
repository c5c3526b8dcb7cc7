// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
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

/// The same of a dense row.
double sum(std::span<const float> row);

Eigen::ArrayXd row_sums(const RowList& rows, const Ranks* ranks);

}  // namespace radiosity
