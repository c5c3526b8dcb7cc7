// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <cmath>

#include "files.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/refractive_index.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace radiosity::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// A 2 × 1 floor and a 1 × 1 lamp, defined in the MTL, beside the scene file under test.
class SceneFileTest : public testing::Test {
 protected:
  SceneFileTest() {
    directory_.write("mesh/room.mtl", "newmtl floor\nKd 0.3 0.4 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 2 3\n");
    directory_.write(
        "mesh/room.obj",
        "mtllib room.mtl\nv 0 0 0\nv 2 0 0\nv 2 0 -1\nv 0 0 -1\nv 0 1 0\nv 0 1 -1\nv 1 1 -1\nv 1 1 0\n"
        "usemtl floor\nf 1 2 3 4\nusemtl lamp\nf 5 6 7 8\n");
  }

  /// The scene file holds `text` from its line 2 on.
  std::filesystem::path file(const std::string& text) const {
    return directory_.write("scene.toml", "mesh = \"mesh/room.obj\"\n" + text);
  }
  LoadedScene read(const std::string& text) const { return read_scene(file(text)); }
  template <class Exception = InputError>
  std::string error(const std::string& text) const {
    const auto scene = file(text);
    std::string message = message_of<Exception>([&] { read_scene(scene); });
    EXPECT_THAT(message, StartsWith(scene.string()));
    return message.substr((directory_.path().string() + "/").size());
  }

  TemporaryDirectory directory_;
};

TEST_F(SceneFileTest, WithOnlyAMeshKeepsWhatTheMeshSays) {
  const LoadedScene loaded = read("");
  EXPECT_EQ(loaded.mesh_file, directory_ / "mesh/room.obj");
  EXPECT_TRUE((loaded.scene.materials()[0].reflectance == rgb(0.3, 0.4, 0.5)).all());
  EXPECT_TRUE((loaded.scene.materials()[1].emission == rgb(1, 2, 3)).all());
  const SceneSettings& settings = loaded.settings;
  EXPECT_FALSE(settings.patches || settings.method || settings.samples || settings.resolution ||
               settings.seed || settings.solver || settings.tolerance || settings.max_iterations ||
               settings.camera);
}

TEST_F(SceneFileTest, ReadsCamerasByName) {
  const std::string door = "[camera.door]\nposition = [1, 2, 3]\ntarget = [0, 0, 0]\nvertical_fov_deg = 50\n";
  const SceneSettings only = read(door).settings;
  EXPECT_FALSE(only.camera);
  ASSERT_EQ(only.cameras.size(), 1U);
  EXPECT_EQ(only.cameras.at("door").position, Vec3(1, 2, 3));
  EXPECT_EQ(only.cameras.at("door").vertical_fov_deg, 50);
  const SceneSettings both = read("[camera]\nposition = [7, 8, 9]\ntarget = [0, 0, 0]\n" + door).settings;
  EXPECT_EQ(both.camera->position, Vec3(7, 8, 9));
  EXPECT_EQ(both.cameras.size(), 1U);
  EXPECT_THAT(error("[camera.door]\nposition = [1, 2, 3]\n"),
              StartsWith("scene.toml:2: [camera.door] needs the key 'target'"));
  EXPECT_THAT(error("[camera.door]\npositon = [1, 2, 3]\n"),
              AllOf(StartsWith("scene.toml:3"), HasSubstr("[camera.door]"), HasSubstr("'position'")));
}

TEST_F(SceneFileTest, ReadsLights) {
  const std::vector<Light> lights = read(R"([lights.a]
type = "point"
position = [1, 2, 3]
power = 12.5
[lights.b]
type = "spot"
position = [1, 2, 3]
direction = [0, -2, 0]
intensity = [1, 2, 3]
exponent = 2
cone_deg = 60
inner_cone_deg = 0
attenuation = [1, 0.5, 0]
[lights.c]
type = "directional"
direction = [0, 0, 5]
irradiance = 1000
)")
                                        .lights;
  ASSERT_EQ(lights.size(), 3U);
  for (const Light& light : lights) EXPECT_NO_THROW(validate(light, 3));
  EXPECT_EQ(lights[0].kind, LightKind::point);
  EXPECT_EQ(lights[0].position, Vec3(1, 2, 3));
  EXPECT_NEAR(lights[0].intensity[2] * 4 * M_PI, 12.5, 1e-12);
  EXPECT_EQ(lights[1].kind, LightKind::spot);
  EXPECT_EQ(lights[1].direction, Vec3(0, -1, 0));
  EXPECT_TRUE((lights[1].intensity == rgb(1, 2, 3)).all());
  EXPECT_EQ(lights[1].exponent, 2);
  EXPECT_NEAR(lights[1].cos_outer, 0.5, 1e-15);
  EXPECT_EQ(lights[1].cos_inner, 1);
  EXPECT_EQ(lights[1].attenuation, (std::array<double, 3>{1, 0.5, 0}));
  EXPECT_EQ(lights[2].kind, LightKind::directional);
  EXPECT_EQ(lights[2].direction, Vec3(0, 0, 1));
  EXPECT_EQ(lights[2].intensity[1], 1000);
}

TEST_F(SceneFileTest, RejectsWrongLights) {
  const std::string point = "[lights.a]\ntype = \"point\"\nposition = [0, 0, 0]\n";
  EXPECT_THAT(error("[lights.a]\nposition = [0, 0, 0]\n"),
              HasSubstr("scene.toml:2: light 'a' needs the key 'type'"));
  EXPECT_THAT(error("[lights.a]\ntype = \"lamp\"\n"),
              HasSubstr("must be \"point\", \"directional\" or \"spot\""));
  EXPECT_THAT(error(point), HasSubstr("light 'a' needs the key 'intensity' (W/sr) or 'power' (W)"));
  EXPECT_THAT(error(point + "intensity = 1\npower = 1\n"),
              AllOf(StartsWith("scene.toml:6"), HasSubstr("exclude each other")));
  EXPECT_THAT(error(point + "intensity = -1\n"), HasSubstr("intensity -1 is negative or not finite (W/sr)"));
  EXPECT_THAT(error(point + "intensity = 1\ncone_deg = 20\n"),
              HasSubstr("unknown key 'cone_deg' in [lights.a]"));
  EXPECT_THAT(error(point + "intensity = 1\nattenuation = [0, 0, 0]\n"), HasSubstr("not all 0"));
  EXPECT_THAT(error(point + "power = 1\nattenuation = [1, 0, 0]\n"), HasSubstr("has no power"));
  EXPECT_THAT(error(point + "intensity = [1, 2]\n"), HasSubstr("light 'a' has 2 values, but"));
  const std::string spot = "[lights.a]\ntype = \"spot\"\nposition = [0, 0, 0]\nintensity = 1\n";
  EXPECT_THAT(error(spot), HasSubstr("light 'a' needs the key 'direction'"));
  EXPECT_THAT(error(spot + "direction = [0, 0, 0]\n"), HasSubstr("direction 0 0 0 is none"));
  EXPECT_THAT(
      error(spot + "direction = [0, 0, 1]\ncone_deg = 20\ninner_cone_deg = 30\n"),
      AllOf(StartsWith("scene.toml:8"), HasSubstr("inner_cone_deg = 30: must be a half-angle from 0")));
}

