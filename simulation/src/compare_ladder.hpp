// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "compare_mesh.hpp"

namespace radiosity {

/// The meshes compared, from coarse to fine.
struct MeshSeries {
  std::vector<PreparedMesh> meshes;
  std::size_t own = 0;                         ///< the user's
  std::optional<std::size_t> twice_as_coarse;  ///< that with patches of twice the user's size

  const PreparedMesh& user() const { return meshes[own]; }
};
/// Adds the meshes of four times and twice the user's patch size, but none that has more than 0.7 times the user's patches.
void add_coarser(MeshSeries& series, const Scene& scene);
/// Adds the mesh of half the user's patch size.
void add_finer(MeshSeries& series, const Scene& scene);

/// Every method at every setting of its ladder, on the user's mesh or on all of them, with nothing measured yet; a method that is exact
/// on a mesh only at its default.
std::vector<ComparedRun> planned_runs(const MeshSeries& series, bool on_all_meshes, std::uint64_t seed);

}  // namespace radiosity
