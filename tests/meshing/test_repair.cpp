// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

Shape unit_cube() {
  return Shape().box({0, 0, 0}, {1, 1, 1});
}

TEST(Repair, MergesVerticesAtTheSamePosition) {
  // Six faces with four vertices each; a cube has eight.
  const Patches patches = make_patches(unit_cube().scene(), KeepFaces{});
  EXPECT_EQ(patches.repairs.merged_vertices, 24 - 8);
}

TEST(Repair, TakesZeroAndMinusZeroForTheSame) {
  const Shape shape =
      Shape().face({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).face({{0, 0, -0.0}, {0, 1, 0}, {-1, 0, -0.0}});
  EXPECT_EQ(make_patches(shape.scene(), KeepFaces{}).repairs.merged_vertices, 2);
}

TEST(Repair, DropsFacesWithoutAnAreaAndNamesThem) {
  const Shape shape = Shape()
                          .face(rectangle(0, 0, 1, 1))
                          .face({{2, 0, 0}, {3, 0, 0}, {2, 0, 0}})      // two different corners
                          .face({{2, 0, 0}, {3, 0.1, 0}, {4, 0.2, 0}})  // collinear but for rounding
                          .face(rectangle(5, 0, 6, 1));
  for (const PatchOptions& options : {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{1})}) {
    const Patches patches = make_patches(shape.scene(), options);
    EXPECT_EQ(patches.repairs.degenerate_faces, 2);
    ASSERT_EQ(patches.mesh.patch_count(), 2);
    EXPECT_EQ(patches.mesh.surface(1), 3);
    EXPECT_THAT(patches.warnings, Contains(HasSubstr("faces 1 and 2 were dropped")));
  }
}

TEST(Repair, KeepsSlivers) {
  const Shape shape = Shape().face({{0, 0, 0}, {1, 0, 0}, {1, 1e-6, 0}});
  const Patches patches = make_patches(shape.scene(), PatchSize{0.1});
  EXPECT_EQ(patches.repairs.degenerate_faces, 0);
  EXPECT_NEAR(total_area(patches.mesh), 0.5e-6, 1e-15);
  EXPECT_LE(longest_edge(patches.mesh), 0.1 * (1 + 1e-8));
}