TEST_F(SceneFileTest, AddsCurvedShapes) {
  const LoadedScene loaded = read(R"(units = "cm"
flip = true
[materials.chrome]
specular = 0.9
[shapes.a]
type = "sphere"
centre = [0, 1, 0]
radius = 0.25
material = "lamp"
chord_error = 0.01
[shapes.b]
type = "cylinder"
base = [0, 0, 0]
top = [0, 0, 2]
radius = 0.1
caps = true
material = "chrome"
[shapes.c]
type = "disk"
centre = [0, 0, 3]
normal = [0, 0, -1]
radius = 0.1
flip = true
material = "floor"
)");
  const Scene& scene = loaded.scene;
  // Two faces of the mesh; the icosahedron with 20 ν² triangles; 23 sides, 1 − cos(π/23) < 1 % < 1 − cos(π/22), and two caps; a disk.
  const Index sphere = scene.face_count() - 2 - 25 - 1;
  ASSERT_GT(sphere, 0);
  const int frequency = static_cast<int>(std::lround(std::sqrt(sphere / 20.0)));
  EXPECT_EQ(sphere, 20 * frequency * frequency);
  EXPECT_EQ(scene.materials()[static_cast<std::size_t>(scene.material(2))].name, "lamp");
  EXPECT_EQ(scene.materials()[static_cast<std::size_t>(scene.material(2 + sphere))].name, "chrome");
  EXPECT_NEAR(scene.area_vector(scene.face_count() - 1).normalized().z(), 1, 1e-12);
  EXPECT_EQ(scene.corners(scene.face_count() - 1).size(), 23U);
  EXPECT_NEAR(scene.upper().z(), 3, 1e-12);  // metres, whatever the unit of the mesh
  // Another chord error in place of it.
  const auto coarse = read_scene(directory_ / "scene.toml", MissingMaterials::refuse,
                                 [](const CurvedShape& shape) { return size(shape); });
  EXPECT_EQ(coarse.scene.face_count(), 2 + 80 + 18 + 1);
}

TEST_F(SceneFileTest, ShapesNeedNoMesh) {
  std::string points;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) points += fmt::format("[{}, {}, 0], ", i, j);
  const auto scene = directory_.write("shapes.toml",
                                      "[materials.sheet]\nemission = 2\n[shapes.sheet]\ntype = \"bezier\"\n"
                                      "material = \"sheet\"\npoints = [" +
                                          points + "]\n");
  const LoadedScene loaded = read_scene(scene);
  EXPECT_EQ(loaded.scene.face_count(), 2);  // flat
  EXPECT_NEAR(loaded.scene.material_area(0), 9, 1e-12);
  EXPECT_EQ(loaded.scene.materials()[0].emission[0], 2);
  EXPECT_NEAR(loaded.scene.area_vector(0).z(), 4.5, 1e-12);
}

TEST_F(SceneFileTest, RejectsWrongShapes) {
  const std::string ball = "[shapes.ball]\ntype = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\n";
  EXPECT_THAT(error(ball), HasSubstr("scene.toml:2: shape 'ball' needs the key 'material'"));
  EXPECT_THAT(error(ball + "material = \"lmap\"\n"),
              HasSubstr("scene.toml:2: shape 'ball': nothing defines its material 'lmap'"));
  EXPECT_THAT(error(ball + "material = \"lamp\"\nchord_error = 0\n"),
              HasSubstr("chord_error = 0: must be positive"));
  EXPECT_THAT(error(ball + "material = \"lamp\"\nchord_error = 1e-9\n"),
              HasSubstr("scene.toml:2: shape 'ball': a chord error of 1e-09 m takes"));
  EXPECT_THAT(error(ball + "material = \"lamp\"\ncaps = true\n"),
              HasSubstr("unknown key 'caps' in [shapes.ball]"));
  EXPECT_THAT(error("[shapes.ball]\ntype = \"cube\"\n"),
              HasSubstr("must be \"sphere\", \"cylinder\", \"disk\" or"));
  EXPECT_THAT(error("[shapes.ball]\nradius = 1\n"), HasSubstr("shape 'ball' needs the key 'type'"));
  EXPECT_THAT(error("[shapes.ball]\ntype = \"sphere\"\nradius = 1\n"),
              HasSubstr("[shapes.ball] needs the key 'centre'"));
  EXPECT_THAT(error("[shapes.p]\ntype = \"bezier\"\npoints = [[0, 0, 0]]\n"),
              HasSubstr("16 points for each patch, not 1"));
  EXPECT_THAT(error("[shapes.p]\ntype = \"bezier\"\npoints = [[0, 0]]\n"),
              HasSubstr("points must be an array of three finite numbers"));
}

TEST_F(SceneFileTest, ReadsMirrorsAndGlass) {
  const Scene scene = read(R"([materials.floor]
specular = [0.5, 0.25, 0]
shininess = 20
[materials.lamp]
transmission = 0.75
refractive_index = "Crown  GLASS"
)")
                          .scene;
  const Material &floor = scene.materials()[0], &lamp = scene.materials()[1];
  EXPECT_TRUE((floor.specular == rgb(0.5, 0.25, 0)).all());
  EXPECT_EQ(floor.shininess, 20);
  EXPECT_TRUE((lamp.transmission == rgb(0.75, 0.75, 0.75)).all());
  EXPECT_EQ(lamp.refractive_index, 1.52);
  EXPECT_TRUE(std::isinf(lamp.shininess));
  EXPECT_EQ(read("[materials.lamp]\nrefractive_index = 2.5\n").scene.materials()[1].refractive_index, 2.5);
  EXPECT_EQ(read("[materials.lamp]\nrefractive_index = \"water\"\n").scene.materials()[1].refractive_index,
            1.333);
}

