// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/point_factors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "cases/closed_forms.hpp"
#include "cases/scenes.hpp"
#include "support/brute_force.hpp"

namespace radiosity::test {
namespace {

std::map<Index, PointFactors::Single> singles(const PointFactors& factors, const Vec3& x, const Vec3& n,
                                              std::uint64_t stream = 0) {
  PointFactors::View view;
  factors.view(x, n, stream, view);
  std::map<Index, PointFactors::Single> result;
  for (const auto& single : view.singles) EXPECT_TRUE(result.emplace(single.patch, single).second);
  return result;
}

// All patches emit, so all are singles. Those not listed are not seen.
TEST(PointFactors, OfLampsAreThoseOfBruteForce) {
  const PatchMesh mesh = room_with_floating_box(4, 2);
  const Visibility visibility(mesh);
  const PointFactors factors(visibility, 32, 1);
  int partial = 0;
  for (Index i = 0; i < mesh.patch_count(); i += 3) {
    const Vec3 x = mesh.centroid(i), n = mesh.normal(i);
    const auto found = singles(factors, x, n);
    for (Index j = 0; j < mesh.patch_count(); ++j) {
      const double expected = i == j ? 0 : brute_force_point_factor(mesh, x, n, i, j);
      const auto at = found.find(j);
      // The sensor stands 1e-9 of the diagonal in front of its patch.
      EXPECT_NEAR(at == found.end() ? 0 : at->second.factor, expected, 1e-8) << i << " " << j;
      if (at == found.end()) continue;
      EXPECT_EQ(at->second.variance, 0);
      partial += expected > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(partial, 1000);
}

// Motes before each lamp, 20, are more than exact shadows are taken of. A screen at half the height, which ends
// above the sensor, hides half of a unit square at distance 1 [Howell, B-3]; its edge runs through the middle patches.
TEST(PointFactors, BehindManyPolygonsAreUnbiasedWithAnHonestVariance) {
  const Vec3 sensor(0.5, 0.5, 0);
  MeshBuilder scene;
  scene.grid({0, 0, 1}, Vec3::UnitY(), Vec3::UnitX(), 3, 3)
      .use_material(grey("dark", 0.5, 0))
      .grid({-1, -1, 0.5}, 3 * Vec3::UnitY(), 1.5 * Vec3::UnitX(), 1, 1);
  constexpr double kMote = 1e-4;  // m: they hide 1e-6 of what the lamps send
  for (int lamp = 0; lamp < 9; ++lamp)
    for (int k = 0; k < 20; ++k) {
      const Vec3 middle((0.5 + lamp / 3) / 3, (0.5 + lamp % 3) / 3, 1);
      const Vec3 corner = sensor + (0.9 + 0.001 * k) * (middle - sensor);
      scene.polygon({corner, corner + Vec3(0, kMote, 0), corner + Vec3(kMote, 0, 0)});
    }
  const PatchMesh mesh = scene.build();
  const Visibility visibility(mesh);
  const PointFactors factors(visibility, 32, 1);
  constexpr int kRuns = 400;
  double bias = 0, squares = 0, variance = 0;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    double error = -element_under_centre(1, 1, 1) / 2;
    for (const auto& [j, single] : singles(factors, sensor, Vec3::UnitZ(), run)) {
      if (j >= 9) continue;
      error += single.factor;
      variance += single.variance / kRuns;
    }
    bias += error / kRuns;
    squares += error * error / kRuns;
  }
  EXPECT_GT(variance, 1e-8);
  EXPECT_LT(std::abs(bias), 4 * std::sqrt(variance / kRuns));
  EXPECT_NEAR(squares / variance, 1, 4 * std::sqrt(2.0 / kRuns));
}

TEST(PointFactors, OfRaysAreThoseOfSingles) {
  const PatchMesh mesh = room_with_floating_box(2, 1);
  const Visibility visibility(mesh);
  const PointFactors factors(visibility, 1 << 15, 5);
  const Vec3 x(0.8, 0.2, 0.3), n = Vec3(-1, 2, 1.5).normalized();
  PointFactors::View view;
  factors.view(x, n, 0, view);
  ASSERT_EQ(static_cast<Index>(view.rays.size()), factors.rays());
  std::map<Index, double> share;
  for (const auto& ray : view.rays) {
    ASSERT_GE(ray.patch, 0);
    EXPECT_TRUE(ray.single);
    share[ray.patch] += 1.0 / factors.rays();
    EXPECT_NEAR(mesh.normal(ray.patch).dot(ray.hit - mesh.centroid(ray.patch)), 0, 1e-6);
    EXPECT_GT(n.dot(ray.hit - x), 0);
  }
  double total = 0;
  for (const auto& single : view.singles) {
    const double f = single.factor;
    EXPECT_NEAR(share[single.patch], f, 5 * std::sqrt(f * (1 - f) / factors.rays()));  // without strata
    total += f;
  }
  EXPECT_NEAR(total, 1, 1e-12);
}

// All patches are lamps; a box of a shelf and its boards stand between many of them.
TEST(PointFactors, WithTheOutlookOfAPatchAreTheSame) {
  MeshBuilder room;
  room.box({0, 0, 0}, {1, 1, 1}, 4, Facing::inward)
      .box({0.3, 0.3, 0.4}, {0.6, 0.65, 0.7}, 2, Facing::outward);
  for (int k = 1; k < 7; ++k) room.box({0.05, 0.2, 0.1 * k}, {0.15, 0.8, 0.1 * k + 0.01}, 1, Facing::outward);
  const PatchMesh mesh = room.build();
  const Visibility visibility(mesh);
  const PointFactors factors(visibility, 32, 1);
  int seen = 0, free = 0, cut = 0;
  for (Index i = 0; i < mesh.patch_count(); i += 2) {
    const auto outlook = factors.outlook(i);
    ASSERT_TRUE(outlook);
    for (const auto& lamp : outlook->lamps) ++(lamp.free ? free : cut);
    const Vec3 a = mesh.vertex(mesh.corners(i)[0]), n = mesh.normal(i);
    for (const double share : {0.02, 0.5, 1.0}) {  // near a corner, half-way, in the middle
      const Vec3 x = a + share * (mesh.centroid(i) - a);
      PointFactors::View with;
      factors.view(x, n, 3, with, &*outlook);
      std::map<Index, double> found;
      for (const auto& single : with.singles) found[single.patch] = single.factor;
      for (const auto& [j, single] : singles(factors, x, n, 3)) {
        const double factor = found.contains(j) ? found[j] : 0;
        found.erase(j);
        if (single.variance > 0) continue;  // by rays: too many boards
        EXPECT_NEAR(factor, single.factor, 1e-12) << i << " " << j;
        ++seen;
      }
      for (const auto& [j, factor] : found) EXPECT_LT(factor, 1e-12) << i << " " << j;
    }
  }
  EXPECT_GT(seen, 5000);
  EXPECT_GT(free, 500);
  EXPECT_GT(cut, 500);
}

// On faces, edges and corners of the room, whatever the direction: no ray slips out through the surface it starts on.
TEST(PointFactors, OnSurfacesSeeTheRoomInFrontOfThem) {
  for (const double turn : {0.0, 0.7}) {
    const Eigen::Affine3d motion =
        Eigen::Translation3d(300, -20, 7) * Eigen::AngleAxisd(turn, Vec3(1, 2, 3).normalized());
    const PatchMesh mesh = transformed(room_with_floating_box(2, 1), motion);
    const Visibility visibility(mesh);
    const PointFactors factors(visibility, 512, 1);
    for (const Vec3& place : {Vec3(0.3, 0.2, 0), Vec3(0, 0.4, 0.7), Vec3(0, 0.4, 0), Vec3(0, 0, 0),
                              Vec3(0.5, 0.5, 0), Vec3(1, 0.25, 1)}) {
      for (const Vec3& facing : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 1, 1), Vec3(0, 1, 0)}) {
        const Vec3 towards = (Vec3(0.5, 0.5, 0.5) - place).cwiseSign();
        bool outwards = false;  // then it lies on the other side of that wall
        for (int axis = 0; axis < 3; ++axis)
          outwards = outwards || ((place[axis] == 0 || place[axis] == 1) && facing[axis] * towards[axis] < 0);
        if (outwards) continue;
        PointFactors::View view;
        factors.view(motion * place, motion.linear() * facing.normalized(), 0, view);
        double total = 0;
        for (const auto& single : view.singles) total += single.factor;
        EXPECT_NEAR(total, 1, 1e-6) << place.transpose() << " | " << facing.transpose();
        for (const auto& ray : view.rays)
          EXPECT_GE(ray.patch, 0) << place.transpose() << " | " << facing.transpose();
      }
    }
  }
}

TEST(PointFactors, OfAnElementOutsideOfTheRoomAreZero) {
  const PatchMesh mesh = cube_room(2);
  const Visibility visibility(mesh);
  const PointFactors factors(visibility, 512, 1);
  for (const Vec3& x : {Vec3(0.4, 0.6, -0.5), Vec3(0.4, 0.6, 0)}) {  // below the floor; on it, facing down
    const Vec3 n = x.z() < 0 ? Vec3::UnitZ() : Vec3(-Vec3::UnitZ());
    PointFactors::View view;
    factors.view(x, n, 0, view);
    for (const auto& single : view.singles) EXPECT_EQ(single.factor, 0);
    for (const auto& ray : view.rays) EXPECT_LT(ray.patch, 0);
  }
}

}  // namespace
}  // namespace radiosity::test
