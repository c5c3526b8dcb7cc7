// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/facets.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "shapes.hpp"

namespace radiosity::test {
namespace {

double area(const Facet::Piece& piece) {
  double sum = 0;
  const auto& c = piece.corners;
  for (std::size_t k = 1; k + 1 < c.size(); ++k)
    sum += piece.normal.dot((c[k] - c[0]).cross(c[k + 1] - c[0])) / 2;
  return sum;
}

std::size_t pieces(const std::vector<Facet>& all) {
  std::size_t count = 0;
  for (const Facet& facet : all) count += facet.pieces.size();
  return count;
}

/// Every patch once, pieces convex, areas of pieces and patches equal.
void expect_cover(const PatchMesh& mesh, const std::vector<Facet>& all) {
  std::vector<int> seen(mesh.patch_count(), 0);
  for (const Facet& facet : all) {
    double patches = 0, covered = 0;
    for (const Index i : facet.patches) {
      ++seen[i];
      patches += mesh.area(i);
    }
    for (const Facet::Piece& piece : facet.pieces) {
      covered += area(piece);
      const auto& c = piece.corners;
      for (std::size_t k = 0; k < c.size(); ++k) {
        const Vec3 e = c[(k + 1) % c.size()] - c[k], f = c[(k + 2) % c.size()] - c[(k + 1) % c.size()];
        EXPECT_GT(piece.normal.dot(e.cross(f)), -1e-7 * e.norm() * f.norm());
      }
    }
    EXPECT_NEAR(covered, patches, 1e-7 * patches);
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), mesh.patch_count());
}

Scene one_face(std::vector<Vec3> corners, Sides sides = Sides::front) {
  return Shape().face(std::move(corners)).scene({radiosity::grey("wall", sides)});
}

TEST(Facets, OfACubeAreItsSixSidesHoweverFinelyCut) {
  for (const Index n : {1, 2, 7}) {
    const PatchMesh mesh = cube_room(n);
    const auto all = facets(mesh);
    expect_cover(mesh, all);
    ASSERT_EQ(all.size(), 6u);
    for (const Facet& facet : all) {
      ASSERT_EQ(facet.pieces.size(), 1u);
      EXPECT_EQ(facet.pieces[0].corners.size(), 4u);
    }
  }
}

TEST(Facets, OfACurvedSurfaceAreItsPatches) {
  const PatchMesh mesh = MeshBuilder().sphere(Vec3::Zero(), 1, 2, Facing::inward).build();
  const auto all = facets(mesh);
  expect_cover(mesh, all);
  EXPECT_EQ(static_cast<Index>(all.size()), mesh.patch_count());
}

TEST(Facets, JoinPatchesOfDifferentFacesInOnePlane) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder().grid({0, 0, 0}, x, y, 2, 2).grid({1, 0, 0}, x, y, 2, 2).build();
  const auto all = facets(mesh);
  expect_cover(mesh, all);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].pieces.size(), 1u);
}

TEST(Facets, KeepTheTwoSidesOfAWallApart) {
  const Scene scene = one_face({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, Sides::both);
  const PatchMesh mesh = make_patches(scene, PatchSize{0.25}).mesh;
  const auto all = facets(mesh);
  expect_cover(mesh, all);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_LT(all[0].pieces[0].normal.dot(all[1].pieces[0].normal), -0.999);
}

TEST(Facets, CutAnLIntoFewConvexPieces) {
  const Scene scene = one_face({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}});
  for (const double size : {10.0, 0.3, 0.07}) {
    const PatchMesh mesh = make_patches(scene, PatchSize{size}).mesh;
    const auto all = facets(mesh);
    expect_cover(mesh, all);
    EXPECT_EQ(all.size(), 1u);
    EXPECT_LE(pieces(all), 3u);
  }
  const PatchMesh whole = make_patches(scene, KeepFaces{}).mesh;
  expect_cover(whole, facets(whole));
  EXPECT_LE(pieces(facets(whole)), 3u);
}

