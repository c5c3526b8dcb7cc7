// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/pipeline.hpp"

#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "io/files.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/light.hpp"
#include "radiosity/rendering/render.hpp"
#include "radiosity/rendering/tone_map.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

/// The closed unit cube from within, in one band; the wall at the largest y emits E.
PatchMesh lit_cube(double emission, double reflectance) {
  const PatchMesh cube = room({0, 0, 0}, {1, 1, 1}, false);
  PatchMesh::Arrays arrays;
  arrays.vertices = cube.vertices();
  for (Index i = 0; i < cube.patch_count(); ++i) {
    const auto corners = cube.corners(i);
    arrays.corners.insert(arrays.corners.end(), corners.begin(), corners.end());
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(i);
    arrays.patch_material.push_back(i == 3 ? 1 : 0);
  }
  const BandValues rho = BandValues::Constant(1, reflectance);
  arrays.materials = {material("wall", rho, BandValues::Zero(1)),
                      material("lamp", rho, BandValues::Constant(1, emission))};
  return PatchMesh(std::move(arrays));
}

ViewScene lit_scene() {
  const auto mesh = std::make_shared<const PatchMesh>(lit_cube(3, 0.5));
  BandArray values(mesh->vertex_count(), 1);
  for (Index v = 0; v < mesh->vertex_count(); ++v) values(v, 0) = 1 + v % 5;
  return {mesh, values, lights_of_emitters(*mesh), ambient_irradiance(*mesh)};
}

Camera inside() {
  Camera camera;
  camera.position = {0.3, 0.4, 0.9};
  camera.target = {0.5, 0.5, 0};
  camera.vertical_fov_deg = 80;
  return camera;
}

TEST(Pipelines, AreFoundByTheirNames) {
  std::set<std::string_view> names;
  for (const PipelineInfo& info : pipelines()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_EQ(&find_pipeline(info.name), &info);
    EXPECT_FALSE(info.summary.empty());
    EXPECT_FALSE(info.citation.empty());
  }
  EXPECT_THAT(message_of<InputError>([] { find_pipeline("z-buffer"); }),
              testing::HasSubstr("there are radiosity"));
}

