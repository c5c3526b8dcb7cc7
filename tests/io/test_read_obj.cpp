// SPDX-License-Identifier: GPL-3.0-or-later
#include "files.hpp"
#include "radiosity/io/read_scene.hpp"

namespace radiosity::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string obj_error(const std::string& text, const std::string& mtl = "") {
  const TemporaryDirectory directory;
  const auto file = directory.write("a.obj", text);
  if (!mtl.empty()) directory.write("a.mtl", mtl);
  std::string message = message_of<InputError>([&] { read_scene(file); });
  EXPECT_THAT(message, testing::AnyOf(StartsWith(file.string()), StartsWith((directory / "a.mtl").string())));
  return message;
}

TEST(ReadObj, KeepsPolygonsMaterialsAndOrderOfFaces) {
  const TemporaryDirectory directory;
  directory.write(
      "box.mtl",
      "newmtl white\nKd 0.7 0.6 0.5\n\nnewmtl lamp\nKd 0.1 0.1 0.1\nKe 17 12 4\nnewmtl spare\nKd 0 0 0\n");
  const auto file =
      directory.write("box.obj", "mtllib box.mtl\n" + kSquare +
                                     "v 0.5 2 0\nusemtl lamp\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
                                     "g other\nusemtl white\nf -5//1 -4//1 -3//1 -1//1 -2//1\nf 1 2 3\n");
  const LoadedScene loaded = read_scene(file);
  const Scene& scene = loaded.scene;
  ASSERT_EQ(scene.face_count(), 3);
  EXPECT_EQ(scene.bands(), 3);
  EXPECT_THAT(scene.corners(0), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(scene.corners(1), ElementsAre(0, 1, 2, 4, 3));
  EXPECT_THAT(scene.corners(2), ElementsAre(0, 1, 2));
  ASSERT_EQ(scene.materials().size(), 2U);
  EXPECT_EQ(scene.materials()[0].name, "lamp");
  EXPECT_TRUE((scene.materials()[0].emission == rgb(17, 12, 4)).all());
  EXPECT_TRUE((scene.materials()[1].reflectance == rgb(0.7, 0.6, 0.5)).all());
  EXPECT_TRUE((scene.materials()[1].emission == rgb(0, 0, 0)).all());
  EXPECT_EQ(scene.material(2), 1);
  EXPECT_THAT(loaded.warnings, ElementsAre("material 'spare' is defined, but no face uses it"));
  EXPECT_EQ(loaded.mesh_file, file);
}

TEST(ReadObj, ReadsNumbersToTheLastBit) {
  const TemporaryDirectory directory;
  directory.write("a.mtl", "newmtl m\nKd 0.725 0.71 0.1\n");
  const auto file = directory.write("a.obj",
                                    "mtllib a.mtl\nv 0.1 5000000.123456789 -1.05e-3\nv +1.01 0 0\nv 0 .3 2.\n"
                                    "usemtl m\nf 1 2 3\n");
  const LoadedScene loaded = read_scene(file);
  EXPECT_EQ(loaded.scene.vertices()[0], Vec3(0.1, 5000000.123456789, -1.05e-3));
  EXPECT_EQ(loaded.scene.vertices()[1], Vec3(1.01, 0, 0));
  EXPECT_EQ(loaded.scene.vertices()[2], Vec3(0, 0.3, 2));
  EXPECT_TRUE((loaded.scene.materials()[0].reflectance == rgb(0.725, 0.71, 0.1)).all());
}

TEST(ReadObj, OneNumberAfterKdStandsForAllBands) {
  const TemporaryDirectory directory;
  directory.write("a.mtl", "newmtl m\nKd 0.4\n");
  const auto file = directory.write("a.obj", "mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n");
  EXPECT_TRUE((read_scene(file).scene.materials()[0].reflectance == rgb(0.4, 0.4, 0.4)).all());
}

TEST(ReadObj, FacesBeforeAnyMaterialGetTheDefaultWithAWarning) {
  const TemporaryDirectory directory;
  directory.write("a.mtl", "newmtl lamp\nKd 0 0 0\nKe 1 1 1\n");
  const auto file = directory.write("a.obj", "mtllib a.mtl\n" + kSquare + "f 1 2 3\nusemtl lamp\nf 1 3 4\n");
  const LoadedScene loaded = read_scene(file);
  const Material& first = loaded.scene.materials()[0];
  EXPECT_EQ(first.name, "default");
  EXPECT_TRUE((first.reflectance == rgb(0.5, 0.5, 0.5)).all());
  EXPECT_THAT(loaded.warnings, ElementsAre("1 of 2 faces have no material: they get 'default'"));
}

TEST(ReadObj, MaterialHoldsUntilTheNextUsemtlWhateverTheGroups) {
  const TemporaryDirectory directory;
  directory.write("a.mtl", "newmtl one\nKd 1 0 0\nnewmtl two\nKd 0 1 0\n");
  const auto file = directory.write(
      "a.obj", "mtllib a.mtl\r\n" + kSquare +
                   "g g1\r\nusemtl one\r\nf 1 2 3\r\nf 1 3 4\r\ng g2\r\nf 1 2 4\r\nusemtl two\r\n"
                   "f 2 3 4\r\n");
  const LoadedScene loaded = read_scene(file);
  const Scene& scene = loaded.scene;
  EXPECT_EQ(scene.material(2), scene.material(0));
  EXPECT_EQ(scene.materials()[static_cast<std::size_t>(scene.material(3))].name, "two");
  EXPECT_THAT(loaded.warnings,
              ElementsAre("material 'one': reflectance is 1 in band 0: the surface absorbs nothing there",
                          "material 'two': reflectance is 1 in band 1: the surface absorbs nothing there"));
}

TEST(ReadObj, NamesWithBlanksAreRead) {
  const TemporaryDirectory directory;
  directory.write("my room.mtl", "newmtl off white \nKd 0.25 0.25 0.25\n");
  const auto file =
      directory.write("a.obj", "mtllib my room.mtl\n" + kSquare + "usemtl off white\nf 1 2 3 4\n");
  EXPECT_EQ(read_scene(file).scene.materials()[0].name, "off white");
}

TEST(ReadObj, RejectsAVertexThatDoesNotExistNamingFaceAndLine) {
  EXPECT_THAT(obj_error(kSquare + "f 1 2 3\nf 1 2 9\n"),
              HasSubstr("a.obj:6: face 2 refers to vertex 9, but the file has only 4"));
  EXPECT_THAT(obj_error(kSquare + "f 1 2 -5\n"), HasSubstr("a.obj:5: face 1 refers to vertex -5"));
  EXPECT_THAT(obj_error(kSquare + "f 0 1 2\n"), HasSubstr("a.obj:5: face 1 refers to vertex 0"));
  EXPECT_THAT(obj_error(kSquare + "f a b c\n"), HasSubstr("a.obj:5: face 1 refers to vertex 0"));
}

TEST(ReadObj, RejectsCoordinatesThatAreNotFiniteNumbers) {
  EXPECT_THAT(obj_error("v 0 0 0\n# comment\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
              HasSubstr("a.obj:3: vertex 2: coordinate 'nan' is not a finite number"));
  EXPECT_THAT(obj_error("v 0 0 inf\n"), HasSubstr("coordinate 'inf'"));
  EXPECT_THAT(obj_error("v 0 0 1,5\n"), HasSubstr("coordinate '1,5'"));
  EXPECT_THAT(obj_error("v 0 0\n"), HasSubstr("a.obj:1: vertex 1 has 2 coordinates"));
}

TEST(ReadObj, RejectsAFaceWithTwoCorners) {
  EXPECT_THAT(obj_error(kSquare + "f 1 2\n"), HasSubstr("a.obj:5: face 1 has 2 corners"));
}

TEST(ReadObj, RejectsAMaterialThatNothingDefines) {
  EXPECT_THAT(obj_error(kSquare + "usemtl wall\nf 1 2 3\n"),
              AllOf(HasSubstr("a.obj:6: face 1 uses material 'wall', which nothing defines"),
                    HasSubstr("scene file")));
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl wall\nf 1 2 3\n", "newmtl wail\nKd 1 1 1\n"),
              HasSubstr("'wall'"));
}

TEST(ReadObj, SaysWhichMaterialLibraryIsMissing) {
  EXPECT_THAT(obj_error("mtllib gone.mtl\n" + kSquare + "usemtl wall\nf 1 2 3\n"),
              AllOf(HasSubstr("material 'wall'"), HasSubstr("material library 'gone.mtl' ("),
                    HasSubstr("a.obj:1) does not exist")));
}

TEST(ReadObj, RejectsAColourThatIsNotNumbers) {
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3\n", "newmtl m\nKd spectral x.rfl\n"),
              HasSubstr("a.mtl:2: 'Kd spectral x.rfl' must be followed by three numbers"));
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3\n", "newmtl m\nKd 0.5 0.5\n"),
              HasSubstr("a.mtl:2"));
}

