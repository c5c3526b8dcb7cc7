// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// A point of a patch and its share of the patch: Σ weight f(x) ≈ mean of f over the patch.
struct Viewpoint {
  Vec3 x;
  double weight;
};

/// At most `most` viewpoints, symmetric about the patch: on a convex planar quad the m × k Gauss–Legendre points of its bilinear
/// map, m and k such that the points are about equally dense both ways; on each triangle of another patch the points of the
/// largest rule that fits of degree 1, 2 and 5 with 1, 3 and 7 points [Radon1948], or the m² points of a conical product rule.
/// Where the triangles are more than `most`, points of an R2 sequence with equal weights.
std::vector<Viewpoint> viewpoints(const PatchMesh& mesh, Index patch, Index most);

struct ClusterViewpoint {
  Index patch;
  Vec3 x;
  double weight;
};

/// Those of a patch that is by itself; on a cluster `count` points with equal weights, spread evenly over the area of its members.
std::vector<ClusterViewpoint> cluster_viewpoints(const PatchMesh& mesh, Index cluster, Index count);

/// Planar, with four corners and a left turn at each.
bool is_convex_quad(const PatchMesh& mesh, Index patch);

}  // namespace radiosity
