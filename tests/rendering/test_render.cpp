// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/render.hpp"

#include <cmath>
#include <numbers>

#include "io/files.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/io/read_scene.hpp"

namespace radiosity::test {
namespace {

using Pixel = Rgb8;

/// The sRGB curve in exact integers of 255 steps, from its definition.
int srgb(double linear) {
  return static_cast<int>(
      std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
}

TEST(ToneMap, EncodesAndClampsOnlyForDisplay) {
  BandArray radiosity(4, 3);
  radiosity << 0, 0.001, 0.5,  //
      1, 2, 1e300,             //
      0.25, 0.125, 0.0625,     //
      0, 0, 0;
  const auto colours = tone_map(radiosity, 1);
  EXPECT_EQ(colours[0], (Pixel{0, 3, 188}));  // 12.92·0.001·255 = 3.29; published: linear 0.5 is 188
  EXPECT_EQ(colours[1], (Pixel{255, 255, 255}));
  EXPECT_EQ(colours[2], (Pixel{137, 99, 71}));  // published: linear 0.25 is 137
  EXPECT_EQ(tone_map(radiosity, 2)[2], (Pixel{188, 137, 99}));
}

TEST(ToneMap, OtherNumbersOfBandsAreTheGreyOfTheirMean) {
  const BandArray two{{0.25, 0.75}};
  EXPECT_EQ(tone_map(two, 1)[0], (Pixel{188, 188, 188}));
  const BandArray one{{0.25}};
  EXPECT_EQ(tone_map(one, 2)[0], (Pixel{188, 188, 188}));
}

TEST(AutomaticExposure, PutsTheBrightReflectorsNearWhite) {
  PatchMesh::Arrays arrays;
  // Ten unit triangles of area 1/2, the last one a lamp.
  for (int k = 0; k < 10; ++k) {
    for (const Vec3& x : {Vec3(0, 0, k), Vec3(1, 0, k), Vec3(0, 1, k)}) {
      arrays.corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(k);
    arrays.patch_material.push_back(k == 9 ? 1 : 0);
  }
  arrays.materials = {material("wall", rgb(0.5, 0.5, 0.5), rgb(0, 0, 0)),
                      material("lamp", rgb(0, 0, 0), rgb(0, 0, 1000))};
  const PatchMesh mesh(std::move(arrays));
  BandArray radiosity = BandArray::Zero(10, 3);
  for (Index i = 0; i < 10; ++i) radiosity(i, 1) = i < 9 ? 9 - i : 1000;
  // Of the nine walls' values 1 … 9 the smallest that covers 90 % of their area is the ninth.
  EXPECT_DOUBLE_EQ(automatic_exposure(mesh, radiosity), 0.8 / 9);
  radiosity(0, 1) = 90;  // one in nine is more than 10 %
  EXPECT_DOUBLE_EQ(automatic_exposure(mesh, radiosity), 0.8 / 90);
  EXPECT_EQ(automatic_exposure(mesh, BandArray::Zero(10, 3)), 1);
  EXPECT_THROW(automatic_exposure(mesh, BandArray::Zero(9, 3)), InputError);
}

/// The second pass on a display.
Image render(const Visibility& visibility, const BandArray& values, const Camera& camera, int width,
             int height, double exposure, Index samples = 9) {
  const auto pipeline =
      find_pipeline("radiosity").make({std::make_shared<const PatchMesh>(visibility.mesh()), values});
  return tone_map(
      pipeline->draw(camera,
                     {.width = width, .height = height, .samples = samples, .brightest = 1 / exposure}),
      exposure);
}

/// Looks along −z at [−1, 1]² in the plane z = 0, which just fills a square image.
Camera facing() {
  Camera camera;
  camera.position = {0, 0, 1};
  camera.target = {0, 0, 0};
  camera.vertical_fov_deg = 90;
  return camera;
}

TEST(Render, InterpolatesAQuadBilinearlyBetweenItsVertices) {
  const PatchMesh mesh = one_patch({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
  const BandArray values{{0.0, 0.1, 1.0}, {1.0, 0.2, 0.5}, {0.25, 0.9, 0.5}, {0.75, 0.4, 0.0}};
  const int size = 8;
  const Image image = render(Visibility(mesh), values, facing(), size, size, 1, 1);
  ASSERT_EQ(image.pixels.size(), 64U);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double u = (x + 0.5) / size, v = 1 - (y + 0.5) / size;  // rows run down, y runs up
      for (int b = 0; b < 3; ++b) {
        const double expected = (1 - u) * (1 - v) * values(0, b) + u * (1 - v) * values(1, b) +
                                u * v * values(2, b) + (1 - u) * v * values(3, b);
        EXPECT_NEAR(image.pixels[y * size + x][b], srgb(expected),
                    1);  // where 255·s is half a step, rounding may go either way
      }
    }
}

/// A field that is linear in space is reproduced by every interpolation on every shape.
void expect_linear_field(const std::vector<Vec3>& loop) {
  const PatchMesh mesh = one_patch(loop, 1);
  const auto field = [](const Vec3& x) { return 0.5 + 0.25 * x.x() + 0.2 * x.y(); };
  BandArray values(mesh.vertex_count(), 1);
  for (Index v = 0; v < mesh.vertex_count(); ++v) values(v, 0) = field(mesh.vertex(v));
  const int size = 32;
  const Image image = render(Visibility(mesh), values, facing(), size, size, 1, 1);
  int seen = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const int pixel = image.pixels[y * size + x][0];
      if (pixel == 0) continue;
      ++seen;
      EXPECT_NEAR(pixel, srgb(field({2 * (x + 0.5) / size - 1, 1 - 2 * (y + 0.5) / size, 0})), 1);
    }
  // As many pixels as the patch covers, to within those on its border.
  EXPECT_NEAR(seen, mesh.area(0) / 4 * size * size, 4 * size);
  EXPECT_GT(seen, 50);
}

TEST(Render, ReproducesALinearFieldOnAnyShape) {
  expect_linear_field({{-0.9, -0.9, 0}, {0.9, -0.8, 0}, {0.1, 0.9, 0}});                  // triangle
  expect_linear_field({{-0.9, -0.9, 0}, {0.9, -0.9, 0}, {0.9, 0.9, 0}, {-0.9, 0.9, 0}});  // square
  expect_linear_field({{-0.9, -0.9, 0}, {0.9, -0.9, 0}, {0.3, 0.9, 0}, {-0.3, 0.9, 0}});  // trapezium
  expect_linear_field(
      {{0.9, -0.9, 0}, {0.3, 0.9, 0}, {-0.3, 0.9, 0}, {-0.9, -0.9, 0}});  // other sides parallel
  expect_linear_field({{-0.9, -0.7, 0}, {0.8, -0.9, 0}, {0.9, 0.6, 0}, {-0.5, 0.9, 0}});    // general quad
  expect_linear_field({{-0.9, -0.9, 0}, {0.9, -0.9, 0}, {-0.3, -0.3, 0}, {-0.9, 0.9, 0}});  // concave quad
  expect_linear_field(
      {{-0.9, -0.9, 0}, {0.9, -0.9, 0}, {0.9, 0, 0}, {0, 0, 0}, {0, 0.9, 0}, {-0.9, 0.9, 0}});  // L
}

TEST(Render, BacksAndTheVoidAreBlack) {
  const PatchMesh mesh =
      one_patch({{-0.5, -1, 0}, {-0.5, 1, 0}, {0.5, 1, 0}, {0.5, -1, 0}}, 1);  // front to −z
  const BandArray values = BandArray::Ones(4, 1);
  const Image back = render(Visibility(mesh), values, facing(), 4, 4, 1);
  for (const Pixel& pixel : back.pixels) EXPECT_EQ(pixel, (Pixel{0, 0, 0}));
  Camera camera = facing();
  camera.position.z() = -1;
  const Image front = render(Visibility(mesh), values, camera, 4, 4, 1);
  for (std::size_t k = 0; k < 16; ++k) EXPECT_EQ(front.pixels[k][0], k % 4 == 0 || k % 4 == 3 ? 0 : 255);
}

TEST(Render, ShowsBothSidesOfATwoSidedPatch) {
  // Two patches back to back at the same place.
  PatchMesh::Arrays arrays;
  const std::vector<Vec3> square{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  arrays.vertices = square;
  arrays.vertices.insert(arrays.vertices.end(), square.begin(), square.end());
  arrays.corners = {0, 1, 2, 3, 7, 6, 5, 4};
  arrays.patch_start = {0, 4, 8};
  arrays.patch_surface = {0, 0};
  arrays.patch_material = {0, 0};
  arrays.materials = {material("sheet", BandValues::Constant(1, 0.5), BandValues::Zero(1))};
  const PatchMesh mesh(std::move(arrays));
  BandArray values(8, 1);
  values << 0.25, 0.25, 0.25, 0.25, 1, 1, 1, 1;
  for (const double z : {1.0, -1.0}) {
    Camera camera = facing();
    camera.position.z() = z;
    const Image image = render(Visibility(mesh), values, camera, 16, 16, 1, 1);
    for (const Pixel& pixel : image.pixels) EXPECT_EQ(pixel[0], z > 0 ? 137 : 255);
  }
}

TEST(Render, AveragesSamplesInLinearLightWithNoneAboveWhite) {
  // The left half of the only pixel is white, the right half void: linear 0.5, published: 188.
  const PatchMesh mesh = one_patch({{-1, -1, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 1, 0}}, 1);
  const Image image = render(Visibility(mesh), BandArray::Constant(4, 1, 50), facing(), 1, 1, 1, 4);
  for (const int value : image.pixels[0]) EXPECT_EQ(value, 188);
}

TEST(Render, WideImagesShowMoreAtTheSides) {
  const PatchMesh mesh = one_patch({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, 1);
  const Image image = render(Visibility(mesh), BandArray::Ones(4, 1), facing(), 8, 4, 1, 1);
  for (std::size_t k = 0; k < 32; ++k) EXPECT_EQ(image.pixels[k][0], k % 8 < 2 || k % 8 > 5 ? 0 : 255);
}

TEST(Render, GivesTheSameBytesOnOneThreadAndOnMany) {
  const PatchMesh mesh = room({0, 0, 0}, {3, 2, 4}, true);
  BandArray values(mesh.vertex_count(), 1);
  for (Index v = 0; v < mesh.vertex_count(); ++v) values(v, 0) = 0.1 * (v + 1);
  const Visibility visibility(mesh);
  const Camera camera = automatic_camera(mesh);
  const Image many = render(visibility, values, camera, 33, 21, 1);
  const ThreadLimit limit(1);
  EXPECT_EQ(render(visibility, values, camera, 33, 21, 1).pixels, many.pixels);
}

TEST(Render, RejectsACameraWithoutAView) {
  const PatchMesh mesh = one_patch({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}}, 1);
  const Visibility visibility(mesh);
  const BandArray values = BandArray::Ones(3, 1);
  Camera up_along_view = facing(), no_target = facing(), no_angle = facing();
  up_along_view.up = {0, 0, -2};
  no_target.target = no_target.position;
  no_angle.vertical_fov_deg = 180;
  for (const Camera& camera : {up_along_view, no_target, no_angle})
    EXPECT_THROW(render(visibility, values, camera, 4, 4, 1), InputError);
  EXPECT_THROW(render(visibility, values, facing(), 0, 4, 1), InputError);
  EXPECT_THROW(render(visibility, BandArray::Ones(4, 1), facing(), 4, 4, 1), InputError);
}

/// Whether a point lies inside the camera's square image.
bool in_view(const Camera& camera, const Vec3& x) {
  const Vec3 forward = (camera.target - camera.position).normalized();
  const Vec3 right = forward.cross(camera.up).normalized(), up = right.cross(forward);
  const Vec3 ray = x - camera.position;
  const double half = std::tan(camera.vertical_fov_deg * std::numbers::pi / 360) * ray.dot(forward);
  return half > 0 && std::abs(ray.dot(right)) <= half && std::abs(ray.dot(up)) <= half;
}

TEST(AutomaticCamera, LooksInAtTheOpenSideWithAllInView) {
  const PatchMesh mesh = room({-1, 0, -1}, {1, 2, 1}, true);
  const Camera camera = automatic_camera(mesh);
  EXPECT_GT(camera.position.z(), 1);
  EXPECT_NEAR(camera.position.x(), 0, 1e-12);
  EXPECT_NEAR(camera.position.y(), 1, 1e-12);
  for (const Vec3& x : mesh.vertices()) EXPECT_TRUE(in_view(camera, x));
  // Every pixel of a square image over the opening shows a front.
  const Image image = render(Visibility(mesh), BandArray::Ones(mesh.vertex_count(), 1), camera, 32, 32, 1, 1);
  EXPECT_GE(std::count(image.pixels.begin(), image.pixels.end(), Pixel{255, 255, 255}), 28 * 28);
}

TEST(AutomaticCamera, SeesTheCornellBoxFromPlusZ) {
  const std::filesystem::path file =
      RADIOSITY_SOURCE_DIR "/../shared/scenes/cornell-box-original/CornellBox-Original.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const PatchMesh mesh = make_patches(read_scene(file).scene, KeepFaces{}).mesh;
  const Camera camera = automatic_camera(mesh);
  EXPECT_GT(camera.position.z(), 2);
  EXPECT_NEAR(camera.position.x(), 0, 0.05);
  EXPECT_NEAR(camera.position.y(), 1, 0.05);
  for (const Vec3& x : mesh.vertices()) EXPECT_TRUE(in_view(camera, x));
}

TEST(AutomaticCamera, StandsInsideAClosedRoomLookingAlongItsLongerSide) {
  const PatchMesh mesh = room({0, 0, 0}, {6, 3, 4}, false);
  const Camera camera = automatic_camera(mesh);
  EXPECT_TRUE((camera.position.array() > mesh.lower().array()).all());
  EXPECT_TRUE((camera.position.array() < mesh.upper().array()).all());
  EXPECT_GT(camera.position.x(), 5);
  EXPECT_LT(camera.target.x(), camera.position.x());
  const Image image = render(Visibility(mesh), BandArray::Ones(mesh.vertex_count(), 1), camera, 16, 16, 1, 1);
  for (const Pixel& pixel : image.pixels) EXPECT_EQ(pixel, (Pixel{255, 255, 255}));
}

TEST(AutomaticCamera, LooksDownOnAFloor) {
  const PatchMesh mesh = one_patch({{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, 1);
  const Camera camera = automatic_camera(mesh);
  EXPECT_GT(camera.position.y(), 0.5);
  const Image image = render(Visibility(mesh), BandArray::Ones(4, 1), camera, 9, 9, 1, 1);
  EXPECT_EQ(image.pixels[40], (Pixel{255, 255, 255}));
}

}  // namespace
}  // namespace radiosity::test