TEST(ReadObj, RejectsAReflectanceAboveOne) {
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3\n", "newmtl m\nKd 1.2 0 0\n"),
              AllOf(HasSubstr("'m'"), HasSubstr("1.2"), HasSubstr("[0, 1]")));
}

TEST(ReadObj, RejectsAFileWithoutFaces) {
  EXPECT_THAT(obj_error("v 0 0 0\n"), HasSubstr("the mesh has no faces"));
  EXPECT_THAT(obj_error(""), HasSubstr("the mesh has no faces"));
  EXPECT_THAT(obj_error(std::string("\x7f"
                                    "ELF\0\1\2garbage\n\xff\xfe",
                                    18)),
              HasSubstr("the mesh has no faces"));
}

TEST(ReadObj, ReadsTheOriginalCornellBoxAsItsFileSays) {
  const std::filesystem::path file =
      RADIOSITY_SOURCE_DIR "/../shared/scenes/cornell-box-original/CornellBox-Original.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const LoadedScene loaded = read_scene(file);
  const Scene& scene = loaded.scene;
  // Five walls, two boxes of six faces, one lamp.
  ASSERT_EQ(scene.face_count(), 18);
  const auto name = [&](Index f) {
    return scene.materials()[static_cast<std::size_t>(scene.material(f))].name;
  };
  EXPECT_EQ(name(0), "floor");
  EXPECT_EQ(name(4), "leftWall");
  // The short box stands before its own usemtl: the material of the wall before it still holds.
  for (Index f = 5; f < 11; ++f) EXPECT_EQ(name(f), "leftWall");
  for (Index f = 11; f < 17; ++f) EXPECT_EQ(name(f), "tallBox");
  EXPECT_EQ(name(17), "light");
  EXPECT_TRUE(
      (scene.materials()[static_cast<std::size_t>(scene.material(17))].emission == rgb(17, 12, 4)).all());
  EXPECT_THAT(
      loaded.warnings,
      ElementsAre("material 'shortBox' is defined, but no face uses it",
                  "material 'leftWall': reflectance is 1 in band 0: the surface absorbs nothing there"));
  EXPECT_NO_THROW(require_emission(scene, file));
}

}  // namespace
}  // namespace radiosity::test
