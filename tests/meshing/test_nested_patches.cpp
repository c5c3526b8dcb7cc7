// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/refine.hpp"
#include "shapes.hpp"

namespace radiosity::test {
namespace {

Coarsening coarsen_all(const PatchMesh& mesh, double factor) {
  return coarsen(mesh, facets(mesh), factor, std::vector<std::uint8_t>(mesh.patch_count(), 0));
}

std::vector<Index> members(const Coarsening& coarsening) {
  std::vector<Index> count(coarsening.count, 0);
  for (const Index p : coarsening.parent) ++count[p];
  return count;
}

TEST(Coarsen, MakesBlocksOfTheCellsOfAGrid) {
  const PatchMesh mesh = cube_room(8);
  for (const Index factor : {2, 4}) {
    const Coarsening larger = coarsen_all(mesh, factor);
    EXPECT_EQ(larger.count, 6 * (8 / factor) * (8 / factor));
    for (const Index count : members(larger)) EXPECT_EQ(count, factor * factor);
    // Blocks: no member is further from the first one than the block is long.
    std::vector<Index> first(larger.count, -1);
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      Index& f = first[larger.parent[i]];
      if (f < 0) f = i;
      EXPECT_LT((mesh.centroid(i) - mesh.centroid(f)).lpNorm<Eigen::Infinity>(), factor / 8.0);
      EXPECT_EQ(mesh.normal(i), mesh.normal(f));
    }
  }
}

TEST(Coarsen, DividesOddNumbersAsEvenlyAsTheyAllow) {
  const Coarsening larger = coarsen_all(opposed_squares(1, 5), 4);
  EXPECT_EQ(larger.count, 2 * 2 * 2);  // 2 or 3 cells along each edge
  for (const Index count : members(larger)) {
    EXPECT_GE(count, 4);
    EXPECT_LE(count, 9);
  }
}

TEST(Coarsen, JoinsAboutFourTrianglesOfAFloorOfAnyShape) {
  const PatchMesh mesh = make_patches(random_room(1), PatchSize{0.25}).mesh;
  const Coarsening twice = coarsen_all(mesh, 2), four_times = coarsen_all(mesh, 4);
  EXPECT_LT(twice.count, 0.45 * mesh.patch_count());
  EXPECT_LT(four_times.count, 0.45 * twice.count);
}

TEST(Coarsen, JoinsNeighboursOnACurvedSurfaceAndNoneThatFaceEachOther) {
  const PatchMesh mesh = concentric_spheres(2, 2, grey("inner", 0.5, 1), grey("outer", 0.7, 0));
  const Coarsening larger = coarsen_all(mesh, 2);
  EXPECT_LT(larger.count, 0.35 * mesh.patch_count());
  EXPECT_LT(coarsen_all(mesh, 4).count, 0.35 * larger.count);
  std::vector<Vec3> first(larger.count, Vec3::Zero());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    Vec3& n = first[larger.parent[i]];
    if (n.isZero()) n = mesh.normal(i);
    EXPECT_GT(n.dot(mesh.normal(i)), 0.3);
  }
}

TEST(Coarsen, KeepsMaterialsAndClassesApart) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder()
                             .grid({0, 0, 0}, x, y, 2, 2)
                             .use_material(grey("other", 0.1, 0))
                             .grid({1, 0, 0}, x, y, 2, 2)
                             .build();
  EXPECT_EQ(coarsen_all(mesh, 8).count, 2);
  std::vector<std::uint8_t> apart(8, 0);
  apart[0] = 1;
  const Coarsening larger = coarsen(mesh, facets(mesh), 8, apart);
  EXPECT_EQ(larger.count, 3);
  EXPECT_EQ(members(larger)[0], 1);
}

TEST(Coarsen, DoesNotReachThroughWallsThatStandOnAFace) {
  // One floor of 4 m × 2 m and a wall across it, a sheet or 0.1 m thick, at places of which some are inside of any grid's cells.
  for (const double thickness : {0.0, 0.1})
    for (const double x : {1.31, 1.44, 1.57, 1.73, 2.18}) {
      Shape shape;
      shape.face(rectangle(0, 0, 4, 2));
      if (thickness > 0)
        shape.box({x, 0, 0}, {x + thickness, 2, 1});
      else
        shape.face({{x, 0, 0}, {x, 0, 1}, {x, 2, 1}, {x, 2, 0}});
      const PatchMesh mesh = make_patches(shape.scene(), PatchSize{0.3}).mesh;
      std::vector<std::uint8_t> covered;
      for (Index i = 0; i < mesh.patch_count(); ++i)
        covered.push_back(mesh.centroid(i).x() > x && mesh.centroid(i).x() < x + thickness);
      for (const double factor : {2.0, 4.0}) {
        const Coarsening larger = coarsen(mesh, facets(mesh), factor, covered);
        EXPECT_LT(larger.count, 0.6 * mesh.patch_count());
        std::vector<std::set<bool>> sides(static_cast<std::size_t>(larger.count));
        for (Index i = 0; i < mesh.patch_count(); ++i)
          if (mesh.surface(i) == 0) {
            std::set<bool>& seen = sides[static_cast<std::size_t>(larger.parent[i])];
            seen.insert(mesh.centroid(i).x() > x);
            EXPECT_EQ(seen.size(), 1)
                << "wall at " << x << ", " << thickness << " m thick, factor " << factor;
          }
      }
    }
}

