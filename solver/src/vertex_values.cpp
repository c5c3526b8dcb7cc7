// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

BandArray vertex_means(const PatchMesh& mesh, const BandArray& patch_values) {
  BandArray mean = BandArray::Zero(mesh.vertex_count(), patch_values.cols());
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    const auto patches = mesh.vertex_patches(v);
    for (const Index i : patches) mean.row(v) += patch_values.row(i);
    if (!patches.empty()) mean.row(v) /= static_cast<double>(patches.size());
  }
  return mean;
}

BandArray vertex_values(const PatchMesh& mesh, const BandArray& patch_values) {
  if (patch_values.rows() != mesh.patch_count()) {
    throw InputError(
        fmt::format("the mesh has {} patches, the field {} rows", mesh.patch_count(), patch_values.rows()));
  }
  using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;
  // Means first: the values of inner vertices, and what the border is extrapolated from.
  const BandArray mean = vertex_means(mesh, patch_values);
  BandArray values = mean;
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.on_border(v)) continue;
    Bands inner = Bands::Zero(patch_values.cols());
    Index count = 0;
    const auto add = [&](Index w) {
      if (mesh.on_border(w)) return;
      inner += mean.row(w);
      ++count;
    };
    for (const Index w : mesh.vertex_neighbours(v)) add(w);
    if (count == 0) {  // such as the corner of a grid of quads: its inner vertex lies across the patch
      for (const Index i : mesh.vertex_patches(v)) {
        for (const Index w : mesh.corners(i)) add(w);
      }
    }
    if (count > 0) values.row(v) = 2 * mean.row(v) - inner / static_cast<double>(count);
  }
  return values.max(0.0);
}

}  // namespace radiosity
