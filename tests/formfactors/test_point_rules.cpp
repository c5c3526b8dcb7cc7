// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radiosity::test {
namespace {

template <class F>
double mean(const std::vector<Sample2>& points, F&& f) {
  double sum = 0;
  for (const auto [u, v] : points) sum += f(u, v);
  return sum / static_cast<double>(points.size());
}

TEST(PointRules, AreExactForWhatIsSmoothAndStayInside) {
  const PointRules rules(9000);
  EXPECT_GT(rules.count(), 30U);
  for (double wanted = 1; wanted < 9000; wanted *= 1.07) {
    const auto& [square, triangle] = rules.nearest(wanted);
    SCOPED_TRACE(square.size());
    ASSERT_EQ(square.size(), triangle.size());
    EXPECT_NEAR(static_cast<double>(square.size()) / wanted, 1, wanted < 8 ? 0.61 : 0.34);
    for (const auto [u, v] : square) EXPECT_TRUE(u > 0 && u < 1 && v > 0 && v < 1);
    for (const auto [u, v] : triangle) EXPECT_TRUE(u > 0 && v > 0 && u + v < 1);
    EXPECT_NEAR(mean(square, [](double u, double) { return u; }), 0.5, 1e-13);
    EXPECT_NEAR(mean(square, [](double, double v) { return v; }), 0.5, 1e-13);
    EXPECT_NEAR(mean(square, [](double u, double v) { return u * v; }), 0.25,
                0.3 / static_cast<double>(square.size()));
    EXPECT_NEAR(mean(triangle, [](double u, double) { return u; }), 1.0 / 3, 1e-13);
    EXPECT_NEAR(mean(triangle, [](double, double v) { return v; }), 1.0 / 3, 1e-13);
    if (square.size() < 8) continue;
    EXPECT_EQ(square.size() % 8, 0U);
    EXPECT_NEAR(mean(triangle, [](double u, double) { return u * u; }), 1.0 / 6, 1e-13);
    EXPECT_NEAR(mean(triangle, [](double u, double v) { return u * v; }), 1.0 / 12, 1e-13);
    EXPECT_NEAR(mean(triangle, [](double, double v) { return v * v; }), 1.0 / 6, 1e-13);
  }
  EXPECT_EQ(rules.nearest_of_vectors(0.1).square.size(), 8U);
  EXPECT_EQ(rules.nearest(0.1).square.size(), 1U);
}

// max(0, (cos φ) (u − ½) + (sin φ) (v − ½) − c), which is 0 on one side of a line: its mean against that over a fine grid.
double worst_kink_error(const std::vector<Sample2>& points, double angle) {
  std::vector<Sample2> grid;
  constexpr int kFine = 300;
  for (int a = 0; a < kFine; ++a)
    for (int b = 0; b < kFine; ++b) grid.push_back({(a + 0.5) / kFine, (b + 0.5) / kFine});
  double worst = 0;
  for (const double c : {-0.31, -0.17, -0.05, 0.08, 0.19, 0.33}) {
    const auto kink = [&](double u, double v) {
      return std::max(0.0, std::cos(angle) * (u - 0.5) + std::sin(angle) * (v - 0.5) - c);
    };
    worst = std::max(worst, std::abs(mean(points, kink) - mean(grid, kink)));
  }
  return worst;
}

TEST(PointRules, MeetBordersOfShadowsAtManyPlaces) {
  const PointRules rules(1024);
  for (const double wanted : {16.0, 64.0, 256.0, 1024.0}) {
    const auto& square = rules.nearest(wanted).square;
    const double n = static_cast<double>(square.size());
    SCOPED_TRACE(n);
    // A grid errs by up to 1 / (8 n) where borders run along its lines.
    for (const double along : {0.0, std::numbers::pi / 2})
      EXPECT_LT(worst_kink_error(square, along), 1 / (8 * n * n) + 2e-6);
    for (const double angle : {0.3, 0.7, 1.2, 2.0, 2.6})
      EXPECT_LT(worst_kink_error(square, angle), 0.16 / n) << angle;
  }
}

}  // namespace
}  // namespace radiosity::test
