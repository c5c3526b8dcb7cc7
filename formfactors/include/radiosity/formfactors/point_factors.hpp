// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"

namespace radiosity {

/// What a surface element at x with unit normal n sees: F(x→j) = ∫_{A_j} V cosθ cosθ' / (π r²) dA_j, as the sum over single
/// patches where that pays and as cosine-distributed rays [Malley1988] for all directions. Thread-safe.
///
/// An element within kContact · (scene diagonal) of a surface lies on it, on the side that its normal points to, and in
/// front of it where the two are perpendicular: the surface hides nothing from it.
class PointFactors {
 public:
  /// Rays per point are rounded up to 32 k². The visibility must outlive this object.
  PointFactors(const Visibility& visibility, Index rays, std::uint64_t seed);
  ~PointFactors();
  PointFactors(const PointFactors&) = delete;
  PointFactors& operator=(const PointFactors&) = delete;

  /// Factor to the visible part of a patch.
  struct Single {
    Index patch;
    double factor;
    double variance;  ///< of the factor; 0: exact
  };
  struct Ray {
    Index patch;  ///< whose front is hit first, or kNothing, or kBack
    bool single;  ///< the patch is one that `singles` answers for
    Vec3 hit;     ///< m; where patch ≥ 0
  };
  struct View {
    std::vector<Single> singles;
    /// Rays 2s and 2s + 1 are independent and share stratum s of the hemisphere, one of rays()/2 of equal factor.
    std::vector<Ray> rays;
  };

  /// What all points of a patch have in common: lamps in front of it, what may stand between, and the walls that touch it.
  struct Outlook {
    struct Lamp {
      std::size_t number;       ///< among all lamps
      std::vector<Vec3> front;  ///< the part in front of the patch
      bool free;                ///< nothing stands between
      std::vector<int> between;
    };
    std::vector<Lamp> lamps;  ///< but those that none of its points sees
    std::vector<std::size_t> walls;
  };

  /// Singles are the patches that emit, unless they are more than kMostLamps: rays would find them by chance only. Near patches among
  /// them would cost more than rays that bring the variance down by as much.
  /// Lambert's formula [Lambert1760] for what is left of the patch when the horizon and the shadows of the walls are cut
  /// away: exact. Where the scene has too many walls, or more than a few stand between, the formula for the whole patch less what
  /// stratified shadow rays find hidden: unbiased, with the variance that pairs of rays in one stratum tell.
  /// The stream of random numbers depends on the seed and `stream`. With the outlook of the patch that x lies on, the same at less
  /// cost. `rays`: in place of the constructor's, rounded up likewise; 0: those.
  void view(const Vec3& x, const Vec3& n, std::uint64_t stream, View& view, const Outlook* outlook = nullptr,
            Index rays = 0) const;

  /// Nothing where the patch is not convex, or the scene has too many walls. Pays where several points of a patch are asked of.
  std::optional<Outlook> outlook(Index patch) const;

  Index rays() const;
  static constexpr std::size_t kMostLamps = 1024;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace radiosity