// n_d and the Abbe number (n_d − 1) / (n_F − n_C) as the manufacturers publish them.
TEST(Glasses, HaveTheirPublishedIndicesAndAbbeNumbers) {
  struct Published {
    const char* name;
    double index, abbe;
  };
  for (const auto& [name, index, abbe] : {Published{"BK7", 1.51680, 64.17},
                                          {"F2", 1.62004, 36.37},
                                          {"SF10", 1.72828, 28.53},
                                          {"SF11", 1.78472, 25.68},
                                          {"Fused Silica", 1.45846, 67.82},
                                          {"calcium fluoride", 1.43385, 95.0}}) {
    const Glass* const glass = find_glass(name);
    ASSERT_NE(glass, nullptr) << name;
    const auto n = [&](double nm) { return refractive_index(glass->sellmeier, nm); };
    EXPECT_NEAR(n(587.5618), index, 6e-6) << name;
    EXPECT_NEAR((n(587.5618) - 1) / (n(486.1327) - n(656.2725)), abbe, 0.05) << name;
  }
  EXPECT_EQ(glasses().size(), 6U);
  EXPECT_NEAR(refractive_index(Cauchy{{1.5, 0.004, 0.0002}}, 500), 1.5 + 0.016 + 0.0032, 1e-15);
}

TEST_F(SceneFileTest, ReadsIndicesPerBand) {
  const LoadedScene loaded = read(R"([bands]
wavelength_nm = [656.2725, 587.5618, 486.1327]
[materials.floor]
refractive_index = "bk7"
[materials.lamp]
refractive_index = { cauchy = [1.5, 0.004] }
)");
  EXPECT_TRUE((loaded.wavelengths_nm == rgb(656.2725, 587.5618, 486.1327)).all());
  EXPECT_TRUE(loaded.scene.materials()[0].refractive_indices.isApprox(rgb(1.51432, 1.51680, 1.52238), 3e-6));
  EXPECT_NEAR(loaded.scene.materials()[1].refractive_indices[2], 1.5 + 0.004 / std::pow(0.4861327, 2), 1e-15);
  // Without wavelengths an index is that of the d line, the same in all bands.
  const Material glass = read("[materials.floor]\nrefractive_index = \"BK7\"\n").scene.materials()[0];
  EXPECT_EQ(glass.refractive_indices.size(), 0);
  EXPECT_NEAR(glass.refractive_index, 1.5168, 1e-6);
  EXPECT_TRUE((read("[materials.floor]\nrefractive_index = [1.4, 1.5, 1.6]\n")
                   .scene.materials()[0]
                   .refractive_indices == rgb(1.4, 1.5, 1.6))
                  .all());
  const std::string sellmeier = "refractive_index = { sellmeier = [1, 0.2, 0.01, 100] }\n";
  EXPECT_NEAR(
      read("[materials.floor]\n" + sellmeier).scene.materials()[0].refractive_index,
      std::sqrt(1 + 1 / (1 - 0.01 / std::pow(0.5875618, 2)) + 0.2 / (1 - 100 / std::pow(0.5875618, 2))),
      1e-15);
}

TEST_F(SceneFileTest, RejectsWrongIndicesPerBand) {
  const std::string bands = "[bands]\nwavelength_nm = [700, 550, 200]\n[materials.floor]\n";
  EXPECT_THAT(error(bands + "refractive_index = \"SF10\"\n"),
              AllOf(StartsWith("scene.toml:5: material 'floor'"),
                    HasSubstr("in band 2, at 200 nm, is outside of what is known, 380 to 2500 nm")));
  EXPECT_THAT(error(bands + "refractive_index = { sellmeier = [1, 0.04] }\n"),
              HasSubstr("must be positive and finite"));
  EXPECT_THAT(error(bands + "refractive_index = { cauchy = [-1] }\n"),
              HasSubstr("is -1, but must be positive"));
  EXPECT_THAT(error(bands + "refractive_index = { sellmeier = [1, 2, 3] }\n"), HasSubstr("as many C as B"));
  EXPECT_THAT(error(bands + "refractive_index = { selmeier = [1, 2] }\n"),
              HasSubstr("nearest known key is 'sellmeier'"));
  EXPECT_THAT(error(bands + "refractive_index = {}\n"),
              HasSubstr("one of the keys 'cauchy' and 'sellmeier'"));
  EXPECT_THAT(error("[bands]\nwavelength_nm = 550\n"), HasSubstr("an array with one number per band"));
  EXPECT_THAT(error("[bands]\nwavelength_nm = [550, -1, 1]\n"),
              HasSubstr("wavelength_nm -1 in band 1 is not positive"));
  EXPECT_THAT(error("[bands]\nwavelength_nm = [550, 600]\n"),
              HasSubstr("wavelength_nm of [bands] has 2 values, but"));
}

TEST_F(SceneFileTest, RejectsWrongMirrorsAndGlass) {
  EXPECT_THAT(
      error("[materials.floor]\nspecular = 0.75\n"),
      HasSubstr("material 'floor', band 0: reflectance 0.3 + specular 0.75 + transmission 0 is 1.05"));
  EXPECT_THAT(error("[materials.floor]\ntransmission = [0.1, 1.5, 0]\n"),
              AllOf(HasSubstr("scene.toml:3"), HasSubstr("transmission 1.5 in band 1 is outside [0, 1]")));
  EXPECT_THAT(
      error("[materials.floor]\nrefractive_index = -1.5\n"),
      AllOf(HasSubstr("scene.toml:3"), HasSubstr("refractive_index -1.5 is not positive and finite")));
  EXPECT_THAT(error("[materials.floor]\nrefractive_index = \"diamont\"\n"),
              AllOf(HasSubstr("scene.toml:3"), HasSubstr("'diamont'; the nearest known is 'diamond'")));
  EXPECT_THAT(error("[materials.floor]\nshininess = -1\n"), HasSubstr("shininess = -1: must be at least 0"));
}

