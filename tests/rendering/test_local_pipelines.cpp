// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "io/files.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/pipeline.hpp"

// The pipelines that light each surface by itself: `gouraud`, `phong`, `priority`.
namespace radiosity::test {
namespace {

constexpr std::array<std::string_view, 3> kLocal{"gouraud", "phong", "priority"};

using Loop = std::vector<Vec3>;

/// Patch k is loops[k], black, and emits k + 1: pictures tell which patch is seen.
PatchMesh coded(const std::vector<Loop>& loops) {
  PatchMesh::Arrays arrays;
  for (const Loop& loop : loops) {
    for (const Vec3& x : loop) {
      arrays.corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    const auto k = static_cast<Index>(arrays.materials.size());
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(k);
    arrays.patch_material.push_back(k);
    arrays.materials.push_back(
        material("face" + std::to_string(k), BandValues::Zero(1), BandValues::Constant(1, k + 1.0)));
  }
  return PatchMesh(std::move(arrays));
}

/// At the origin, looking along −z at [−1, 1]² in the plane z = −1, which just fills a square image.
Camera ahead() {
  Camera camera;
  camera.vertical_fov_deg = 90;
  return camera;
}

LinearImage drawn(std::string_view pipeline, const ViewScene& scene, const Camera& camera, int size) {
  return find_pipeline(pipeline).make(scene)->draw(camera, {.width = size, .height = size, .samples = 1});
}

LinearImage drawn(std::string_view pipeline, const PatchMesh& mesh, const Camera& camera, int size) {
  return drawn(pipeline, {std::make_shared<const PatchMesh>(mesh)}, camera, size);
}

/// The point (x, y) of the image plane at distance 1 that pixel (column, row) of a square image by `ahead` looks at.
Vec3 looked_at(int column, int row, int size) {
  return {2 * (column + 0.5) / size - 1, 1 - 2 * (row + 0.5) / size, -1};
}

/// Every pipeline shows the patch that a ray meets, at each pixel whose neighbours' rays meet the same. Their number.
int expect_what_rays_meet(const PatchMesh& mesh, const Camera& camera, int size) {
  const Visibility visibility(mesh);
  const Pinhole eye(camera, size, size);
  BandArray met = BandArray::Zero(size, size);
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      const auto hit =
          visibility.first_hit(eye.position(), eye.direction((column + 0.5) / size, (row + 0.5) / size));
      if (hit.patch >= 0 && hit.front) met(row, column) = hit.patch + 1;
    }
  int compared = 0;
  for (const std::string_view name : kLocal) {
    const LinearImage image = drawn(name, mesh, camera, size);
    for (int row = 1; row + 1 < size; ++row)
      for (int column = 1; column + 1 < size; ++column) {
        if ((met.block(row - 1, column - 1, 3, 3) != met(row, column)).any()) continue;
        ++compared;
        EXPECT_EQ(image.radiosity(row * size + column, 0), met(row, column))
            << name << " at " << column << ", " << row;
      }
  }
  return compared / static_cast<int>(kLocal.size());
}

TEST(LocalPipelines, ShowWhatPrimaryRaysMeetInRandomScenes) {
  std::mt19937_64 random(1);
  const auto uniform = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
  const auto vector = [&] { return Vec3(uniform(), uniform(), uniform()); };
  constexpr int kSize = 32;
  int compared = 0;
  for (int scene = 0; scene < 100; ++scene) {
    std::vector<Loop> loops;
    for (int k = 0; k < 12; ++k) {
      // Triangles and parallelograms about the eye that go through each other; some reach behind it.
      const Vec3 origin = 1.5 * vector(), u = 2 * vector(), v = 2 * vector();
      loops.push_back(k % 2 ? Loop{origin, origin + u, origin + v}
                            : Loop{origin, origin + u, origin + u + v, origin + v});
    }
    Camera camera = ahead();
    camera.position = 0.3 * vector();
    camera.target = camera.position + vector();
    compared += expect_what_rays_meet(coded(loops), camera, kSize);
  }
  EXPECT_GT(compared, 50 * kSize * kSize);
}

TEST(LocalPipelines, ShowWhatPrimaryRaysMeetWhereThereIsNoOrderOfFaces) {
  // Each of three bars lies over the next: from the left end up to the right end, turned by 120°.
  std::vector<Loop> bars;
  for (int k = 0; k < 3; ++k) {
    const Eigen::AngleAxisd turn(2 * std::numbers::pi / 3 * k, Vec3::UnitZ());
    Loop bar;
    for (const Vec3& x :
         {Vec3(-0.9, -0.4, -2.2), Vec3(0.9, -0.4, -1.8), Vec3(0.9, -0.2, -1.8), Vec3(-0.9, -0.2, -2.2)})
      bar.push_back(turn * x);
    bars.push_back(bar);
  }
  bars.push_back({{-9, -9, -4}, {9, -9, -4}, {9, 9, -4}, {-9, 9, -4}});
  EXPECT_GT(expect_what_rays_meet(coded(bars), ahead(), 96), 5000);
  // Tiles of one plane, side by side; a wall behind them. One of them faces away.
  std::vector<Loop> tiles{{{-9, -9, -3}, {9, -9, -3}, {9, 9, -3}, {-9, 9, -3}}};
  for (int k = -2; k < 2; ++k) {
    const double x = 0.5 * k, z = -2 + 0.25 * x;
    Loop tile{{x, -1, z}, {x + 0.5, -1, z + 0.125}, {x + 0.5, 1, z + 0.125}, {x, 1, z}};
    if (k == 1) std::reverse(tile.begin(), tile.end());
    tiles.push_back(tile);
  }
  EXPECT_GT(expect_what_rays_meet(coded(tiles), ahead(), 64), 3000);
  // Walls through the plane of the eye, and one whose plane holds the eye, so that it is seen edge-on.
  EXPECT_GT(expect_what_rays_meet(coded({{{-0.5, -9, 9}, {-0.5, -9, -9}, {-0.5, 9, -9}, {-0.5, 9, 9}},
                                         {{1, -9, -9}, {1, -9, 5}, {1, 9, 5}, {1, 9, -9}},
                                         {{-9, -0.5, 0}, {9, -0.5, 0}, {9, -0.5, -9}, {-9, -0.5, -9}},
                                         {{-9, 0, -9}, {9, 0, -9}, {9, 0, -1}, {-9, 0, -1}},
                                         {{-9, -9, -8}, {9, -9, -8}, {9, 9, -8}, {-9, 9, -8}}}),
                                  ahead(), 64),
            3000);
}

TEST(LocalPipelines, ShowWhatPrimaryRaysMeetFarFromTheOriginAndAtAnySize) {
  std::mt19937_64 random(4);
  const auto uniform = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
  const auto vector = [&] { return Vec3(uniform(), uniform(), uniform()); };
  for (const double size : {1e-3, 1.0, 1e6})
    for (const double shift : {0.0, 1e7}) {
      const Vec3 centre = size * shift * Vec3(1, -0.5, 0.1);
      std::vector<Loop> loops;
      for (int k = 0; k < 12; ++k) {
        const Vec3 a = centre + size * 2 * vector();
        loops.push_back({a, a + size * 2 * vector(), a + size * 2 * vector()});
      }
      Camera camera = ahead();
      camera.position = centre;
      camera.target = centre + size * vector();
      EXPECT_GT(expect_what_rays_meet(coded(loops), camera, 32), 400);
    }
}

/// Reflecting surfaces under a lamp and a spot that shine on all of them.
ViewScene lit(PatchMesh mesh) {
  Light lamp{.name = "lamp", .position = {1, 3, 1}, .intensity = BandValues::Constant(mesh.bands(), 2)};
  Light spot = lamp;
  spot.kind = LightKind::spot;
  spot.position = {-1, 2, 0};
  spot.direction = Vec3(0.5, -1, -2).normalized();
  spot.attenuation = {1, 0.5, 0.25};
  const Index bands = mesh.bands();
  return {
      std::make_shared<const PatchMesh>(std::move(mesh)), {}, {lamp, spot}, BandValues::Constant(bands, 0.1)};
}

// By hand: at y = −0.5 the pyramid |x|, |y| ≤ −z begins at z = −0.5; at z = −2 it is [−2, 2]²; the plane x = 0.5 + z/2, whose front is
// to the left, is in it from z = −1, where y is in [−1, 1] and x = 0, back to z = −1/3, where it leaves at the right.
TEST(LocalPipelines, ClippedPolygonsLookLikeThoseCutByHand) {
  const std::array<std::array<Loop, 2>, 3> cases{{
      {{{{-9, -0.5, 3}, {9, -0.5, 3}, {9, -0.5, -9}, {-9, -0.5, -9}},
        {{-0.5, -0.5, -0.5}, {0.5, -0.5, -0.5}, {9, -0.5, -9}, {-9, -0.5, -9}}}},
      {{{{-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2}},
        {{-2, -2, -2}, {2, -2, -2}, {2, 2, -2}, {-2, 2, -2}}}},
      {{{{0, -5, -1}, {1, -5, 1}, {1, 5, 1}, {0, 5, -1}},
        {{0, -1, -1}, {1.0 / 3, -1.0 / 3, -1.0 / 3}, {1.0 / 3, 1.0 / 3, -1.0 / 3}, {0, 1, -1}}}},
  }};
  for (std::size_t k = 0; k < cases.size(); ++k) {
    for (const bool backwards : {false, true}) {
      auto [whole, cut] = cases[k];
      if (backwards)
        for (Loop* loop : {&whole, &cut}) std::reverse(loop->begin(), loop->end());
      const LinearImage a = drawn("phong", lit(one_patch(whole, 1)), ahead(), 31);
      const LinearImage b = drawn("phong", lit(one_patch(cut, 1)), ahead(), 31);
      EXPECT_LT((a.radiosity - b.radiosity).abs().maxCoeff(), 1e-12) << k;
      EXPECT_EQ(a.radiosity.maxCoeff() > 0, !backwards) << k;
    }
  }
}

/// From the camera `ahead`, where the plane of the patch is looked at.
Vec3 on_plane(const PatchMesh& mesh, const Vec3& direction) {
  return direction * (mesh.normal(0).dot(mesh.centroid(0)) / mesh.normal(0).dot(direction));
}

// ρ (H_a + Σ I f_att s (n·l)) with ρ = 1/2, at the point that the pixel looks at.
TEST(Phong, ShowsTheIrradianceOfLightsAtEachPoint) {
  const PatchMesh floor = one_patch({{-9, -0.5, 3}, {9, -0.5, 3}, {9, -0.5, -9}, {-9, -0.5, -9}}, 1);
  const LinearImage image = drawn("phong", lit(floor), ahead(), 16);
  int seen = 0;
  for (int row = 0; row < 16; ++row)
    for (int column = 0; column < 16; ++column) {
      const double shown = image.radiosity(row * 16 + column, 0);
      const Vec3 x = on_plane(floor, looked_at(column, row, 16));
      if (row < 8 || x.z() < -9) {
        EXPECT_EQ(shown, 0);
        continue;
      }
      ++seen;
      const Vec3 a = Vec3(1, 3, 1) - x, b = Vec3(-1, 2, 0) - x;
      const double lamp = 2 * a.y() / std::pow(a.norm(), 3);
      const double aim = std::max(0.0, -b.dot(Vec3(0.5, -1, -2).normalized()) / b.norm());
      const double spot = 2 / (1 + 0.5 * b.norm() + 0.25 * b.squaredNorm()) * aim * b.y() / b.norm();
      EXPECT_NEAR(shown, 0.5 * (0.1 + lamp + spot), 1e-13);
    }
  EXPECT_EQ(seen, 16 * 8);  // the row below the horizon looks at z = −8
}

// A roof of two faces whose ridge is smooth: there the normal is vertical, at the eaves it is that of the face. Under a vertical sun of
// 1 W/m² it shows ρ n·l with n between them in proportion to the distance from the ridge.
TEST(Phong, InterpolatesNormalsAndMakesThemUnitVectorsAgain) {
  PatchMesh::Arrays arrays;
  arrays.vertices = {{-1, -1, -2}, {0, -1, -1.5}, {1, -1, -2}, {-1, 1, -2}, {0, 1, -1.5}, {1, 1, -2}};
  arrays.corners = {0, 1, 4, 3, 1, 2, 5, 4};
  arrays.patch_start = {0, 4, 8};
  arrays.patch_surface = {0, 0};
  arrays.patch_material = {0, 0};
  arrays.materials = {material("roof", BandValues::Constant(1, 0.5), BandValues::Zero(1))};
  const Light sun{.name = "sun",
                  .kind = LightKind::directional,
                  .direction = {0, 0, -1},
                  .intensity = BandValues::Ones(1)};
  const LinearImage image =
      drawn("phong", {std::make_shared<const PatchMesh>(std::move(arrays)), {}, {sun}}, ahead(), 15);
  const Vec3 left = Vec3(-0.5, 0, 1).normalized();
  int seen = 0;
  for (int row = 4; row < 11; ++row)
    for (int column = 4; column < 8; ++column) {
      // On the left face z = −1.5 + x/2 the direction (d, y, −1) meets x = 1.5 d / (1 + d/2).
      const double d = looked_at(column, row, 15).x(), x = 1.5 * d / (1 + d / 2);
      if (x < -1) continue;
      ++seen;
      const Vec3 n = ((1 + x) * Vec3::UnitZ() - x * left).normalized();
      EXPECT_NEAR(image.radiosity(row * 15 + column, 0), 0.5 * n.z(), 1e-14);
      EXPECT_NEAR(image.radiosity(row * 15 + 14 - column, 0), 0.5 * n.z(), 1e-14);
    }
  EXPECT_EQ(seen, 7 * 4);
}

// Of a clipped polygon, too: values at new vertices are those of the plane.
TEST(Gouraud, InterpolatesTheIntensitiesOfTheVerticesLinearlyOverTriangles) {
  for (const Loop& loop : {Loop{{-9, -0.5, 3}, {5, -0.5, 3}, {0.5, -1.5, -9}},
                           Loop{{-0.5, -0.5, -2}, {0.5, -0.5, -1}, {0.2, 0.7, -1.2}, {-0.6, 0.7, -2}}}) {
    const PatchMesh mesh = one_patch(loop, 1);
    const ViewScene scene = lit(mesh);
    // What the vertices show, as phong does at each point.
    std::vector<double> intensity;
    for (const Vec3& x : loop) {
      double h = 0.1;
      for (const Light& light : scene.lights) {
        const Arriving from = arriving(light, x);
        h += 2 * from.share * std::max(0.0, from.to.dot(mesh.normal(0)));
      }
      intensity.push_back(0.5 * h);
    }
    const LinearImage image = drawn("gouraud", scene, ahead(), 41);
    int seen = 0;
    for (int row = 0; row < 41; ++row)
      for (int column = 0; column < 41; ++column) {
        const Vec3 direction = looked_at(column, row, 41), x = on_plane(mesh, direction);
        double expected = 0;
        for (const auto& [a, b, c] : mesh.triangles()) {
          const auto part = [&](Index p, Index q) {
            return mesh.normal(0).dot((mesh.vertex(p) - x).cross(mesh.vertex(q) - x));
          };
          const std::array<double, 3> w{part(b, c), part(c, a), part(a, b)};
          if (x.z() > 0 || std::min({w[0], w[1], w[2]}) < 0) continue;
          const auto value = [&](Index v) { return intensity[v]; };
          expected = (w[0] * value(a) + w[1] * value(b) + w[2] * value(c)) / (w[0] + w[1] + w[2]);
        }
        if (expected > 0) ++seen;
        EXPECT_NEAR(image.radiosity(row * 41 + column, 0), expected, 1e-13);
      }
    EXPECT_GT(seen, 100);
  }
}

// k_s H (r·v)ⁿ, r = 2 (n·l) n − l, beside the diffuse part: at each point, or at the vertices and linear between them. A mirror has no
// highlight.
TEST(LocalPipelines, AddHighlightsOfTheLights) {
  constexpr int kSize = 21;
  PatchMesh wall = one_patch({{-4, -3, -2}, {4, -3, -2}, {0, 13, -2}}, 1);
  const Light lamp{.name = "lamp", .position = {0.5, 0.25, -0.5}, .intensity = BandValues::Constant(1, 3)};
  const auto shown = [&](const Vec3& x, double specular, double shininess) {
    const Vec3 l = lamp.position - x, r(-l.x(), -l.y(), l.z());
    const double h = 3 / l.squaredNorm(), along = r.dot(-x) / (r.norm() * x.norm());
    return 0.5 * h * l.z() / l.norm() + (along > 0 ? specular * h * std::pow(along, shininess) : 0);
  };
  for (const double shininess : {2.0, 30.0, HUGE_VAL}) {
    Material material = wall.material_of(0);
    material.specular = BandValues::Constant(1, 0.25);
    material.shininess = shininess;
    const auto mesh = std::make_shared<const PatchMesh>(wall.with_materials({material}));
    const double specular = std::isfinite(shininess) ? 0.25 : 0, exponent = specular > 0 ? shininess : 1;
    for (const std::string_view name : kLocal) {
      const LinearImage image = drawn(name, {mesh, {}, {lamp}}, ahead(), kSize);
      for (int row = 0; row < kSize; ++row)
        for (int column = 0; column < kSize; ++column) {
          const Vec3 x = 2 * looked_at(column, row, kSize);
          double expected = shown(x, specular, exponent);
          if (name == "gouraud") {
            // Barycentric in the triangle: the top's share from the height.
            const double top = (x.y() + 3) / 16, right = (x.x() + 4 - 4 * top) / 8;
            expected = top * shown({0, 13, -2}, specular, exponent) +
                       right * shown({4, -3, -2}, specular, exponent) +
                       (1 - top - right) * shown({-4, -3, -2}, specular, exponent);
          }
          EXPECT_NEAR(image.radiosity(row * kSize + column, 0), expected, 1e-13) << name << " " << shininess;
        }
    }
  }
}

// A quad that is not planar is its two triangles: ρ I cosθ / d² at the point of the one that the pixel looks at, x = Σ λ v with λ in
// proportion to the volumes that the direction spans with the other two corners.
TEST(Phong, LightsPatchesThatAreNotPlanarWhereTheirTrianglesAre) {
  const PatchMesh mesh = one_patch({{-1, -1, -2}, {1, -1, -1.5}, {1, 1, -2}, {-1, 1, -1.5}}, 1);
  const Light lamp{.name = "lamp", .position = {0.5, 0.25, 0}, .intensity = BandValues::Ones(1)};
  const LinearImage image =
      drawn("phong", {std::make_shared<const PatchMesh>(mesh), {}, {lamp}}, ahead(), 32);
  int seen = 0;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column)
      for (const auto& triangle : mesh.triangles()) {
        const Vec3 &a = mesh.vertex(triangle[0]), &b = mesh.vertex(triangle[1]),
                   &c = mesh.vertex(triangle[2]);
        const Vec3 direction = looked_at(column, row, 32);
        const Vec3 parts(direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b)));
        if (parts.maxCoeff() > 0) continue;
        ++seen;
        const Vec3 x = (parts[0] * a + parts[1] * b + parts[2] * c) / parts.sum(), l = lamp.position - x;
        EXPECT_NEAR(image.radiosity(row * 32 + column, 0),
                    0.5 * mesh.normal(0).dot(l) / std::pow(l.norm(), 3), 1e-13);
      }
  EXPECT_GT(seen, 300);
}

