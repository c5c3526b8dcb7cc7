// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/patch_mesh.hpp"

#include <gmock/gmock.h>

#include <set>
#include <thread>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

/// Patches over the vertices of an N × N raster (N vertices each way, distance 1).
PatchMesh::Arrays raster(Index n) {
  PatchMesh::Arrays arrays;
  arrays.materials = {grey()};
  for (Index y = 0; y < n; ++y)
    for (Index x = 0; x < n; ++x) arrays.vertices.push_back(Vec3(x, y, 0));
  return arrays;
}

void add(PatchMesh::Arrays& arrays, std::vector<Index> corners) {
  arrays.corners.insert(arrays.corners.end(), corners.begin(), corners.end());
  arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
  arrays.patch_surface.push_back(0);
  arrays.patch_material.push_back(0);
}

TEST(PatchMesh, NeighboursOfABlockOfFour) {
  auto arrays = raster(3);
  for (const Index c : {0, 1, 3, 4}) add(arrays, {c, c + 1, c + 4, c + 3});
  const PatchMesh mesh(arrays);
  EXPECT_THAT(mesh.vertex_patches(4), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(mesh.vertex_neighbours(4), ElementsAre(1, 3, 5, 7));
  EXPECT_THAT(mesh.vertex_patches(0), ElementsAre(0));
  EXPECT_THAT(mesh.vertex_neighbours(1), ElementsAre(0, 2, 4));
  for (Index v = 0; v < 9; ++v) EXPECT_EQ(mesh.on_border(v), v != 4);
}

TEST(PatchMesh, RejectsStartsBeyondTheCorners) {
  auto arrays = raster(3);
  for (const Index c : {0, 1}) add(arrays, {c, c + 1, c + 4, c + 3});
  arrays.patch_start[1] = 100;
  try {
    const PatchMesh mesh(arrays);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "patch 0: patch_start ends it at corner 100, of 8");
  }
}

TEST(PatchMesh, ThreePatchesAtAnEdgeAreABorder) {
  PatchMesh::Arrays arrays;
  arrays.materials = {grey()};
  arrays.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
  add(arrays, {0, 2, 1});
  add(arrays, {0, 1, 3});
  add(arrays, {0, 4, 1});
  const PatchMesh mesh(arrays);
  EXPECT_THAT(mesh.vertex_patches(0), ElementsAre(0, 1, 2));
  EXPECT_THAT(mesh.vertex_neighbours(0), ElementsAre(1, 2, 3, 4));
  for (Index v = 0; v < 5; ++v) EXPECT_TRUE(mesh.on_border(v));
}

TEST(PatchMesh, TwoClosedFansAtOneVertexAreABorder) {
  // Two tetrahedra that share their tip.
  PatchMesh::Arrays arrays;
  arrays.materials = {grey()};
  arrays.vertices = {{0, 0, 0}, {1, 0, 1}, {-1, 1, 1}, {-1, -1, 1}, {1, 0, -1}, {-1, -1, -1}, {-1, 1, -1}};
  for (const Index base : {1, 4}) {
    add(arrays, {0, base + 1, base});
    add(arrays, {0, base + 2, base + 1});
    add(arrays, {0, base, base + 2});
    add(arrays, {base, base + 1, base + 2});
  }
  const PatchMesh mesh(arrays);
  EXPECT_TRUE(mesh.on_border(0));
  EXPECT_EQ(mesh.vertex_patches(0).size(), 6U);
  EXPECT_EQ(mesh.vertex_neighbours(0).size(), 6U);
  for (Index v = 1; v < 7; ++v) EXPECT_FALSE(mesh.on_border(v));
}

// Around vertex 0 the last patch closes a fan in whose gap another stands.
TEST(PatchMesh, AFanWithinTheGapOfAnotherIsABorderOfWhichNothingIsPrinted) {
  PatchMesh::Arrays arrays;
  arrays.materials = {grey()};
  arrays.vertices = {Vec3(0, 0, 1),   Vec3(1, 0, 0), Vec3(0, 1, 0),
                     Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(2, 1, 0)};
  add(arrays, {0, 1, 2});
  add(arrays, {0, 2, 3});
  add(arrays, {0, 4, 5});
  add(arrays, {0, 3, 1});
  testing::internal::CaptureStderr();
  const auto build = [&] {
    for (int k = 0; k < 20000; ++k) EXPECT_TRUE(PatchMesh(arrays).on_border(0));
  };
  std::thread other(build);
  build();
  other.join();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(PatchMesh, AKeyholePatchListsItsBridgeOnce) {
  // The 3 × 3 square with a hole [1, 2]², bridge from vertex 0 to vertex 5.
  auto arrays = raster(4);
  add(arrays, {0, 3, 15, 12, 0, 5, 9, 10, 6, 5});
  const PatchMesh mesh(arrays);
  EXPECT_DOUBLE_EQ(mesh.area(0), 8);
  EXPECT_NEAR((mesh.centroid(0) - Vec3(1.5, 1.5, 0)).norm(), 0, 1e-15);
  EXPECT_THAT(mesh.vertex_patches(0), ElementsAre(0));
  EXPECT_TRUE(mesh.on_border(0));
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles()) {
    const double area = (mesh.vertex(b) - mesh.vertex(a)).cross(mesh.vertex(c) - mesh.vertex(a)).z() / 2;
    EXPECT_GT(area, 0);
    sum += area;
    const Vec3 middle = (mesh.vertex(a) + mesh.vertex(b) + mesh.vertex(c)) / 3;
    EXPECT_FALSE((middle - Vec3(1.5, 1.5, 0)).cwiseAbs().maxCoeff() < 0.5) << "a triangle covers the hole";
  }
  EXPECT_NEAR(sum, 8, 1e-14);
}

