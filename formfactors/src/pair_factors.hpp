// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "polygon_factor.hpp"
#include "radiosity/formfactors/visibility.hpp"

namespace radiosity {

/// A_i F_ij of single pairs = (exact unoccluded factor) × (visible fraction). The fraction is measured on stratified
/// pairs of points, each weighted by its kernel k = cosθ cosθ' / r²:   Σ V k / Σ k;  a pair that the first points find
/// partly hidden gets four times as many. Convex scenes cast no ray and are exact.
class PairFactors {
 public:
  /// `samples` is rounded up to a multiple of 16. The visibility must outlive this object.
  PairFactors(const Visibility& visibility, Index samples, std::uint64_t seed);

  /// A_i F_ij in m²; the same bits for (i, j) and (j, i).
  double mutual_area(Index i, Index j) const;

  Index samples() const { return 16 * packets_; }
  std::uint64_t rays() const { return rays_.load(std::memory_order_relaxed); }

 private:
  struct Weights {
    double seen = 0, all = 0;
  };
  Weights sight_lines(Index i, Index j, Index first, Index last) const;
  double visible_fraction(Index i, Index j) const;

  const Visibility& visibility_;
  Index packets_;
  std::uint64_t seed_;
  std::vector<Polygon> polygons_;
  mutable std::atomic<std::uint64_t> rays_{0};
};

}  // namespace radiosity