// A floor at y = −1 from z = −1 to z = −3 is seen from y = −1 up to −1/3 on the screen. At −1/2, three quarters of the way, there is
// z = −2, the middle: it shows the mean of the ends, not 1/4 of the near and 3/4 of the far end.
TEST(Gouraud, InterpolatesWithPerspective) {
  const PatchMesh floor = one_patch({{-1, -1, -1}, {1, -1, -1}, {1, -1, -3}, {-1, -1, -3}}, 1);
  Light sky{
      .name = "lamp", .position = {0, 9, -1}, .intensity = BandValues::Ones(1), .attenuation = {1, 0, 0}};
  const LinearImage image =
      drawn("gouraud", {std::make_shared<const PatchMesh>(floor), {}, {sky}}, ahead(), 6);
  const double near = 10 / std::sqrt(101.0), far = 10 / std::sqrt(105.0);
  EXPECT_NEAR(image.radiosity(4 * 6 + 2, 0), 0.5 * (near + far) / 2, 1e-14);
  EXPECT_NEAR(image.radiosity(4 * 6 + 3, 0), 0.5 * (near + far) / 2, 1e-14);
}

// Edges through pixels' middles: the axes, both diagonals, and a corner in the very middle of the image. Each sample belongs to one
// face, so that the images of single faces add up to one of all of them, which has no holes.
TEST(LocalPipelines, CoverSharedEdgesExactlyOnce) {
  std::mt19937_64 random(2);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  constexpr int kSize = 45;
  for (const int corners : {4, 8, 12, 40}) {
    std::vector<Vec3> rim;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * std::numbers::pi * (k + (corners > 8 ? 0.8 * uniform() : 0)) / corners;
      rim.emplace_back(4 * std::cos(angle), 4 * std::sin(angle), -1 - uniform());
      if (corners <= 8) rim.back() = {std::round(rim.back().x()), std::round(rim.back().y()), -1};
    }
    const Vec3 hub(0, 0, -1.25);
    std::vector<Loop> loops;
    for (std::size_t k = 0; k < rim.size(); ++k) loops.push_back({hub, rim[k], rim[(k + 1) % rim.size()]});
    for (const std::string_view name : kLocal) {
      BandArray sum = BandArray::Zero(kSize * kSize, 1);
      for (const Loop& loop : loops) sum += drawn(name, coded({loop}), ahead(), kSize).radiosity;
      EXPECT_TRUE((sum == 1).all()) << name << ", " << corners;
      EXPECT_GT(drawn(name, coded(loops), ahead(), kSize).radiosity.minCoeff(), 0);
    }
  }
}

