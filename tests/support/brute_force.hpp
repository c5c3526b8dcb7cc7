// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/patch_mesh.hpp"

/// An independent reference for form factors: double precision, no ray tracing library, no sampling. Slow;
/// for scenes of a few hundred patches at most.
namespace radiosity::test {

/// From the surface element at x with unit normal n to patch j: Lambert's formula for what is left of j when
/// the shadows that the other patches cast from x are cut away. The shadow of a triangle is the intersection
/// of four half-spaces (the cone over its edges with apex x, and all that lies beyond its plane), so what is
/// left is a set of convex polygons, and no visibility is left to chance. Patch `from` holds x and casts no
/// shadow.
double brute_force_point_factor(const PatchMesh& mesh, const Vec3& x, const Vec3& n, Index from, Index j);

/// F_ij: the mean of the above over patch i, by Gauss–Legendre quadrature on triangles that are split in four
/// until the halves agree to `tolerance` (absolute, of F_ij).
double brute_force_form_factor(const PatchMesh& mesh, Index i, Index j, double tolerance = 1e-6);

}  // namespace radiosity::test
