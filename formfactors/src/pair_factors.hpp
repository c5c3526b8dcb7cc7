// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "occluders.hpp"
#include "patch_columns.hpp"
#include "point_rules.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"
#include "shadow_share.hpp"

namespace radiosity {

/// A_i F_ij of single pairs = (exact unoccluded factor) × (visible fraction). Convex scenes need no fraction and are exact.
/// Elsewhere the polygons of the scene as they were before they were cut into patches are asked (Occluders): most pairs
/// are proved to see all or nothing of each other. The others take the fraction
///   Σ_k w_k F(x_k → visible part of j) / Σ_k w_k F(x_k → j)
/// over N points x_k of the smaller patch, of PointRules, each term exact or, where patches are some radii apart, by ShadowShare. Its error goes like F/N, so the sum of squares over all pairs
/// is least for a given work where
///   N = samples · min(16, (n F)^(2/3)),   F the larger of F_ij and F_ji without occlusion, n the number of patches, at
/// least 256.
/// Where the scene has too many polygons, or a patch is not convex, shadow rays measure the fraction on stratified pairs of
/// points, each weighted by its kernel k = cosθ cosθ' / r²:  Σ V k / Σ k.  They are `samples`, rounded up to a multiple of
/// 16, and four times as many where the first find a pair partly hidden.
class PairFactors {
 public:
  /// Pairs of one of `rows`, or where there are none of any patch, with any patch. The visibility must outlive this object.
  PairFactors(const Visibility& visibility, Index samples, std::uint64_t seed,
              double tolerance = kFactorTolerance, std::span<const Index> rows = {});

  /// Pairs of these patches with those in groups that neither lie behind them nor are hidden from them: what their rows cost. Of many,
  /// some are asked.
  double near_pairs(std::span<const Index> patches) const;

  /// False only where all patches lie behind i or are hidden from it in whole groups.
  bool may_see_any(Index i) const;

  /// Calls f(j, A_i F_ij) for every j, or where `upper` is set every j > i and every image of i and of such, that patch i exchanges
  /// light with; not in order.
  /// Groups of patches that lie behind i, or are hidden from it by one polygon, are passed over whole, as are those of which `skip` is true.
  template <class F, class Skip = bool (*)(const std::vector<Index>&)>
  void for_each_in_row(
      Index i, bool upper, F&& f, Skip&& skip = [](const std::vector<Index>&) { return false; }) const {
    const PatchMesh& mesh = visibility_.mesh();
    PairCounts counts;
    Work work{i};
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      const std::vector<Index>& patches = groups_[group].patches;
      // All are of the cell, or of one image of it.
      auto j = upper ? std::partition_point(patches.begin(), patches.end(),
                                            [&](Index k) { return k <= i || mesh.original(k) < i; })
                     : patches.begin();
      if (j == patches.end() || skip(patches)) continue;
      if (std::uint64_t PairCounts::*const none = approach(i, group)) {
        counts.*none += static_cast<std::uint64_t>(patches.end() - j);
        continue;
      }
      const bool free = sees_all_of(i, group);
      columns_.mutual_areas(i, group, work.areas);
      const double* area = work.areas.data() + (j - patches.begin());
      if (free) {
        counts.free += static_cast<std::uint64_t>(patches.end() - j);
        for (; j != patches.end(); ++j, ++area)
          if (const double mutual = *area != kNearPair ? *area : near_area(i, *j); mutual > 0) f(*j, mutual);
        continue;
      }
      for (; j != patches.end(); ++j, ++area)
        if (const double mutual = mutual_area(i, *j, *area, work, counts); mutual > 0) f(*j, mutual);
    }
    add(counts);
  }

  /// A_I F_IJ = Σ_i∈I Σ_j∈J A_i F_ij of cluster I and every cluster J, or every J ≥ I where `upper` is set, that it exchanges light
  /// with, otherwise 0; a number for each J. A cluster of several patches may exchange light with itself.
  void cluster_row(Index cluster, bool upper, std::vector<double>& row) const;

  Index samples() const { return samples_; }
  std::uint64_t seed() const { return seed_; }
  double tolerance() const { return tolerance_; }
  std::uint64_t rays() const { return rays_.load(std::memory_order_relaxed); }
  PairCounts counts() const;  ///< of for_each_in_row

 private:
  // Memory of one row.
  struct Work {
    Index row;
    std::vector<double> areas = {};
    std::vector<ShadowShare::Points> points = {};  // on its patch, by their rules
    ShadowShare::Points others = {};               // on another one
  };
  struct Weights {
    double seen = 0, all = 0;
  };
  // Why i exchanges light with no patch of the group; null where it may.
  std::uint64_t PairCounts::*approach(Index i, std::size_t group) const;
  // After `approach`: nothing is in between, and all patches of the group are whole in front of i, which is whole in front of them.
  bool sees_all_of(Index i, std::size_t group) const;
  // Where PatchColumns gives `area`.
  double mutual_area(Index i, Index j, double area, Work& work, PairCounts& counts) const;
  double near_area(Index i, Index j) const;
  void add(const PairCounts& counts) const;
  Weights sight_lines(Index i, Index j, Index first, Index last) const;
  double visible_by_rays(Index i, Index j) const;
  // Of patch i, the smaller one, as far as it is `from`.
  std::optional<double> visible_by_areas(Index i, const Polygon& from, const Polygon& to,
                                         const PointRules::Rule& rule, Work& work) const;
  ShadowShare::Points& points_on(Index i, const Polygon& from, const PointRules::Rule& rule,
                                 Work& work) const;
  double visible_by_shadows(Index i, const Polygon& from, const Polygon& to, double mutual, Work& work) const;

  const Visibility& visibility_;
  Index samples_, packets_;
  std::uint64_t seed_;
  double tolerance_;
  std::vector<Polygon> polygons_;
  std::vector<bool> convex_;
  std::vector<PatchGroup> groups_;
  std::vector<std::uint32_t> group_of_;
  std::vector<bool> any_covered_;  // of groups
  PatchColumns columns_;
  std::optional<Occluders> occluders_;  // absent where rays alone are used
  static constexpr double kMostOfSamples = 16;
  std::optional<PointRules> rules_;  // with the occluders
  mutable std::atomic<std::uint64_t> rays_{0};
  mutable std::mutex counting_;
  mutable PairCounts counts_;
};

}  // namespace radiosity