TEST_F(SceneFileTest, ReadsEveryKey) {
  const LoadedScene loaded = read(R"(units = "cm"
[materials.floor]
reflectance = [0.7, 0.68, 0.6]
sides = "both"
[materials.lamp]
emission = [17, 12.5, 4.0]
[patches]
size = 0.1
[form_factors]
method = "hemisphere"
samples = 1024
resolution = 256
factor_tolerance = 1e-5
seed = 7
[solver]
name = "gauss-seidel"
tolerance = 1e-6
max_iterations = 50
[camera]
position = [0, 1, 3.9]
target = [0, 1, 0]
up = [0, 0, 1]
vertical_fov_deg = 35
)");
  const Scene& scene = loaded.scene;
  EXPECT_DOUBLE_EQ(scene.upper().x(), 0.02);
  EXPECT_TRUE((scene.materials()[0].reflectance == rgb(0.7, 0.68, 0.6)).all());
  EXPECT_EQ(scene.materials()[0].sides, Sides::both);
  EXPECT_TRUE((scene.materials()[1].emission == rgb(17, 12.5, 4)).all());
  EXPECT_EQ(scene.materials()[1].sides, Sides::front);
  const SceneSettings& settings = loaded.settings;
  ASSERT_TRUE(settings.patches && settings.camera);
  EXPECT_EQ(std::get<PatchSize>(*settings.patches).metres, 0.1);
  EXPECT_EQ(settings.method, "hemisphere");
  EXPECT_EQ(settings.samples, 1024);
  EXPECT_EQ(settings.resolution, 256);
  EXPECT_EQ(settings.factor_tolerance, 1e-5);
  EXPECT_EQ(settings.seed, 7U);
  EXPECT_EQ(settings.solver, "gauss-seidel");
  EXPECT_EQ(settings.tolerance, 1e-6);
  EXPECT_EQ(settings.max_iterations, 50);
  EXPECT_EQ(settings.camera->position, Vec3(0, 1, 3.9));
  EXPECT_EQ(settings.camera->target, Vec3(0, 1, 0));
  EXPECT_EQ(settings.camera->up, Vec3(0, 0, 1));
  EXPECT_EQ(settings.camera->vertical_fov_deg, 35);
}

TEST_F(SceneFileTest, TakesTheAbsorptanceInPlaceOfTheReflectance) {
  // 1 − 10⁻¹² as a double is off by 2·10⁻⁵ of 10⁻¹².
  const LoadedScene loaded = read("[materials.floor]\nabsorptance = [1e-12, 0.25, 1]\n");
  const Material& floor = loaded.scene.materials()[0];
  EXPECT_TRUE((absorptance(floor) == rgb(1e-12, 0.25, 1)).all());
  EXPECT_TRUE((floor.reflectance == rgb(1 - 1e-12, 0.75, 0)).all());
  EXPECT_THAT(
      error("[materials.floor]\nabsorptance = 0.5\nreflectance = 0.5\n"),
      AllOf(HasSubstr("scene.toml:4"), HasSubstr("material 'floor'"), HasSubstr("exclude each other")));
  EXPECT_THAT(error("[materials.floor]\nabsorptance = 1.5\n"),
              AllOf(HasSubstr("scene.toml:3"), HasSubstr("absorptance 1.5 is outside [0, 1]")));
}

TEST_F(SceneFileTest, ReadsSetUpsOfTheLamps) {
  const LoadedScene loaded = read("[setup.night]\nlamp = 0.25\n[setup.day]\n");
  ASSERT_EQ(loaded.setups.size(), 2U);
  EXPECT_EQ(loaded.setups[0].name, "day");
  EXPECT_EQ(loaded.setups[0].factors, (std::vector<double>{1, 1}));
  EXPECT_EQ(loaded.setups[1].name, "night");
  EXPECT_EQ(loaded.setups[1].factors, (std::vector<double>{1, 0.25}));
  EXPECT_THAT(error("[setup.night]\nlapm = 0.25\n"),
              AllOf(StartsWith("scene.toml:2"), HasSubstr("set-up 'night'"), HasSubstr("'lapm'"),
                    HasSubstr("'lamp'")));
  EXPECT_THAT(error("[setup.night]\nlamp = -1\n"),
              AllOf(StartsWith("scene.toml:3"), HasSubstr("at least 0")));
  EXPECT_THAT(error("[setup.night]\nlamp = 0\n"),
              AllOf(StartsWith("scene.toml:2"), HasSubstr("every lamp is off")));
  EXPECT_THAT(error("[setup.\"a/b\"]\nlamp = 1\n"),
              AllOf(StartsWith("scene.toml:2"), HasSubstr("letters, digits")));
}

TEST_F(SceneFileTest, ReadsHowTheSolverSteps) {
  const SceneSettings settings = read("[solver]\nrelaxation = 1.25\nambient = true\n").settings;
  EXPECT_EQ(settings.relaxation, 1.25);
  EXPECT_EQ(settings.ambient, true);
  EXPECT_THAT(error("[solver]\nrelaxation = 2\n"),
              AllOf(StartsWith("scene.toml:3"), HasSubstr("between 0 and 2")));
  EXPECT_THAT(error("[solver]\nambient = 1\n"),
              AllOf(StartsWith("scene.toml:3"), HasSubstr("true or false")));
}

TEST_F(SceneFileTest, ConvertsEveryUnitToMetres) {
  for (const auto& [unit, metres] :
       {std::pair{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}, {"ft", 0.3048}})
    EXPECT_DOUBLE_EQ(read(std::string("units = \"") + unit + "\"\n").scene.upper().x(), 2 * metres) << unit;
  EXPECT_THAT(error("units = \"yd\"\n"),
              StartsWith("scene.toml:2: units = \"yd\" must be one of \"m\", \"cm\""));
}

TEST_F(SceneFileTest, SpreadsPowerOverTheAreaOfTheMaterial) {
  // 2 m × 1 m in units of 1 cm: 2e-4 m².
  const LoadedScene front = read("units = \"cm\"\n[materials.floor]\npower = [2.0, 4.0, 6.0]\n");
  EXPECT_TRUE(make_patches(front.scene).mesh.materials()[0].emission.isApprox(rgb(1e4, 2e4, 3e4), 1e-12));
  const LoadedScene both = read("[materials.floor]\npower = 8\nsides = \"both\"\n");
  EXPECT_TRUE(make_patches(both.scene).mesh.materials()[0].emission.isApprox(rgb(2, 2, 2), 1e-12));
}

