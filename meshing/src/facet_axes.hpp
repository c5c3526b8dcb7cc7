// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "radiosity/meshing/facet.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// Axes in the plane of a facet, along the first edge of its first patch.
struct FacetAxes {
  FacetAxes(const PatchMesh& mesh, const Facet& facet);

  Eigen::Vector2d flat(const Vec3& x) const { return {u.dot(x - origin), v.dot(x - origin)}; }

  Vec3 origin, u, v;
  Eigen::AlignedBox2d box;              ///< of all patches
  double area = 0;                      ///< of all patches, m²
  std::optional<Eigen::Vector2d> cell;  ///< size of the first patch where that is a rectangle along the axes
};

}  // namespace radiosity
