// SPDX-License-Identifier: GPL-3.0-or-later
// The references that the other tests rely on, against values that were evaluated by two other routes.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cases/closed_forms.hpp"
#include "cases/scenes.hpp"
#include "support/brute_force.hpp"

namespace radiosity::test {
namespace {

TEST(ClosedForms, OpposedRectanglesGiveTheTabulatedValues) {
  EXPECT_NEAR(opposed_rectangles(1, 1, 1), 0.199824895698387, 1e-14);
  EXPECT_NEAR(opposed_rectangles(1, 1, 0.5), 0.415253283577147, 1e-14);
  EXPECT_NEAR(opposed_rectangles(1, 1, 2), 0.0685895888185524, 1e-14);
  EXPECT_NEAR(opposed_rectangles(2, 3, 1), 0.475576436532953, 1e-14);
  EXPECT_NEAR(opposed_rectangles(1, 4, 0.1), 0.885262904902343, 1e-13);
  EXPECT_NEAR(opposed_rectangles(10, 10, 1), 0.826994522397257, 1e-13);
}

TEST(ClosedForms, PerpendicularRectanglesGiveTheTabulatedValues) {
  EXPECT_NEAR(perpendicular_rectangles(1, 1, 1), 0.200043776075403, 1e-14);
  EXPECT_NEAR(perpendicular_rectangles(1, 1, 2), 0.232852602795362, 1e-14);
  EXPECT_NEAR(perpendicular_rectangles(1, 0.5, 3), 0.319608956264445, 1e-14);
  EXPECT_NEAR(perpendicular_rectangles(2, 1, 1), 0.240636006176962, 1e-14);
}

TEST(ClosedForms, TheSixFacesOfACubeAddUpToOne) {
  EXPECT_NEAR(opposed_rectangles(1, 1, 1) + 4 * perpendicular_rectangles(1, 1, 1), 1, 1e-14);
}

TEST(ClosedForms, EqualDisksAtOneRadiusGiveTheTabulatedValue) {
  EXPECT_NEAR(coaxial_disks(1, 1, 1), (3 - std::sqrt(5.0)) / 2, 1e-15);
}

TEST(ClosedForms, DisksAreReciprocal) {
  EXPECT_NEAR(coaxial_disks(1, 2, 0.7), 4 * coaxial_disks(2, 1, 0.7), 1e-14);
}

TEST(ClosedForms, AnElementUnderACornerOrTheCentreGivesTheTabulatedValues) {
  EXPECT_NEAR(element_under_corner(1, 1, 1), 0.138531605994893, 1e-14);
  EXPECT_NEAR(element_under_centre(1, 1, 1), 0.239456470460774, 1e-14);
}

TEST(ClosedForms, ACylinderClosesWithItsEnds) {
  const double r = 0.8, h = 1.7;
  // From the side, the two ends take what the ends send to it: A_end (1 − F_end,end) each.
  const double ends = 2 * (r * r) * (1 - coaxial_disks(r, r, h)) / (2 * r * h);
  EXPECT_NEAR(cylinder_side_to_itself(r, h) + ends, 1, 1e-14);
}

TEST(ClosedForms, ASphereSeesAllOfItself) {
  EXPECT_NEAR(inside_sphere(4 * std::numbers::pi * 9, 3), 1, 1e-15);
}

TEST(BruteForce, SeesARectangleFromAPointAsTheClosedFormDoes) {
  const PatchMesh mesh = opposed_squares(1);
  EXPECT_NEAR(brute_force_point_factor(mesh, {0, 0, 0}, Vec3::UnitZ(), 0, 1), element_under_corner(1, 1, 1),
              1e-14);
  EXPECT_NEAR(brute_force_point_factor(mesh, {0.5, 0.5, 0}, Vec3::UnitZ(), 0, 1),
              element_under_centre(1, 1, 1), 1e-14);
}

TEST(BruteForce, GivesTheClosedFormOfOpposedAndOfPerpendicularSquares) {
  EXPECT_NEAR(brute_force_form_factor(opposed_squares(1), 0, 1), 0.199824895698387, 1e-6);
  const PatchMesh corner = rectangles_sharing_an_edge(1, 0.5, 3, std::numbers::pi / 2);
  EXPECT_NEAR(brute_force_form_factor(corner, 0, 1), 0.319608956264445, 1e-6);
}

TEST(BruteForce, SeesNothingThroughAWall) {
  EXPECT_NEAR(brute_force_form_factor(opposed_squares_with_screen(1, 3), 0, 1), 0, 1e-12);
}

TEST(BruteForce, CutsTheShadowOfAScreenOutOfTheSquareBehindIt) {
  // From the middle of the floor the screen (side 1/2, half way up) hides the ceiling exactly.
  const PatchMesh mesh = opposed_squares_with_screen(1, 0.5);
  EXPECT_NEAR(brute_force_point_factor(mesh, {0.5, 0.5, 0}, Vec3::UnitZ(), 0, 1), 0, 1e-9);
  // From its corner the shadow is the quarter [1/2, 1]² of the ceiling or, written out, the shadow of
  // [1/4, 3/4]² doubled about the corner: [1/2, 3/2]² ∩ [0, 1]².
  const double shadow =
      element_under_corner(1, 1, 1) - 2 * element_under_corner(1, 0.5, 1) + element_under_corner(0.5, 0.5, 1);
  EXPECT_NEAR(brute_force_point_factor(mesh, {0, 0, 0}, Vec3::UnitZ(), 0, 1),
              element_under_corner(1, 1, 1) - shadow, 1e-9);
}

TEST(BruteForce, GivesTheTabulatedValueOfSquaresWithAScreenHalfTheirSize) {
  EXPECT_NEAR(brute_force_form_factor(opposed_squares_with_screen(1, 0.5), 0, 1), 0.0995062945990, 1e-6);
}

TEST(BruteForce, ClosesARoomWithABoxInIt) {
  const PatchMesh mesh = room_with_floating_box(1, 1);
  for (const Index i : {0, 4, 7}) {
    double sum = 0;
    for (Index j = 0; j < mesh.patch_count(); ++j) sum += brute_force_form_factor(mesh, i, j, 1e-3);
    EXPECT_NEAR(sum, 1, 1e-3) << "patch " << i;
  }
}

TEST(Scenes, BoxesAndSpheresFaceTheWayTheyShould) {
  const auto outward = [](const PatchMesh& mesh, const Vec3& centre) {
    double volume = 0;  // Σ A n·x / 3
    for (Index i = 0; i < mesh.patch_count(); ++i)
      volume += mesh.area(i) * mesh.normal(i).dot(mesh.centroid(i) - centre) / 3;
    return volume;
  };
  EXPECT_NEAR(outward(cube_room(2), Vec3::Constant(0.5)), -1, 1e-14);
  const MeshBuilder ball = MeshBuilder().sphere(Vec3::Zero(), 1, 3, Facing::outward);
  EXPECT_NEAR(outward(ball.build(), Vec3::Zero()), 4 * std::numbers::pi / 3, 0.04);
  EXPECT_LT(outward(tetrahedron(), Vec3::Zero()), 0);
}

}  // namespace
}  // namespace radiosity::test
