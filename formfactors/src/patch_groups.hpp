// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Neighbouring patches of one facet, so few that one question about all of them pays: is the group behind a patch, hidden from
/// it, in free view?
struct PatchGroup {
  std::vector<Index> patches;  ///< ascending
  std::vector<Vec3>
      corners;    ///< of a convex polygon that holds them, relative to the origin; counter-clockwise
  Vec3 normal;    ///< unit, front
  double offset;  ///< normal·x on the plane
  std::size_t facet;
};

/// Facets halved across their longer side until no part has more than 32 patches.
std::vector<PatchGroup> patch_groups(const PatchMesh& mesh, const std::vector<Facet>& facets,
                                     const Vec3& origin);

}  // namespace radiosity
