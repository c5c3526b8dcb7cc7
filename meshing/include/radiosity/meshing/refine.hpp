// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "radiosity/meshing/coarsen.hpp"

namespace radiosity {

/// Patches cut into smaller ones, and which those are parts of.
struct Refinement {
  PatchMesh mesh;
  Coarsening coarsening;  ///< from the smaller patches to the given ones
};

/// Every convex quad becomes k × k quads, every triangle k² triangles alike; any other polygon is cut into triangles first. Neighbours
/// share the points on their common edges, so no cracks open, and smooth surfaces stay smooth. Throws InputError on k < 1 or more
/// corners than an Index counts.
Refinement refine(const PatchMesh& mesh, Index k);

/// The same with a k of its own for each patch. Throws InputError, too, where patches that share an edge have different ones, or the
/// number of them is not that of the patches.
Refinement refine(const PatchMesh& mesh, std::span<const Index> k);

}  // namespace radiosity