TEST(Repair, RepeatedCornersMakeAQuadATriangle) {
  const Shape shape = Shape().face({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  EXPECT_EQ(patches.mesh.corners(0).size(), 3U);
}

TEST(Repair, DropsADuplicateWhereverItStarts) {
  const Shape shape = Shape().face(rectangle(0, 0, 1, 1)).face({{1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}});
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  EXPECT_EQ(patches.repairs.duplicate_faces, 1);
  EXPECT_EQ(patches.mesh.patch_count(), 1);
  EXPECT_THAT(patches.warnings, Contains(HasSubstr("face 1 was dropped")));
}

TEST(Repair, ALoopThatGoesRoundSeveralTimesIsOneFace) {
  Shape shape = Shape().face(rectangle(0, 0, 2, 1));
  const std::vector<Vec3> once = shape.faces[0];
  for (const int rounds : {2, 3}) {
    shape.faces[0].insert(shape.faces[0].end(), once.begin(), once.end());
    for (const PatchOptions& options : {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{3})}) {
      const Patches patches = make_patches(shape.scene(), options);
      EXPECT_EQ(patches.repairs.unwound_faces, 1);
      ASSERT_EQ(patches.mesh.patch_count(), 1) << rounds;
      EXPECT_DOUBLE_EQ(patches.mesh.area(0), 2);
      EXPECT_THAT(patches.warnings, Contains(HasSubstr("face 0 was cut down to one round")));
    }
  }
}

TEST(Repair, DropsFacesWithinAnotherOfTheirMaterialThatFacesTheSameWay) {
  const Shape quad = Shape().face(rectangle(0, 0, 1, 1));
  const Shape halves =
      Shape().face({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}).face({{0, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const Shape part = Shape().face(rectangle(0.2, 0, 0.7, 0.5));
  for (const auto& [shape, dropped] : {std::pair{Shape(quad).append(halves), 2},
                                       {Shape(halves).append(quad), 2},
                                       {Shape(quad).append(part), 1},
                                       {Shape(part).append(quad).append(quad), 2}}) {
    for (const PatchOptions& options : {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{0.1})}) {
      const Patches patches = make_patches(shape.scene(), options);
      EXPECT_EQ(patches.repairs.duplicate_faces, dropped);
      EXPECT_EQ(patches.repairs.flipped_faces, 0);
      EXPECT_NEAR(total_area(patches.mesh), 1, 1e-12);
      EXPECT_THAT(patches.warnings, Not(Contains(HasSubstr("coincide"))));
      for (Index p = 0; p < patches.mesh.patch_count(); ++p) EXPECT_GT(patches.mesh.normal(p).z(), 0.9);
    }
  }
  // Neither what faces the other way nor what overlaps.
  EXPECT_EQ(make_patches(Shape(quad).append(part.reversed()).scene()).repairs.duplicate_faces, 0);
  EXPECT_EQ(make_patches(Shape(quad).face(rectangle(0.5, 0.5, 1.5, 0.7)).scene()).repairs.duplicate_faces, 0);
}

TEST(Repair, NamesTheMaterialsOfDuplicates) {
  const Shape shape = Shape().face(rectangle(0, 0, 1, 1), 1).face(rectangle(0, 0, 1, 1), 0);
  EXPECT_THAT(make_patches(shape.scene({grey("brick"), grey("plaster")})).warnings,
              Contains(HasSubstr("whose material stays (instead of another: 1 of 'plaster' over 'brick')")));
}

TEST(Repair, ATwoSidedFaceIsTheSameEitherWayRound) {
  const Shape sheet = Shape().face(rectangle(0, 0, 1, 1));
  const Patches patches =
      make_patches(Shape(sheet).append(sheet.reversed()).scene({grey("sheet", Sides::both)}), KeepFaces{});
  EXPECT_EQ(patches.repairs.duplicate_faces, 1);
  EXPECT_EQ(patches.mesh.patch_count(), 2);
}

TEST(Repair, KeepsBothSidesOfASheet) {
  const Shape sheet = Shape().face(rectangle(0, 0, 1, 1));
  const Patches patches = make_patches(Shape(sheet).append(sheet.reversed()).scene(), PatchSize{0.5});
  EXPECT_EQ(patches.repairs.duplicate_faces, 0);
  EXPECT_EQ(patches.repairs.flipped_faces, 0);
  EXPECT_EQ(patches.repairs.cut_faces, 0);
  EXPECT_EQ(patches.mesh.patch_count(), 8);
  EXPECT_TRUE(patches.mesh.normal(0).isApprox(-patches.mesh.normal(4)));
  EXPECT_THAT(patches.warnings, Not(Contains(HasSubstr("coincide"))));
}

TEST(Repair, TurnsTheSmallerAreaOver) {
  // The top is 10 m², larger than all else together; the other five faces of this flat box point inward.
  Shape shape = Shape().box({0, 0, 0}, {5, 2, 0.01}, true);
  shape.faces.pop_back();
  shape.faces.erase(shape.faces.begin() + 4);  // the bottom, too: 10 m² against the four sides of 0.14 m²
  shape.face(rectangle(0, 0, 5, 2, 0.01));
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  EXPECT_EQ(patches.repairs.flipped_faces, 4);
  EXPECT_EQ(patches.mesh.normal(4), Vec3(0, 0, 1));
  EXPECT_EQ(patches.mesh.normal(0), Vec3(-1, 0, 0));
  EXPECT_THAT(patches.warnings, Contains(HasSubstr("faces 0, 1, 2 and 3 were turned over")));
}

TEST(Repair, TurnsOneFaceOfACube) {
  for (std::size_t turned = 0; turned < 6; ++turned) {
    Shape shape = unit_cube();
    std::reverse(shape.faces[turned].begin(), shape.faces[turned].end());
    const Patches patches = make_patches(shape.scene(), PatchSize{1});
    EXPECT_EQ(patches.repairs.flipped_faces, 1);
    for (Index p = 0; p < 6; ++p)
      EXPECT_GT(patches.mesh.normal(p).dot(patches.mesh.centroid(p) - Vec3(0.5, 0.5, 0.5)), 0);
    EXPECT_THAT(patches.warnings, Contains(HasSubstr("face " + std::to_string(turned) + " was turned over")));
  }
}

// The lid of a unit cube in three strips, the middle one turned over and in two halves: of the strips' edges only those at the ends
// are edges of the cube.
TEST(Repair, TurnsFacesThatMeetTheirNeighboursAtTJunctions) {
  Shape shape = Shape().box({0, 0, 0}, {1, 1, 1});
  shape.faces.pop_back();
  shape.materials.pop_back();
  shape.face(rectangle(0, 0, 0.25, 1, 1)).face(rectangle(0.75, 0, 1, 1, 1));
  Shape middle = Shape().face(rectangle(0.25, 0, 0.75, 0.5, 1)).face(rectangle(0.25, 0.5, 0.75, 1, 1));
  shape.append(middle.reversed());
  for (const double off : {0.0, 1e-7, 1e-4}) {  // of the edges that they meet
    const Shape meant =
        shape.mapped([&](const Vec3& x) { return x.x() > 0.3 && x.x() < 0.9 ? x + off * Vec3::UnitX() : x; });
    const Patches patches = make_patches(meant.scene(), KeepFaces{});
    EXPECT_EQ(patches.repairs.flipped_faces, 2);
    for (Index i = 5; i < 9; ++i) EXPECT_GT(patches.mesh.normal(i).z(), 0) << i;
  }
}

TEST(Repair, LeavesAnOrnamentBesideTheEdgeOfAWallAsItIs) {
  // It shares no corner with the wall: millimetres are a T-junction where the whole edge is met.
  const Shape ornament = Shape().face({{1, 0, 1e-4}, {1, 1, 1e-4}, {2, 1, 1e-4}, {2, 0, 1e-4}});
  for (const Shape& way : {ornament, ornament.reversed()}) {
    Shape shape = Shape().face({{0, 0, 0}, {4, 0, 0}, {4, 0, 2}, {0, 0, 2}});
    shape.append(way);
    EXPECT_EQ(make_patches(shape.scene(), KeepFaces{}).repairs.flipped_faces, 0);
  }
}

TEST(Repair, NeverTurnsAWholeRoomInsideOut) {
  const Patches patches = make_patches(Shape().box({0, 0, 0}, {1, 1, 1}, true).scene(), KeepFaces{});
  EXPECT_EQ(patches.repairs.flipped_faces, 0);
  EXPECT_EQ(patches.mesh.normal(0), Vec3(1, 0, 0));
}

TEST(Repair, OrientsAcrossDifferentMaterials) {
  const Shape shape =
      Shape().face(rectangle(0, 0, 2, 1), 0).face({{2, 0, 0}, {2, 1, 0}, {3, 1, 0}, {3, 0, 0}}, 1);
  const Patches patches = make_patches(shape.scene({grey("a"), grey("b")}), KeepFaces{});
  EXPECT_EQ(patches.repairs.flipped_faces, 1);
  EXPECT_EQ(patches.mesh.normal(1), Vec3(0, 0, 1));
}

TEST(Repair, LeavesAMobiusStripAsItIs) {
  // A rung across the middle line of radius 2 turns by π on its way round.
  constexpr int kQuads = 12;
  const auto rung = [](int k, double side) {
    const double angle = 2 * std::numbers::pi * k / kQuads;
    const double radius = 2 + side * std::cos(angle / 2);
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), side * std::sin(angle / 2));
  };
  Shape shape;
  for (int k = 0; k + 1 < kQuads; ++k) shape.face({rung(k, -1), rung(k, 1), rung(k + 1, 1), rung(k + 1, -1)});
  shape.face({rung(kQuads - 1, -1), rung(kQuads - 1, 1), rung(0, -1), rung(0, 1)});
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  EXPECT_EQ(patches.repairs.flipped_faces, 0);
  EXPECT_THAT(patches.warnings, Contains(HasSubstr("cannot be given a front")));
}

TEST(Repair, ThrowsWhenNothingIsLeft) {
  const Shape shape = Shape().face({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}});
  EXPECT_THROW(make_patches(shape.scene()), InputError);
}

TEST(Repair, CountsTheEdgesOfAnOpenSurface) {
  EXPECT_THAT(make_patches(unit_cube().scene(), KeepFaces{}).warnings, testing::IsEmpty());
  Shape shape = unit_cube();
  shape.faces.pop_back();
  EXPECT_THAT(make_patches(shape.scene(), KeepFaces{}).warnings,
              testing::ElementsAre(HasSubstr("the surface is open: 4 edges belong to one face only")));
}

}  // namespace
}  // namespace radiosity
