// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"

namespace radiosity {

/// What a ray meets.
struct SurfaceHit {
  Index patch;
  bool front;       ///< seen from its front
  double distance;  ///< m, in double precision
  Vec3 x;           ///< on the patch's plane
  Vec3 n;           ///< unit, towards where the ray came from
};

/// A material as rays want it, one column per band.
struct Finish {
  using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;
  Bands diffuse, mirrored, transmitted, emission;  ///< ρ, k_s, k_t, E
  double shininess;
  Bands index;
  bool disperses;     ///< not all indices are the same
  bool lets_through;  ///< k_t > 0 in some band
};

/// A mesh as rays meet it.
class RayCaster {
 public:
  explicit RayCaster(const PatchMesh& mesh);

  /// Along a unit direction from anywhere, or from a point of patch `from`. Rays are traced in single precision; where they meet a
  /// patch's plane is computed in double, along the ray or, where that is nearly in the plane, at its foot.
  std::optional<SurfaceHit> cast(const Vec3& origin, const Vec3& direction,
                                 Index from = Visibility::kNothing) const;

  /// Nothing stands between a point of a patch and what is `distance` m away along a unit direction.
  bool reaches(const Vec3& origin, const Vec3& direction, Index from, double distance) const {
    const auto hit = cast(origin, direction, from);
    return !hit || ends(*hit, distance);
  }
  /// What was hit is where a ray of that length ends.
  bool ends(const SurfaceHit& hit, double distance) const { return hit.distance >= distance - end_; }

  /// Takes from light that comes to a point of a patch from `distance` m away along a unit direction what stands between: all, or all
  /// but the share k_t that a surface lets through, as if it did not refract. Where `straight_only`, what does refract takes all.
  void dim(const SurfaceHit& at, const Vec3& direction, double distance, Finish::Bands& light,
           bool straight_only = false) const;

  const Finish& finish(Index patch) const { return finishes_[visibility_.mesh().material(patch)]; }

  /// The direction of light of a band that a surface lets through, by Snell's law; straight on through a sheet, which has a patch on
  /// either side and no thickness. Nothing where all is reflected.
  std::optional<Vec3> through(const SurfaceHit& hit, const Vec3& n, const Vec3& direction, Index band) const;
  /// That depends on the band.
  bool disperses(Index patch) const { return finish(patch).disperses && sheet_[patch] == 0; }

  /// Cast so far. Not to be called while others cast.
  std::uint64_t rays() const {
    return rays_.combine([](std::uint64_t a, std::uint64_t b) { return a + b; });
  }

 private:
  Visibility visibility_;
  double end_;                       // m
  std::vector<std::uint8_t> sheet_;  // per patch
  std::vector<Finish> finishes_;     // per material
  mutable tbb::enumerable_thread_specific<std::uint64_t> rays_{0};
};

/// The direction of a mirror's ray: d − 2 (d·n) n.
inline Vec3 mirrored(const Vec3& d, const Vec3& n) {
  return d - 2 * d.dot(n) * n;
}

/// Snell's law: η₁ sin θ₁ = η₂ sin θ₂ for a unit direction d that meets a surface whose unit normal n is on the side it comes from,
/// with eta = η₁ / η₂. Nothing where all is reflected, sin θ₂ > 1.
std::optional<Vec3> refracted(const Vec3& d, const Vec3& n, double eta);

}  // namespace radiosity
