// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/scene_bytes.hpp"

#include "files.hpp"
#include "radiosity/io/checkpoints.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

LoadedScene scene_with_all() {
  Scene::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.25}, {0, 1, 1.0 / 3}};
  Material lamp{"lamp", BandValues::Constant(2, 0.5), BandValues::LinSpaced(2, 1, 2), Sides::both};
  Material mirror{"mirror", BandValues::Constant(2, 0.25), BandValues::Zero(2)};
  mirror.absorptance = BandValues::Constant(2, 0.75);
  mirror.specular = BandValues::Constant(2, 0.125);
  mirror.shininess = 12;
  arrays.materials = {lamp, mirror};
  const std::vector<Index> front{0, 1, 2}, back{0, 2, 3};
  arrays.add_face(front, 0);
  arrays.add_face(back, 1);
  SceneSettings settings;
  settings.patches = PatchSize{0.1};
  settings.elements = AutoElements{};
  settings.method = "hemisphere";
  settings.seed = 0xFFFFFFFFFFFFFFFFU;
  settings.tolerance = 1e-7;
  settings.ambient = true;
  arrays.symmetry = {.planes = {{0, 0}, {1, 1}}, .period = {0, 0, 0.5}, .steps = 3};
  return {Scene(std::move(arrays)), settings, {{"off", {0, 1}}}, {}, {}};
}

TEST(SceneBytes, HoldAllThatASolveDependsOn) {
  const LoadedScene given = scene_with_all();
  const LoadedScene taken = scene_of_bytes(scene_bytes(given));
  EXPECT_EQ(digest(taken, taken.settings, true), digest(given, given.settings, true));
  EXPECT_TRUE((taken.scene.materials()[1].specular == given.scene.materials()[1].specular).all());
  EXPECT_EQ(taken.scene.materials()[1].shininess, 12);
  EXPECT_EQ(taken.setups[0].name, "off");
  EXPECT_EQ(text_of(taken.scene.symmetry()),
            "mirrored in x = 0, y = 1; period 0 0 0.5 m, 3 steps either way: 27 images");
}

TEST(SceneBytes, AreRefusedWhereTheyAreCutShort) {
  const std::string bytes = scene_bytes(scene_with_all());
  EXPECT_THROW(scene_of_bytes(bytes.substr(0, bytes.size() - 1)), InputError);
  EXPECT_THROW(scene_of_bytes(bytes + "x"), InputError);
  EXPECT_THROW(scene_of_bytes(""), InputError);
}

}  // namespace
}  // namespace radiosity::test
