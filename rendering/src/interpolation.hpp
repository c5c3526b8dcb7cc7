// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// A value of vertices (rows, a column per band) at a point of a patch: bilinear on convex quads, barycentric on triangles and on the
/// triangles of other polygons.
BandValues interpolate(const PatchMesh& mesh, const BandArray& values, Index patch, const Vec3& x);

}  // namespace radiosity
