// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Sets of the numbers 0 … n−1 that grow together; the least number of a set stands for it.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

  Index root(Index i) {
    while (parent_[at(i)] != i) i = parent_[at(i)] = parent_[at(parent_[at(i)])];
    return i;
  }

  void unite(Index a, Index b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent_[at(high)] = low;
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  std::vector<Index> parent_;
};

}  // namespace radiosity
