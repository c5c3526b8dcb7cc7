// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "io/files.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/io/refractive_index.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/scene.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/rendering/pipeline.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

/// Polygons with materials of one band; closed boxes and spheres have their fronts outside.
class Model {
 public:
  Index add(Material m) {
    m.name += std::to_string(arrays_.materials.size());
    arrays_.materials.push_back(std::move(m));
    return static_cast<Index>(arrays_.materials.size()) - 1;
  }
  void face(const std::vector<Vec3>& loop, Index m) {
    std::vector<Index> corners;
    for (const Vec3& x : loop) {
      corners.push_back(static_cast<Index>(arrays_.vertices.size()));
      arrays_.vertices.push_back(x);
    }
    arrays_.add_face(corners, m);
  }
  void box(const Vec3& a, const Vec3& b, Index m, bool inwards = false) {
    const auto first = static_cast<Index>(arrays_.vertices.size());
    for (int k = 0; k < 8; ++k)
      arrays_.vertices.emplace_back((k & 1) ? b.x() : a.x(), (k & 2) ? b.y() : a.y(),
                                    (k & 4) ? b.z() : a.z());
    for (std::array<Index, 4> wall : std::array<std::array<Index, 4>, 6>{
             {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}}) {
      for (Index& v : wall) v += first;
      if (inwards) std::reverse(wall.begin(), wall.end());
      arrays_.add_face(wall, m);
    }
  }
  /// 2 · n² triangles and quads.
  void sphere(const Vec3& centre, double radius, int n, Index m) {
    const auto first = static_cast<Index>(arrays_.vertices.size());
    const auto at = [&](int i, int j) {  // ring i of n, meridian j of 2n
      return i == 0 ? first : i == n ? first + 1 : first + 2 + (i - 1) * 2 * n + j % (2 * n);
    };
    arrays_.vertices.push_back(centre + radius * Vec3::UnitZ());
    arrays_.vertices.push_back(centre - radius * Vec3::UnitZ());
    for (int i = 1; i < n; ++i)
      for (int j = 0; j < 2 * n; ++j) {
        const double theta = pi * i / n, phi = pi * j / n;
        arrays_.vertices.push_back(centre + radius * Vec3(std::sin(theta) * std::cos(phi),
                                                          std::sin(theta) * std::sin(phi), std::cos(theta)));
      }
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < 2 * n; ++j) {
        if (i == 0)
          arrays_.add_face(std::array{at(0, j), at(1, j), at(1, j + 1)}, m);
        else if (i == n - 1)
          arrays_.add_face(std::array{at(i, j), at(n, j), at(i, j + 1)}, m);
        else
          arrays_.add_face(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}, m);
      }
  }

  ViewScene scene() const {
    const auto mesh = std::make_shared<const PatchMesh>(make_patches(Scene(arrays_), KeepFaces{}).mesh);
    return {mesh, {}, lights_of_emitters(*mesh), ambient_irradiance(*mesh)};
  }

 private:
  Scene::Arrays arrays_;
};

Material grey(double reflectance, double emission = 0) {
  return material("grey", BandValues::Constant(1, reflectance), BandValues::Constant(1, emission));
}
Material mirror(double specular, double shininess = HUGE_VAL) {
  Material m = grey(0);
  m.specular = BandValues::Constant(1, specular);
  m.shininess = shininess;
  return m;
}
Material glass(double transmission, double index, double specular = 0) {
  Material m = mirror(specular);
  m.transmission = BandValues::Constant(1, transmission);
  m.refractive_index = index;
  return m;
}

/// A solution that says what it shows: at x, value(x).
ViewScene with_values(ViewScene scene, const std::function<double(const Vec3&)>& value) {
  scene.vertex_radiosity.emplace(scene.mesh->vertex_count(), 1);
  for (Index v = 0; v < scene.mesh->vertex_count(); ++v)
    (*scene.vertex_radiosity)(v, 0) = value(scene.mesh->vertex(v));
  return scene;
}

/// What the one pixel along a direction shows.
double seen(const Pipeline& pipeline, const Vec3& from, const Vec3& along, Index samples = 1) {
  Camera camera;
  camera.position = from;
  camera.target = from + along;
  camera.up = along.unitOrthogonal();
  camera.vertical_fov_deg = 1e-4;
  return pipeline.draw(camera, {.width = 1, .height = 1, .samples = samples}).radiosity(0, 0);
}

