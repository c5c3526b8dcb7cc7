// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/sides.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "radiosity/meshing/make_patches.hpp"

namespace radiosity {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr Index kWall = 0, kSheet = 1, kLamp = 2;

/// A scene of axis-parallel boxes and horizontal sheets, of a wall, a sheet and a lamp material.
class SidesTest : public testing::Test {
 protected:
  void face(std::initializer_list<Vec3> corners, Index material) {
    std::vector<Index> numbers;
    for (const Vec3& x : corners) {
      numbers.push_back(static_cast<Index>(arrays_.vertices.size()));
      arrays_.vertices.push_back(x);
    }
    arrays_.add_face(numbers, material);
  }
  /// [x0, x1] × [y0, y1] at height z.
  void sheet(double x0, double y0, double x1, double y1, double z, bool up, Index material) {
    if (up)
      face({{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}, material);
    else
      face({{x0, y0, z}, {x0, y1, z}, {x1, y1, z}, {x1, y0, z}}, material);
  }
  void box(const Vec3& a, const Vec3& b, bool inward, bool ceiling = true) {
    sheet(a.x(), a.y(), b.x(), b.y(), a.z(), inward, kWall);
    if (ceiling) sheet(a.x(), a.y(), b.x(), b.y(), b.z(), !inward, kWall);
    const std::array<std::array<double, 2>, 4> ring{
        {{a.x(), a.y()}, {b.x(), a.y()}, {b.x(), b.y()}, {a.x(), b.y()}}};
    for (std::size_t k = 0; k < 4; ++k) {
      const auto &p = ring[inward ? (k + 1) % 4 : k], &q = ring[inward ? k : (k + 1) % 4];
      face({{p[0], p[1], a.z()}, {q[0], q[1], a.z()}, {q[0], q[1], b.z()}, {p[0], p[1], b.z()}}, kWall);
    }
  }
  Scene scene(Sides wall = Sides::front, Sides sheet = Sides::front) const {
    Scene::Arrays arrays = arrays_;
    const BandValues half = BandValues::Constant(1, 0.5), none = BandValues::Zero(1);
    arrays.materials = {{"wall", half, none, wall}, {"sheet", half, none, sheet}, {"lamp", half, half}};
    return Scene(std::move(arrays));
  }
  SeenSides seen() const {
    const PatchMesh mesh = make_patches(scene(), PatchSize{0.25}).mesh;
    return seen_sides(Visibility(mesh));
  }
  std::vector<std::string> warnings() const {
    const PatchMesh mesh = make_patches(scene(), PatchSize{0.25}).mesh;
    return side_warnings(seen_sides(Visibility(mesh)), mesh);
  }

  Scene::Arrays arrays_;
};

TEST_F(SidesTest, InAClosedRoomNothingMeetsABack) {
  box({0, 0, 0}, {1, 1, 1}, true);
  EXPECT_EQ(seen().backs, 0);
  EXPECT_EQ(seen().isolated, 0);
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(SidesTest, ARoomWithItsFrontsOutwardsIsRecognisedWithTheCure) {
  box({0, 0, 0}, {1, 1, 1}, false, false);
  sheet(0, 0, 1, 1, 1, true, kLamp);
  EXPECT_TRUE(seen().look_outwards);
  EXPECT_EQ(seen().isolated, 1);
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("fronts look outwards"), HasSubstr("flip = true"))));
}

// The walls are the wrong way round, the lamp is not: to turn all over would not do.
TEST_F(SidesTest, ALampThatOnlySeesBacksIsToldWithTheirMaterials) {
  box({0, 0, 0}, {1, 1, 1}, false);
  sheet(0.4, 0.4, 0.6, 0.6, 0.9, false, kLamp);
  EXPECT_FALSE(seen().look_outwards);
  EXPECT_EQ(seen().lamp_backs, 1);
  EXPECT_THAT(warnings(),
              ElementsAre(AllOf(HasSubstr("100 % of what the lamps emit"), HasSubstr("'wall'"),
                                HasSubstr("sides = \"both\" or \"auto\""), Not(HasSubstr("flip")))));
}

// By reciprocity Σ A_i F(i → back) = A_back Σ F(back → i) = 1 m²; the fronts are six walls and the sheet's own, 7 m².
TEST_F(SidesTest, BacksAreCountedByMaterial) {
  box({0, 0, 0}, {1, 1, 1}, true);
  sheet(0, 0, 1, 1, 0.5, true, kSheet);
  const SeenSides sides = seen();
  constexpr double kShare = 1.0 / 7, kRays = 2000 * 64;
  EXPECT_NEAR(sides.backs, kShare, 4 * std::sqrt(kShare * (1 - kShare) / kRays));
  EXPECT_EQ(sides.backs_of[kSheet], sides.backs);
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("14 % of what leaves the patches ends on backs"),
                                            HasSubstr("'sheet' 14 %"), Not(HasSubstr("'wall'")))));
}

