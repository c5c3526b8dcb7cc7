// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "polygon.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace radiosity {

/// Polygons on their way from the scene's faces to patches.
struct Surface {
  std::vector<Vec3> points;
  std::vector<Index> corners;
  std::vector<Index> start{0};
  std::vector<Index> face;      ///< per polygon: the scene's face it is (a piece of)
  std::vector<Index> material;  ///< per polygon

  Index count() const { return static_cast<Index>(face.size()); }
  std::span<const Index> loop(Index polygon) const {
    return std::span(corners).subspan(start[polygon], start[polygon + 1] - start[polygon]);
  }
  void add(std::span<const Index> polygon_corners, Index of_face, Index of_material) {
    corners.insert(corners.end(), polygon_corners.begin(), polygon_corners.end());
    start.push_back(static_cast<Index>(corners.size()));
    face.push_back(of_face);
    material.push_back(of_material);
  }
  double diagonal() const;  ///< of the box round all corners
};

/// A polygon at (a part of) an edge of its own.
struct EdgeSide {
  std::uint64_t key;  ///< of the edge
  Index polygon;
  bool forward;  ///< from the smaller to the larger number
};

/// The sides of all edges, ordered by edge, then by polygon. Edges that only one polygon has are divided at the ends of other such
/// edges within kContact of them, and at those a little further off that a chain of other edges joins from end to end, so that those
/// who meet at a T-junction share edges.
std::vector<EdgeSide> edge_sides(const Surface& surface);

/// "face 3" or "faces 3, 7, 9 and 12 more".
std::string name_faces(const std::vector<Index>& faces);

/// Numbers of faces by two materials.
using MaterialPairs = std::map<std::array<Index, 2>, Index>;

/// "3 of 'floor' and 'box', 1 of 'floor' and 'wall'", the most frequent first; `between` is the "and".
std::string name_materials(const MaterialPairs& pairs, const Scene& scene, std::string_view between);

/// Merges equal vertices, drops degenerate and duplicate faces, orients the others. Throws InputError when
/// nothing is left.
Surface repair(const Scene& scene, Repairs& repairs, std::vector<std::string>& warnings);

/// Cuts the polygons that leave their mean plane into triangles.
Surface split_non_planar(const Surface& surface);

}  // namespace radiosity
