// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/ranks.hpp"

#include <algorithm>
#include <numeric>

namespace radiosity {
namespace {

// f(first, last) of each block of rows that rank r owns, ascending.
template <class F>
void for_each_owned(const Ranks& ranks, int r, Index n, F&& f) {
  for (Index first = r * Ranks::kBlock; first < n; first += ranks.count() * Ranks::kBlock)
    f(first, std::min(n, first + Ranks::kBlock));
}

}  // namespace

Index Ranks::rows_of(int r, Index n) const {
  Index rows = 0;
  for_each_owned(*this, r, n, [&](Index first, Index last) { rows += last - first; });
  return rows;
}

void Ranks::gather(double* values, Index rows, Index width) const {
  if (count() == 1) return;
  std::vector<int> counts;
  for (int r = 0; r < count(); ++r) counts.push_back(rows_of(r, rows) * width);
  std::vector<double> own;
  own.reserve(static_cast<std::size_t>(counts[static_cast<std::size_t>(rank())]));
  const auto at = [&](Index row) {
    return values + static_cast<std::ptrdiff_t>(row) * static_cast<std::ptrdiff_t>(width);
  };
  for_each_owned(*this, rank(), rows,
                 [&](Index first, Index last) { own.insert(own.end(), at(first), at(last)); });
  std::vector<double> all(std::reduce(counts.begin(), counts.end(), std::size_t{0}));
  all_gather(own, counts, all);
  const double* from = all.data();
  for (int r = 0; r < count(); ++r)
    for_each_owned(*this, r, rows, [&](Index first, Index last) {
      std::copy(from, from + (at(last) - at(first)), at(first));
      from += at(last) - at(first);
    });
}

bool on_all(const Ranks* ranks, bool so) {
  return total(ranks, so ? 0 : 1) == 0;
}

std::uint64_t total(const Ranks* ranks, std::uint64_t own) {
  if (ranks != nullptr) ranks->sum({&own, 1});
  return own;
}

std::vector<double> of_all(const Ranks* ranks, double own) {
  if (ranks == nullptr) return {own};
  std::vector<double> all(static_cast<std::size_t>(ranks->count()));
  ranks->all_gather({&own, 1}, std::vector<int>(all.size(), 1), all);
  return all;
}

}  // namespace radiosity
