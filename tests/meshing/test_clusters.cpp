// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

/// A floor of 2 × 2 m with 16 × 16 blocks of 4 cm on it, sides and tops.
Scene blocks() {
  Shape shape;
  shape.face(rectangle(0, 0, 2, 2));
  for (int a = 0; a < 16; ++a)
    for (int b = 0; b < 16; ++b) {
      const Vec3 corner(0.05 + 0.12 * a, 0.05 + 0.12 * b, 0);
      shape.append(Shape().box(corner, corner + Vec3(0.04, 0.04, 0.04), false, false));
    }
  return shape.scene();
}

Eigen::AlignedBox3d box_of(const PatchMesh& mesh, Index cluster) {
  Eigen::AlignedBox3d box;
  for (const Index i : mesh.members(cluster))
    for (const Index v : mesh.corners(i)) box.extend(mesh.vertex(v));
  return box;
}

TEST(Clusters, JoinSmallFacesThatFaceTheSameWay) {
  const PatchMesh mesh = make_patches(blocks(), PatchSize{0.5}).mesh;
  ASSERT_TRUE(mesh.clustered());
  EXPECT_LT(mesh.cluster_count(), mesh.patch_count() / 4);
  double area = 0;
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    EXPECT_LE(box_of(mesh, c).sizes().maxCoeff(), 0.5 * 1.0001);
    double of_members = 0;
    for (const Index i : mesh.members(c)) {
      EXPECT_EQ(mesh.cluster(i), c);
      of_members += mesh.area(i);
      for (const Index j : mesh.members(c))
        if (mesh.cluster_areas()[c] > 0.5 * 0.5 / 16) {
          EXPECT_GT(mesh.normal(i).dot(mesh.normal(j)), -1e-9);
        }
    }
    EXPECT_NEAR(mesh.cluster_areas()[c], of_members, 1e-12);
    area += of_members;
  }
  EXPECT_NEAR(area, mesh.areas().sum(), 1e-9);
}

TEST(Clusters, AreNumberedByTheirFirstMembers) {
  const PatchMesh mesh = make_patches(blocks(), PatchSize{0.5}).mesh;
  Index next = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    EXPECT_LE(mesh.cluster(i), next);
    if (mesh.cluster(i) == next) {
      EXPECT_EQ(mesh.members(next)[0], i);
      ++next;
    }
  }
  EXPECT_EQ(next, mesh.cluster_count());
}

TEST(Clusters, AreNoneWhereFacesAreKeptOrPatchesAreAsSmall) {
  EXPECT_FALSE(make_patches(blocks(), KeepFaces{}).mesh.clustered());
  EXPECT_FALSE(make_patches(blocks(), PatchSize{0.04}).mesh.clustered());
}

TEST(Clusters, NeverHoldSeveralMaterialsOrFrontsAndBacks) {
  Shape shape;
  for (int k = 0; k < 100; ++k) {
    const double x = 0.01 * k;
    shape.face(rectangle(x, 0, x + 0.01, 0.01), k % 2);
  }
  const PatchMesh mesh = make_patches(shape.scene({grey("a", Sides::both), grey("b")}), PatchSize{2}).mesh;
  EXPECT_EQ(mesh.cluster_count(), 3);
  for (Index i = 0; i < mesh.patch_count(); ++i)
    for (const Index j : mesh.members(mesh.cluster(i))) {
      EXPECT_EQ(mesh.material(i), mesh.material(j));
      EXPECT_GT(mesh.normal(i).dot(mesh.normal(j)), 0);
    }
  EXPECT_THROW(mesh.with_clusters(std::vector<Index>(static_cast<std::size_t>(mesh.patch_count()), 0)),
               InputError);
  EXPECT_THROW(mesh.with_clusters({0}), InputError);
}

TEST(Clusters, BringAnyNumberOfFacesNearTheTarget) {
  for (const Index target : {200, 1000}) {
    const PatchMesh mesh = make_patches(icosphere(5), AutoPatches{target}).mesh;  // 20,480 faces
    EXPECT_EQ(mesh.patch_count(), 20480);
    EXPECT_NEAR(mesh.cluster_count(), target, 0.3 * target);
  }
}

TEST(Clusters, SpreadTheirValuesOverTheirMembers) {
  const PatchMesh mesh = make_patches(blocks(), PatchSize{0.5}).mesh;
  BandArray values(mesh.cluster_count(), 2);
  for (Index c = 0; c < mesh.cluster_count(); ++c) values.row(c) << c, 2 * c;
  const BandArray spread = mesh.per_patch(values);
  ASSERT_EQ(spread.rows(), mesh.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) EXPECT_EQ(spread(i, 1), 2 * mesh.cluster(i));
  EXPECT_TRUE((mesh.per_cluster(spread) == values).all());
}

}  // namespace
}  // namespace radiosity
