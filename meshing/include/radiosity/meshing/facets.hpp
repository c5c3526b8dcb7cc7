// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// A connected planar part of the surface, seen from one side, as it was before it was cut into patches: a wall, whatever
/// the number of its patches. Architecture has few of them; who hides whom is asked of them.
struct Facet {
  struct Piece {
    std::vector<Vec3> corners;  ///< convex, counter-clockwise about normal
    Vec3 normal;                ///< unit, front
  };
  std::vector<Index> patches;  ///< ascending
  std::vector<Piece> pieces;   ///< cover the same points as the patches, without overlap
};

/// Patches that share an edge (end points equal to the bit) and lie in one plane, up to rounding, make a facet, whichever
/// faces of the file they come from. Every patch is in one facet; facets are ordered by their first patch. A non-convex
/// facet is cut into few convex pieces: its constrained Delaunay triangles, joined while they stay convex
/// [HertelMehlhorn1983].
std::vector<Facet> facets(const PatchMesh& mesh);

}  // namespace radiosity
