// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Who sees whom. Patches are opaque; the back of a patch blocks light and returns none. Thread-safe. Of one cell of a symmetric
/// scene it answers for the whole.
///
/// Rays are cast in single precision on geometry that is recentred and scaled to unit size, so that neither
/// map coordinates nor the unit of length matter. A ray that starts on a patch passes through every patch in
/// the same plane (a box's bottom on the floor): what lies in a plane is never in front of it. Those of packets start at most
/// kNearPlane above it.
class Visibility {
 public:
  /// The mesh must outlive this object.
  explicit Visibility(const PatchMesh& cell);
  ~Visibility();
  Visibility(const Visibility&) = delete;
  Visibility& operator=(const Visibility&) = delete;

  /// The patches that are seen: those of the cell, and behind them their images (PatchMesh::with_images).
  const PatchMesh& mesh() const { return mesh_; }
  /// The mesh that was given.
  const PatchMesh& cell() const { return cell_; }

  /// What is asked who hides whom: the walls as they were before they were cut, so that the cost of a ray does not depend
  /// on the number of patches. A hit is mapped to the patch at its place.
  const std::vector<Facet>& facets() const { return *facets_; }

  /// No patch can stand between two others: all lie on or in front of the planes of all others, so the
  /// scene is (part of) the boundary of a convex room and no ray is needed.
  bool convex() const { return convex_; }

  /// The patch lies against another one that faces it: a wall behind a cupboard, the cupboard's back. Such a patch sees nothing
  /// and nothing sees it. Told from the two sides of a wall without thickness by the winding number of all polygons
  /// just before the patch, w = Σ Ω / 4π [VanOosterom1983]: 1 in a room, 0 inside the furniture and behind the walls;
  /// 0 and −1 where no room is round the scene. In open scenes, where such numbers are not whole before most patches, none counts as
  /// covered.
  bool covered(Index patch) const { return covered_[patch] != 0; }
  /// Whether something that faces the patch lies within 4 kSamePlane of it at this point of it, in scaled coordinates: too near for
  /// rays, and what no light to speak of gets to.
  bool faced(Index patch, const Eigen::Vector3f& x) const;

  static constexpr Index kNothing = -1;  ///< the ray leaves the scene
  static constexpr Index kBack = -2;     ///< the ray ends on the back of a patch

  /// Up to 16 rays that start on one patch, or anywhere.
  struct Packet {
    Index from = 0;  ///< the patch they start on; kNothing: none
    int count = 0;
    alignas(64) std::array<float, 16> x{}, y{}, z{};     ///< origins, in scaled coordinates (see `scaled`)
    alignas(64) std::array<float, 16> dx{}, dy{}, dz{};  ///< directions, any length
    alignas(64) std::array<Index, 16> hit{};  ///< out: patch seen from its front, kNothing or kBack
    alignas(64)
        std::array<float, 16> distance{};  ///< out: to what is hit, in lengths of the direction; ∞: nothing
  };
  void first_hits(Packet& packet) const;

  /// Position in the unit-size coordinates of the rays.
  Vec3 scaled(const Vec3& x) const { return (x - centre_) * scale_; }

  /// Up to 16 sight lines between a point on patch `from` (kNothing: anywhere) and a point on patch `to`.
  struct SightLines {
    Index from = 0, to = 0;
    int count = 0;
    alignas(64) std::array<float, 16> x{}, y{}, z{};     ///< points on `from`, in scaled coordinates
    alignas(64) std::array<float, 16> tx{}, ty{}, tz{};  ///< points on `to`
    std::array<bool, 16> blocked{};                      ///< out: a patch outside both planes stands between
  };
  void blocked(SightLines& lines) const;

  /// Whether x on patch i and y on patch j see each other: both in front of the other's plane and nothing
  /// between. Symmetric: visible(x, i, y, j) == visible(y, j, x, i), to the bit.
  bool visible(const Vec3& x, Index i, const Vec3& y, Index j) const;

  struct Hit {
    Index patch = kNothing;  ///< whichever side it shows
    bool front = false;
    double distance = 0;  ///< in lengths of `direction`
  };
  /// What a ray meets first that starts anywhere, such as at a camera, or on either side of patch `from`. Then it starts kSamePlane
  /// above that side and passes through what lies in the plane, and through what shows its other side before it is clear of a curved
  /// surface (kLeaving).
  Hit first_hit(const Vec3& origin, const Vec3& direction, Index from = kNothing) const;

 private:
  struct Impl;
  void find_covered();
  const PatchMesh& cell_;
  std::unique_ptr<const PatchMesh> whole_;  // null where it is the cell
  const PatchMesh& mesh_;
  Vec3 centre_;
  double scale_;
  std::shared_ptr<const std::vector<Facet>> facets_;
  bool convex_;
  std::vector<std::uint8_t> covered_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace radiosity