TEST(LocalPipelines, ShowTheFrontOfSheetsWithTwoSides) {
  const Loop sheet{{-5, -0.1, 1}, {5, -0.1, 1}, {4, -0.3, -90}, {-5, -0.3, -90}};
  const Loop flat = {{sheet[0], sheet[1], sheet[2]}};
  const PatchMesh mesh = coded({flat, {flat.rbegin(), flat.rend()}, {flat[1], flat[0], flat[2]}, flat});
  for (const std::string_view name : kLocal) {
    const LinearImage image = drawn(name, mesh, ahead(), 64);
    for (int row = 33; row < 64; ++row)
      for (int column = 28; column < 36; ++column) {
        const double shown = image.radiosity(row * 64 + column, 0);
        EXPECT_TRUE(shown == 1 || shown == 4) << name << " " << shown;
      }
  }
}

TEST(LocalPipelines, ShowNothingOfWhatIsBehindTheEye) {
  // A floor that ends in the plane of the eye, and a triangle in that plane.
  const PatchMesh mesh =
      coded({{{-9, -1, 9}, {9, -1, 9}, {9, -1, 0}, {-9, -1, 0}}, {{0, 1, 0}, {1, 1, 0}, {0, 2, 0}}});
  for (const std::string_view name : kLocal)
    EXPECT_EQ(drawn(name, mesh, ahead(), 8).radiosity.abs().maxCoeff(), 0) << name;
}