TEST(Coarsen, RefusesWhatDoesNotFit) {
  const PatchMesh mesh = cube_room(1);
  EXPECT_THROW(coarsen(mesh, facets(mesh), 2, {}), InputError);
  EXPECT_THROW(coarsen_all(mesh, 0.5), InputError);
  EXPECT_THROW(restrict_to(coarsen_all(mesh, 2), mesh.areas(), BandArray::Zero(5, 1)), InputError);
}

TEST(Refine, KeepsAreasAndMeansAndFitsTogetherWithoutCracks) {
  for (const PatchMesh& mesh : {make_patches(random_room(2), PatchSize{0.8}).mesh, cube_room(2)}) {
    for (const Index k : {1, 2, 3, 5}) {
      const Refinement fine = refine(mesh, k);
      EXPECT_EQ(fine.mesh.patch_count(), k * k * mesh.patch_count());
      ASSERT_EQ(static_cast<Index>(fine.coarsening.parent.size()), fine.mesh.patch_count());
      Eigen::ArrayXd area = Eigen::ArrayXd::Zero(mesh.patch_count());
      BandArray position(fine.mesh.patch_count(), 3), expected(mesh.patch_count(), 3);
      for (Index i = 0; i < fine.mesh.patch_count(); ++i) {
        const Index p = fine.coarsening.parent[i];
        area[p] += fine.mesh.area(i);
        EXPECT_EQ(fine.mesh.surface(i), mesh.surface(p));
        EXPECT_EQ(fine.mesh.material(i), mesh.material(p));
        EXPECT_GT(fine.mesh.normal(i).dot(mesh.normal(p)), 1 - 1e-12);
        position.row(i) = fine.mesh.centroid(i).transpose();
      }
      EXPECT_LT((area / mesh.areas() - 1).abs().maxCoeff(), 1e-12);
      // The mean of the centroids is the centroid.
      for (Index p = 0; p < mesh.patch_count(); ++p) expected.row(p) = mesh.centroid(p).transpose();
      EXPECT_LT((restrict_to(fine.coarsening, fine.mesh.areas(), position) - expected).abs().maxCoeff(),
                1e-12);
      // Where the given patches share vertices, the fine ones do, and nowhere else: the borders are k times as many edges.
      const auto border_vertices = [](const PatchMesh& m) {
        Index count = 0;
        for (Index v = 0; v < m.vertex_count(); ++v) count += m.on_border(v) ? 1 : 0;
        return count;
      };
      if (mesh.patch_count() == 24) {  // six sides of 2 × 2: 8 edges round each
        EXPECT_EQ(border_vertices(fine.mesh), 6 * 8 * k);
        EXPECT_EQ(fine.mesh.vertex_count(), 6 * (2 * k + 1) * (2 * k + 1));
      }
    }
  }
}

TEST(Refine, CutsPolygonsThatAreNotConvexIntoTriangles) {
  PatchMesh::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  arrays.corners = {0, 1, 2, 3, 4, 5};
  arrays.patch_start = {0, 6};
  arrays.patch_surface = {0};
  arrays.patch_material = {0};
  arrays.materials = {grey("wall", 0.5, 0)};
  const Refinement fine = refine(PatchMesh(std::move(arrays)), 3);
  EXPECT_EQ(fine.mesh.patch_count(), 4 * 9);  // four triangles cover six corners
  EXPECT_NEAR(fine.mesh.areas().sum(), 3, 1e-12);
  EXPECT_EQ(*std::max_element(fine.coarsening.parent.begin(), fine.coarsening.parent.end()), 0);
}

TEST(Refine, CutsEachSurfaceAsFinelyAsItIsAsked) {
  const PatchMesh mesh = cube_room(1);  // six surfaces
  const std::vector<Index> k{1, 2, 3, 4, 5, 6};
  const Refinement fine = refine(mesh, k);
  EXPECT_EQ(fine.mesh.patch_count(), 1 + 4 + 9 + 16 + 25 + 36);
  EXPECT_EQ(members(fine.coarsening), (std::vector<Index>{1, 4, 9, 16, 25, 36}));
  EXPECT_THROW(refine(cube_room(2), std::vector<Index>{1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
                                                       1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}),
               InputError);  // patches 0 and 1 share an edge
  EXPECT_THROW(refine(mesh, std::vector<Index>{1, 1}), InputError);
}

TEST(Refine, RefusesLessThanOnePieceAndMoreThanCanBeCounted) {
  EXPECT_THROW(refine(cube_room(1), 0), InputError);
  EXPECT_THROW(refine(cube_room(1), 1 << 14), InputError);
}

}  // namespace
}  // namespace radiosity::test
