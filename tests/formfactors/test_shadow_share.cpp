// SPDX-License-Identifier: GPL-3.0-or-later
#include "shadow_share.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "cases/scenes.hpp"

namespace radiosity::test {
namespace {

struct Answer {
  double all = 0, seen = 0;
  bool unsure = false;
};

Answer ask(std::span<const Vec3> q, const Vec3& x, const Vec3& n,
           std::span<const std::vector<Vec3>> occluders) {
  ShadowShare shadows(q, Vec3::UnitZ());
  for (std::size_t k = 0; k < occluders.size(); ++k) shadows.add(occluders[k], k, nullptr);
  ShadowShare::Points points;
  points.add(x, 1);
  points.fill();
  shadows.add_to(points, n);
  return {points.all[0], points.seen[0], points.unsure[0] != 0};
}

// By the midpoints of a fine grid; the corner of q that is left out of a triangle is behind its longest side.
Answer by_grid(std::span<const Vec3> q, const Vec3& x, const Vec3& n, const std::vector<Vec3>& occluder) {
  constexpr int kCells = 400;
  const Vec3 e = q[1] - q[0], f = q[2] - q[1];
  const Vec3 m = (occluder[1] - occluder[0]).cross(occluder[2] - occluder[0]);
  Answer out;
  for (int a = 0; a < kCells; ++a)
    for (int b = 0; b < (q.size() == 3 ? a + 1 : kCells); ++b) {
      const double half = q.size() == 3 && a == b ? 0.5 : 1;  // of a cell on the diagonal
      const Vec3 y = q[0] + (a + 0.5) / kCells * e + (b + 0.5) / kCells * f;
      const Vec3 r = y - x;
      const double s = r.squaredNorm();
      const double kernel = half * n.dot(r) * -r.z() / (s * s) * e.cross(f).norm() / (kCells * kCells);
      const Vec3 cut = x + m.dot(occluder[0] - x) / m.dot(r) * r;
      bool hit = true;
      for (std::size_t k = 0; k < occluder.size(); ++k) {
        const Vec3& c = occluder[k];
        hit = hit && m.dot((occluder[(k + 1) % occluder.size()] - c).cross(cut - c)) > 0;
      }
      out.all += kernel;
      out.seen += hit ? 0 : kernel;
    }
  return out;
}

TEST(ShadowShare, IsThatOfAFineGrid) {
  std::mt19937_64 random(1);
  const auto within = [&](double low, double high) { return low + (high - low) * uniform(random); };
  const std::vector<Vec3> parallelogram{{0, 0, 0}, {1, 0.2, 0}, {1.3, 1, 0}, {0.3, 0.8, 0}};
  const std::vector<Vec3> triangle{{0, 0, 0}, {1, 0.2, 0}, {0.8, 1.1, 0}};
  int partial = 0;
  for (const auto& q : {parallelogram, triangle})
    for (int trial = 0; trial < 40; ++trial) {
      const Vec3 x(within(-3, 4), within(-3, 4), within(4, 6));
      const Vec3 n = (Vec3(0.5, 0.5, 0) - x + Vec3(within(-2, 2), within(-2, 2), 0)).normalized();
      const Vec3 middle = x + within(0.4, 0.7) * (Vec3(within(0, 1), within(0, 1), 0) - x);
      std::vector<Vec3> occluder;
      for (int k = 0; k < 3; ++k)
        occluder.push_back(middle + Vec3(within(-0.6, 0.6), within(-0.6, 0.6), within(-0.3, 0.3)));
      const Answer found = ask(q, x, n, std::vector<std::vector<Vec3>>{occluder});
      const Answer expected = by_grid(q, x, n, occluder);
      ASSERT_FALSE(found.unsure);
      EXPECT_NEAR(found.all, expected.all, 2e-3 * expected.all);
      EXPECT_NEAR(found.seen, expected.seen, 3e-3 * expected.all);
      partial += found.seen > 0 && found.seen < 0.999 * found.all ? 1 : 0;
    }
  EXPECT_GT(partial, 30);
}

TEST(ShadowShare, IsUnsureWhereShadowsMayOverlap) {
  const std::vector<Vec3> q{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const auto square = [](double low, double high, double z) {
    return std::vector<Vec3>{{low, 0.2, z}, {high, 0.2, z}, {high, 0.8, z}, {low, 0.8, z}};
  };
  const Vec3 x(0.5, 0.5, 100);
  EXPECT_FALSE(ask(q, x, -Vec3::UnitZ(), std::vector{square(0.1, 0.4, 1e-3), square(0.6, 0.9, 2e-3)}).unsure);
  EXPECT_TRUE(ask(q, x, -Vec3::UnitZ(), std::vector{square(0.1, 0.6, 1e-3), square(0.4, 0.9, 2e-3)}).unsure);
  EXPECT_TRUE(ask(q, x, -Vec3::UnitZ(), std::vector<std::vector<Vec3>>{square(0.1, 0.6, 100)}).unsure);
  // 0.3 · 0.6 twice of nearly equal kernels.
  const Answer two = ask(q, x, -Vec3::UnitZ(), std::vector{square(0.1, 0.4, 1e-3), square(0.6, 0.9, 2e-3)});
  EXPECT_NEAR(two.seen / two.all, 1 - 0.36, 1e-4);
}

}  // namespace
}  // namespace radiosity::test
