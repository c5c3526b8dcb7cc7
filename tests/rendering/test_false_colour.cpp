// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/false_colour.hpp"

#include <cmath>
#include <limits>
#include <set>

#include "io/files.hpp"
#include "radiosity/rendering/annotate.hpp"

namespace radiosity::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The closed unit cube from within, one patch a side, with vertices of its own as meshes have them at creases.
std::shared_ptr<const PatchMesh> cube() {
  const PatchMesh joined = room({0, 0, 0}, {1, 1, 1}, false);
  PatchMesh::Arrays arrays;
  for (Index i = 0; i < joined.patch_count(); ++i) {
    for (const Index v : joined.corners(i)) {
      arrays.corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(joined.vertex(v));
    }
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(i);
    arrays.patch_material.push_back(0);
  }
  arrays.materials = {joined.materials()[0]};
  return std::make_shared<const PatchMesh>(std::move(arrays));
}

/// Sees nothing but the wall z = 0, upright, from (0.2, 0.3) to (0.8, 0.7).
Camera at_the_wall() {
  Camera camera;
  camera.position = {0.5, 0.5, 0.8};
  camera.target = {0.5, 0.5, 0};
  camera.vertical_fov_deg = 2 * std::atan(0.2 / 0.8) * 180 / M_PI;
  return camera;
}
constexpr int kWidth = 60, kHeight = 40;

/// x at each vertex: linear within patches.
Field x_of_vertices(const PatchMesh& mesh) {
  Field field{.name = "x", .unit = "m", .at_vertices = true, .values = Eigen::ArrayXd(mesh.vertex_count())};
  for (Index v = 0; v < mesh.vertex_count(); ++v) field.values[v] = mesh.vertex(v).x();
  return field;
}

Rgb8 pixel(const Image& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y * image.width + x)];
}