std::unique_ptr<Pipeline> ray_tracing(ViewScene scene, PipelineOptions options = {}) {
  return find_pipeline("ray-tracing").make(std::move(scene), options);
}

// A ray that falls at 30° on glass of index 1.5, down to a floor that tells x: sin θ₂ = sin 30° / 1.5, θ₂ = 19.4712°.
TEST(RayTracing, RefractsBySnellsLaw) {
  Model model;
  model.box({-5, -5, -9}, {5, 5, 0}, model.add(glass(1, 1.5)));
  const Index floor = model.add(grey(0));
  model.face({{-4, -4, -2}, {4, -4, -2}, {4, 4, -2}, {-4, 4, -2}}, floor);
  const auto pipeline =
      ray_tracing(with_values(model.scene(), [](const Vec3& x) { return x.z() == -2 ? 10 + x.x() : 0; }));
  const double in = pi / 6;
  const double x = seen(*pipeline, {-std::tan(in), 0, 1}, {std::sin(in), 0, -std::cos(in)}) - 10;
  EXPECT_NEAR(std::atan(x / 2) * 180 / pi, 19.4712206, 1e-6);
}

// t = 1, n = 1.5, θ = 45°: t sin θ (1 − cos θ / √(n² − sin² θ)) = 0.3291423.
TEST(RayTracing, ASlabShiftsTheRay) {
  Model model;
  model.box({-9, -9, -1}, {9, 9, 0}, model.add(glass(1, 1.5)));
  const Index floor = model.add(grey(0));
  model.face({{-9, -9, -4}, {9, -9, -4}, {9, 9, -4}, {-9, 9, -4}}, floor);
  const auto pipeline =
      ray_tracing(with_values(model.scene(), [](const Vec3& x) { return x.z() == -4 ? 10 + x.x() : 0; }));
  const double x = seen(*pipeline, {-1, 0, 1}, {1, 0, -1}) - 10;
  EXPECT_NEAR((4 - x) * std::cos(pi / 4), 0.3291423, 1e-7);  // without it, x = 4 on the floor
}

// A prism of 60° of BK7, the lines C, d and F, a screen of three bands that tells the height of each. In two dimensions: the faces rise by
// ±60°, light falls on the left one at 50°, is refracted in by n and out again by 1/n.
TEST(RayTracing, APrismSeparatesTheColours) {
  const BandValues wavelengths = Eigen::Array3d(656.2725, 587.5618, 486.1327);
  const BandValues indices = Eigen::Array3d(1.51432, 1.51680, 1.52238);  // as published
  Material bk7 = material("BK7", BandValues::Zero(3), BandValues::Zero(3));
  bk7.transmission = BandValues::Ones(3);
  bk7.refractive_indices =
      wavelengths.unaryExpr([](double nm) { return refractive_index(find_glass("BK7")->sellmeier, nm); });
  Model model;
  const Index m = model.add(bk7);
  const Index black = model.add(material("screen", BandValues::Zero(3), BandValues::Zero(3)));
  const double top = std::sqrt(3.0);
  const Vec3 a(-1, 0, -5), b(1, 0, -5), c(0, top, -5), z(0, 0, 10);
  model.face({a, c, b}, m);
  model.face({a + z, b + z, c + z}, m);
  model.face({a, a + z, c + z, c}, m);
  model.face({b, c, c + z, b + z}, m);
  model.face({a, b, b + z, a + z}, m);
  model.face({{10, -9, -5}, {10, -9, 5}, {10, 9, 5}, {10, 9, -5}}, black);
  ViewScene scene = model.scene();
  scene.vertex_radiosity.emplace(scene.mesh->vertex_count(), 3);
  for (Index v = 0; v < scene.mesh->vertex_count(); ++v)
    scene.vertex_radiosity->row(v).setConstant(
        scene.mesh->vertex(v).x() == 10 ? 20 + scene.mesh->vertex(v).y() : 0);
  Camera camera;
  const double degree = pi / 180;
  const Vec3 entry(-0.5, top / 2, 0), along(std::cos(20 * degree), std::sin(20 * degree), 0);
  camera.position = entry - 2 * along;
  camera.target = entry;
  camera.vertical_fov_deg = 1e-4;
  const LinearImage image = ray_tracing(scene)->draw(camera, {.width = 1, .height = 1, .samples = 1});
  std::array<double, 3> deviation{};
  for (int k = 0; k < 3; ++k) {
    const double n = indices[k], in = std::asin(std::sin(50 * degree) / n),
                 out = std::asin(n * std::sin(60 * degree - in));
    deviation[static_cast<std::size_t>(k)] = 50 + out / degree - 60;
    // Inside it goes at in − 30° to the line from (1, 0) to (0, √3), and on at 20° − deviation.
    const double slope = std::tan(in - 30 * degree);
    const double x = (top - entry.y() + slope * entry.x()) / (slope + top);
    const double y =
        top * (1 - x) + std::tan(20 * degree - deviation[static_cast<std::size_t>(k)] * degree) * (10 - x);
    EXPECT_NEAR(image.radiosity(0, k) - 20, y, 2e-4);  // 5e-6 of n
  }
  // (n_F − n_C) sin 60° / (cos 30.3° cos 48.6°) is 0.70°.
  EXPECT_NEAR(deviation[2] - deviation[0], 0.70, 0.01);
  EXPECT_GT(image.radiosity(0, 0) - image.radiosity(0, 2), 0.1);
}