TEST_F(SidesTest, TheBackOfALampIsNoFault) {
  box({0, 0, 0}, {1, 1, 1}, true);
  sheet(0, 0, 1, 1, 0.5, true, kLamp);
  EXPECT_EQ(seen().backs, 0);
}

TEST_F(SidesTest, TheFloorUnderABoxIsNoFault) {
  box({0, 0, 0}, {1, 1, 1}, true);
  box({0.25, 0.25, 0}, {0.75, 0.75, 0.5}, false);
  EXPECT_EQ(seen().backs, 0);
}

TEST_F(SidesTest, AutomaticSidesGiveASheetABackAndLeaveClosedSolidsAlone) {
  box({0, 0, 0}, {4, 4, 3}, true);
  box({1, 1, 0.5}, {2, 2, 1}, false);
  sheet(2.5, 1, 3.5, 2, 1, true, kSheet);
  const DecidedSides decided = decide_sides(scene(Sides::automatic, Sides::automatic));
  EXPECT_EQ(decided.sheets, 1);
  EXPECT_EQ(decided.faces, 1);
  EXPECT_DOUBLE_EQ(decided.area, 1);
  EXPECT_EQ(decided.unseen_sheets, 0);
  EXPECT_EQ(decided.solids, 2);  // the room and the box
  for (Index f = 0; f < 12; ++f) EXPECT_FALSE(decided.scene.two_sided(f));
  EXPECT_TRUE(decided.scene.two_sided(12));
  EXPECT_EQ(make_patches(decided.scene, PatchSize{4}).mesh.patch_count(), 12 + 2);
}

TEST_F(SidesTest, ASheetThatNothingSeesFromBehindStaysOneSided) {
  box({0, 0, 0}, {4, 4, 3}, true, false);  // no ceiling: nothing is outside
  const DecidedSides decided = decide_sides(scene(Sides::automatic));
  EXPECT_EQ(decided.sheets, 0);
  EXPECT_EQ(decided.unseen_sheets, 1);
  EXPECT_FALSE(decided.scene.two_sided(0));
}

// Inside of the box without a bottom it is dark, although the floor under it is a front.
TEST_F(SidesTest, ABoxWithoutABottomOnTheFloorStaysOneSided) {
  box({0, 0, 0}, {4, 4, 3}, true);
  box({1, 1, 0}, {2, 2, 1}, false);
  arrays_.corners.erase(arrays_.corners.begin() + 24, arrays_.corners.begin() + 28);  // face 6, the bottom
  arrays_.face_start.pop_back();
  arrays_.face_material.pop_back();
  const DecidedSides decided = decide_sides(scene(Sides::automatic));
  EXPECT_EQ(decided.sheets, 0);
  EXPECT_EQ(decided.unseen_sheets, 1);
  EXPECT_EQ(decided.solids, 1);
}

// The lamp lights the back over it, and only that lights the back beside the lamp.
TEST_F(SidesTest, BacksThatOnlySeeSuchBacksGetTheirs) {
  sheet(0, 0, 1, 1, 0, true, kLamp);
  sheet(1.5, 0, 2.5, 1, 0, false, kSheet);
  sheet(0, 0, 2.5, 1, 1, true, kSheet);
  const DecidedSides decided = decide_sides(scene(Sides::front, Sides::automatic));
  EXPECT_EQ(decided.sheets, 2);
  EXPECT_FALSE(decided.scene.two_sided(0));
  EXPECT_TRUE(decided.scene.two_sided(1));
  EXPECT_TRUE(decided.scene.two_sided(2));
}

TEST_F(SidesTest, WithoutAutomaticMaterialsNothingIsDecided) {
  box({0, 0, 0}, {1, 1, 1}, true);
  sheet(0, 0, 1, 1, 0.5, true, kSheet);
  const DecidedSides decided = decide_sides(scene(Sides::front, Sides::both));
  EXPECT_EQ(decided.sheets + decided.unseen_sheets + decided.solids, 0);
  EXPECT_FALSE(decided.scene.two_sided(0));
  EXPECT_TRUE(decided.scene.two_sided(6));
}

}  // namespace
}  // namespace radiosity
