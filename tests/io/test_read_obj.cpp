// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>

#include <algorithm>
#include <cmath>

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

/// The material that an MTL gives to a square, and what was odd.
std::pair<Material, std::vector<std::string>> finish(const std::string& mtl) {
  const TemporaryDirectory directory;
  directory.write("a.mtl", "newmtl m\n" + mtl);
  const auto file = directory.write("a.obj", "mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n");
  const LoadedScene loaded = read_scene(file);
  return {loaded.scene.materials()[0], loaded.warnings};
}

TEST(ReadObj, ReadsGlossMirrorsAndGlass) {
  const auto [gloss, odd] = finish("Kd 0.4 0.4 0.4\nKs 0.1 0.2 0.3\nNs 50\n");
  EXPECT_TRUE((gloss.specular == rgb(0.1, 0.2, 0.3)).all());
  EXPECT_EQ(gloss.shininess, 50);
  EXPECT_EQ(gloss.transmission.size(), 0);
  EXPECT_TRUE(odd.empty());
  EXPECT_TRUE(std::isinf(finish("Kd 0 0 0\nKs 1\nillum 3\n").first.shininess));  // a mirror
  EXPECT_EQ(finish("Kd 0.4 0.4 0.4\nKs 0.5\nillum 1\n").first.specular.size(), 0);
  for (const char* dissolve : {"d 0.25\n", "Tr 0.75\n", "Tr 0.25\nd 0.25\n"}) {
    const Material pane = finish(std::string("Kd 0.4 0.4 0.8\nTf 1 0.8 0.6\nNi 1.5\n") + dissolve).first;
    EXPECT_TRUE(pane.reflectance.isApprox(rgb(0.1, 0.1, 0.2))) << dissolve;
    EXPECT_TRUE(pane.transmission.isApprox(rgb(0.75, 0.6, 0.45))) << dissolve;
    EXPECT_EQ(pane.refractive_index, 1.5);
  }
  EXPECT_TRUE((finish("Kd 0 0 0\nTf 0.9\nillum 6\n").first.transmission == 0.9).all());
  EXPECT_EQ(finish("Kd 0 0 0\nTf 0.9\nillum 2\n").first.transmission.size(), 0);
}

TEST(ReadObj, SurfacesThatWouldBeInvisibleAreOpaque) {
  const auto [wall, odd] = finish("Kd 0.5\nTf 1\nd 0\nillum 2\n");
  EXPECT_TRUE((wall.reflectance == 0.5).all());
  EXPECT_EQ(wall.transmission.size(), 0);
  EXPECT_THAT(odd, testing::Contains("d is 0 (or Tr 1), nothing to be seen, for 'm': taken for opaque"));
  const Material glass = finish("Kd 0.5\nTf 0.9\nd 0\nillum 6\n").first;
  EXPECT_TRUE((glass.reflectance == 0).all());
  EXPECT_TRUE((glass.transmission == 0.9).all());
}

// The diffuse light of a room can be solved although its file gives every material Ks 0.5 by habit.
TEST(ReadObj, GlossThatTheReflectanceLeavesNoRoomForIsReducedWithAWarning) {
  const auto [material, odd] = finish("Kd 0.75 0.5 1\nKs 0.5\n");
  EXPECT_TRUE((material.reflectance == rgb(0.75, 0.5, 1)).all());
  EXPECT_TRUE((material.specular == rgb(0.25, 0.5, 0)).all());
  EXPECT_THAT(odd,
              testing::Contains(testing::AllOf(StartsWith("'m'"), HasSubstr("reduced to what it leaves"))));
}

TEST(ReadObj, RejectsATransparencyThatIsNone) {
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n", "newmtl m\nKd 0 0 0\nd 1.5\n"),
              HasSubstr("a.mtl:3: 'd 1.5' must be followed by a number from 0 to 1"));
  EXPECT_THAT(obj_error("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n", "newmtl m\nKd 0 0 0\nNs x\n"),
              HasSubstr("'Ns x' must be followed by a number that is at least 0"));
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
  EXPECT_EQ(scene.materials()[scene.material(3)].name, "two");
  EXPECT_THAT(loaded.warnings,
              ElementsAre("the reflectance of 'one' and 'two' is 1 in some band: nothing is absorbed there"));
}