TEST(Facets, CutAWallRoundItsWindow) {
  const Scene scene = one_face(wall_round_a_window());
  for (const double size : {10.0, 0.2}) {
    const PatchMesh mesh = make_patches(scene, PatchSize{size}).mesh;
    const auto all = facets(mesh);
    expect_cover(mesh, all);
    EXPECT_EQ(all.size(), 1u);
    EXPECT_LE(pieces(all), 6u);
  }
}

TEST(Facets, AreTheSameFarFromTheOriginAndTurned) {
  const PatchMesh mesh = make_patches(box_on_floor(), PatchSize{0.09}).mesh;
  const auto all = facets(mesh);
  expect_cover(mesh, all);
  EXPECT_EQ(all.size(), 12u);
  EXPECT_EQ(pieces(all), 12u);
  const Eigen::Affine3d turned(Eigen::AngleAxisd(1.1, Vec3(3, -1, 2).normalized()));
  for (const Eigen::Affine3d& transform :
       {turned, Eigen::Affine3d(Eigen::Translation3d(1e6, -3e6, 2e6) * turned),
        Eigen::Affine3d(Eigen::Scaling(1e-6)), Eigen::Affine3d(Eigen::Scaling(1e6))}) {
    const PatchMesh other = transformed(mesh, transform);
    const auto same = facets(other);
    expect_cover(other, same);
    EXPECT_EQ(pieces(same), 12u);
  }
}

TEST(Facets, AreNotFooledByPointsThatDifferByRounding) {
  // A door 2.1 high: the panel beside it is cut in tenths of 3, and 7 · 0.3 is not 2.1.
  const PatchMesh mesh = MeshBuilder()
                             .grid({0, 0, 0}, Vec3::UnitX(), 3 * Vec3::UnitY(), 1, 10)
                             .grid({1, 2.1, 0}, Vec3::UnitX(), 0.9 * Vec3::UnitY(), 1, 3)
                             .grid({2, 0, 0}, Vec3::UnitX(), 3 * Vec3::UnitY(), 1, 10)
                             .build();
  const auto all = facets(mesh);
  expect_cover(mesh, all);
  EXPECT_GE(pieces(all), 3u);
}

TEST(Facets, LeavePatchesThatOverlapAsTheyAre) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, 0}, 2 * x, y, 2, 1).build();
  expect_cover(mesh, facets(mesh));
}

// Those of the whole polygons are those that a search among the patches finds.
TEST(Facets, AreHandedOnByThoseWhoCut) {
  const auto two_sided = one_face(wall_round_a_window(), Sides::both);
  for (const Scene& scene :
       {box_on_floor(), two_furnished_rooms(), office_floor(), random_room(1), random_room(7), two_sided}) {
    for (const double size : {5.0, 0.4}) {
      const PatchMesh mesh = make_patches(scene, PatchSize{size}).mesh;
      ASSERT_TRUE(mesh.facets());
      expect_cover(mesh, *mesh.facets());
      const auto found = facets(mesh);
      ASSERT_EQ(mesh.facets()->size(), found.size());
      for (std::size_t f = 0; f < found.size(); ++f) {
        EXPECT_EQ((*mesh.facets())[f].patches, found[f].patches);
        EXPECT_EQ((*mesh.facets())[f].back, found[f].back);
      }
      EXPECT_LE(pieces(*mesh.facets()), pieces(found));
    }
  }
}

TEST(Facets, OfAMeshHaveEachPatchOnce) {
  PatchMesh::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  arrays.corners = {0, 1, 2, 2, 1, 3};
  arrays.patch_start = {0, 3, 6};
  arrays.patch_surface = {0, 0};
  arrays.patch_material = {0, 0};
  arrays.materials = {radiosity::grey("wall", Sides::front)};
  for (const std::vector<Index>& patches : {std::vector<Index>{0}, {0, 1, 1}, {0, 2}}) {
    arrays.facets = std::make_shared<const std::vector<Facet>>(std::vector<Facet>{{patches, {}}});
    EXPECT_THROW(PatchMesh{arrays}, InputError);
  }
}

}  // namespace
}  // namespace radiosity::test
