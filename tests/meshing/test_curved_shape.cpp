// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/curved_shape.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;
using testing::HasSubstr;

/// Facets as they are made, without repair: the faces are the patches.
PatchMesh mesh_of(const CurvedShape& shape, double chord_error) {
  Scene::Arrays arrays;
  tessellate(shape, chord_error, 0, arrays);
  arrays.materials = {grey()};
  return make_patches(Scene(std::move(arrays)), KeepFaces{}).mesh;
}

/// ⅓ Σ A n·c
double volume(const PatchMesh& mesh) {
  double sum = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    sum += mesh.area(i) * mesh.normal(i).dot(mesh.centroid(i)) / 3;
  return sum;
}

// The ball of radius r − e is within the facets, which are within the ball of radius r.
TEST(CurvedShape, ASphereIsNowhereFurtherFromItsFacetsThanTheChordError) {
  const Vec3 centre(1, 2, 3);
  const double r = 0.5;
  Index last = 0;
  for (const double e : {0.1, 0.01, 0.001}) {
    const PatchMesh mesh = mesh_of({.surface = Sphere{centre, r}}, e);
    EXPECT_EQ(unmatched_edges(mesh), 0);
    for (const Vec3& x : mesh.vertices()) EXPECT_NEAR((x - centre).norm(), r, 1e-15);
    double nearest = r;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      nearest = std::min(nearest, mesh.normal(i).dot(mesh.centroid(i) - centre));
    EXPECT_GE(nearest, r - e);
    if (e < 0.1) {
      EXPECT_LT(nearest, r - e / 2);  // not finer than needed
    }
    const double inner = std::pow(1 - e / r, 2);
    EXPECT_GT(mesh.areas().sum(), 4 * pi * r * r * inner);
    EXPECT_LT(mesh.areas().sum(), 4 * pi * r * r);
    EXPECT_GT(volume(mesh), 4 * pi / 3 * r * r * r * inner * (1 - e / r));
    EXPECT_LT(volume(mesh), 4 * pi / 3 * r * r * r);
    // Euler: all is one closed surface without a handle, smooth everywhere, so each position is one vertex.
    EXPECT_EQ(mesh.vertex_count(), mesh.patch_count() / 2 + 2);
    EXPECT_GT(mesh.patch_count(), last);
    last = mesh.patch_count();
    EXPECT_LT(mesh.patch_count(),
              4 * pi * r / e + 100);  // an even division has about 8 π r / (√27 e) triangles
  }
}

TEST(CurvedShape, TurnedOverItHasItsFrontsOnTheOtherSide) {
  const CurvedShape sphere{.surface = Sphere{{0, 0, 0}, 1}};
  CurvedShape inside = sphere;
  inside.flip = true;
  EXPECT_NEAR(volume(mesh_of(inside, 0.1)), -volume(mesh_of(sphere, 0.1)), 1e-14);
}

// A prism over a regular n-gon: ½ n r² sin(2π/n) h.
TEST(CurvedShape, ACylinderIsAPrism) {
  const double r = 0.3;
  const Vec3 base(1, 0, 0), top(1, 2, 1);
  const double h = std::sqrt(5.0);
  for (const double e : {0.01, 1e-4}) {
    const double n = std::max(16.0, std::ceil(pi / std::acos(1 - e / r)));
    EXPECT_LE(r * (1 - std::cos(pi / n)), e);
    const PatchMesh closed = mesh_of({.surface = Cylinder{base, top, r, true}}, e);
    EXPECT_EQ(closed.patch_count(), static_cast<Index>(n) + 2);
    EXPECT_EQ(unmatched_edges(closed), 0);
    EXPECT_NEAR(volume(closed), n * r * r * std::sin(2 * pi / n) / 2 * h, 1e-12);
    const PatchMesh open = mesh_of({.surface = Cylinder{base, top, r}}, e);
    EXPECT_EQ(open.patch_count(), static_cast<Index>(n));
    EXPECT_NEAR(open.areas().sum(), 2 * n * r * std::sin(pi / n) * h, 1e-12);
    EXPECT_EQ(open.vertex_count(), 2 * static_cast<Index>(n));  // smooth all round
  }
}

TEST(CurvedShape, ADiskIsARegularPolygon) {
  const PatchMesh mesh = mesh_of({.surface = Disk{{1, 2, 3}, {0, 3, 4}, 2}}, 0.001);
  ASSERT_EQ(mesh.patch_count(), 1);
  const double n = std::ceil(pi / std::acos(1 - 0.0005));
  EXPECT_NEAR(mesh.area(0), n * 4 * std::sin(2 * pi / n) / 2, 1e-12);
  EXPECT_TRUE(mesh.normal(0).isApprox(Vec3(0, 0.6, 0.8), 1e-12));
  EXPECT_TRUE(mesh.centroid(0).isApprox(Vec3(1, 2, 3), 1e-12));
}

/// z = f over [0, 1]², f a polynomial of degree 3 given at 0, 1/3, 2/3, 1 as Bernstein coefficients in x and y.
std::array<Vec3, 16> graph(const std::array<double, 16>& z) {
  std::array<Vec3, 16> points;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      points[4 * i + j] = {static_cast<double>(i) / 3, static_cast<double>(j) / 3, z[4 * i + j]};
  return points;
}