// From within glass, beyond arcsin(1/1.5) = 41.8103° nothing leaves.
TEST(RayTracing, ReflectsAllBeyondTheCriticalAngle) {
  Model model;
  const Index m = model.add(glass(1, 1.5));
  model.face({{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}},
             m);  // the camera is below its front, in the glass
  const Index above = model.add(grey(0)), below = model.add(grey(0));
  model.face({{-90, -90, 0.1}, {-90, 90, 0.1}, {90, 90, 0.1}, {90, -90, 0.1}}, above);
  model.face({{-90, -90, -3}, {90, -90, -3}, {90, 90, -3}, {-90, 90, -3}}, below);
  const auto pipeline =
      ray_tracing(with_values(model.scene(), [](const Vec3& x) { return x.z() > 0 ? 1.0 : 2.0; }));
  const auto at = [&](double degrees) {
    const double angle = degrees * pi / 180;
    return seen(*pipeline, {0, 0, -1}, {std::sin(angle), 0, std::cos(angle)});
  };
  EXPECT_NEAR(at(41.8102), 1, 1e-12);
  EXPECT_NEAR(at(41.8104), 2, 1e-12);
}

// Light that is mirrored on and on in a box of glass, 60° at one pair of its walls and 90° at none: it ends by depth. Nothing is lost on
// the way, so there is nothing to see.
TEST(RayTracing, ATrappedRayEndsByDepth) {
  Model model;
  model.box({0, 0, 0}, {1, 1, 1}, model.add(glass(1, 1.5)));
  model.box({-1, -1, -1}, {2, 2, 2}, model.add(grey(0)), true);
  ViewScene scene = with_values(model.scene(), [](const Vec3& x) {
    return (x.array() > -0.5).all() && (x.array() < 1.5).all() ? 0.0 : 1.0;
  });
  // (1, 1, 0.9) falls on all three pairs of walls at more than 41.8°: cosines 0.597, 0.597 and 0.537.
  EXPECT_EQ(seen(*ray_tracing(scene, {.depth = 1000}), {0.5, 0.4, 0.3}, Vec3(1, 1, 0.9).normalized()), 0);
  EXPECT_GT(seen(*ray_tracing(scene), {0.5, 0.4, 0.3}, {1, 0, 0}), 0.99);
}

// All has the radiosity 1/(1 − ρ) of a furnace with E = 1; a mirror that gives back all shows it.
TEST(RayTracing, MirrorsInAFurnaceShowTheFurnace) {
  Model model;
  model.box({-2, -2, -2}, {2, 2, 2}, model.add(grey(0.5, 1)), true);
  model.sphere({0.3, 0.2, 0.1}, 0.7, 20, model.add(mirror(1)));
  const ViewScene scene = model.scene();
  const auto pipeline = ray_tracing(
      with_values(scene, [](const Vec3& x) { return x.cwiseAbs().maxCoeff() > 1.5 ? 2.0 : 0.0; }));
  Camera camera;
  camera.position = {-1.5, -1.4, 1.2};
  camera.target = {0.3, 0.2, 0.1};
  const LinearImage image = pipeline->draw(camera, {.width = 60, .height = 60, .samples = 1});
  EXPECT_NEAR(image.radiosity.minCoeff(), 2, 1e-12);
  EXPECT_NEAR(image.radiosity.maxCoeff(), 2, 1e-12);
}

