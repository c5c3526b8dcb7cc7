// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/refine.hpp"

#include <fmt/format.h>

#include <limits>
#include <unordered_map>

#include "polygon.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/facets.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

class Cutter {
 public:
  Cutter(const PatchMesh& mesh, std::span<const Index> k) : mesh_(mesh), all_k_(k) {
    arrays_.vertices = mesh.vertices();
    arrays_.materials = mesh.materials();
    arrays_.symmetry = mesh.symmetry();
  }

  Refinement run() {
    for (patch_ = 0; patch_ < mesh_.patch_count(); ++patch_) {
      const auto c = mesh_.corners(patch_);
      k_ = all_k_[patch_];
      if (c.size() == 4 && polygon::is_convex(mesh_.vertices(), c, 0))
        add_quad({c[0], c[1], c[2], c[3]});
      else
        for (const auto& triangle : mesh_.triangles(patch_)) add_triangle(triangle);
    }
    coarsening_.count = mesh_.patch_count();
    if (mesh_.facets()) arrays_.facets = with_pieces(*mesh_.facets(), coarsening_.parent);
    return {PatchMesh(std::move(arrays_)), std::move(coarsening_)};
  }

 private:
  Index add_point(const Vec3& x) {
    arrays_.vertices.push_back(x);
    return static_cast<Index>(arrays_.vertices.size()) - 1;
  }

  // The point at step/k of the way from a to b: one for both sides of the edge.
  Index on_edge(Index a, Index b, Index step) {
    if (step == k_) return b;
    const auto [found, is_new] =
        edges_.try_emplace(edge_key(a, b), Edge{static_cast<Index>(arrays_.vertices.size()), k_});
    if (found->second.pieces != k_)
      throw InputError(fmt::format("finer patches: patch {} has an edge in {} pieces that another has in {}",
                                   patch_, k_, found->second.pieces));
    if (is_new) {
      const Vec3 from = mesh_.vertex(std::min(a, b)), to = mesh_.vertex(std::max(a, b));
      for (Index s = 1; s < k_; ++s) add_point(from + static_cast<double>(s) / k_ * (to - from));
    }
    if (step == 0) return a;
    return found->second.first + (a < b ? step : k_ - step) - 1;
  }

  void add_patch(std::initializer_list<Index> corners) {
    arrays_.corners.insert(arrays_.corners.end(), corners);
    arrays_.patch_start.push_back(static_cast<Index>(arrays_.corners.size()));
    arrays_.patch_surface.push_back(mesh_.surface(patch_));
    arrays_.patch_material.push_back(mesh_.material(patch_));
    coarsening_.parent.push_back(patch_);
  }

  void add_quad(const std::array<Index, 4>& c) {
    const polygon::BilinearQuad quad(
        std::array{mesh_.vertex(c[0]), mesh_.vertex(c[1]), mesh_.vertex(c[2]), mesh_.vertex(c[3])});
    const auto inner = static_cast<Index>(arrays_.vertices.size());
    for (Index j = 1; j < k_; ++j)
      for (Index i = 1; i < k_; ++i)
        add_point(quad.at(static_cast<double>(i) / k_, static_cast<double>(j) / k_));
    const auto point = [&](Index i, Index j) {
      if (j == 0) return on_edge(c[0], c[1], i);
      if (i == k_) return on_edge(c[1], c[2], j);
      if (j == k_) return on_edge(c[3], c[2], i);
      if (i == 0) return on_edge(c[0], c[3], j);
      return inner + (j - 1) * (k_ - 1) + i - 1;
    };
    for (Index j = 0; j < k_; ++j)
      for (Index i = 0; i < k_; ++i)
        add_patch({point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
  }

  void add_triangle(const std::array<Index, 3>& c) {
    const Vec3& origin = mesh_.vertex(c[0]);
    const Vec3 u = (mesh_.vertex(c[1]) - origin) / k_, v = (mesh_.vertex(c[2]) - origin) / k_;
    const auto inner = static_cast<Index>(arrays_.vertices.size());
    for (Index j = 1; j < k_; ++j)
      for (Index i = 1; i < k_ - j; ++i) add_point(origin + (i * u + j * v));
    const auto point = [&](Index i, Index j) {
      if (j == 0) return on_edge(c[0], c[1], i);
      if (i + j == k_) return on_edge(c[1], c[2], j);
      if (i == 0) return on_edge(c[0], c[2], j);
      // Rows 1 … j − 1 have k − 1 − row inner points each.
      return inner + (j - 1) * (k_ - 1) - (j - 1) * j / 2 + i - 1;
    };
    for (Index j = 0; j < k_; ++j)
      for (Index i = 0; i + j < k_; ++i) {
        add_patch({point(i, j), point(i + 1, j), point(i, j + 1)});
        if (i + j + 1 < k_) add_patch({point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
      }
  }

  struct Edge {
    Index first;  // inner point
    Index pieces;
  };

  const PatchMesh& mesh_;
  std::span<const Index> all_k_;
  Index k_ = 1;  // of this patch
  Index patch_ = 0;
  PatchMesh::Arrays arrays_;
  Coarsening coarsening_;
  std::unordered_map<std::uint64_t, Edge> edges_;
};

}  // namespace

Refinement refine(const PatchMesh& mesh, Index k) {
  return refine(mesh, std::vector<Index>(mesh.patch_count(), k));
}

Refinement refine(const PatchMesh& mesh, std::span<const Index> k) {
  if (k.size() != at(mesh.patch_count()))
    throw InputError(
        fmt::format("finer patches: {} numbers of pieces for {} patches", k.size(), mesh.patch_count()));
  double corners = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const double pieces = k[i];
    if (pieces < 1)
      throw InputError(
          fmt::format("finer patches: {} pieces of an edge of patch {}; at least 1 is needed", pieces, i));
    corners += 4 * pieces * pieces * static_cast<double>(mesh.triangles(i).size());
  }
  if (corners > std::numeric_limits<Index>::max())
    throw InputError(fmt::format(
        "finer patches: they would have about {:.2g} corners, more than can be numbered", corners));
  return Cutter(mesh, k).run();
}

}  // namespace radiosity
