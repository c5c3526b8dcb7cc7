// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/quartering.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "cases/scenes.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "shapes.hpp"

namespace radiosity::test {
namespace {

/// Leaves of some rounds in which the leaves nearest to a place are cut.
Quartering::Leaves cut_near(Quartering& cells, const Vec3& place, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const Quartering::Leaves leaves = cells.leaves();
    const PatchMesh& mesh = leaves.refinement.mesh;
    Index nearest = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if ((mesh.centroid(i) - place).norm() < (mesh.centroid(nearest) - place).norm()) nearest = i;
    const Index cell = leaves.cell[nearest];
    cells.cut(std::span(&cell, 1));
  }
  return cells.leaves();
}

/// How often each directed edge is one of a patch.
std::map<std::pair<Index, Index>, int> directed_edges(const PatchMesh& mesh) {
  std::map<std::pair<Index, Index>, int> edges;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const auto c = mesh.corners(i);
    for (std::size_t k = 0; k < c.size(); ++k) ++edges[{c[k], c[(k + 1) % c.size()]}];
  }
  return edges;
}

/// Border edges of a mesh, in m: those that no other patch has in the other direction.
double border_length(const PatchMesh& mesh) {
  const auto edges = directed_edges(mesh);
  double length = 0;
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge.second, edge.first}))
      length += (mesh.vertex(edge.first) - mesh.vertex(edge.second)).norm();
  return length;
}

void expect_tiles(const PatchMesh& patches, const Quartering::Leaves& leaves) {
  const PatchMesh& mesh = leaves.refinement.mesh;
  const std::vector<Index>& parent = leaves.refinement.coarsening.parent;
  Eigen::ArrayXd area = Eigen::ArrayXd::Zero(patches.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    area[parent[i]] += mesh.area(i);
    EXPECT_GT(mesh.normal(i).dot(patches.normal(parent[i])), 1 - 1e-9);
    EXPECT_EQ(mesh.material(i), patches.material(parent[i]));
    EXPECT_EQ(mesh.surface(i), patches.surface(parent[i]));
    EXPECT_GE(parent[i], i > 0 ? parent[i - 1] : 0);
  }
  EXPECT_LT((area / patches.areas() - 1).abs().maxCoeff(), 1e-12);
  // A crack, or a vertex on the edge of a neighbour, would be a border that the patches do not have.
  for (const auto& [edge, count] : directed_edges(mesh)) EXPECT_EQ(count, 1);
  EXPECT_NEAR(border_length(mesh), border_length(patches), 1e-9 * border_length(patches) + 1e-12);
}

TEST(Quartering, StartsWithThePatches) {
  const PatchMesh patches = cube_room(3);
  const Quartering::Leaves leaves = Quartering(patches).leaves();
  ASSERT_EQ(leaves.refinement.mesh.patch_count(), patches.patch_count());
  for (Index i = 0; i < patches.patch_count(); ++i) {
    EXPECT_EQ(leaves.refinement.mesh.centroid(i), patches.centroid(i));
    EXPECT_EQ(leaves.cell[i], i);
  }
  expect_tiles(patches, leaves);
}

TEST(Quartering, OfAllQuadsIsAGridTwiceAsFine) {
  const PatchMesh patches = cube_room(2), fine = refine(patches, 2).mesh;
  Quartering cells(patches);
  std::vector<Index> all(patches.patch_count());
  for (Index i = 0; i < patches.patch_count(); ++i) all[i] = i;
  cells.cut(all);
  const Quartering::Leaves leaves = cells.leaves();
  const PatchMesh& mesh = leaves.refinement.mesh;
  ASSERT_EQ(mesh.patch_count(), 4 * patches.patch_count());
  EXPECT_EQ(mesh.vertex_count(), fine.vertex_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    EXPECT_EQ(mesh.corners(i).size(), 4u);
    EXPECT_EQ(cells.depth(leaves.cell[i]), 1);
  }
  expect_tiles(patches, leaves);
}

TEST(Quartering, IsConformingAndGradedWhereverItIsCut) {
  std::mt19937 random(5);
  for (const PatchMesh& patches : {cube_room(2), make_patches(random_room(2), PatchSize{0.8}).mesh,
                                   concentric_spheres(1, 2, grey("inner", 0.5, 1), grey("outer", 0.7, 0))}) {
    for (int trial = 0; trial < 4; ++trial) {
      const auto seen = static_cast<Index>(random() % static_cast<unsigned>(patches.patch_count()));
      Quartering cells(patches);
      const Quartering::Leaves leaves = cut_near(cells, patches.vertex(patches.corners(seen)[0]), 6);
      expect_tiles(patches, leaves);
      const PatchMesh& mesh = leaves.refinement.mesh;
      int deepest = 0;
      for (Index i = 0; i < mesh.patch_count(); ++i) {
        deepest = std::max(deepest, cells.depth(leaves.cell[i]));
        EXPECT_LE(mesh.corners(i).size(), 2 * patches.corners(leaves.refinement.coarsening.parent[i]).size());
      }
      EXPECT_GE(deepest, 4);
    }
  }
}

TEST(Quartering, CutsOtherPolygonsToTrianglesFirst) {
  const Vec3 up = Vec3::UnitZ();
  PatchMesh::Arrays arrays;
  for (int k = 0; k < 6; ++k)
    arrays.vertices.push_back({std::cos(k * std::numbers::pi / 3), std::sin(k * std::numbers::pi / 3), 0});
  arrays.corners = {0, 1, 2, 3, 4, 5};
  arrays.patch_start = {0, 6};
  arrays.patch_surface = {0};
  arrays.patch_material = {0};
  arrays.materials = {grey("floor", 0.5, 0)};
  const PatchMesh hexagon(std::move(arrays));
  Quartering cells(hexagon);
  const Index whole = 0;
  cells.cut(std::span(&whole, 1));
  Quartering::Leaves leaves = cells.leaves();
  EXPECT_EQ(leaves.refinement.mesh.patch_count(), 4);
  expect_tiles(hexagon, leaves);
  cells.cut(std::span(&whole, 1));  // it is no leaf any more
  EXPECT_EQ(cells.leaves().refinement.mesh.patch_count(), 4);
  leaves = cut_near(cells, Vec3::Zero(), 5);
  expect_tiles(hexagon, leaves);
  for (Index i = 0; i < leaves.refinement.mesh.patch_count(); ++i)
    EXPECT_GT(leaves.refinement.mesh.normal(i).dot(up), 1 - 1e-12);
}

}  // namespace
}  // namespace radiosity::test
