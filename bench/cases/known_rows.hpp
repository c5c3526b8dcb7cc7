// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity::test {

/// A mesh with what its true factors are summed up from.
struct KnownScene {
  std::string name;
  PatchMesh mesh;
  /// Surfaces of n × n squares: the same with every square cut in four, and the patch that each of those is a quarter of.
  std::optional<PatchMesh> finer;
  std::vector<Index> parent;
};

/// build(cut) makes surfaces of n × n squares, with `cut` times as many along an edge.
KnownScene grids(std::string_view name, const std::function<PatchMesh(Index cut)>& build);
/// [0, 1]³ from the inside, n × n patches a face.
KnownScene empty_cube(Index n);
/// The same round a box [0.25, 0.75]³, moved, of n/2 × n/2 patches a face.
KnownScene cube_with_box(std::string_view name, Index n, const Vec3& shift);

struct RowErrors {
  double l1;         ///< mean over rows of Σ_j |error of F_ij|
  double frobenius;  ///< √(Σ error² / Σ F²)
  double largest;
};

/// Rows of F for a few patches spread over a mesh.
struct KnownRows {
  std::vector<Index> rows;
  std::vector<Eigen::ArrayXd> factors;

  /// Of F as f(i, j) gives it.
  RowErrors errors(const std::function<double(Index i, Index j)>& f) const;
};

/// By the analytic method with 16 times as many points in partial shadow and, where the scene has a finer mesh, summed up from
/// patches a quarter of the size: there quadratures are taken at twice the distance. The tests hold that method against brute
/// force and closed forms.
KnownRows known_rows(const KnownScene& scene, Index row_count);

}  // namespace radiosity::test
