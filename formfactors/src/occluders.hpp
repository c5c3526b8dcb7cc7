// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// The opaque polygons of a scene as they were before they were cut into patches: in architecture they are few, whatever
/// the number of patches. Answers exactly which part of one convex polygon another one sees.
/// Coordinates are relative to `origin`.
class Occluders {
 public:
  /// Above these, rays are cheaper: polygons in the scene; polygons to test against the shaft of a pair; polygons
  /// that cast shadows between a pair (each may cut what the others leave visible in several pieces).
  static constexpr std::size_t kMost = 2048;
  static constexpr std::size_t kMostToTest = 128;
  static constexpr std::size_t kMostShadows = 16;

  Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets, const Vec3& origin);

  /// Whether the scene has few enough polygons for exact visibility to pay.
  bool usable() const { return usable_; }

  /// Memory for one thread's questions.
  struct Scratch {
    std::vector<int> candidates;
    struct Plane {
      Vec3 normal;
      double offset;
    };
    std::vector<Plane> shaft;
    std::vector<std::vector<Vec3>> pieces, next;
    std::vector<Vec3> inside, outside;
  };

  enum class View { free, hidden, partial, crowded };

  /// Proves that nothing stands between p (part of patch i) and q (part of patch j), or that one polygon hides
  /// them from each other; where neither can be proved, leaves the polygons concerned in scratch.candidates.
  /// Crowded: so many polygons may stand between them that rays are cheaper. p and q are convex.
  View classify(Index i, std::span<const Vec3> p, Index j, std::span<const Vec3> q, Scratch& scratch) const;

  /// Factor from a point x with normal n to the part of q that scratch.candidates leave visible.
  double visible_point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q, Scratch& scratch) const;

 private:
  struct Convex {
    std::vector<Vec3> corners;
    Vec3 normal;
    double offset;
  };
  using Mask = std::vector<std::uint64_t>;

  void mark_sides(const PatchMesh& mesh, const Vec3& origin);

  double slack_;
  bool usable_ = false;
  std::vector<Convex> polygons_;
  std::size_t words_ = 0;
  Mask front_, back_,
      facing_;  // words_ per patch: patch on the front / back side of the polygon; polygon before the patch
};

/// Point to polygon [Lambert1760]: F = 1/(2π) Σ_k n·Γ_k, Γ_k = angle(v_k, v_{k+1}) · (v_k × v_{k+1}) / |v_k × v_{k+1}|,
/// positive when q is counter-clockwise about a normal that points towards x. q lies in front of x's horizon.
double point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q);

}  // namespace radiosity