// Rays that pass a sphere of the index of what is round it, or are mirrored by one, show the walls: no facet is met by what leaves it, at
// any size.
TEST(RayTracing, NoRayMeetsTheSurfaceThatItLeaves) {
  for (const double size : {1.0, 1e6}) {
    for (const bool of_glass : {true, false}) {
      Model model;
      const Vec3 away = 3 * size * Vec3(1, -2, 5);
      model.box(away - Vec3::Constant(2 * size), away + Vec3::Constant(2 * size), model.add(grey(0)), true);
      model.sphere(away, size, of_glass ? 30 : 70, model.add(of_glass ? glass(1, 1) : mirror(1)));
      const ViewScene scene = with_values(model.scene(), [&](const Vec3& x) {
        return (x - away).cwiseAbs().maxCoeff() > 1.5 * size ? 1.0 : 0.0;
      });
      Camera camera;
      camera.position = away + size * Vec3(1.9, 0.3, -0.2);
      camera.target = away;
      camera.vertical_fov_deg = 66;  // to the rim of the sphere, at grazing angles
      const LinearImage image = ray_tracing(scene)->draw(camera, {.width = 200, .height = 200, .samples = 1});
      EXPECT_EQ((image.radiosity < 1 - 1e-9).count(), 0) << size << ' ' << of_glass;
    }
  }
}

