// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Patches joined to larger ones, each the union of some of them: what a coarser mesh would have, but nested, so that the mean of a
/// quantity over a larger patch is an area-weighted mean over its members, exactly.
struct Coarsening {
  std::vector<Index> parent;  ///< per patch (cluster): the number of the larger one that it is part of
  Index count = 0;            ///< of larger patches
};

/// Joins patches of one material to pieces about `factor` times as long and as wide. Those of a facet are taken together cell by cell
/// of a grid in its plane, blocks of factor × factor where they are a grid themselves. Patches that are facets of their own, on
/// curved surfaces and of many small faces, and clusters, are joined with about factor² others that are near and face about the same
/// way. `apart` is a class of each cluster (PatchMesh::cluster); those of different classes are never joined. Larger patches are
/// numbered by their first member. Throws InputError on a factor below 1 or another number of classes.
Coarsening coarsen(const PatchMesh& mesh, std::span<const Facet> facets, double factor,
                   std::span<const std::uint8_t> apart);

/// Σ_i∈I A_i x_i / A_I for every larger patch I, columns are bands.
BandArray restrict_to(const Coarsening& coarsening, const Eigen::ArrayXd& areas, const BandArray& values);

}  // namespace radiosity
