// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity::test {
namespace {

PatchMesh plate(Index nu, Index nv) {
  return MeshBuilder().grid({0, 0, 0}, Vec3::UnitX() * nu, Vec3::UnitY() * nv, nu, nv).build();
}

/// f at the centroids of the patches.
BandArray sampled(const PatchMesh& mesh, const auto& f) {
  BandArray values(mesh.patch_count(), 1);
  for (Index i = 0; i < mesh.patch_count(); ++i) values(i, 0) = f(mesh.centroid(i));
  return values;
}

Index vertex_at(const PatchMesh& mesh, const Vec3& x) {
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    if ((mesh.vertex(v) - x).norm() < 1e-9) return v;
  ADD_FAILURE() << "no vertex at " << x.transpose();
  return 0;
}

TEST(VertexValues, FollowTheFormulasOfTheBlockOfFourPatches) {
  const PatchMesh mesh = plate(2, 2);  // patches 0 1 / 2 3
  BandArray b(4, 2);
  b << 8, 3, 6, 4, 5, 5, 7, 4;
  const BandArray values = vertex_values(mesh, b);
  for (const Index band : {0, 1}) {
    const double centre = b.col(band).mean();  // B_e
    const auto value = [&](double x, double y) { return values(vertex_at(mesh, {x, y, 0}), band); };
    EXPECT_DOUBLE_EQ(value(1, 1), centre);
    EXPECT_DOUBLE_EQ(value(1, 0), b(0, band) + b(1, band) - centre);  // B_b = B_1 + B_2 − B_e
    EXPECT_DOUBLE_EQ(value(0, 1), b(0, band) + b(2, band) - centre);
    EXPECT_DOUBLE_EQ(value(2, 1), b(1, band) + b(3, band) - centre);
    EXPECT_DOUBLE_EQ(value(0, 0), 2 * b(0, band) - centre);  // B_a = 2 B_1 − B_e
    EXPECT_DOUBLE_EQ(value(2, 2), 2 * b(3, band) - centre);
  }
}

TEST(VertexValues, RepeatAConstantField) {
  const MeshBuilder ball = MeshBuilder().sphere(Vec3::Zero(), 1, 1, Facing::outward);
  for (const PatchMesh& mesh :
       {plate(3, 4), plate(1, 5), cube_room(3), ball.build(), tetrahedron(), two_rooms(1)}) {
    const BandArray values = vertex_values(mesh, BandArray::Constant(mesh.patch_count(), 3, 0.7));
    ASSERT_EQ(values.rows(), mesh.vertex_count());
    ASSERT_EQ(values.cols(), 3);
    EXPECT_LT((values - 0.7).abs().maxCoeff(), 1e-14);
  }
}

TEST(VertexValues, RepeatALinearFieldOnARegularGrid) {
  const auto linear = [](const Vec3& x) { return 20 + 2 * x.x() - 3 * x.y(); };
  const PatchMesh mesh = plate(5, 4);
  const BandArray values = vertex_values(mesh, sampled(mesh, linear));
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    EXPECT_NEAR(values(v, 0), linear(mesh.vertex(v)), 1e-12) << mesh.vertex(v).transpose();
}

TEST(VertexValues, TakeTheMeanWhereAStripHasNoInnerVertex) {
  const PatchMesh mesh = plate(3, 1);
  BandArray b(3, 1);
  b << 1, 3, 8;
  const BandArray values = vertex_values(mesh, b);
  const auto value = [&](double x, double y) { return values(vertex_at(mesh, {x, y, 0}), 0); };
  EXPECT_DOUBLE_EQ(value(0, 0), 1);
  EXPECT_DOUBLE_EQ(value(1, 0), 2);
  EXPECT_DOUBLE_EQ(value(2, 1), 5.5);
  EXPECT_DOUBLE_EQ(value(3, 1), 8);
}

TEST(VertexValues, ReachOutFromTheMiddleOfAFanOfTriangles) {
  PatchMesh::Arrays arrays;
  arrays.materials = {grey("fan", 0.5, 1)};
  arrays.vertices = {{0, 0, 0}};
  for (Index k = 0; k < 6; ++k) {
    const double angle = std::numbers::pi / 3 * k;
    arrays.vertices.emplace_back(std::cos(angle), std::sin(angle), 0);
    arrays.corners.insert(arrays.corners.end(), {0, k + 1, (k + 1) % 6 + 1});
    arrays.patch_start.push_back(3 * (k + 1));
    arrays.patch_surface.push_back(0);
    arrays.patch_material.push_back(0);
  }
  const PatchMesh mesh(arrays);
  BandArray b(6, 1);
  b << 4, 5, 6, 7, 6, 5;
  const BandArray values = vertex_values(mesh, b);
  EXPECT_DOUBLE_EQ(values(0, 0), 5.5);
  EXPECT_DOUBLE_EQ(values(1, 0), (5 + 4) - 5.5);  // between patches 5 and 0
  EXPECT_DOUBLE_EQ(values(4, 0), (6 + 7) - 5.5);  // between patches 2 and 3
}

TEST(VertexValues, NeverFallBelowZero) {
  const PatchMesh mesh = plate(2, 2);
  BandArray b(4, 1);
  b << 0, 1, 1, 1;
  const BandArray values = vertex_values(mesh, b);
  EXPECT_EQ(values(vertex_at(mesh, {0, 0, 0}), 0), 0);  // 2·0 − 3/4
  EXPECT_DOUBLE_EQ(values(vertex_at(mesh, {1, 0, 0}), 0), 0.25);
  EXPECT_GE(values.minCoeff(), 0);
}

TEST(VertexValues, LetNothingBleedRoundTheEdgesOfACube) {
  const PatchMesh mesh = cube_room(2);
  BandArray b(mesh.patch_count(), 1);
  for (Index i = 0; i < mesh.patch_count(); ++i) b(i, 0) = 1 + mesh.surface(i);
  const BandArray values = vertex_values(mesh, b);
  for (Index i = 0; i < mesh.patch_count(); ++i)
    for (const Index v : mesh.corners(i))
      EXPECT_DOUBLE_EQ(values(v, 0), b(i, 0)) << "vertex " << v << " of patch " << i;
}

TEST(VertexValues, RefuseAFieldOfAnotherSize) {
  EXPECT_THROW(vertex_values(plate(2, 2), BandArray::Ones(5, 1)), InputError);
}

}  // namespace
}  // namespace radiosity::test