TEST(LocalPipelines, FillCoarseImagesUpToTheirBorders) {
  const ViewScene scene = lit(room({-1, -1, -1}, {1, 1, 1}, false));
  for (const std::string_view name : kLocal)
    find_pipeline(name).make(scene)->draw(
        ahead(), {.width = 21, .height = 9, .samples = 1, .refined = [&](const LinearImage& image) {
                    EXPECT_GT(image.radiosity.minCoeff(), 0) << name;
                    return true;
                  }});
}

/// Wavy sheets of 2 n² triangles that share vertices, before the camera `ahead`, each turned about the line of sight.
PatchMesh waves(Index n, std::initializer_list<double> turns) {
  PatchMesh::Arrays arrays;
  for (const double turn : turns) {
    const auto first = static_cast<Index>(arrays.vertices.size());
    const double cell = 7.5 / n;
    for (Index j = 0; j <= n; ++j)
      for (Index i = 0; i <= n; ++i)
        arrays.vertices.push_back(Eigen::AngleAxisd(turn, Vec3::UnitZ()) *
                                  Vec3(cell * i - 3.75, cell * j - 3.75,
                                       -2.5 + 0.3 * std::sin(3 * cell * i) * std::cos(3.5 * cell * j)));
    for (Index j = 0; j < n; ++j)
      for (Index i = 0; i < n; ++i) {
        const Index a = first + j * (n + 1) + i, b = a + 1, d = a + n + 1, c = d + 1;
        for (const Index corner : {a, b, c, a, c, d}) arrays.corners.push_back(corner);
        for (int k = 0; k < 2; ++k) {
          arrays.patch_start.push_back(arrays.patch_start.back() + 3);
          arrays.patch_surface.push_back(0);
          arrays.patch_material.push_back(0);
        }
      }
  }
  arrays.materials = {material("sheet", rgb(0.5, 0.25, 0.75), rgb(0, 0, 0))};
  return PatchMesh(std::move(arrays));
}

