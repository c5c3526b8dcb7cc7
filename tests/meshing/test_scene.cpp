// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <limits>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::AllOf;
using testing::HasSubstr;

template <class Act>
std::string message_of(const Act& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

Scene::Arrays unit_square() {
  Scene::Arrays arrays;
  arrays.vertices = rectangle(0, 0, 1, 1);
  arrays.materials = {grey()};
  arrays.add_face(std::vector<Index>{0, 1, 2, 3}, 0);
  return arrays;
}

std::string message_of(const Scene::Arrays& arrays) {
  return message_of([&] { Scene{arrays}; });
}

TEST(Scene, HoldsWhatItWasGiven) {
  const Scene scene(unit_square());
  EXPECT_EQ(scene.face_count(), 1);
  EXPECT_EQ(scene.vertex_count(), 4);
  EXPECT_EQ(scene.bands(), 1);
  EXPECT_EQ(scene.area_vector(0), Vec3(0, 0, 1));
  EXPECT_EQ(scene.lower(), Vec3(0, 0, 0));
  EXPECT_EQ(scene.upper(), Vec3(1, 1, 0));
}

TEST(Scene, RejectsAVertexIndexOutOfRange) {
  auto arrays = unit_square();
  arrays.corners[2] = 4;
  EXPECT_THAT(message_of(arrays),
              AllOf(HasSubstr("face 0, corner 2"), HasSubstr("vertex 4"), HasSubstr("4 vertices")));
  arrays.corners[2] = -1;
  EXPECT_THAT(message_of(arrays), HasSubstr("vertex -1"));
}

TEST(Scene, RejectsACoordinateThatIsNotFinite) {
  auto arrays = unit_square();
  arrays.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of(arrays), HasSubstr("vertex 3"));
}

TEST(Scene, RejectsAFaceWithTwoCorners) {
  auto arrays = unit_square();
  arrays.add_face(std::vector<Index>{0, 1}, 0);
  EXPECT_THAT(message_of(arrays), AllOf(HasSubstr("face 1"), HasSubstr("2 corners")));
}

TEST(Scene, RejectsAMeshWithoutFaces) {
  Scene::Arrays arrays;
  arrays.materials = {grey()};
  EXPECT_EQ(message_of(arrays), "the mesh has no faces");
}

TEST(Scene, RejectsAMaterialIndexOutOfRange) {
  auto arrays = unit_square();
  arrays.face_material[0] = 1;
  EXPECT_THAT(message_of(arrays), AllOf(HasSubstr("face 0"), HasSubstr("material 1")));
}

TEST(Scene, RejectsTwoMaterialsOfOneName) {
  auto arrays = unit_square();
  arrays.materials.push_back(grey());
  EXPECT_THAT(message_of(arrays), HasSubstr("same name 'grey'"));
}

TEST(Scene, RejectsMaterialsWithDifferentBands) {
  auto arrays = unit_square();
  arrays.materials.push_back({"rgb", BandValues::Zero(3), BandValues::Zero(3)});
  EXPECT_THAT(message_of(arrays), AllOf(HasSubstr("'rgb' has 3 bands"), HasSubstr("'grey' has 1")));
}

TEST(Scene, RejectsStartsThatDoNotFitTheCorners) {
  auto arrays = unit_square();
  arrays.face_start.back() = 3;
  EXPECT_THAT(message_of(arrays), HasSubstr("face_start"));
  for (const Index beyond : {100, std::numeric_limits<Index>::max()}) {
    auto two = unit_square();
    two.add_face(std::vector<Index>(two.corners), 0);
    two.face_start[1] = beyond;
    EXPECT_THAT(message_of(two),
                HasSubstr(fmt::format("face 0: face_start ends it at corner {}, of 8", beyond)));
  }
}

TEST(Scene, AreaOfAMaterialCountsBothSidesOfATwoSidedOne) {
  auto arrays = unit_square();
  EXPECT_EQ(Scene(arrays).material_area(0), 1);
  arrays.materials[0].sides = Sides::both;
  EXPECT_EQ(Scene(arrays).material_area(0), 2);
}

TEST(Scene, AreaVectorIsAccurateFarFromTheOrigin) {
  auto arrays = unit_square();
  for (Vec3& x : arrays.vertices) x += Vec3::Constant(1e7);
  // Differences of the coordinates, which are whole numbers, are exact.
  EXPECT_EQ(Scene(arrays).area_vector(0), Vec3(0, 0, 1));
}

TEST(Scene, TakesOtherMaterialsButOnlyAsMany) {
  const Scene scene(unit_square());
  EXPECT_EQ(scene.with_materials({grey("other")}).materials()[0].name, "other");
  EXPECT_THAT(message_of([&] { scene.with_materials({}); }), HasSubstr("0 materials"));
}

TEST(Material, RejectsReflectanceAboveOneNamingBandAndValue) {
  Material material{"wall", BandValues::Constant(3, 0.5), BandValues::Zero(3)};
  EXPECT_NO_THROW(validate(material));
  material.reflectance[1] = 1.2;
  EXPECT_THAT(message_of([&] { validate(material); }),
              AllOf(HasSubstr("'wall'"), HasSubstr("band 1"), HasSubstr("1.2"), HasSubstr("[0, 1]")));
}

TEST(Material, RejectsEmissionThatIsNegativeOrNotFinite) {
  for (const double emission : {-1.0, std::numeric_limits<double>::infinity(), std::nan("")})
    EXPECT_THAT(message_of([&] {
                  validate({"lamp", BandValues::Zero(1), BandValues::Constant(1, emission)});
                }),
                HasSubstr("material 'lamp', band 0: emission"));
}

TEST(Material, RejectsDifferentOrNoBands) {
  EXPECT_THAT(message_of([] {
                validate({"a", BandValues::Zero(1), BandValues::Zero(3)});
              }),
              HasSubstr("bands"));
  EXPECT_THAT(message_of([] {
                validate({"a", BandValues(), BandValues()});
              }),
              HasSubstr("at least one band"));
}

TEST(MergeEqualBands, KeepsOneBandOfAGreyScene) {
  auto arrays = unit_square();
  arrays.materials = {{"grey", BandValues::Constant(3, 0.5), BandValues::Constant(3, 2)}};
  const Scene merged = merge_equal_bands(Scene(arrays));
  EXPECT_EQ(merged.bands(), 1);
  EXPECT_EQ(merged.materials()[0].reflectance[0], 0.5);
  EXPECT_EQ(merged.materials()[0].emission[0], 2);
}

TEST(MergeEqualBands, KeepsAllBandsWhenOneMaterialIsColoured) {
  auto arrays = unit_square();
  arrays.materials = {{"grey", BandValues::Constant(2, 0.5), BandValues::Zero(2)},
                      {"red", (BandValues(2) << 0.5, 0.1).finished(), BandValues::Zero(2)}};
  EXPECT_EQ(merge_equal_bands(Scene(arrays)).bands(), 2);
}

}  // namespace
}  // namespace radiosity