// A point light above a floor, as the formula says: I_a ρ + I / (c1 + c2 d + c3 d²) (ρ N·L + k_s (R·V)ⁿ), dimmed by two faces of glass.
TEST(RayTracing, LightsABareSceneByTheFormula) {
  Model model;
  Material finish = grey(0.4);
  finish.specular = BandValues::Constant(1, 0.3);
  finish.shininess = 5;
  const Index floor = model.add(finish);
  model.face({{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, floor);
  const auto add_light = [](ViewScene scene) {
    scene.lights.push_back({.name = "l",
                            .position = {2, 0, 2},
                            .intensity = BandValues::Constant(1, 50),
                            .attenuation = {1, 0.5, 0.25}});
    scene.ambient = BandValues::Constant(1, 0.7);
    return scene;
  };
  const double d = std::sqrt(8.0), f = 1 / (1 + 0.5 * d + 0.25 * 8), cosine = std::sqrt(0.5);
  // Seen from straight above, the mirror's direction is the normal.
  const double lit = 50 * f * (0.4 * cosine + 0.3 * std::pow(cosine, 5));
  EXPECT_NEAR(seen(*ray_tracing(add_light(model.scene())), {0, 0, 5}, {0, 0, -1}), 0.4 * 0.7 + lit, 1e-9);
  model.box({0.9, -1, 0.9}, {1.1, 1, 1.1}, model.add(glass(0.5, 1.5)));
  EXPECT_NEAR(seen(*ray_tracing(add_light(model.scene())), {0, 0, 5}, {0, 0, -1}), 0.4 * 0.7 + 0.25 * lit,
              1e-9);
  model.box({1.3, -1, 1.3}, {1.4, 1, 1.4}, model.add(grey(0.5)));
  EXPECT_NEAR(seen(*ray_tracing(add_light(model.scene())), {0, 0, 5}, {0, 0, -1}), 0.4 * 0.7, 1e-9);
}

// Two hundred lights, walls between them: together they give what each gives alone, whose one ray tells its shadow. Shadows of what could
// add half a percent are shared, so that points whose lights are all bright have none of that.
TEST(RayTracing, LightsManyLightsAsOneByOne) {
  Model model;
  const Index floor = model.add(grey(0.5)), wall = model.add(grey(0.2));
  model.face({{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, floor);
  for (int k = -2; k <= 2; ++k) {
    const double x = 2.0 * k;
    model.box({x, -3, 0.5}, {x + 0.3, 3, 2}, wall);
    model.box({-4, x, 0.2}, {4, x + 0.2, 0.6}, wall);
  }
  ViewScene scene = model.scene();
  scene.lights.clear();
  scene.ambient = {};
  RandomStream random(1, 1);
  for (int k = 0; k < 200; ++k) {
    Light light{
        .name = "l", .intensity = BandValues::Constant(1, 1 + random.uniform()), .surface = k % 10 != 0};
    light.position = {16 * random.uniform() - 8, 16 * random.uniform() - 8, 1 + 3 * random.uniform()};
    scene.lights.push_back(light);
  }
  Camera camera;
  camera.position = {0, 0, 20};
  camera.vertical_fov_deg = 40;
  const DrawOptions options{.width = 12, .height = 12, .samples = 1};
  const BandArray together = ray_tracing(scene)->draw(camera, options).radiosity;
  BandArray sum = BandArray::Zero(144, 1);
  const std::vector<Light> lights = scene.lights;
  for (const Light& light : lights) {
    scene.lights = {light};
    sum += ray_tracing(scene)->draw(camera, options).radiosity;
  }
  EXPECT_LT(((together - sum) / sum).abs().maxCoeff(), 0.05);
  EXPECT_LT(std::sqrt(((together - sum) / sum).square().mean()), 0.01);
  EXPECT_FALSE((together == sum).all());
  // Eight of them, each more than half a percent of the rest.
  scene.lights.assign(lights.begin(), lights.begin() + 8);
  const BandArray eight = ray_tracing(scene)->draw(camera, options).radiosity;
  sum.setZero();
  for (int k = 0; k < 8; ++k) {
    scene.lights = {lights[static_cast<std::size_t>(k)]};
    sum += ray_tracing(scene)->draw(camera, options).radiosity;
  }
  EXPECT_LT((eight - sum).abs().maxCoeff(), 0.01 * sum.maxCoeff());
}

TEST(RayTracing, ClassicalAttenuationFallsAlongMirroredRays) {
  Model model;
  const Index m = model.add(mirror(0.8)), wall = model.add(grey(0));
  model.face({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, m);
  model.face({{-9, -9, 4}, {-9, 9, 4}, {9, 9, 4}, {9, -9, 4}}, wall);
  const ViewScene scene = with_values(model.scene(), [](const Vec3& x) { return x.z() > 1 ? 3.0 : 0.0; });
  const Vec3 down(0, 0.1, -1);
  EXPECT_NEAR(seen(*ray_tracing(scene), {0, 0, 1}, down), 0.8 * 3, 1e-12);
  const double d = 4 * down.norm();
  EXPECT_NEAR(seen(*ray_tracing(scene, {.classical_attenuation = true}), {0, 0, 1}, down), 0.8 * 3 / d, 1e-9);
  EXPECT_THROW(ray_tracing(scene, {.depth = 0}), InputError);
}

// The mean irradiance of the floor of the cube of scenes/cube.toml: 0.17121605 / 0.5. At its corners lamps and walls are near.
TEST(PathTraced, FindsTheIrradianceOfTheCubesFloor) {
  Model model;
  const Index wall = model.add(grey(0.5));
  model.face({{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, wall);
  model.face({{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}, wall);
  model.face({{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}, wall);
  model.face({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, wall);
  model.face({{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, wall);
  model.face({{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}, model.add(grey(0.5, 1)));
  const auto mesh = model.scene().mesh;
  constexpr int kSide = 40;  // H is smooth: a rule of midpoints errs by some 10⁻⁵
  std::vector<Place> places;
  for (int k = 0; k < kSide * kSide; ++k)
    places.push_back({{(k % kSide + 0.5) / kSide, 0, (k / kSide + 0.5) / kSide}, {0, 3, 0}, 0});
  const PathTraced floor = path_traced(mesh, places, 100);
  const double error = std::sqrt(floor.standard_error.square().sum()) / (kSide * kSide);
  EXPECT_LT(error, 0.002);
  EXPECT_NEAR(floor.irradiance.mean(), 0.17121605 / 0.5, 4 * error);
  EXPECT_FALSE((floor.irradiance == path_traced(mesh, places, 100, 2).irradiance).any());
  EXPECT_THROW(path_traced(mesh, places, 1), InputError);
}

/// Mean of an image, and the standard error of that mean.
std::pair<double, double> mean(const LinearImage& image) {
  const double n = static_cast<double>(image.radiosity.rows());
  return {image.radiosity.mean(), std::sqrt(image.standard_error->square().sum()) / n};
}

// Closed, E everywhere, ρ = 0.9: every point has E + ρ E + ρ² E + … = 10 E.
TEST(PathTracing, FillsAFurnace) {
  Model model;
  model.box({0, 0, 0}, {1, 2, 3}, model.add(grey(0.9, 1)), true);
  model.box({0.3, 0.4, 0.5}, {0.6, 0.9, 1.1}, model.add(grey(0.9, 1)));
  const auto pipeline = find_pipeline("path-tracing").make(model.scene());
  Camera camera;
  camera.position = {0.1, 0.2, 2.9};
  camera.target = {0.5, 0.7, 0};
  camera.vertical_fov_deg = 90;
  const auto [value, error] =
      mean(pipeline->draw(camera, {.width = 40, .height = 40, .samples = 16, .standard_error = true}));
  EXPECT_LT(error, 0.1);
  EXPECT_NEAR(value, 10, 4 * error);
}

// Whatever is in a furnace without losses shows it, mirrors, glass and dull mirrors: ρ + k_s + k_t = 1 of things in walls with E = 1,
// ρ = 0.5, radiosity 2. A lobe about the mirror's direction loses what is below the horizon, so it stays below.
TEST(PathTracing, MirrorsAndGlassInAFurnaceShowTheFurnace) {
  const auto look = [](const Material& thing, Index samples) {
    Model model;
    model.box({-2, -2, -2}, {2, 2, 2}, model.add(grey(0.5, 1)), true);
    model.box({-0.5, -0.6, -0.7}, {0.5, 0.6, 0.7}, model.add(thing));
    Camera camera;
    camera.position = {1.9, 1.1, 1.3};
    camera.target = {0, 0, 0};
    camera.vertical_fov_deg = 25;  // the thing fills the image
    return mean(find_pipeline("path-tracing")
                    .make(model.scene())
                    ->draw(camera, {.width = 24, .height = 24, .samples = samples, .standard_error = true}));
  };
  Material mixed = glass(0.3, 1.5, 0.3);
  mixed.reflectance.setConstant(0.4);
  for (const Material& thing : {mirror(1), glass(1, 1.5), glass(0.6, 1.5, 0.4), mixed}) {
    const auto [value, error] = look(thing, 16);
    EXPECT_NEAR(value, 2, 4 * error + 1e-12) << thing.name;
    EXPECT_LT(error, 0.05);
  }
  const auto [dull, error] = look(mirror(1, 20), 16);
  EXPECT_LT(dull, 2 + 4 * error);
  EXPECT_GT(dull, 1.6);
}

// Glass bends one band of three past the edge of a lamp; where there is another lamp beyond it, all show the same.
TEST(PathTracing, RefractsEachBandByItsOwnIndex) {
  const auto scene = [](const Material& thing, double outside) {
    Model model;
    model.box({-9, -9, -1}, {9, 9, 0}, model.add(thing));
    const Index dark = model.add(material("dark", BandValues::Zero(3), BandValues::Constant(3, outside)));
    const Index lamp = model.add(material("lamp", BandValues::Zero(3), BandValues::Constant(3, 3)));
    model.face({{-9, -9, -1.5}, {1, -9, -1.5}, {1, 9, -1.5}, {-9, 9, -1.5}}, dark);
    model.face({{1, -9, -1.5}, {9, -9, -1.5}, {9, 9, -1.5}, {1, 9, -1.5}}, lamp);
    return model.scene();
  };
  Material thing = material("glass", BandValues::Zero(3), BandValues::Zero(3));
  thing.transmission = Eigen::Array3d(1, 0.75, 0.5);
  thing.refractive_indices = Eigen::Array3d(1.1, 1.9, 1.3);
  const auto look = [](const ViewScene& drawn) {
    Camera camera;
    camera.position = {-1, 0, 1};
    camera.target = {0, 0, 0};
    camera.vertical_fov_deg = 1e-4;
    return find_pipeline("path-tracing")
        .make(drawn)
        ->draw(camera, {.width = 1, .height = 1, .samples = 4000, .standard_error = true});
  };
  const auto expect = [&](const LinearImage& image, const Eigen::Array3d& value) {
    for (int b = 0; b < 3; ++b) {
      EXPECT_NEAR(image.radiosity(0, b), value[b], 4 * (*image.standard_error)(0, b) + 1e-12);
      EXPECT_LT((*image.standard_error)(0, b), 0.1);
    }
  };
  // At 45° the slab takes it tan asin(sin 45° / n) = 0.839, 0.401, 0.648 aside, and the way below 0.5 more: the edge is between.
  expect(look(scene(thing, 0)), 3 * thing.transmission.square() * Eigen::Array3d(1, 0, 1));
  expect(look(scene(thing, 3)), 3 * thing.transmission.square());
}

// The mean radiosities of scenes/cube.toml: a closed unit cube, ρ = 0.5, whose ceiling has E = 1: floor 0.17121605, from which
// ceiling 1.1043616 follows. The image of a pinhole in the middle of the ceiling has each part of the floor in its own share.
TEST(PathTracing, FindsTheRadiositiesOfTheCube) {
  Model model;
  const Index wall = model.add(grey(0.5)), lamp = model.add(grey(0.5, 1));
  model.face({{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, wall);
  model.face({{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}, lamp);
  model.face({{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}, wall);
  model.face({{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}, wall);
  model.face({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, wall);
  model.face({{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, wall);
  const auto pipeline = find_pipeline("path-tracing").make(model.scene());
  constexpr double kOff = 1e-4;  // the camera is not in the wall
  const auto look = [&](const Vec3& from, const Vec3& to) {
    Camera camera;
    camera.position = from;
    camera.target = to;
    camera.up = Vec3::UnitZ();
    camera.vertical_fov_deg = 2 * std::atan(0.5 / (1 - kOff)) * 180 / pi;
    return mean(pipeline->draw(camera, {.width = 32, .height = 32, .samples = 64, .standard_error = true}));
  };
  const auto [floor, floor_error] = look({0.5, 1 - kOff, 0.5}, {0.5, 0, 0.5});
  EXPECT_NEAR(floor, 0.17121605, 4 * floor_error);
  EXPECT_LT(floor_error, 0.001);
  const auto [ceiling, ceiling_error] = look({0.5, kOff, 0.5}, {0.5, 1, 0.5});
  EXPECT_NEAR(ceiling, 1.1043616, 4 * ceiling_error);
  EXPECT_LT(ceiling_error, 0.001);
}

// A lamp seen in a mirror: k_s E. A lamp behind a pane whose two faces let 0.9 through each: 0.81 E, and 0.9 E behind a sheet without
// thickness, which bends nothing.
TEST(PathTracing, FollowsMirrorsAndGlass) {
  Model model;
  const Index m = model.add(mirror(0.8)), lamp = model.add(grey(0, 5));
  model.face({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, m);
  model.face({{-9, -9, 4}, {-9, 9, 4}, {9, 9, 4}, {9, -9, 4}}, lamp);
  model.box({-0.5, -0.5, 2}, {0.5, 0.5, 2.1}, model.add(glass(0.9, 1.5)));
  Material sheet = glass(0.9, 1.5);
  sheet.sides = Sides::both;
  const Index s = model.add(sheet);
  model.face({{-6, -1, 2}, {-4, -1, 2}, {-4, 1, 2}, {-6, 1, 2}}, s);
  const auto pipeline = find_pipeline("path-tracing").make(model.scene());
  const auto count = [&](const Vec3& from, const Vec3& along) { return seen(*pipeline, from, along, 20000); };
  // Roulette lets a share through that its weight makes good: standard errors √(p (1 − p) / N) / p of the value.
  EXPECT_NEAR(count({0, 0, 1}, Vec3(0, 0.9, -1).normalized()), 0.8 * 5, 4 * 5 * std::sqrt(0.8 * 0.2 / 20000));
  EXPECT_NEAR(count({0, 0, 1}, Vec3(0.1, 0.1, 1).normalized()), 0.81 * 5,
              4 * 5 * std::sqrt(0.81 * 0.19 / 20000));
  EXPECT_NEAR(count({-5, 0, 1}, Vec3(0.1, 0.1, 1).normalized()), 0.9 * 5,
              4 * 5 * std::sqrt(0.9 * 0.1 / 20000));
}

TEST(PathTracing, HasOtherRandomNumbersForAnotherSeed) {
  Model model;
  model.box({0, 0, 0}, {1, 2, 3}, model.add(grey(0.9, 1)), true);
  Camera camera;
  camera.position = {0.5, 1, 2};
  const DrawOptions options{.width = 4, .height = 4, .samples = 2};
  const auto& info = find_pipeline("path-tracing");
  const LinearImage one = info.make(model.scene(), {.seed = 1})->draw(camera, options);
  EXPECT_TRUE(
      (one.radiosity == info.make(model.scene(), {.seed = 1})->draw(camera, options).radiosity).all());
  EXPECT_FALSE(
      (one.radiosity == info.make(model.scene(), {.seed = 2})->draw(camera, options).radiosity).any());
}

}  // namespace
}  // namespace radiosity::test