TEST(LocalPipelines, DrawManyPolygonsWithTheSameBitsOnAnyNumberOfThreads) {
  const ViewScene scene = lit(waves(50, {0}));
  for (const std::string_view name : kLocal) {
    const LinearImage many = drawn(name, scene, ahead(), 50);
    const ThreadLimit limit(1);
    EXPECT_TRUE((drawn(name, scene, ahead(), 50).radiosity == many.radiosity).all()) << name;
    EXPECT_GT(many.radiosity.minCoeff(), 0) << name;
  }
}

// The same lighting of the same fragments, but for rounding of what was split; smooth normals, three bands.
TEST(Priority, ShowsWhatPhongShows) {
  std::vector<std::pair<ViewScene, Camera>> cases;
  for (const char* name : {"cornell-box", "cornell-box-glass", "cube", "two-rooms", "corridor"}) {
    const LoadedScene loaded = read_scene(std::string(RADIOSITY_SOURCE_DIR "/scenes/") + name + ".toml");
    const auto mesh =
        std::make_shared<const PatchMesh>(make_patches(loaded.scene, KeepFaces{}).mesh.unfolded());
    cases.push_back(
        {{mesh, {}, lights_of_emitters(*mesh), ambient_irradiance(*mesh)}, loaded.settings.camera.value()});
  }
  // Two sheets of 800 triangles that go through each other. Middles of pixels lie on edges of the first, which are split where
  // their neighbours' are not: there must be no hole.
  cases.push_back({lit(waves(20, {0, 1})), ahead()});
  // Quads that are not planar, as files have them, through each other.
  std::mt19937_64 random(5);
  const auto uniform = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
  std::vector<Loop> quads;
  for (int k = 0; k < 30; ++k) {
    const Vec3 middle(uniform(), uniform(), -2.5 + 0.5 * uniform());
    quads.push_back({});
    for (const auto& [x, y] : std::array<std::array<double, 2>, 4>{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}})
      quads.back().push_back(middle + 0.5 * Vec3(x + 0.2 * uniform(), y + 0.2 * uniform(), 0.5 * uniform()));
  }
  cases.push_back({{std::make_shared<const PatchMesh>(coded(quads))}, ahead()});
  for (const auto& [scene, camera] : cases) {
    const DrawOptions options{.width = 64, .height = 48, .samples = 1};
    const LinearImage z = find_pipeline("phong").make(scene)->draw(camera, options),
                      order = find_pipeline("priority").make(scene)->draw(camera, options);
    const double largest = z.radiosity.maxCoeff();
    EXPECT_GT(largest, 0);
    EXPECT_LT((z.radiosity - order.radiosity).abs().maxCoeff(), 1e-9 * largest);
  }
}

}  // namespace
}  // namespace radiosity::test
