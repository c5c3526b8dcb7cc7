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
  static constexpr std::size_t kNoBack = static_cast<std::size_t>(-1);
  std::size_t back =
      kNoBack;  ///< the facet with the same corners that is seen from the other side: a sheet has two
};

/// Patches that share an edge (end points equal to the bit) make a facet where they are pieces of one planar face of the file
/// (however the rounding of its corners bends it, up to kPlanarity), or lie in one plane up to kCoplanar. A facet never hides
/// one of its points from the half-space it faces. Every patch is in one facet; facets are ordered by their first patch. A non-convex
/// facet is cut into few convex pieces: its constrained Delaunay triangles, joined while they stay convex
/// [HertelMehlhorn1983].
std::vector<Facet> facets(const PatchMesh& mesh);

}  // namespace radiosity