/// A room of 4 m × 2.5 m × 3 m with a lamp of 1 m² under its ceiling (y up) that emits 100 W downwards; the lamp's faces as given.
PatchMesh room_with_lamp(const TemporaryDirectory& directory, const std::string& faces,
                         double corner_y = 2.4) {
  directory.write(
      "lamp.obj",
      fmt::format("v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 0 2.5 0\nv 4 2.5 0\nv 4 2.5 3\nv 0 2.5 3\n"
                  "v 1.5 2.4 1\nv 2.5 {0} 1\nv 2.5 2.4 2\nv 1.5 {0} 2\n"
                  "usemtl room\nf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n"
                  "usemtl lamp\n{1}",
                  corner_y, faces));
  const auto file = directory.write("lamp.toml",
                                    "mesh = \"lamp.obj\"\n[materials.room]\nreflectance = 0.5\n"
                                    "[materials.lamp]\nreflectance = 0.5\npower = 100\n");
  return make_patches(read_scene(file).scene, PatchSize{0.5}).mesh;
}

double watts(const PatchMesh& mesh) {
  return (mesh.emission().col(0) * mesh.areas()).sum();
}

TEST(LampPower, IsThatOfOneFaceHoweverOftenItIsGiven) {
  const TemporaryDirectory directory;
  const PatchMesh once = room_with_lamp(directory, "f 9 10 11 12\n");
  EXPECT_NEAR(watts(once), 100, 1e-10);
  for (const char* faces : {"f 9 10 11 12\nf 9 10 11 12\n", "f 9 10 11 12 9 10 11 12\n",
                            "f 9 10 11 12\nf 11 12 9 10\nf 12 9 10 11\n",
                            "f 9 10 11 12\nf 9 10 11\nf 9 11 12\n", "f 9 10 11\nf 9 11 12\nf 9 10 11 12\n"}) {
    // The same patches with the same emission, so the same light.
    const PatchMesh mesh = room_with_lamp(directory, faces);
    EXPECT_EQ(mesh.vertices(), once.vertices()) << faces;
    EXPECT_TRUE((mesh.emission() == once.emission()).all()) << faces;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      EXPECT_EQ(mesh.normal(i), once.normal(i));
    }
  }
}

TEST(LampPower, IsThatOfBothFacesOfASheet) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = room_with_lamp(directory, "f 9 10 11 12\nf 12 11 10 9\n");
  EXPECT_NEAR(watts(mesh), 100, 1e-10);
  double up = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (mesh.material_of(i).name == "lamp" && mesh.normal(i).y() > 0)
      up += mesh.area(i) * mesh.emission()(i, 0);
  EXPECT_NEAR(up, 50, 1e-10);
}

TEST(LampPower, IsThatOfTheTrianglesOfATwistedFace) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = room_with_lamp(directory, "f 9 10 11 12\n", 2.0);
  EXPECT_NEAR(watts(mesh), 100, 1e-10);
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (mesh.material_of(i).name != "lamp") continue;
    EXPECT_LT(mesh.normal(i).y(), 0);
  }
}

TEST_F(SceneFileTest, ASingleNumberHoldsForAllBands) {
  const LoadedScene loaded = read("[materials.lamp]\nemission = 5\n");
  EXPECT_EQ(loaded.scene.bands(), 3);
  EXPECT_TRUE((loaded.scene.materials()[1].emission == rgb(5, 5, 5)).all());
}

TEST_F(SceneFileTest, TakesItsBandsFromItselfWhereItReplacesAllOfTheMesh) {
  EXPECT_EQ(read("[materials.floor]\nreflectance = 0.5\nemission = 0\n[materials.lamp]\nreflectance = 0\n"
                 "emission = 5\n")
                .scene.bands(),
            1);
  EXPECT_EQ(read("[materials.floor]\nreflectance = [0.1, 0.2, 0.3, 0.4]\n"
                 "[materials.lamp]\nreflectance = 0\nemission = 5\n")
                .scene.bands(),
            4);
}

TEST_F(SceneFileTest, RejectsArraysOfDifferentLengths) {
  EXPECT_THAT(error("[materials.lamp]\nreflectance = 0\nemission = [1, 2]\n"),
              AllOf(HasSubstr("scene.toml:4"), HasSubstr("emission of material 'lamp' has 2 values"),
                    HasSubstr("reflectance of material 'floor' has 3")));
}

TEST_F(SceneFileTest, RejectsUnknownKeysNamingTheNearest) {
  EXPECT_THAT(error("unit = \"m\"\n"),
              StartsWith("scene.toml:2: unknown key 'unit'; the nearest known key is 'units'"));
  EXPECT_THAT(
      error("[materials.floor]\nreflectence = 0.5\n"),
      StartsWith("scene.toml:3: unknown key 'reflectence' in [materials.floor]; the nearest known key is "
                 "'reflectance'"));
  EXPECT_THAT(error("[patches]\nsizes = 1\n"), HasSubstr("'size'"));
  EXPECT_THAT(error("[form_factors]\nsample = 1\n"), HasSubstr("'samples'"));
  EXPECT_THAT(error("[solver]\ntolerence = 1\n"), HasSubstr("'tolerance'"));
  EXPECT_THAT(error("[camera]\npositon = [0,0,0]\n"), HasSubstr("'position'"));
}

TEST_F(SceneFileTest, RejectsAMaterialThatTheMeshDoesNotHave) {
  EXPECT_THAT(error("\n[materials.flor]\nreflectance = 0.5\n"),
              AllOf(StartsWith("scene.toml:3:"), HasSubstr("'flor'"), HasSubstr("'floor'")));
}