TEST(ReadObj, ManyUnusedMaterialsAreOneWarning) {
  const TemporaryDirectory directory;
  std::string library;
  for (const char* name : {"used", "one", "two", "three", "four", "five"})
    library += std::string("newmtl ") + name + "\nKd 0.5 0.5 0.5\n";
  directory.write("a.mtl", library);
  const auto file = directory.write("a.obj", "mtllib a.mtl\n" + kSquare + "usemtl used\nf 1 2 3 4\n");
  EXPECT_THAT(
      read_scene(file).warnings,
      ElementsAre("5 materials are defined, but no face uses them: 'one', 'two', 'three' and 2 more"));
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
  EXPECT_THAT(obj_error(kSquare + "f 1 2 4294967297\n"), HasSubstr("vertex 4294967297"));
  for (const std::string word : {"a", "1.5", "1,2", "/1", "99999999999999999999", "--1", "+-1"})
    EXPECT_THAT(
        obj_error(kSquare + "f 1 2 " + word + "\n"),
        HasSubstr("a.obj:5: face 1: corner '" + word + "' does not begin with the number of a vertex"));
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

/// A closed room of 4 × 2.5 × 3 m with the materials of kRoomMtl.
const std::string kRoom =
    "v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 0 2.5 0\nv 4 2.5 0\nv 4 2.5 3\nv 0 2.5 3\n"
    "usemtl floor\nf 1 4 3 2\nusemtl ceil\nf 5 6 7 8\nusemtl w\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
const std::string kRoomMtl =
    "newmtl floor\nKd 0.2 0.2 0.2\nnewmtl w\nKd 0.5 0.5 0.5\nnewmtl ceil\nKd 0.8 0.8 0.8\nKe 10 10 10\n";

void expect_same(const LoadedScene& loaded, const LoadedScene& reference) {
  const Scene &a = loaded.scene, &b = reference.scene;
  EXPECT_EQ(a.vertices(), b.vertices());
  ASSERT_EQ(a.face_count(), b.face_count());
  for (Index f = 0; f < a.face_count(); ++f) {
    EXPECT_TRUE(std::ranges::equal(a.corners(f), b.corners(f))) << f;
    EXPECT_EQ(a.material(f), b.material(f)) << f;
  }
  ASSERT_EQ(a.materials().size(), b.materials().size());
  for (std::size_t m = 0; m < a.materials().size(); ++m) {
    EXPECT_EQ(a.materials()[m].name, b.materials()[m].name);
    EXPECT_TRUE((a.materials()[m].reflectance == b.materials()[m].reflectance).all());
    EXPECT_TRUE((a.materials()[m].emission == b.materials()[m].emission).all());
  }
  EXPECT_EQ(loaded.warnings, reference.warnings);
}

class ObjWays : public testing::Test {
 protected:
  LoadedScene read(const std::string& obj, const std::string& mtl = kRoomMtl) const {
    directory_.write("room.mtl", mtl);
    return read_scene(directory_.write("room.obj", obj));
  }
  const TemporaryDirectory directory_;
  const std::string obj_ = "mtllib room.mtl\n" + kRoom;
  const LoadedScene plain_ = read(obj_);
};

TEST_F(ObjWays, LinesMayEndWithCrLfOrCr) {
  for (const std::string end : {"\r\n", "\r"}) {
    expect_same(read(replaced(obj_, "\n", end), replaced(kRoomMtl, "\n", end)), plain_);
    EXPECT_THAT(message_of<InputError>([&] { read(replaced(obj_ + "f 1 2 99\n", "\n", end)); }),
                HasSubstr("room.obj:19: face 7 refers to vertex 99"));
  }
}

TEST_F(ObjWays, AByteOrderMarkIsDropped) {
  expect_same(read("\xef\xbb\xbf" + obj_, "\xef\xbb\xbf" + kRoomMtl), plain_);
  EXPECT_THAT(message_of<IoError>([&] { read(std::string("\xff\xfem\0t\0", 6)); }), HasSubstr("UTF-16"));
}

TEST_F(ObjWays, ABackslashJoinsLines) {
  const std::string joined =
      replaced(replaced(obj_, "v 4 2.5 3", "v 4 2.5 \\\n 3"), "f 1 4 3 2", "f 1 4\\ \r\n3 2");
  expect_same(read(joined), plain_);
  expect_same(read("# made from C:\\rooms\\\n" + obj_), plain_);
  EXPECT_THAT(message_of<InputError>([&] { read(joined + "f 1 2 99\n"); }), HasSubstr("room.obj:21: face 7"));
}

TEST_F(ObjWays, BlanksCommentsAndFormsOfNumbersDoNotMatter) {
  expect_same(read(replaced(obj_, " ", " \t "), replaced(kRoomMtl, " ", "\t")), plain_);
  expect_same(read(replaced(obj_, "\n", " \n\n# f 1 2 3\n"), replaced(kRoomMtl, "\n", "\t\n\n#\n")), plain_);
  expect_same(read(replaced(obj_, "2.5", "+2.5e+0")), plain_);
  expect_same(read(replaced(obj_, "v 4 2.5 3", "v 4.0 .25E1 3. 1.0 # far")), plain_);
  expect_same(read(replaced(obj_, "f 1 4 3 2", "f 1/1 4/-1/2 3//3 2/2/2 # floor")), plain_);
  expect_same(read(obj_.substr(0, obj_.size() - 1), kRoomMtl.substr(0, kRoomMtl.size() - 1)), plain_);
}

TEST_F(ObjWays, SeveralLibrariesStandOnOneLine) {
  const auto split = kRoomMtl.find("newmtl ceil");
  directory_.write("a.mtl", kRoomMtl.substr(0, split));
  directory_.write("the ceiling.mtl", kRoomMtl.substr(split));
  for (const std::string line :
       {"mtllib a.mtl the ceiling.mtl\n", "mtllib the ceiling.mtl a.mtl\n",
        "mtllib a.mtl\nmtllib the ceiling.mtl a.mtl\n", "mtllib .\\a.mtl \"the ceiling.mtl\"\n"})
    expect_same(read(line + kRoom), plain_);
  EXPECT_THAT(message_of<InputError>([&] { read("mtllib a.mtl gone.mtl\n" + kRoom); }),
              AllOf(HasSubstr("'ceil'"), HasSubstr("material library 'gone.mtl'")));
}

TEST_F(ObjWays, UsemtlWithoutANameMeansTheDefault) {
  for (const std::string line : {"usemtl\n", "usemtl \t\n"}) {
    const LoadedScene loaded = read(replaced(obj_, "usemtl w\n", line));
    for (Index f = 2; f < 6; ++f)
      EXPECT_EQ(loaded.scene.materials()[loaded.scene.material(f)].name, "default");
    EXPECT_THAT(loaded.warnings, ElementsAre("4 of 6 faces have no material: they get 'default'",
                                             "material 'w' is defined, but no face uses it"));
  }
}

TEST_F(ObjWays, ALoopThatWalksRoundTwiceIsOneFace) {
  const LoadedScene loaded = read(
      replaced(replaced(obj_, "f 5 6 7 8", "f 5 6 7 8 5 6 7 8"), "f 4 1 5 8", "f 4 1 5 8 4 1 5 8 4 1 5 8"));
  EXPECT_THAT(loaded.scene.corners(1), ElementsAre(4, 5, 6, 7));
  EXPECT_THAT(loaded.scene.corners(5), ElementsAre(3, 0, 4, 7));
  EXPECT_THAT(loaded.warnings, ElementsAre("2 faces walk round more than once: one round is kept"));
}

TEST_F(ObjWays, ColoursOfNoMaterialAreNamed) {
  const LoadedScene loaded = read(obj_, "Ka 1 1 1\nKd 0.5 0.5 0.5\n" + kRoomMtl + "newmtl\nKe 9 9 9\n");
  EXPECT_THAT(loaded.warnings, ElementsAre(HasSubstr("room.mtl:2: 'Kd 0.5 0.5 0.5' belongs to no material"),
                                           HasSubstr("room.mtl:10: a material without a name"),
                                           HasSubstr("room.mtl:11: 'Ke 9 9 9' belongs to no material")));
  EXPECT_EQ(loaded.scene.materials()[0].reflectance[0], 0.2);
}

TEST_F(ObjWays, StatementsThatAreNotUnderstoodAreCounted) {
  const LoadedScene loaded = read(obj_ + "F 1 2 3\nsurf 0 1 0 1 1 2 3\ng a\ns 1\nl 1 2\n");
  EXPECT_THAT(loaded.warnings, ElementsAre(AllOf(HasSubstr("2 statements are not understood"),
                                                 HasSubstr("room.obj:19: 'F 1 2 3'"))));
}

/// A TGA image of 2 × 1 pixels: red is 0 and 255, green 128, blue 0.
/// Linear means: (0 + 1)/2, ((128/255 + 0.055)/1.055)^2.4, 0.
const std::string kImage(
    "\0\0\2\0\0\0\0\0\0\0\0\0\2\0\1\0\x18\0"
    "\0\x80\0\0\x80\xff",
    24);
const double kHalf = std::pow((128 / 255.0 + 0.055) / 1.055, 2.4);

BandValues reflectance_with(const TemporaryDirectory& directory, const std::string& statements,
                            std::vector<std::string>* warnings = nullptr) {
  directory.write("a.mtl", "newmtl m\n" + statements);
  const LoadedScene loaded =
      read_scene(directory.write("a.obj", "mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n"));
  if (warnings) *warnings = loaded.warnings;
  return loaded.scene.materials()[0].reflectance;
}

TEST(ReadObj, ATextureGivesItsMeanInLinearLightTimesKd) {
  const TemporaryDirectory directory;
  directory.write("textures/my image.tga", kImage);
  for (const std::string name :
       {"textures/my image.tga", "textures\\my image.tga", "\"textures/my image.tga\"",
        "-s 2 2 2 textures/my image.tga", "-o 0.5 -blendu on -mm 0 1 -clamp off textures\\my image.tga",
        "-s 1 1 -bm 0.5  textures/my image.tga\r"}) {
    const BandValues rho = reflectance_with(directory, "map_Kd " + name + "\nKd 0.5 0.25 1\n");
    ASSERT_EQ(rho.size(), 3) << name;
    EXPECT_NEAR(rho[0], 0.25, 1e-15) << name;
    EXPECT_NEAR(rho[1], 0.25 * kHalf, 1e-15);
    EXPECT_EQ(rho[2], 0);
  }
  EXPECT_NEAR(reflectance_with(directory, "map_Kd textures/my image.tga\n")[0], 0.5, 1e-15);
}

/// Pixels of several channels, one after the other, as a PNG file.
template <class Array>
void write_png(const std::filesystem::path& file, int width, int channels,
               const std::vector<typename Array::ValueType>& values) {
  vtkNew<Array> pixels;
  pixels->SetNumberOfComponents(channels);
  for (const auto value : values) pixels->InsertNextValue(value);
  vtkNew<vtkImageData> image;
  image->SetDimensions(width, 1, 1);
  image->GetPointData()->SetScalars(pixels);
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(image);
  writer->SetFileName(file.c_str());
  writer->Write();
}

TEST(ReadObj, TexturesMayBeGreyHaveAlphaOr16Bits) {
  const TemporaryDirectory directory;
  write_png<vtkUnsignedCharArray>(directory / "grey.png", 4, 1, {0, 255, 255, 255});
  write_png<vtkUnsignedCharArray>(directory / "grey-alpha.png", 2, 2, {0, 9, 128, 0});
  write_png<vtkUnsignedCharArray>(directory / "alpha.png", 2, 4, {255, 0, 128, 0, 255, 255, 128, 255});
  write_png<vtkUnsignedShortArray>(directory / "deep.png", 2, 3, {65535, 0, 128 * 257, 0, 0, 128 * 257});
  const auto is = [&](const std::string& name, double r, double g, double b) {
    const BandValues rho = reflectance_with(directory, "map_Kd " + name + "\n");
    ASSERT_EQ(rho.size(), 3) << name;
    EXPECT_LT((rho - rgb(r, g, b)).abs().maxCoeff(), 1e-12) << name << ' ' << rho.transpose();
  };
  is("grey.png", 0.75, 0.75, 0.75);
  is("grey-alpha.png", kHalf / 2, kHalf / 2, kHalf / 2);
  is("alpha.png", 1, 0.5, kHalf);
  is("deep.png", 0.5, 0, kHalf);
}

TEST(ReadObj, TexturesThatCannotBeReadAreOneWarning) {
  const TemporaryDirectory directory;
  directory.write("good.tga", kImage);
  // The data end before the last pixel.
  directory.write("cut.tga", kImage.substr(0, kImage.size() - 1));
  // A JPEG whose table of codes has 16 × 255 entries; 256 are possible.
  directory.write("codes.jpg", std::string("\xff\xd8\xff\xc4\x10\x03\0", 7) + std::string(16, '\xff') +
                                   std::string(4080, '\0'));
  std::string mtl = "newmtl good\nKd 1 1 1\nmap_Kd good.tga\n",
              obj = "mtllib a.mtl\n" + kSquare + "usemtl good\nf 1 2 3\n";
  const std::vector<std::string> bad{"textures\\gone.png", "cut.tga", "codes.jpg", ".", ""};
  for (std::size_t k = 0; k < bad.size(); ++k) {
    mtl += fmt::format("newmtl bad{}\nKd 0.25 0.5 0.75\nmap_Kd {}\n", k, bad[k]);
    obj += fmt::format("usemtl bad{}\nf 1 2 3 4\n", k);
  }
  directory.write("a.mtl", mtl);
  const LoadedScene loaded = read_scene(directory.write("a.obj", obj));
  for (std::size_t k = 1; k <= bad.size(); ++k)
    EXPECT_TRUE((loaded.scene.materials()[k].reflectance == rgb(0.25, 0.5, 0.75)).all()) << bad[k - 1];
  EXPECT_THAT(loaded.warnings, ElementsAre(AllOf(HasSubstr("5 of 6 textures (map_Kd) cannot be read"),
                                                 HasSubstr("textures/gone.png', which does not exist"))));
}

TEST(ReadObj, ReadsTheOriginalCornellBoxAsItsFileSays) {
  const std::filesystem::path file =
      RADIOSITY_SOURCE_DIR "/../shared/scenes/cornell-box-original/CornellBox-Original.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const LoadedScene loaded = read_scene(file);
  const Scene& scene = loaded.scene;
  // Five walls, two boxes of six faces, one lamp.
  ASSERT_EQ(scene.face_count(), 18);
  const auto name = [&](Index f) { return scene.materials()[scene.material(f)].name; };
  EXPECT_EQ(name(0), "floor");
  EXPECT_EQ(name(4), "leftWall");
  // The short box stands before its own usemtl: the material of the wall before it still holds.
  for (Index f = 5; f < 11; ++f) EXPECT_EQ(name(f), "leftWall");
  for (Index f = 11; f < 17; ++f) EXPECT_EQ(name(f), "tallBox");
  EXPECT_EQ(name(17), "light");
  EXPECT_TRUE((scene.materials()[scene.material(17)].emission == rgb(17, 12, 4)).all());
  EXPECT_THAT(loaded.warnings,
              ElementsAre("material 'shortBox' is defined, but no face uses it",
                          "the reflectance of 'leftWall' is 1 in some band: nothing is absorbed there"));
  EXPECT_NO_THROW(require_emission(scene, file));
}

}  // namespace
}  // namespace radiosity::test