int difference(const Rgb8& a, const Rgb8& b) {
  int most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

TEST(Viridis, HasThePublishedColoursWithinOneStepOfEightBits) {
  EXPECT_THAT(viridis(0), ElementsAre(0x44, 0x01, 0x54));
  EXPECT_LE(difference(viridis(64 / 255.0), {0x3b, 0x52, 0x8b}), 1);
  EXPECT_LE(difference(viridis(128 / 255.0), {0x21, 0x91, 0x8c}), 1);
  EXPECT_LE(difference(viridis(192 / 255.0), {0x5e, 0xc9, 0x62}), 1);
  EXPECT_THAT(viridis(1), ElementsAre(0xfd, 0xe7, 0x25));
}

TEST(Viridis, RisesInLightness) {
  double before = -1;
  for (int k = 0; k <= 100; ++k) {
    const Rgb8 c = viridis(k / 100.0);
    const double luma = 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
    EXPECT_GT(luma, before) << k;
    before = luma;
  }
}

TEST(ColourScale, IsLinearOrLogarithmicAndEndsAtItsEnds) {
  const ColourScale linear{2, 6};
  EXPECT_DOUBLE_EQ(linear.position(3), 0.25);
  EXPECT_EQ(linear.position(1), 0);
  EXPECT_EQ(linear.position(7), 1);
  const ColourScale logarithmic{1, 100, ScaleKind::logarithmic};
  EXPECT_DOUBLE_EQ(logarithmic.position(10), 0.5);
  EXPECT_EQ(logarithmic.position(0), 0);
  EXPECT_EQ(logarithmic.position(-1), 0);
  EXPECT_EQ((ColourScale{3, 3}.position(3)), 0.5);
}

TEST(ColourScale, HasRoundTicks) {
  EXPECT_THAT(round_values({0, 1}, 6), ElementsAre(0, 0.2, 0.4, 0.6, 0.8, 1));
  EXPECT_THAT(round_values({0, 1}, 3), ElementsAre(0, 0.5, 1));
  EXPECT_THAT(round_values({3.1, 17.2}, 4), ElementsAre(5, 10, 15));
  EXPECT_THAT(round_values({-0.3, 0.3}, 4), ElementsAre(-0.2, 0, 0.2));
  EXPECT_THAT(round_values({0.1, 1000, ScaleKind::logarithmic}, 5), ElementsAre(0.1, 1, 10, 100, 1000));
  EXPECT_THAT(round_values({1, 100, ScaleKind::logarithmic}, 9), ElementsAre(1, 2, 5, 10, 20, 50, 100));
  EXPECT_THAT(round_values({1e-8, 1e8, ScaleKind::logarithmic}, 4),
              testing::SizeIs(testing::AllOf(testing::Ge(3u), testing::Le(4u))));
  EXPECT_THAT(round_values({2.2, 4.8, ScaleKind::logarithmic}, 5), ElementsAre(2.5, 3, 3.5, 4, 4.5));
  EXPECT_THAT(round_values({7, 7}, 5), ElementsAre(7));
}

TEST(ColourScale, RefusesWhatCannotBeOne) {
  EXPECT_THAT(message_of<InputError>([] { validate(ColourScale{2, 1}); }), HasSubstr("not falling"));
  EXPECT_THAT(message_of<InputError>([] {
                validate(ColourScale{0, 1, ScaleKind::logarithmic});
              }),
              HasSubstr("must begin above 0"));
}

TEST(FieldView, ShowsValuesOfVerticesInterpolated) {
  const auto mesh = cube();
  const FieldImage seen = FieldView(mesh, x_of_vertices(*mesh)).look(at_the_wall(), kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      EXPECT_NEAR(seen.values[y * kWidth + x], 0.2 + 0.6 * (x + 0.5) / kWidth, 1e-6);
}

TEST(FieldView, ColoursThemByTheScale) {
  const auto mesh = cube();
  const Image image =
      FieldView(mesh, x_of_vertices(*mesh)).colours(at_the_wall(), kWidth, kHeight, 4, {0.2, 0.8});
  for (int x = 0; x < kWidth; ++x)
    EXPECT_LE(difference(pixel(image, x, 20), viridis((x + 0.5) / kWidth)), 1) << x;
}

TEST(FieldView, ShowsOneValueForEachPatchWhereThatIsWhatThereIs) {
  const auto mesh = cube();
  Field field{.name = "number", .values = Eigen::ArrayXd(mesh->patch_count())};
  for (Index i = 0; i < mesh->patch_count(); ++i) field.values[i] = i;
  const FieldImage seen = FieldView(mesh, field).look(at_the_wall(), kWidth, kHeight);
  const Index wall = seen.patch[0];
  EXPECT_GT(mesh->normal(wall).z(), 0.999);
  EXPECT_TRUE((seen.values == wall).all());
}

TEST(FieldView, TellsTheVoidFromZero) {
  const auto mesh = cube();
  Field field{.name = "zero", .values = Eigen::ArrayXd::Zero(mesh->patch_count())};
  Camera outside = at_the_wall();
  outside.position.z() = 10;  // what it sees of the cube are backs
  const FieldView view(mesh, field);
  EXPECT_TRUE(view.look(outside, 8, 8).values.isNaN().all());
  EXPECT_TRUE((view.means(outside, 8, 8, 2).coverage == 0).all());
  EXPECT_TRUE(view.means(at_the_wall(), 8, 8, 4).coverage.isApproxToConstant(1));
  EXPECT_NE(pixel(view.colours(outside, 8, 8, 1, {0, 1}), 4, 4), viridis(0));
}

TEST(FieldView, RefusesFieldsThatAreNotOfItsMesh) {
  const auto mesh = cube();
  Field field{.name = "h", .values = Eigen::ArrayXd::Zero(5)};
  EXPECT_THAT(message_of<InputError>([&] { FieldView(mesh, field); }),
              HasSubstr("'h' has 5 values for 6 patches"));
  field.values = Eigen::ArrayXd::Zero(6);
  field.values[2] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message_of<InputError>([&] { FieldView(mesh, field); }), HasSubstr("'h' is inf at patch 2"));
}

TEST(Isolines, RunWhereTheFieldHasTheirValue) {
  const auto mesh = cube();
  const FieldView view(mesh, x_of_vertices(*mesh));
  const ColourScale scale{0.2, 0.8};
  const FieldImage seen = view.look(at_the_wall(), kWidth, kHeight);
  const Image plain = view.colours(at_the_wall(), kWidth, kHeight, 1, scale);
  Image lines = plain;
  const std::vector<double> levels{0.405};  // at 20.5 pixels from the left: in the middle of column 20
  draw_isolines(lines, seen, *mesh, scale, levels);
  // Its one label is further up, where it found room first.
  EXPECT_EQ(pixel(lines, 20, 35), (Rgb8{255, 255, 255}));
  EXPECT_EQ(pixel(lines, 18, 35), pixel(plain, 18, 35));
  EXPECT_EQ(pixel(lines, 22, 35), pixel(plain, 22, 35));
}

TEST(Isolines, DoNotRunAlongTheBorderOfSurfaces) {
  const auto mesh = cube();
  Field field{.name = "number", .values = Eigen::ArrayXd(mesh->patch_count())};
  for (Index i = 0; i < mesh->patch_count(); ++i) field.values[i] = i;
  Camera camera = at_the_wall();
  camera.vertical_fov_deg = 100;
  const FieldView view(mesh, field);
  const ColourScale scale{0, 5};
  const FieldImage seen = view.look(camera, kWidth, kHeight);
  ASSERT_GT(seen.values.maxCoeff() - seen.values.minCoeff(), 1);
  const Image plain = view.colours(camera, kWidth, kHeight, 1, scale);
  Image lines = plain;
  draw_isolines(lines, seen, *mesh, scale, std::vector{0.5, 1.5, 2.5, 3.5, 4.5});
  EXPECT_EQ(lines.pixels, plain.pixels);
}

TEST(Legend, StandsBesideTheImageWithTheColoursOfTheScale) {
  const auto mesh = cube();
  const Field field = x_of_vertices(*mesh);
  Image image{40, 400, std::vector<Rgb8>(40 * 400, Rgb8{1, 2, 3})};
  const Image out = with_legend(image, field, {1, 2});
  EXPECT_EQ(out.height, 400);
  ASSERT_GT(out.width, 40);
  std::set<Rgb8> beside;
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 40; ++x) ASSERT_EQ(pixel(out, x, y), (Rgb8{1, 2, 3}));
    for (int x = 40; x < out.width; ++x) beside.insert(pixel(out, x, y));
  }
  for (const double t : {0.0, 1.0}) EXPECT_TRUE(beside.contains(viridis(t)));
  // Ticks at 1, 1.2, 1.4 ... or so add text; marks of values beyond add more, and make the bar shorter.
  const Image more = with_legend(image, field, {1, 2}, {.below = true, .above = true});
  EXPECT_NE(more.pixels, out.pixels);
}

TEST(Legend, OfASmallImageIsAsHighAsItMustBe) {
  const Image image{4, 3, std::vector<Rgb8>(12, Rgb8{})};
  EXPECT_GT(with_legend(image, {.name = "h", .values = {}}, {5, 5}).height, 50);
}

}  // namespace
}  // namespace radiosity::test