TEST(Pipelines, DrawEverySceneOfTheRepository) {
  for (const auto& entry : std::filesystem::directory_iterator(RADIOSITY_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    const std::string name = entry.path().stem();
    const LoadedScene loaded = read_scene(entry.path());
    const auto mesh =
        std::make_shared<const PatchMesh>(make_patches(loaded.scene, KeepFaces{}).mesh.unfolded());
    const Camera camera = loaded.settings.camera ? *loaded.settings.camera : automatic_camera(*mesh);
    for (const PipelineInfo& info : pipelines()) {
      const ViewScene scene{mesh, BandArray::Ones(mesh->vertex_count(), mesh->bands()),
                            lights_of_emitters(*mesh), ambient_irradiance(*mesh)};
      const LinearImage image = info.make(scene)->draw(camera, {.width = 40, .height = 30, .samples = 2});
      EXPECT_TRUE(image.radiosity.isFinite().all()) << name << ", " << info.name;
      EXPECT_GE(image.radiosity.minCoeff(), 0) << name << ", " << info.name;
      // Much of each picture is lit: the camera looks at it. Two paths may find nothing.
      EXPECT_GT((image.radiosity.rowwise().maxCoeff() > 0).count(), 300) << name << ", " << info.name;
      const bool casts = info.solved || info.random || info.recursive;
      EXPECT_EQ(image.rays >= 2 * 40 * 30, casts) << name << ", " << info.name;
    }
  }
}

TEST(Pipelines, RefuseOneCellOfASymmetricScene) {
  const LoadedScene corridor = read_scene(RADIOSITY_SOURCE_DIR "/scenes/corridor.toml");
  const auto cell = std::make_shared<const PatchMesh>(make_patches(corridor.scene, KeepFaces{}).mesh);
  for (const PipelineInfo& info : pipelines())
    EXPECT_THROW(info.make({cell, BandArray::Ones(cell->vertex_count(), cell->bands())}), InputError)
        << info.name;
}

TEST(Pipelines, GiveTheSameBitsOnAnyNumberOfThreadsAndWithCoarseImagesFirst) {
  const DrawOptions plain{.width = 23, .height = 17, .samples = 3, .standard_error = true};
  for (const PipelineInfo& info : pipelines()) {
    const auto pipeline = info.make(lit_scene());
    const LinearImage image = pipeline->draw(inside(), plain);
    EXPECT_TRUE(image.completed);
    EXPECT_EQ(image.samples, 3);
    EXPECT_GT(image.radiosity.minCoeff(), 0) << info.name;  // a closed room
    const ThreadLimit limit(1);
    std::vector<Index> samples;
    DrawOptions watched = plain;
    watched.refined = [&](const LinearImage& shown) {
      samples.push_back(shown.samples);
      EXPECT_EQ(shown.radiosity.rows(), 23 * 17);
      return true;
    };
    const LinearImage refined = pipeline->draw(inside(), watched);
    EXPECT_TRUE((refined.radiosity == image.radiosity).all()) << info.name;
    EXPECT_TRUE((*refined.standard_error == *image.standard_error).all()) << info.name;
    EXPECT_EQ(samples, (std::vector<Index>{0, 0, 1, 2, 3}));
  }
}

TEST(Pipelines, StopWithTheBestImageWhenAsked) {
  for (const PipelineInfo& info : pipelines()) {
    const auto pipeline = info.make(lit_scene());
    const LinearImage one = pipeline->draw(inside(), {.width = 8, .height = 8, .samples = 1});
    for (int calls = 1; calls <= 5; ++calls) {
      int left = calls;
      LinearImage best;
      const LinearImage image = pipeline->draw(
          inside(), {.width = 8, .height = 8, .samples = 3, .refined = [&](const LinearImage& shown) {
                       best = shown;
                       return --left > 0;
                     }});
      EXPECT_EQ(image.completed, calls == 5);
      EXPECT_EQ(image.samples, std::max(0, calls - 2));
      EXPECT_TRUE((image.radiosity == best.radiosity).all());
    }
    EXPECT_EQ(one.samples, 1);
  }
}

// Asked for the first time in the second pass: what is left is the first.
TEST(Pipelines, StopWithinAPass) {
  for (const PipelineInfo& info : pipelines()) {
    if (info.solved) continue;  // its passes are short
    const auto pipeline = info.make(lit_scene());
    const DrawOptions one{.width = 8, .height = 64, .samples = 1};
    DrawOptions two = one;
    two.samples = 2;
    std::atomic<int> asked = 0;
    two.stop = [&] { return ++asked > 3; };
    const LinearImage first = pipeline->draw(inside(), one), image = pipeline->draw(inside(), two);
    EXPECT_FALSE(image.completed);
    EXPECT_EQ(image.samples, 1);
    EXPECT_GT(asked, 3);
    // Its place in the pixel is another one than that of a single sample.
    EXPECT_EQ(image.radiosity.rows(), first.radiosity.rows());
    EXPECT_GT(image.radiosity.minCoeff(), 0);
    LinearImage coarse;
    two.refined = [&](const LinearImage& shown) {
      if (shown.samples == 0) coarse = shown;
      return true;
    };
    asked = 0;
    const LinearImage best = pipeline->draw(inside(), two);
    EXPECT_EQ(best.samples, 0);
    EXPECT_FALSE(best.completed);
    EXPECT_TRUE((best.radiosity == coarse.radiosity).all());
  }
}

TEST(Pipelines, RefuseWhatCannotBeDrawn) {
  for (const PipelineInfo& info : pipelines()) {
    const auto pipeline = info.make(lit_scene());
    EXPECT_THROW(pipeline->draw(inside(), {.width = 0}), InputError);
    EXPECT_THROW(pipeline->draw(inside(), {.height = -1}), InputError);
    EXPECT_THROW(pipeline->draw(inside(), {.samples = 0}), InputError);
    EXPECT_THROW(pipeline->draw(inside(), {.samples = 1, .standard_error = true}), InputError);
    EXPECT_THROW(info.make({}), InputError);
    ViewScene scene = lit_scene();
    if (info.solved) {
      scene.vertex_radiosity.reset();
      EXPECT_THAT(message_of<InputError>([&] { info.make(scene); }), testing::HasSubstr("shows a solution"));
    }
    scene.vertex_radiosity = BandArray::Ones(3, 1);
    EXPECT_THROW(info.make(scene), InputError);
    scene = lit_scene();
    scene.ambient = BandValues::Ones(2);
    EXPECT_THROW(info.make(scene), InputError);
    scene = lit_scene();
    scene.lights[0].intensity[0] = -1;
    EXPECT_THAT(message_of<InputError>([&] { info.make(scene); }), testing::HasSubstr("light 'lamp'"));
  }
}

/// The closed unit cube from outside: inside of it is matter.
ViewScene solid(Material finish) {
  const PatchMesh cube = room({0, 0, 0}, {1, 1, 1}, false);
  PatchMesh::Arrays arrays;
  arrays.vertices = cube.vertices();
  for (Index i = 0; i < cube.patch_count(); ++i) {
    const auto corners = cube.corners(i);
    arrays.corners.insert(arrays.corners.end(), corners.rbegin(), corners.rend());
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(i);
    arrays.patch_material.push_back(0);
  }
  arrays.materials = {std::move(finish)};
  const auto mesh = std::make_shared<const PatchMesh>(std::move(arrays));
  return {mesh, BandArray::Ones(mesh->vertex_count(), 1), lights_of_emitters(*mesh), {}};
}

TEST(Pipelines, RefuseAnEyeInMatter) {
  const Material concrete = material("concrete", BandValues::Constant(1, 0.5), BandValues::Constant(1, 1));
  Camera camera = inside();
  camera.name = "door";
  const DrawOptions small{.width = 8, .height = 8, .samples = 1};
  for (const PipelineInfo& info : pipelines())
    EXPECT_THAT(message_of<InputError>([&] { info.make(solid(concrete))->draw(camera, small); }),
                testing::AllOf(testing::StartsWith("camera 'door': at 0.3 0.4 0.9 it is inside"),
                               testing::HasSubstr("0.1 m away of material 'concrete' (face 5)")))
        << info.name;
  // In glass it is not, and outside of a room whose walls show their backs it is not either, although all that it sees is black.
  Material glass = concrete;
  glass.reflectance.setZero();
  glass.transmission = BandValues::Constant(1, 1);
  camera.position.z() = 3;
  for (const PipelineInfo& info : pipelines()) {
    EXPECT_NO_THROW(info.make(solid(glass))->draw(inside(), small));
    EXPECT_TRUE((info.make(lit_scene())->draw(camera, small).radiosity == 0).all()) << info.name;
  }
}

// Air of 1/e in 2 m, a wall that emits 3 at 0.9 m and more.
TEST(Pipelines, OfLocalLightingSeeThroughAirThatAbsorbs) {
  const auto wall = std::make_shared<const PatchMesh>(
      one_patch({{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, 1)
          .with_materials({material("wall", BandValues::Constant(1, 0.0), BandValues::Constant(1, 3))}));
  Camera camera;
  camera.position = {1, 1, 0.9};
  camera.vertical_fov_deg = 90;
  camera.target = {1, 1, 0};
  for (const PipelineInfo& info : pipelines()) {
    if (!info.local) continue;
    const LinearImage image =
        info.make({wall}, {.attenuation_length = 2})->draw(camera, {.width = 3, .height = 1, .samples = 1});
    EXPECT_NEAR(image.radiosity(1, 0), 3 * std::exp(-0.45), 1e-12) << info.name;
    // The middle of the next pixel is one pixel, that is 2 · 0.9 m, aside.
    EXPECT_NEAR(image.radiosity(2, 0), 3 * std::exp(-0.9 * std::sqrt(5.0) / 2), 1e-12) << info.name;
    EXPECT_THROW(info.make({wall}, {.attenuation_length = 0}), InputError);
  }
}

// The edge x = 0 of a half-plane over the middle of a pixel that n samples divide into n columns: half of them, or one less or more.
TEST(Pipelines, SpreadSamplesOverThePixel) {
  const auto half =
      std::make_shared<const PatchMesh>(one_patch({{-9, -9, 0}, {0, -9, 0}, {0, 9, 0}, {-9, 9, 0}}, 1));
  Camera camera;
  camera.position = {0, 0, 1};
  camera.vertical_fov_deg = 90;
  const auto pipeline = find_pipeline("radiosity").make({half, BandArray::Ones(4, 1)});
  for (const Index n : {2, 4, 5, 16, 64}) {
    for (const double roll : {0.0, 90.0, 180.0, 270.0}) {
      camera.up = {std::sin(roll * pi / 180), std::cos(roll * pi / 180), 0};
      const double seen = pipeline->draw(camera, {.width = 1, .height = 1, .samples = n}).radiosity(0, 0);
      EXPECT_NEAR(seen * static_cast<double>(n), static_cast<double>(n) / 2, n % 2 == 0 ? 1e-9 : 0.5 + 1e-9);
    }
  }
}

TEST(Pipelines, TellTheStandardErrorOfTheMean) {
  // Half of four samples see 1, half 0: s² = 1/3, so that of the mean is √(1/12).
  const auto half =
      std::make_shared<const PatchMesh>(one_patch({{-9, -9, 0}, {0, -9, 0}, {0, 9, 0}, {-9, 9, 0}}, 1));
  Camera camera;
  camera.position = {0, 0, 1};
  const auto pipeline = find_pipeline("radiosity").make({half, BandArray::Ones(4, 1)});
  const LinearImage image =
      pipeline->draw(camera, {.width = 1, .height = 1, .samples = 4, .standard_error = true});
  EXPECT_NEAR((*image.standard_error)(0, 0), std::sqrt(1.0 / 12), 1e-15);
}

TEST(AutomaticExposure, OfAnImageLeavesATenthOfThePixelsAboveNearWhite) {
  LinearImage image{10, 1, BandArray::Zero(10, 2)};
  for (Index k = 0; k < 10; ++k) image.radiosity(k, k % 2) = 10 - k;
  EXPECT_DOUBLE_EQ(automatic_exposure(image), 0.8 / 9);
  image.radiosity.setZero();
  EXPECT_EQ(automatic_exposure(image), 1);
}

// From an area A that emits E, on its axis: E A / (π d² + A), the factor to a disk [Howell]: r² / (r² + d²).
TEST(Lights, OfAnEmitterGiveTheIrradianceOfADiskOnItsAxis) {
  const PatchMesh cube = lit_cube(3, 0.5);
  const std::vector<Light> lights = lights_of_emitters(cube);
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_EQ(lights[0].name, "lamp");
  EXPECT_TRUE(lights[0].position.isApprox(Vec3(0.5, 1, 0.5), 1e-15));
  const double r2 = 1 / pi;
  for (const double d : {0.0, 0.1, 1.0}) {
    const Arriving light = arriving(lights[0], {0.5, 1 - d, 0.5});
    EXPECT_NEAR(light.share * lights[0].intensity[0], 3 * r2 / (r2 + d * d), 1e-15);
    EXPECT_TRUE(light.to.isApprox(Vec3(0, 1, 0)));
    EXPECT_DOUBLE_EQ(light.distance, d);
  }
  // Aside by 45°: the cosine at the lamp, and twice the distance squared.
  EXPECT_NEAR(arriving(lights[0], {1, 0.5, 0.5}).share, std::sqrt(0.5) / (r2 + 0.5), 1e-15);
  EXPECT_EQ(arriving(lights[0], {0.5, 2, 0.5}).share, 0);  // behind it
}

TEST(Lights, FollowTheirAttenuationAndDirection) {
  const Light point{
      .name = "p", .position = {1, 2, 3}, .intensity = BandValues::Ones(1), .attenuation = {1, 2, 3}};
  EXPECT_DOUBLE_EQ(arriving(point, {1, 2, 1}).share, 1.0 / (1 + 2 * 2 + 3 * 4));
  const Light sun{.name = "s",
                  .kind = LightKind::directional,
                  .direction = {0, -0.6, 0.8},
                  .intensity = BandValues::Ones(1)};
  EXPECT_EQ(arriving(sun, {1, 1, 1}).share, 1);
  EXPECT_TRUE(arriving(sun, {1, 1, 1}).to.isApprox(Vec3(0, 0.6, -0.8)));
  Light bad = sun;
  bad.direction *= 2;
  EXPECT_THAT(message_of<InputError>([&] { validate(bad, 1); }),
              testing::HasSubstr("light 's': direction 0 -1.2 1.6"));
  bad = point;
  bad.attenuation = {0, 0, 0};
  EXPECT_THAT(message_of<InputError>([&] { validate(bad, 1); }), testing::HasSubstr("not all 0"));
  EXPECT_THAT(message_of<InputError>([&] { validate(point, 3); }), testing::HasSubstr("1 bands"));
}

// s by the formula, and its integral by a midpoint rule.
TEST(Lights, OfSpotsFallOverTheirCone) {
  Light spot{.name = "s", .kind = LightKind::spot, .intensity = BandValues::Ones(1), .exponent = 0};
  const auto cosine = [](double degrees) { return std::cos(degrees * pi / 180); };
  EXPECT_NEAR(solid_angle(spot), 2 * pi, 1e-15);
  spot.cos_inner = spot.cos_outer = cosine(30);
  EXPECT_EQ(spot_share(spot, cosine(29.9)), 1);
  EXPECT_EQ(spot_share(spot, cosine(30.1)), 0);
  EXPECT_NEAR(solid_angle(spot), 2 * pi * (1 - cosine(30)), 1e-15);
  for (const double exponent : {0.0, 1.0, 3.5}) {
    spot.exponent = exponent;
    spot.cos_inner = cosine(20);
    spot.cos_outer = cosine(50);
    const double middle = (spot.cos_inner + spot.cos_outer) / 2;
    EXPECT_NEAR(spot_share(spot, middle), std::pow(middle, exponent) / 2, 1e-15);
    constexpr int kSteps = 100000;
    double sum = 0;
    for (int k = 0; k < kSteps; ++k) sum += 2 * pi * spot_share(spot, (k + 0.5) / kSteps) / kSteps;
    EXPECT_NEAR(solid_angle(spot), sum, 1e-6);
  }
  std::swap(spot.cos_inner, spot.cos_outer);
  EXPECT_THAT(message_of<InputError>([&] { validate(spot, 1); }), testing::HasSubstr("cosines of its cone"));
}

/// A floor with ρ = 0.5, small enough for lighting of its vertices, in the plane z = 0 about (1, 0, 0), and what more is there.
ViewScene lit_floor(std::vector<Light> lights, const std::vector<std::vector<Vec3>>& loops = {},
                    const Material& finish = {}) {
  PatchMesh::Arrays arrays;
  const auto add = [&](const std::vector<Vec3>& loop, Index m) {
    for (const Vec3& x : loop) {
      arrays.corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(static_cast<Index>(arrays.patch_surface.size()));
    arrays.patch_material.push_back(m);
  };
  constexpr double kHalf = 1e-4;
  add({{1 - kHalf, -kHalf, 0}, {1 + kHalf, -kHalf, 0}, {1 + kHalf, kHalf, 0}, {1 - kHalf, kHalf, 0}}, 0);
  arrays.materials = {material("floor", BandValues::Constant(1, 0.5), BandValues::Zero(1))};
  if (!loops.empty()) arrays.materials.push_back(finish);
  for (const auto& loop : loops) add(loop, 1);
  return {std::make_shared<const PatchMesh>(std::move(arrays)), {}, std::move(lights), {}};
}

double at_floor(const PipelineInfo& info, const ViewScene& scene) {
  Camera camera;
  camera.position = {1, 0, 3};
  camera.target = {1, 0, 0};
  camera.vertical_fov_deg = 1e-4;
  return info.make(scene)->draw(camera, {.width = 1, .height = 1, .samples = 1}).radiosity(0, 0);
}

// From (0, 0, 1): 45° aside of both normal and axis, d² = 2.
TEST(Lights, ShineInAllPipelinesThatLight) {
  Light point{.name = "p", .position = {0, 0, 1}, .intensity = BandValues::Constant(1, 8)};
  Light spot = point;
  spot.kind = LightKind::spot;
  spot.exponent = 2;
  Light sun = point;
  sun.kind = LightKind::directional;
  sun.direction = Vec3(3, 0, -4) / 5;
  const double cosine = std::sqrt(0.5);
  for (const PipelineInfo& info : pipelines()) {
    if (info.solved) continue;
    EXPECT_NEAR(at_floor(info, lit_floor({point})), 0.5 * 8 * cosine / 2, 1e-3) << info.name;
    EXPECT_NEAR(at_floor(info, lit_floor({spot})), 0.5 * 8 * cosine / 2 / 2, 1e-3) << info.name;
    EXPECT_NEAR(at_floor(info, lit_floor({sun})), 0.5 * 8 * 0.8, 1e-12) << info.name;
    EXPECT_NEAR(at_floor(info, lit_floor({point, sun})), 0.5 * 8 * (cosine / 2 + 0.8), 1e-3) << info.name;
  }
}

TEST(Lights, AreKeptAwayByWhatStandsInTheirWay) {
  const Light point{.name = "p", .position = {0, 0, 1}, .intensity = BandValues::Constant(1, 8)};
  const double free = 0.5 * 8 * std::sqrt(0.5) / 2;
  const std::vector<Vec3> across{{0.4, -1, 0.5}, {0.6, -1, 0.5}, {0.6, 1, 0.5}, {0.4, 1, 0.5}};
  const std::vector<Vec3> back(across.rbegin(), across.rend());
  const Material wall = material("wall", BandValues::Constant(1, 0.0), BandValues::Zero(1));
  Material glass = wall;
  glass.transmission = BandValues::Constant(1, 0.75);
  for (const char* name : {"ray-tracing", "path-tracing"}) {
    const PipelineInfo& info = find_pipeline(name);
    EXPECT_EQ(at_floor(info, lit_floor({point}, {across}, wall)), 0) << name;
    EXPECT_NEAR(at_floor(info, lit_floor({point}, {across, back}, glass)), 0.75 * free, 1e-3)
        << name;                                                                                  // a sheet
    EXPECT_NEAR(at_floor(info, lit_floor({point}, {across}, glass)), 0.75 * free, 1e-3) << name;  // index 1
  }
  // Paths do not find a point through what refracts.
  glass.refractive_index = 1.5;
  EXPECT_NEAR(at_floor(find_pipeline("ray-tracing"), lit_floor({point}, {across}, glass)), 0.75 * free, 1e-3);
  EXPECT_EQ(at_floor(find_pipeline("path-tracing"), lit_floor({point}, {across}, glass)), 0);
}

// What the lamp gives is in the solution, what the light gives is not.
TEST(Lights, ThatAreNoSurfacesAreAddedToASolution) {
  Light light{.name = "p", .position = {0, 0, 1}, .intensity = BandValues::Constant(1, 8)};
  const auto over = [&](std::vector<Light> lights) {
    ViewScene scene = lit_floor(std::move(lights));
    scene.vertex_radiosity = BandArray::Constant(4, 1, 7);
    return at_floor(find_pipeline("ray-tracing"), scene);
  };
  EXPECT_NEAR(over({light}), 7 + 0.5 * 8 * std::sqrt(0.5) / 2, 1e-3);
  light.surface = true;
  EXPECT_NEAR(over({light}), 7, 1e-12);
}

// Ē = 3/6, ρ̄ = 1/2: H_a = ½ · ½ / ½. With the mean direct irradiance Ē it is the furnace's 1 W/m² = Ē / (1 − ρ̄).
TEST(Lights, AmbientIrradianceIsThatOfAnEvenlyLitRoom) {
  EXPECT_DOUBLE_EQ(ambient_irradiance(lit_cube(3, 0.5))[0], 0.5);
  EXPECT_EQ(ambient_irradiance(lit_cube(3, 1))[0], 0);
  // A point light of the same power, 3 W, and one that has none.
  Light light{.intensity = BandValues::Constant(1, 3 / (4 * pi))};
  EXPECT_NEAR(ambient_irradiance(lit_cube(0, 0.5), std::array{light})[0], 0.5, 1e-15);
  light.attenuation = {1, 0, 0};
  EXPECT_EQ(ambient_irradiance(lit_cube(0, 0.5), std::array{light})[0], 0);
}

TEST(VertexNormals, AreTheMeanOfWhatMeetsAtTheVertex) {
  // The corner of a cube, its faces sharing vertices: the one in the middle looks along the diagonal.
  PatchMesh::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  arrays.corners = {0, 1, 2, 3, 0, 4, 5, 1, 0, 3, 6, 4};
  arrays.patch_start = {0, 4, 8, 12};
  arrays.patch_surface = {0, 1, 2};
  arrays.patch_material = {0, 0, 0};
  arrays.materials = {material("wall", BandValues::Constant(1, 0.5), BandValues::Zero(1))};
  const std::vector<Vec3> normals = vertex_normals(PatchMesh(std::move(arrays)));
  EXPECT_TRUE(normals[0].isApprox(Vec3(1, 1, 1).normalized()));
  EXPECT_TRUE(normals[1].isApprox(Vec3(0, 1, 1).normalized()));
  EXPECT_TRUE(normals[2].isApprox(Vec3(0, 0, 1)));
}

}  // namespace
}  // namespace radiosity::test
