// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// Means over the patches of `coarse` of values (one row per patch, a column per band) on those of `fine`, another division of the
/// same faces: exact integrals, over the parts of fine patches that lie in a coarse one, of a field that is linear on each triangle
/// of a fine patch between the means at its vertices and keeps the mean of the patch. (Patches that gave their one value to both
/// sides of a border would hide a part of the gradient, as large as what the size of patches does.) Coarse patches that no fine one
/// lies in get not-a-number. Throws InputError on another number of values.
BandArray restrict_to(const PatchMesh& coarse, const PatchMesh& fine, const BandArray& values);

}  // namespace radiosity