TEST_F(SceneFileTest, DefinesMaterialsThatTheMeshOnlyNames) {
  directory_.write(
      "bare.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wall\nf 1 2 3\nusemtl lamp\nf 1 3 2\n");
  const auto good = directory_.write("good.toml",
                                     "mesh = \"bare.obj\"\n[materials.wall]\nreflectance = 0.5\n"
                                     "[materials.lamp]\nemission = 3\n");
  const LoadedScene loaded = read_scene(good);
  EXPECT_EQ(loaded.scene.materials()[0].reflectance[0], 0.5);
  EXPECT_EQ(loaded.scene.materials()[0].emission[0], 0);
  EXPECT_EQ(loaded.scene.materials()[1].reflectance[0], 0);
  EXPECT_EQ(loaded.scene.materials()[1].emission[0], 3);
  EXPECT_THAT(loaded.warnings, testing::ElementsAre(HasSubstr("'gone.mtl'")));

  const auto bad = directory_.write("bad.toml", "mesh = \"bare.obj\"\n[materials.wall]\nreflectance = 0.5\n");
  EXPECT_THAT(message_of<InputError>([&] { read_scene(bad); }),
              AllOf(HasSubstr("bare.obj:8: face 2 uses material 'lamp'"), Not(HasSubstr("nearest")),
                    HasSubstr("undefined = \"default\"")));
}

TEST_F(SceneFileTest, SuggestsANameOnlyWhereItIsNear) {
  EXPECT_THAT(error("[materials.carpet]\nreflectance = 0.5\n"),
              AllOf(HasSubstr("'carpet'; names there are 'floor' and 'lamp'"), Not(HasSubstr("nearest"))));
  EXPECT_THAT(error("luminaire = 1\n"),
              AllOf(HasSubstr("unknown key 'luminaire'; known are mesh, units"), Not(HasSubstr("nearest"))));
}

/// Faces of 1, 2, 3, … m², one for each material, which are all named and none defined.
std::string named_faces(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k)
    text += fmt::format("v 0 0 {0}\nv {1} 0 {0}\nv {1} 1 {0}\nv 0 1 {0}\nusemtl {2}\nf -4 -3 -2 -1\n", k,
                        k + 1, names[k]);
  return text;
}

class PatternTest : public SceneFileTest {
 protected:
  PatternTest() { directory_.write("mesh/room.obj", named_faces({"Glas", "Glas_1", "Glas_12", "Wand"})); }
  /// Reflectances of the four materials.
  std::vector<double> reflectances(const std::string& text) const {
    std::vector<double> result;
    const LoadedScene loaded = read(text);
    for (const Material& material : loaded.scene.materials()) result.push_back(material.reflectance[0]);
    return result;
  }
};

TEST_F(PatternTest, AStarStandsForAnyCharactersAndAQuestionMarkForOne) {
  EXPECT_EQ(
      reflectances("[materials.\"Glas*\"]\nreflectance = 0.1\n[materials.\"?and\"]\nreflectance = 0.7\n"),
      (std::vector<double>{0.1, 0.1, 0.1, 0.7}));
}

TEST_F(PatternTest, AnExactNameWinsOverAPatternAndTheLongerPatternOverTheShorter) {
  EXPECT_EQ(
      reflectances("[materials.Glas]\nreflectance = 0.1\n[materials.\"Glas*\"]\nreflectance = 0.2\n"
                   "[materials.\"Glas_??\"]\nreflectance = 0.3\n[materials.\"*\"]\nreflectance = 0.4\n"),
      (std::vector<double>{0.1, 0.2, 0.3, 0.4}));
}

TEST_F(PatternTest, TwoPatternsOfOneLengthThatBothFitAreAnError) {
  EXPECT_THAT(error("[materials.\"Gl*\"]\nreflectance = 0.1\n[materials.\"*as\"]\nreflectance = 0.2\n"
                    "[materials.\"*\"]\nreflectance = 0.4\n"),
              AllOf(HasSubstr("material 'Glas' fits both '*as' and 'Gl*'"), HasSubstr("equally long")));
  // Not where a longer one decides.
  EXPECT_EQ(reflectances("[materials.\"Gl*\"]\nreflectance = 0.1\n[materials.\"*as\"]\nreflectance = 0.2\n"
                         "[materials.\"Glas*\"]\nreflectance = 0.3\n[materials.\"*\"]\nreflectance = 0.4\n"),
            (std::vector<double>{0.3, 0.3, 0.3, 0.4}));
}

TEST_F(PatternTest, APatternThatFitsNothingIsAnError) {
  EXPECT_THAT(error("[materials.\"*\"]\nreflectance = 0.1\n[materials.\"Holz*\"]\nreflectance = 0.2\n"),
              AllOf(StartsWith("scene.toml:4"), HasSubstr("no face"), HasSubstr("'Holz*'")));
}

TEST_F(PatternTest, PowerIsThatOfAllFacesThatThePatternServes) {
  // Glas, Glas_1 and Glas_12 have 1 + 2 + 3 m²: each m² emits 2 of 12 W.
  const LoadedScene loaded = read("[materials.\"Glas*\"]\npower = 12\n[materials.Wand]\nreflectance = 0.5\n");
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_TRUE(loaded.scene.materials()[m].emits_power);
    EXPECT_DOUBLE_EQ(loaded.scene.materials()[m].emission[0], 2 * static_cast<double>(m + 1));
  }
}

TEST_F(PatternTest, SetUpsTakePatternsToo) {
  const std::string materials = "[materials.\"*\"]\nemission = 1\n";
  EXPECT_EQ(read(materials + "[setup.night]\n\"Glas*\" = 0.5\nGlas_1 = 0.25\n").setups.at(0).factors,
            (std::vector<double>{0.5, 0.25, 0.5, 1}));
  EXPECT_THAT(error(materials + "[setup.night]\n\"Holz*\" = 0.5\n"),
              HasSubstr("no face has the material 'Holz*'"));
  EXPECT_THAT(error(materials + "[setup.night]\n\"Gl*\" = 0.5\n\"*as\" = 0.5\n"),
              AllOf(HasSubstr("set-up 'night'"), HasSubstr("'Glas' fits both '*as' and 'Gl*'")));
}