// z = x² has the Bernstein coefficients 0, 0, 1/3, 1; its area is ∫ √(1 + 4x²) dx = √5/2 + asinh(2)/4.
TEST(CurvedShape, ABezierPatchIsNowhereFurtherFromItsFacetsThanTheChordError) {
  const double third = 1.0 / 3;
  const CurvedShape shape{
      .surface = BezierSurface{{graph({0, 0, 0, 0, 0, 0, 0, 0, third, third, third, third, 1, 1, 1, 1})}}};
  for (const double e : {0.1, 0.01, 0.0005}) {
    const PatchMesh mesh = mesh_of(shape, e);
    for (const Vec3& x : mesh.vertices()) EXPECT_NEAR(x.z(), x.x() * x.x(), 1e-15);
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      const Vec3& c = mesh.centroid(i);
      EXPECT_GT(mesh.normal(i).z(), 0);
      // The facet lies above the parabola, where M_uu = 2 makes the bound exact: by at most h²/4 of its width h.
      double low = 1, high = 0;
      for (const Index v : mesh.corners(i)) {
        low = std::min(low, mesh.vertex(v).x());
        high = std::max(high, mesh.vertex(v).x());
      }
      EXPECT_LE((high - low) * (high - low) / 4, e * (1 + 1e-12));
      EXPECT_GE(c.z(), c.x() * c.x());
      EXPECT_LE(c.z() - c.x() * c.x(), e);
    }
    EXPECT_LT(mesh.areas().sum(), std::sqrt(5.0) / 2 + std::asinh(2.0) / 4);
    EXPECT_NEAR(mesh.areas().sum(), std::sqrt(5.0) / 2 + std::asinh(2.0) / 4, 4 * e);
  }
}

TEST(CurvedShape, BezierPatchesWithACommonEdgeHaveNoGap) {
  // Two lids over one curved rim: points as they are, and those of the other patch with u and v exchanged, which turns it over, and
  // its edges run the other way round.
  std::array<Vec3, 16> upper =
      graph({0.11, 0.2, 0.13, 0.3, 0.17, 0.9, 0.7, 0.1, 0.23, 0.8, 0.6, 0.2, 0.31, 0.1, 0.2, 0.05});
  for (Vec3& x : upper) x += Vec3(0.1, 0.2, 0.3);
  std::array<Vec3, 16> lower;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const bool rim = i % 3 == 0 || j % 3 == 0;
      lower[4 * i + j] = upper[4 * (3 - j) + (3 - i)] - (rim ? Vec3(0, 0, 0) : Vec3(0, 0, 1));
    }
  const PatchMesh mesh = mesh_of({.surface = BezierSurface{{upper, lower}}}, 0.003);
  EXPECT_GT(mesh.patch_count(), 200);
  EXPECT_EQ(unmatched_edges(mesh), 0);
  EXPECT_GT(volume(mesh), 0);
}

TEST(CurvedShape, ABezierPatchMayEndInATip) {
  std::array<Vec3, 16> points = graph({});
  for (std::size_t j = 0; j < 4; ++j) points[12 + j] = {1, 0.5, 0.4};
  Scene::Arrays arrays;
  tessellate({.surface = BezierSurface{{points}}}, 0.005, 0, arrays);
  arrays.materials = {grey()};
  const Patches patches = make_patches(Scene(std::move(arrays)), KeepFaces{});
  EXPECT_EQ(patches.repairs.degenerate_faces, 0);
  EXPECT_EQ(patches.repairs.merged_vertices, 0);
  EXPECT_GT(patches.mesh.patch_count(), 10);
}

TEST(CurvedShape, RefusesWhatHasNoSurface) {
  const auto error = [](CurvedShape shape, double chord_error = 0.1) {
    shape.name = "ball";
    Scene::Arrays arrays;
    try {
      tessellate(shape, chord_error, 0, arrays);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(error({.surface = Sphere{{0, 0, 0}, 0}}),
              HasSubstr("shape 'ball': radius 0 m is not positive"));
  EXPECT_THAT(error({.surface = Sphere{{0, 0, 0}, 1}}, -1), HasSubstr("chord error -1 m is not positive"));
  EXPECT_THAT(error({.surface = Sphere{{0, 0, 0}, 1}}, 1e-9), HasSubstr("a chord error of 1e-09 m takes"));
  EXPECT_THAT(error({.surface = Sphere{{0, NAN, 0}, 1}}), HasSubstr("centre 0 nan 0 is not finite"));
  EXPECT_THAT(error({.surface = Cylinder{{0, 0, 0}, {0, 0, 0}, 1}}),
              HasSubstr("length from base to top 0 m"));
  EXPECT_THAT(error({.surface = Disk{{0, 0, 0}, {0, 0, 0}, 1}}), HasSubstr("normal 0 0 0 is none"));
  EXPECT_THAT(error({.surface = BezierSurface{}}), HasSubstr("has no points"));
}

TEST(CurvedShape, FitsIntoItsBall) {
  const std::array<Vec3, 16> flat = graph({});
  for (const CurvedShape& shape : {CurvedShape{.surface = Sphere{{1, 2, 3}, 2}},
                                   CurvedShape{.surface = Cylinder{{0, 0, 0}, {3, 0, 0}, 1}},
                                   CurvedShape{.surface = Disk{{1, 2, 3}, {0, 3, 4}, 2}},
                                   CurvedShape{.surface = BezierSurface{{flat}}}}) {
    const Ball ball = enclosing_ball(shape);
    const PatchMesh mesh = mesh_of(shape, 0.01);
    double far = 0;
    for (const Vec3& x : mesh.vertices()) far = std::max(far, (x - ball.centre).norm());
    EXPECT_NEAR(far, ball.radius, 1e-12);
    EXPECT_LE(size(shape), ball.radius + 1e-12);
  }
}

}  // namespace
}  // namespace radiosity::test
