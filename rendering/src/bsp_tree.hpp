// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "rasteriser.hpp"

namespace radiosity {

/// All patches in pieces that have an order of priority from every eye: a binary space partition [Fuchs1980]. Built once, whatever the
/// view, and always the same.
///
/// A plane divides what is left into what is in front of it, behind it and on it; what it crosses is split. Planes are those of patches,
/// among some of them the one that splits least and divides most evenly, or, where many patches are left, parallel to two axes: a
/// convex thing has all of itself behind each of its patches, and would make a chain of them.
///
/// Signs of heights over planes are not exact but have a tolerance: corners within kCoplanar · (scene diagonal), and the rounding of
/// coordinates, count as on the plane. Split vertices are rounded, so that exact signs would find them off the planes they were
/// made on, and would split off slivers of rounding; and faces that were modelled to touch or to share a plane would be cut by it.
/// What is on the wrong side is thinner than the tolerance, far below a pixel. Edges are drawn as the lines that they were before they
/// were split, so that no holes come from that, either.
class BspTree {
 public:
  explicit BspTree(const PatchMesh& mesh);

  const Polygons& polygons() const { return polygons_; }
  /// Of the vertices, interpolated where polygons were split; not of unit length there. Vertices × 3.
  const BandArray& normals() const { return normals_; }

  /// All polygons; none hides one that comes after it. Of those in one plane, those that show their backs come first.
  std::vector<Index> back_to_front(const Vec3& eye) const;

 private:
  struct Node {
    Vec3 normal, on;
    Index front = -1, back = -1;                    ///< nodes
    Index first = 0, first_opposite = 0, last = 0;  ///< polygons in the plane: first those with its front
  };
  class Builder;

  std::vector<Node> nodes_;
  Polygons polygons_;
  BandArray normals_;
};

}  // namespace radiosity
