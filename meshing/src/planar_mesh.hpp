// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "polygon.hpp"

namespace radiosity {

struct PlanarMesh {
  std::vector<Vec2> points;                     ///< those given, then those added inside
  std::vector<std::array<Index, 3>> triangles;  ///< counter-clockwise
};

/// Constrained Delaunay triangles of the region inside `boundary` (even–odd rule: an edge walked twice, the
/// bridge of a keyhole polygon, bounds nothing). Boundary edges and `lines` are kept as edges and get no new
/// points. Inside, a hexagonal lattice of the given spacing is added, 0.6 · spacing clear of every kept edge,
/// and inner edges longer than `longest` are halved.
PlanarMesh mesh_polygon(std::vector<Vec2> points, std::span<const std::array<Index, 2>> boundary,
                        std::span<const std::array<Index, 2>> lines = {},
                        double spacing = std::numeric_limits<double>::infinity(),
                        double longest = std::numeric_limits<double>::infinity());

}  // namespace radiosity
