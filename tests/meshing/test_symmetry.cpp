// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/symmetry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// What `make` throws says.
template <class Make>
std::string refusal(const Make& make) {
  try {
    make();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(nothing was thrown)";
}

Scene with_symmetry(const Shape& shape, Symmetry symmetry, std::vector<Material> materials = {grey()}) {
  Scene::Arrays arrays;
  arrays.materials = std::move(materials);
  for (std::size_t f = 0; f < shape.faces.size(); ++f) {
    std::vector<Index> corners;
    for (const Vec3& x : shape.faces[f]) {
      corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    arrays.add_face(corners, shape.materials[f]);
  }
  arrays.symmetry = std::move(symmetry);
  return Scene(std::move(arrays));
}

/// The inside of [0, 2] × [0, 1]², without its wall at x = 0.
Shape half_room() {
  Shape room = Shape().box({0, 0, 0}, {2, 1, 1}, true);
  room.faces.erase(room.faces.begin());
  room.materials.erase(room.materials.begin());
  return room;
}

TEST(Symmetry, MakesAClosedRoomOfItsHalf) {
  const Patches patches = make_patches(with_symmetry(half_room(), {.planes = {{0, 0}}}), PatchSize{0.5});
  EXPECT_TRUE(patches.warnings.empty());  // it is not open
  const PatchMesh& cell = patches.mesh;
  EXPECT_GT(unmatched_edges(cell), 0);
  const PatchMesh whole = cell.unfolded();
  EXPECT_EQ(whole.patch_count(), 2 * cell.patch_count());
  EXPECT_EQ(unmatched_edges(whole), 0);
  EXPECT_NEAR(total_area(whole), 4 * 4 + 2, 1e-12);
  EXPECT_EQ(whole.lower(), Vec3(-2, 0, 0));
  for (Index i = 0; i < cell.patch_count(); ++i) {
    const Index image = cell.patch_count() + i;
    EXPECT_EQ(whole.normal(image), whole.normal(i).cwiseProduct(Vec3(-1, 1, 1)));
    EXPECT_LT((whole.centroid(image) - whole.centroid(i).cwiseProduct(Vec3(-1, 1, 1))).norm(), 1e-12);
  }
}

TEST(Symmetry, TiesImagesToTheirOriginals) {
  const PatchMesh cell = make_patches(with_symmetry(half_room(), {.planes = {{0, 0}}}), PatchSize{0.5}).mesh;
  const PatchMesh whole = cell.with_images();
  const Index n = cell.patch_count();
  EXPECT_EQ(whole.original_count(), n);
  EXPECT_EQ(whole.cluster_count(), n);
  EXPECT_FALSE(whole.clustered());
  EXPECT_TRUE((whole.cluster_areas() == cell.areas()).all());
  for (Index i = 0; i < n; ++i) {
    EXPECT_EQ(whole.cluster(n + i), i);
    ASSERT_EQ(whole.members(i).size(), 1U);
    EXPECT_EQ(whole.members(i)[0], i);
  }
}

TEST(Symmetry, HasAllImagesOfSeveralPlanesAndAPeriod) {
  const Symmetry symmetry{.planes = {{0, 0}, {1, 2}}, .period = {0, 0, 3}, .steps = 2};
  const std::vector<SymmetryImage> all = images(symmetry);
  EXPECT_EQ(all.size(), 4U * 5 - 1);
  // (1, 1, 1) has its images at x = ±1, y = 1 or 3, z = 1 + 3 k: all different.
  std::vector<Vec3> places{{1, 1, 1}};
  for (const SymmetryImage& image : all) places.push_back(image.of_point({1, 1, 1}, 0));
  for (std::size_t a = 0; a < places.size(); ++a) {
    EXPECT_EQ(std::abs(places[a].x()), 1);
    EXPECT_TRUE(places[a].y() == 1 || places[a].y() == 3);
    EXPECT_EQ(std::abs(std::remainder(places[a].z() - 1, 3)), 0);
    for (std::size_t b = 0; b < a; ++b) EXPECT_NE(places[a], places[b]);
  }
}

TEST(Symmetry, SpreadsAPowerOverTheCell) {
  Material lamp = grey("lamp");
  lamp.emission = BandValues::Constant(1, 18);
  lamp.emits_power = true;
  // 9 m² of the half: 2 W/m².
  const Scene scene = with_symmetry(half_room(), {.planes = {{0, 0}}}, {lamp});
  const PatchMesh cell = make_patches(scene, PatchSize{0.5}).mesh;
  EXPECT_NEAR(cell.emission()(0, 0), 2, 1e-12);
  EXPECT_NEAR(cell.with_images().emission()(cell.patch_count(), 0), 2, 1e-12);
}

TEST(Symmetry, HasNoBorderWhereAMirroredWallGoesOn) {
  const PatchMesh cell = make_patches(with_symmetry(half_room(), {.planes = {{0, 0}}}), PatchSize{0.5}).mesh;
  int in_plane = 0;
  for (Index v = 0; v < cell.vertex_count(); ++v) {
    const Vec3& x = cell.vertex(v);
    if (x.x() != 0) continue;
    // At the edges of the room there is a border, in the middle of its walls none.
    const bool edge = (x.y() == 0 || x.y() == 1) && (x.z() == 0 || x.z() == 1);
    EXPECT_EQ(cell.on_border(v), edge) << x.transpose();
    ++in_plane;
  }
  EXPECT_EQ(in_plane, 4 * 3);
  // A ridge is a border: two slopes that meet in the plane.
  const Scene roof =
      with_symmetry(Shape().face({{0, 0, 1}, {0, 1, 1}, {1, 1, 0}, {1, 0, 0}}), {.planes = {{0, 0}}});
  const PatchMesh slope = make_patches(roof, PatchSize{0.5}).mesh;
  for (Index v = 0; v < slope.vertex_count(); ++v)
    EXPECT_TRUE(slope.vertex(v).x() != 0 || slope.on_border(v));
}

TEST(Symmetry, RefusesWhatIsNoCell) {
  const auto of = [](const Shape& shape, const Symmetry& symmetry) {
    return refusal([&] { with_symmetry(shape, symmetry); });
  };
  EXPECT_THAT(of(half_room(), {.planes = {{0, 0.5}}}),
              AllOf(StartsWith("symmetry: face 1 crosses the plane x = 0.5"), HasSubstr("from 0 to 2 m")));
  EXPECT_THAT(of(Shape().box({0, 0, 0}, {2, 1, 1}, true), {.planes = {{0, 0}}}),
              StartsWith("symmetry: face 0 lies in the plane x = 0"));
  EXPECT_THAT(of(half_room().append(Shape().face(rectangle(-2, 0, -1, 1))), {.planes = {{0, 0}}}),
              AllOf(StartsWith("symmetry: face 5 reaches from -2 to -1 m"), HasSubstr("x = 0")));
  EXPECT_THAT(of(half_room(), {.planes = {{0, 0}, {0, 2.5}}}),
              AllOf(HasSubstr("x = 0 and x = 2.5 are parallel"), HasSubstr("period = [5, 0, 0]")));
  EXPECT_THAT(of(half_room(), {.planes = {{0, 0}, {0, 0}}}), HasSubstr("the plane x = 0 is given twice"));
  EXPECT_THAT(of(half_room(), {.planes = {{0, 0}}, .period = {4, 1, 0}}),
              HasSubstr("period 4 1 0 is neither along nor across the plane x = 0"));
  EXPECT_THAT(of(half_room(), {.period = {1.5, 0, 0}}),
              AllOf(HasSubstr("reaches from 0 to 2 m"), HasSubstr("at most 1.5 m")));
  EXPECT_THAT(
      of(half_room(), {.planes = {{0, 0}}, .period = {3, 0, 0}}),
      AllOf(HasSubstr("2 m from the plane x = 0"), HasSubstr("at most 1.5 m"), HasSubstr("half the period")));
  EXPECT_EQ(of(half_room(), {.planes = {{0, 0}}, .period = {4, 0, 0}}), "(nothing was thrown)");
}

TEST(Symmetry, RefusesMoreImagesThanMemoryHolds) {
  const PatchMesh cell =
      make_patches(with_symmetry(half_room(), {.period = {2, 0, 0}, .steps = 1'000'000}), PatchSize{0.05})
          .mesh;
  EXPECT_THAT(refusal([&] { cell.with_images(); }),
              AllOf(HasSubstr("2000000 images"), HasSubstr("at most 1.6e+07")));
}

TEST(MirrorPlane, IsReadFromTheTextThatItIsWrittenAs) {
  for (const MirrorPlane plane : {MirrorPlane{0, 0}, MirrorPlane{1, -2.5}, MirrorPlane{2, 0.1}}) {
    const MirrorPlane read = plane_of(text_of(plane));
    EXPECT_EQ(read.axis, plane.axis);
    EXPECT_EQ(read.offset, plane.offset);
  }
  EXPECT_EQ(plane_of(" z=1e-3 ").offset, 1e-3);
  for (const char* text : {"", "x", "x =", "w = 0", "x = one", "x = 0 m", "xy = 0", "x = inf"})
    EXPECT_THAT(refusal([&] { plane_of(text); }), HasSubstr("is no plane such as")) << text;
}

}  // namespace
}  // namespace radiosity