TEST_F(PatternTest, UndefinedNamesMayHaveTheValuesOfDefault) {
  EXPECT_EQ(reflectances("undefined = \"default\"\n[materials.Glas]\nreflectance = 0.1\n"
                         "[materials.default]\nreflectance = 0.3\n"),
            (std::vector<double>{0.1, 0.3, 0.3, 0.3}));
  // Without that table they are as faces without a material: 0.5.
  EXPECT_EQ(reflectances("undefined = \"default\"\n"), (std::vector<double>{0.5, 0.5, 0.5, 0.5}));
  EXPECT_THAT(error("undefined = \"black\"\n"), StartsWith("scene.toml:2: undefined = \"black\" must be"));
  // Names that the mesh defines keep what it says.
  directory_.write("mesh/room.obj", "mtllib room.mtl\n" + named_faces({"floor", "Glas"}));
  EXPECT_TRUE((read("undefined = \"default\"\n[materials.default]\nreflectance = 0.1\n")
                   .scene.materials()[0]
                   .reflectance == rgb(0.3, 0.4, 0.5))
                  .all());
}

TEST_F(SceneFileTest, FlipTurnsEveryFaceOver) {
  const Scene front = read("").scene;
  const Scene back = read("flip = true\n").scene;
  for (Index f = 0; f < front.face_count(); ++f) EXPECT_EQ(back.area_vector(f), -front.area_vector(f));
  EXPECT_EQ(read("flip = false\n").scene.area_vector(0), front.area_vector(0));
}

TEST_F(SceneFileTest, SidesAtTheTopHoldForMaterialsThatDoNotSay) {
  const Scene scene = read("sides = \"both\"\n[materials.floor]\nsides = \"front\"\n").scene;
  EXPECT_EQ(scene.materials()[0].sides, Sides::front);
  EXPECT_EQ(scene.materials()[1].sides, Sides::both);
  EXPECT_THAT(error("sides = \"back\"\n"), StartsWith("scene.toml:2: sides = \"back\" must be"));
}

TEST_F(SceneFileTest, AutomaticSidesLeaveLampsOneSided) {
  const Scene scene = read("sides = \"auto\"\n").scene;
  EXPECT_EQ(scene.materials()[0].sides, Sides::automatic);
  EXPECT_EQ(scene.materials()[1].sides, Sides::front);
}

TEST_F(SceneFileTest, DoubtsSizesThatNoBuildingHas) {
  const auto floor = [&](double edge) {
    directory_.write("mesh/room.obj", fmt::format("v 0 0 0\nv {0} 0 0\nv {0} {0} 0\nf 1 2 3\n", edge));
  };
  const auto warnings = [&](const std::string& text) { return read(text).warnings; };
  const auto doubt = [](const char* text) { return testing::Contains(HasSubstr(text)); };
  floor(2000);  // diagonal 2.83 km
  EXPECT_THAT(warnings(""),
              doubt("the scene is 2.83 km across, which no building is; units = \"cm\" in a scene "
                    "file would make it 28.3 m"));
  EXPECT_THAT(warnings("units = \"cm\"\n"), Not(doubt("across")));
  floor(12000);
  EXPECT_THAT(warnings(""), doubt("units = \"mm\" in a scene file would make it 17 m"));
  floor(3);  // a room in metres of which the file says that they are millimetres
  EXPECT_THAT(warnings("units = \"mm\"\n"),
              doubt("the scene is 4.24 mm across, which no building is; units = \"m\""));
  EXPECT_THAT(warnings(""), Not(doubt("across")));
  floor(1e9);
  EXPECT_THAT(warnings(""), doubt("1.41e+06 km across, which no building is"));
}

TEST_F(SceneFileTest, RejectsValuesOutOfRangeNamingLineMaterialValueAndRule) {
  EXPECT_THAT(error("[materials.floor]\nreflectance = 1.2\n"),
              StartsWith("scene.toml:3: material 'floor': reflectance 1.2 is outside [0, 1]"));
  EXPECT_THAT(error("[materials.floor]\nreflectance = [0.1,\n -0.5, 0.1]\n"),
              StartsWith("scene.toml:4: material 'floor': reflectance -0.5 in band 1 is outside [0, 1]"));
  EXPECT_THAT(error("[materials.floor]\nreflectance = nan\n"), HasSubstr("nan is outside [0, 1]"));
  EXPECT_THAT(error("[materials.lamp]\nemission = -1\n"),
              StartsWith("scene.toml:3: material 'lamp': emission -1 is negative or not finite"));
  EXPECT_THAT(error("[materials.lamp]\npower = inf\n"), HasSubstr("power inf is negative or not finite"));
  EXPECT_THAT(error("[materials.lamp]\nemission = []\n"), HasSubstr("emission has no numbers"));
  EXPECT_THAT(error("[patches]\nsize = 0\n"),
              StartsWith("scene.toml:3: [patches] size = 0: must be positive"));
  EXPECT_THAT(error("[form_factors]\nsamples = 0\n"), StartsWith("scene.toml:3: [form_factors] samples = 0"));
  EXPECT_THAT(error("[form_factors]\nsamples = 3000000000\n"), HasSubstr("samples = 3000000000"));
  EXPECT_THAT(error("[form_factors]\nseed = -1\n"), HasSubstr("seed = -1"));
  EXPECT_THAT(error("[solver]\ntolerance = 0.0\n"), HasSubstr("tolerance = 0"));
  EXPECT_THAT(error("[camera]\nposition = [0,0,0]\ntarget = [0,0,1]\nvertical_fov_deg = 180\n"),
              StartsWith("scene.toml:5: [camera] vertical_fov_deg = 180: must be between 0 and 180"));
}

TEST_F(SceneFileTest, RejectsWrongTypesNamingKeyLineAndWhatWasExpected) {
  EXPECT_THAT(error("units = 3\n"), StartsWith("scene.toml:2: units is an integer, but must be a string"));
  EXPECT_THAT(error("materials = 3\n"),
              StartsWith("scene.toml:2: materials is an integer, but must be a table"));
  EXPECT_THAT(error("[materials]\nfloor = 0.5\n"), StartsWith("scene.toml:3: [materials] floor is a number"));
  EXPECT_THAT(
      error("[materials.floor]\nreflectance = \"grey\"\n"),
      StartsWith(
          "scene.toml:3: [materials.floor] reflectance is a string, but must be a number or an array"));
  EXPECT_THAT(error("[materials.floor]\nreflectance = [0.1, true]\n"), HasSubstr("is a boolean"));
  EXPECT_THAT(
      error("[materials.floor]\nsides = \"back\"\n"),
      StartsWith("scene.toml:3: material 'floor': sides = \"back\" must be \"front\", \"both\" or \"auto\""));
  EXPECT_THAT(error("[patches]\nsize = true\n"),
              HasSubstr("must be a number of metres, \"none\" or \"auto\""));
  EXPECT_THAT(error("[patches]\nsize = \"fine\"\n"), HasSubstr("size = \"fine\""));
  EXPECT_THAT(error("[form_factors]\nsamples = 10.5\n"),
              HasSubstr("samples is a number, but must be an integer"));
  EXPECT_THAT(error("[camera]\nposition = [0, 1]\ntarget = [0,0,0]\n"),
              StartsWith("scene.toml:3: [camera] position must be an array of three finite numbers"));
  EXPECT_THAT(error("[camera]\nposition = [0, 1, 2]\n"),
              StartsWith("scene.toml:2: [camera] needs the key 'target'"));
}

