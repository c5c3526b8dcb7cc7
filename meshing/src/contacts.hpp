// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <unordered_map>
#include <unordered_set>

#include "surface.hpp"

namespace radiosity {

/// Where polygons touch or cross each other other than along common edges.
struct Contacts {
  /// A line in a polygon from point a to b; it is (part of) `parent`, an edge of another polygon or the line
  /// in which two polygons cross, from which it inherits its points, so that both sides have the same ones.
  struct Line {
    Index polygon, a, b;
    std::array<Index, 2> parent;
  };
  std::vector<Line> lines;  ///< sorted by polygon

  /// Points that must be kept on the edge or line with this key (edge_key of its ends).
  std::unordered_map<std::uint64_t, std::vector<Index>> splits;

  /// Edges of polygons along which another polygon's edge runs: no smooth surface crosses them.
  std::unordered_set<std::uint64_t> creases;

  /// Edges along which the edge of a smooth neighbour runs that has other ends.
  std::unordered_set<std::uint64_t> partly_shared;

  /// Length of the edge that lies on other polygons.
  std::unordered_map<std::uint64_t, double> covered;

  double distance = 0;  ///< m, what counts as the same place

  /// Faces that lie in one another, (smaller, larger) number, sorted.
  std::vector<std::array<Index, 2>> coincident;

  /// Polygons that lie wholly in another one of the same material that faces the same way, and that other one.
  std::vector<std::array<Index, 2>> contained;

  /// The points on a straight way from a to b, both included.
  std::vector<Index> chain(const std::vector<Vec3>& points, Index a, Index b) const;
  std::vector<Index> chain(const std::vector<Vec3>& points, const Line& line) const;
};

/// Finds all contacts within `distance`, and appends the points they need to surface.points. Polygons that
/// leave their mean plane, and slivers no wider than a few times the distance, take no part.
Contacts find_contacts(Surface& surface, double distance);

}  // namespace radiosity