TEST(PatchMesh, CentroidAreaAndNormalFarFromTheOrigin) {
  // An L of three unit squares: centroid (5/6, 5/6), area 3.
  const Vec3 far(1e7, -1e7, 1e7);
  PatchMesh::Arrays arrays;
  arrays.materials = {grey()};
  for (const Vec3& x : std::vector<Vec3>{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}})
    arrays.vertices.push_back(x + far);
  add(arrays, {0, 1, 2, 3, 4, 5});
  const PatchMesh mesh(arrays);
  EXPECT_DOUBLE_EQ(mesh.area(0), 3);
  EXPECT_EQ(mesh.normal(0), Vec3(0, 0, 1));
  EXPECT_LT((mesh.centroid(0) - far - Vec3(5. / 6, 5. / 6, 0)).norm(), 4e-9);  // 1e7 · 2^-52 a coordinate
  EXPECT_EQ(mesh.triangles().size(), 4U);
}

TEST(PatchMesh, TrianglesOfConvexPolygonsWithStraightCornersHaveAnArea) {
  auto arrays = raster(3);
  add(arrays, {0, 1, 2, 5, 8, 7, 6, 3});
  add(arrays, {0, 1, 2, 8});
  add(arrays, {1, 2, 8, 0});
  const PatchMesh mesh(arrays);
  for (Index p = 0; p < 3; ++p) {
    double sum = 0;
    EXPECT_EQ(mesh.triangles(p).size(), mesh.corners(p).size() - 2);
    for (const auto& [a, b, c] : mesh.triangles(p)) {
      const double area = (mesh.vertex(b) - mesh.vertex(a)).cross(mesh.vertex(c) - mesh.vertex(a)).z() / 2;
      EXPECT_GT(area, 0.1);
      sum += area;
    }
    EXPECT_DOUBLE_EQ(sum, mesh.area(p));
  }
}

TEST(PatchMesh, TrianglesKnowTheirPatch) {
  auto arrays = raster(3);
  add(arrays, {0, 1, 4, 3});
  add(arrays, {1, 2, 4});
  const PatchMesh mesh(arrays);
  ASSERT_EQ(mesh.triangles().size(), 3U);
  EXPECT_EQ(mesh.triangle_patch(0), 0);
  EXPECT_EQ(mesh.triangle_patch(1), 0);
  EXPECT_EQ(mesh.triangle_patch(2), 1);
  EXPECT_EQ(mesh.triangles(1)[0], (std::array<Index, 3>{1, 2, 4}));
}

TEST(PatchMesh, GivesReflectanceAndEmissionPerPatch) {
  auto arrays = raster(3);
  arrays.materials = {{"a", BandValues::Constant(2, 0.25), BandValues::Zero(2)},
                      {"b", BandValues::Constant(2, 0.75), (BandValues(2) << 1, 2).finished()}};
  add(arrays, {0, 1, 4, 3});
  add(arrays, {1, 2, 5, 4});
  arrays.patch_material[0] = 1;
  const PatchMesh mesh(arrays);
  EXPECT_EQ(mesh.bands(), 2);
  EXPECT_EQ(mesh.reflectance()(0, 1), 0.75);
  EXPECT_EQ(mesh.reflectance()(1, 1), 0.25);
  EXPECT_EQ(mesh.emission()(0, 1), 2);
  EXPECT_EQ(mesh.emission()(1, 0), 0);
}

TEST(PatchMesh, RejectsWhatIsNotAPatch) {
  const auto with = [](std::vector<Index> corners) {
    auto arrays = raster(3);
    add(arrays, std::move(corners));
    return arrays;
  };
  EXPECT_THROW(PatchMesh{with({0, 1})}, InputError);
  EXPECT_THROW(PatchMesh{with({0, 1, 2})}, InputError);
  EXPECT_THROW(PatchMesh{with({0, 1, 9})}, InputError);
  auto arrays = with({0, 1, 4});
  EXPECT_NO_THROW(PatchMesh{arrays});
  arrays.patch_material[0] = 1;
  EXPECT_THROW(PatchMesh{arrays}, InputError);
  arrays.patch_material[0] = 0;
  arrays.vertices[8].x() = std::nan("");
  EXPECT_THROW(PatchMesh{arrays}, InputError);
}

}  // namespace
}  // namespace radiosity
