// SPDX-License-Identifier: GPL-3.0-or-later
#include "shadow_share.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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
Answer by_grid(std::span<const Vec3> q, const Vec3& x, const Vec3& n,
               std::span<const std::vector<Vec3>> occluders) {
  constexpr int kCells = 400;
  const Vec3 e = q[1] - q[0], f = q[2] - q[1];
  Answer out;
  for (int a = 0; a < kCells; ++a)
    for (int b = 0; b < (q.size() == 3 ? a + 1 : kCells); ++b) {
      const double half = q.size() == 3 && a == b ? 0.5 : 1;  // of a cell on the diagonal
      const Vec3 y = q[0] + (a + 0.5) / kCells * e + (b + 0.5) / kCells * f;
      const Vec3 r = y - x;
      const double s = r.squaredNorm();
      const double kernel = half * n.dot(r) * -r.z() / (s * s) * e.cross(f).norm() / (kCells * kCells);
      const bool hit =
          std::any_of(occluders.begin(), occluders.end(), [&](const std::vector<Vec3>& occluder) {
            const Vec3 m = (occluder[1] - occluder[0]).cross(occluder[2] - occluder[0]);
            const Vec3 cut = x + m.dot(occluder[0] - x) / m.dot(r) * r;
            for (std::size_t k = 0; k < occluder.size(); ++k) {
              const Vec3& c = occluder[k];
              if (m.dot((occluder[(k + 1) % occluder.size()] - c).cross(cut - c)) <= 0) return false;
            }
            return true;
          });
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
      std::vector<std::vector<Vec3>> occluders(1 + trial % 4);
      for (auto& occluder : occluders)
        for (int k = 0; k < 3; ++k)
          occluder.push_back(middle + Vec3(within(-0.6, 0.6), within(-0.6, 0.6), within(-0.3, 0.3)));
      const Answer found = ask(q, x, n, occluders);
      const Answer expected = by_grid(q, x, n, occluders);
      ASSERT_FALSE(found.unsure);
      EXPECT_NEAR(found.all, expected.all, 2e-3 * expected.all);
      EXPECT_NEAR(found.seen, expected.seen, 3e-3 * expected.all);
      partial += found.seen > 0 && found.seen < 0.999 * found.all ? 1 : 0;
    }
  EXPECT_GT(partial, 30);
}

TEST(ShadowShare, CountsWhatShadowsShareOnce) {
  const std::vector<Vec3> q{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const auto rectangle = [](double x0, double x1, double y0, double y1, double z) {
    return std::vector<Vec3>{{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}};
  };
  const Vec3 x(0.5, 0.5, 100);  // from where kernels and shadows are those of parallel light, but for 1e-4
  const auto hidden = [&](const std::vector<std::vector<Vec3>>& occluders) {
    const Answer found = ask(q, x, -Vec3::UnitZ(), occluders);
    EXPECT_FALSE(found.unsure);
    return 1 - found.seen / found.all;
  };
  const auto left = rectangle(0.1, 0.4, 0.2, 0.8, 1e-3), right = rectangle(0.6, 0.9, 0.2, 0.8, 2e-3),
             middle = rectangle(0.3, 0.7, 0.2, 0.8, 3e-3), across = rectangle(0, 1, 0.4, 0.6, 3e-3),
             beside = rectangle(0.4, 0.6, 0.2, 0.8, 1e-3);
  EXPECT_NEAR(hidden({left, right}), 0.36, 2e-4);
  EXPECT_NEAR(hidden({left, beside}), 0.30, 2e-4);  // they share an edge
  EXPECT_NEAR(hidden({left, left}), 0.18, 2e-4);    // … all edges
  EXPECT_NEAR(hidden({left, left, left, beside}), 0.30, 2e-4);
  EXPECT_NEAR(hidden({left, middle}), 0.36, 2e-4);
  EXPECT_NEAR(hidden({left, middle, right, across}), 0.48 + 0.04, 2e-4);
  const auto half = rectangle(-1, 0.5, -1, 2, 1e-3), other = rectangle(0.5, 2, -1, 2, 1e-3);
  EXPECT_EQ(hidden({half, other, across}), 1);
}

TEST(ShadowShare, LeavesOutWhatIsAsHighAsThePoint) {
  const std::vector<Vec3> q{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const Vec3 x(-6, 0.4, 3);
  const Vec3 n = (Vec3(0.5, 0.5, 0) - x).normalized();
  const auto upright = [](double y0, double y1, double z1) {
    return std::vector<Vec3>{{-2, y0, 0}, {-2, y1, 0}, {-2, y1, z1}, {-2, y0, z1}};
  };
  for (const double z1 : {2.0, 3.0, 3 + 1e-9, 30.0}) {
    EXPECT_EQ(ask(q, x, n, std::vector<std::vector<Vec3>>{upright(-9, 9, z1)}).seen, 0) << z1;
    const std::vector<std::vector<Vec3>> part{upright(0.3, 0.5, z1),
                                              {{-4, 0.5, 1}, {-4, 0.7, 1}, {-4, 0.7, z1 + 1}}};
    const Answer found = ask(q, x, n, part), expected = by_grid(q, x, n, part);
    EXPECT_NEAR(found.seen, expected.seen, 3e-3 * expected.all) << z1;
    EXPECT_LT(found.seen, 0.9 * found.all) << z1;
    EXPECT_FALSE(found.unsure);
  }
  const std::vector<std::vector<Vec3>> higher{{{-2, -9, 4}, {-2, 9, 4}, {-2, 9, 9}, {-2, -9, 9}}};
  const Answer all = ask(q, x, n, higher);
  EXPECT_EQ(all.seen, all.all);
}

// A lid right under a point that looks down hides all of q, however close it is; one of the same height beside the point hides nothing.
TEST(ShadowShare, IsSureOfNothingThatIsRightBesideThePoint) {
  const std::vector<Vec3> q{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const Vec3 x(0.4, 0.6, 5);
  for (const double gap : {1e-9, 1e-6, 1e-4, 1e-3}) {
    const auto lid = [&](double from) {
      const double z = 5 * (1 - gap);
      return std::vector<std::vector<Vec3>>{{{from, 0, z}, {from + 1, 0, z}, {from + 1, 1, z}, {from, 1, z}}};
    };
    const Answer under = ask(q, x, -Vec3::UnitZ(), lid(0));
    EXPECT_TRUE(under.unsure || under.seen < 1e-12 * under.all) << gap;
    const Answer beside = ask(q, x, -Vec3::UnitZ(), lid(0.5));
    EXPECT_FALSE(beside.unsure) << gap;
    EXPECT_NEAR(beside.seen, beside.all, 1e-12 * beside.all) << gap;
  }
}

}  // namespace
}  // namespace radiosity::test