TEST_F(SceneFileTest, RejectsEmissionTogetherWithPower) {
  EXPECT_THAT(error("[materials.lamp]\nemission = 1\npower = 2\n"),
              AllOf(StartsWith("scene.toml:4: material 'lamp'"), HasSubstr("exclude each other")));
}

TEST_F(SceneFileTest, ReadsThePatchSizesThatAreWords) {
  EXPECT_TRUE(std::holds_alternative<KeepFaces>(*read("[patches]\nsize = \"none\"\n").settings.patches));
  EXPECT_TRUE(std::holds_alternative<AutoPatches>(*read("[patches]\nsize = \"auto\"\n").settings.patches));
}

TEST_F(SceneFileTest, SaysWhereItIsNotToml) {
  EXPECT_THAT(error<IoError>("[solver\n"), StartsWith("scene.toml:2: is not TOML"));
}

TEST_F(SceneFileTest, NeedsAMeshThatIsThere) {
  const auto none = directory_.write("none.toml", "units = \"m\"\n");
  EXPECT_EQ(message_of<InputError>([&] { read_scene(none); }),
            none.string() + ": the key 'mesh' is missing, and there are no [shapes]: mesh = \"FILE\"");
  const auto gone = directory_.write("gone.toml", "mesh = \"gone.obj\"\n");
  EXPECT_EQ(message_of<IoError>([&] { read_scene(gone); }),
            (directory_ / "gone.obj").string() + ": no such file");
  const auto self = directory_.write("self.toml", "mesh = \"self.toml\"\n");
  EXPECT_THAT(message_of<InputError>([&] { read_scene(self); }), StartsWith(self.string()));
}

TEST_F(SceneFileTest, AMeshThatEmitsNothingSaysHowToAddALamp) {
  const auto file = directory_.write("dark.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const LoadedScene loaded = read_scene(file);
  EXPECT_THAT(message_of<InputError>([&] { require_emission(loaded.scene, file); }),
              AllOf(StartsWith(file.string()), HasSubstr("Ke "), HasSubstr("[materials.default]"),
                    HasSubstr("emission ="), HasSubstr("power =")));
  // A scene file need not be told to make one.
  EXPECT_THAT(message_of<InputError>([&] { require_emission(loaded.scene, "dark.toml"); }),
              AllOf(HasSubstr("[materials.default]"), Not(HasSubstr("Ke "))));
  EXPECT_NO_THROW(require_emission(read("").scene, "x"));
}

/// The floor is 2 × 1 and the lamp above it, both at z from −1 to 0.
TEST_F(SceneFileTest, ReadsASymmetry) {
  EXPECT_TRUE(read("").scene.symmetry().none());
  // Metres, whatever the units of the mesh.
  const Symmetry symmetry =
      read("units = \"cm\"\n[symmetry]\nplanes = [\"x = 0\", \"z=-0.01\"]\nperiod = [0, 3, 0]\nsteps = 7\n")
          .scene.symmetry();
  ASSERT_EQ(symmetry.planes.size(), 2U);
  EXPECT_EQ(symmetry.planes[0].axis, 0);
  EXPECT_EQ(symmetry.planes[1].axis, 2);
  EXPECT_EQ(symmetry.planes[1].offset, -0.01);
  EXPECT_EQ(symmetry.period, Vec3(0, 3, 0));
  EXPECT_EQ(symmetry.steps, 7);
  // Without a number: that of the rule. The box is 2 × 1 × 1, mirrored 4 × 1 × 1: √17 · 4 · 2 / (π s³) = 10⁻³ at s = 21.9.
  EXPECT_EQ(read("[symmetry]\nplanes = [\"x = 2\"]\nperiod = [0, 5, 0]\n").scene.symmetry().steps, 5);
}

TEST_F(SceneFileTest, RefusesASymmetryThatIsNone) {
  const auto of = [&](const std::string& text) { return error("[symmetry]\n" + text); };
  EXPECT_THAT(error("[symmetry]\n"),
              StartsWith("scene.toml:2: [symmetry] needs the key 'planes' or 'period'"));
  EXPECT_THAT(of("plane = [\"x = 0\"]\n"),
              AllOf(StartsWith("scene.toml:3: unknown key 'plane'"), HasSubstr("'planes'")));
  EXPECT_THAT(of("planes = \"x = 0\"\n"),
              StartsWith("scene.toml:3: [symmetry] planes is a string, but must be"));
  EXPECT_THAT(of("planes = [0]\n"), StartsWith("scene.toml:3: [symmetry] planes is an integer, but must be"));
  EXPECT_THAT(of("planes = [\"x 0\"]\n"),
              StartsWith("scene.toml:3: [symmetry] planes: \"x 0\" is no plane such as"));
  EXPECT_THAT(of("period = [0, 0, 0]\n"), StartsWith("scene.toml:3: [symmetry] period 0 0 0 is none"));
  EXPECT_THAT(of("planes = [\"x = 0\"]\nsteps = 3\n"),
              StartsWith("scene.toml:4: [symmetry] steps needs the key 'period'"));
  EXPECT_THAT(of("period = [9, 0, 0]\nsteps = 0\n"),
              StartsWith("scene.toml:4: [symmetry] steps = 0: must be from 1"));
  EXPECT_THAT(of("planes = [\"x = 1\"]\n"),
              StartsWith("scene.toml:2: symmetry: face 0 crosses the plane x = 1"));
  EXPECT_THAT(of("planes = [\"y = 0\"]\n"),
              StartsWith("scene.toml:2: symmetry: face 0 lies in the plane y = 0"));
}

}  // namespace
}  // namespace radiosity::test
