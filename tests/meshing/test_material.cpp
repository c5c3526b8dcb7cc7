// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/material.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/scene.hpp"

namespace radiosity::test {
namespace {

using testing::HasSubstr;

Material glossy() {
  return {.name = "glossy",
          .reflectance = Eigen::Array2d(0.5, 0.7),
          .emission = Eigen::Array2d(0, 0),
          .specular = Eigen::Array2d(0.3, 0.2),
          .transmission = Eigen::Array2d(0.2, 0.1)};
}

std::string error(const Material& material) {
  try {
    validate(material);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Material, GivesBackAtMostWhatArrives) {
  EXPECT_EQ(error(glossy()), "");  // both sums are 1 as decimals, 0.7 + 0.2 + 0.1 is not as doubles
  Material material = glossy();
  material.specular[1] = 0.3;
  EXPECT_THAT(
      error(material),
      HasSubstr("material 'glossy', band 1: reflectance 0.7 + specular 0.3 + transmission 0.1 is 1.1"));
  material = glossy();
  material.transmission[0] = -0.1;
  EXPECT_THAT(error(material), HasSubstr("band 0: transmission -0.1 is outside [0, 1]"));
  material.transmission[0] = std::nan("");
  EXPECT_THAT(error(material), HasSubstr("is outside [0, 1]"));
  material = glossy();
  material.specular = Eigen::Array3d(0, 0, 0);
  EXPECT_THAT(error(material), HasSubstr("specular has 3 bands but reflectance has 2"));
  material = glossy();
  material.shininess = -1;
  EXPECT_THAT(error(material), HasSubstr("shininess -1 is not at least 0"));
  for (const double index : {0.0, -1.5, std::numeric_limits<double>::infinity()}) {
    material = glossy();
    material.refractive_index = index;
    EXPECT_THAT(error(material), HasSubstr("is not positive and finite"));
  }
}

TEST(Material, HasOneIndexOrOneForEachBand) {
  Material material = glossy();
  material.refractive_indices = Eigen::Array2d(1.5, 1.6);
  EXPECT_EQ(error(material), "");
  material.refractive_indices[1] = 0;
  EXPECT_THAT(error(material), HasSubstr("material 'glossy', band 1: refractive index 0 is not positive"));
  material.refractive_indices = Eigen::Array3d(1.5, 1.5, 1.5);
  EXPECT_THAT(error(material), HasSubstr("3 refractive indices, but reflectance has 2 bands"));
}

TEST(Material, WithoutMirrorsAndGlassHasZerosOfThem) {
  Material material = glossy();
  material.specular = material.transmission = {};
  EXPECT_TRUE((specular(material) == Eigen::Array2d(0, 0)).all());
  EXPECT_TRUE((transmission(material) == Eigen::Array2d(0, 0)).all());
}

TEST(Material, MirrorsFollowTheBandsOfSetUps) {
  Scene::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  arrays.add_face(std::array<Index, 3>{0, 1, 2}, 0);
  arrays.materials = {glossy()};
  const Scene scene(std::move(arrays));
  const std::vector<LightingSetup> setups{{"dark", {0.0}}};
  const Scene both = with_setups(scene, setups);
  EXPECT_TRUE((both.materials()[0].specular == Eigen::Array4d(0.3, 0.2, 0.3, 0.2)).all());
  EXPECT_TRUE(
      (select_bands(both.materials(), 3, 1)[0].transmission == Eigen::Array<double, 1, 1>(0.1)).all());
}

}  // namespace
}  // namespace radiosity::test
