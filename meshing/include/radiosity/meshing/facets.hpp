// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "radiosity/meshing/facet.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// Patches that share an edge (end points equal to the bit) make a facet where they are pieces of one planar face of the file
/// (however the rounding of its corners bends it, up to kPlanarity), or lie in one plane up to kCoplanar. A facet never hides
/// one of its points from the half-space it faces. Every patch is in one facet; facets are ordered by their first patch. A non-convex
/// facet is cut into few convex pieces: its constrained Delaunay triangles, joined while they stay convex
/// [HertelMehlhorn1983].
std::vector<Facet> facets(const PatchMesh& mesh);

/// Those that the mesh carries (PatchMesh::facets), which need no search, or else those found.
std::shared_ptr<const std::vector<Facet>> carried_or_found_facets(const PatchMesh& mesh);

/// The facets of a mesh, with the pieces that its patches were cut into in their place: piece i is one of patch whole_of[i]. Null where
/// a facet has lost all of them.
std::shared_ptr<const std::vector<Facet>> with_pieces(std::vector<Facet> facets,
                                                      std::span<const Index> whole_of);

}  // namespace radiosity
