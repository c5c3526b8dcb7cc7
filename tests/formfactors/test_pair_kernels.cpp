// SPDX-License-Identifier: GPL-3.0-or-later
#include "pair_kernels.hpp"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <vector>

namespace radiosity::test {
namespace {

class Numbers {
 public:
  std::vector<double> take(std::size_t count, double low, double high) {
    std::uniform_real_distribution<double> uniform(low, high);
    std::vector<double> out(count);
    for (double& x : out) x = uniform(random_);
    return out;
  }

 private:
  std::mt19937_64 random_{7};
};

void expect_same_bits(const std::function<std::vector<double>(const PairKernels&)>& values) {
  const std::vector<double> plain = values(pair_kernels().front());
  ASSERT_FALSE(plain.empty());
  bool alike = true;
  for (const double value : plain) alike = alike && value == plain.front();
  EXPECT_FALSE(alike) << "all are " << plain.front();
  for (const PairKernels& kernel : pair_kernels()) EXPECT_EQ(values(kernel), plain) << kernel.level;
}

TEST(PairKernels, SumUpQuadraturesAlikeOnEveryLevelOfProcessors) {
  Numbers numbers;
  const std::size_t blocks = 24, points = 9, size = (kColumns + 4 * (kGaussPoints + points)) * kLanes;
  std::vector<double> p = numbers.take(size, 0, 1), q = numbers.take(blocks * size, -1, 1);
  std::vector<ColumnBlock> block;
  for (std::size_t b = 0; b < blocks; ++b) {
    block.push_back({b * size, points});
    // Far, between and near pairs of each kind.
    const std::array<double, 4> reach{0.1, 3, 30, 100};
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (const std::size_t column : {kFarReach, kMiddleReach, kLeastReach})
        q[b * size + column * kLanes + lane] = reach[(b + lane * (column - kFarReach)) % 4];
    for (std::size_t lane = 0; lane < kLanes; ++lane) q[b * size + 2 * kLanes + lane] += 4;
  }
  for (const std::size_t column : {kFarReach, kMiddleReach, kLeastReach}) p[column * kLanes] = 0.1;
  expect_same_bits([&](const PairKernels& kernel) {
    std::vector<double> areas(blocks * kLanes);
    kernel.mutual_areas(p.data(), points, q.data(), block.data(), block.data() + blocks, areas.data());
    return areas;
  });
}

TEST(PairKernels, IntegrateContoursAlikeOnEveryLevelOfProcessors) {
  Numbers numbers;
  const std::size_t count = 8 * kLanes;
  std::vector<double> w = numbers.take(count, -2, 2), d = numbers.take(count, 0, 1),
                      sign = numbers.take(count, -1, 1);
  w[3] = d[3] = d[5] = w[7] = 0;
  const std::vector<double> middle = numbers.take(3, -1, 1), start = numbers.take(3, -1, 1);
  const std::array<double, 3> along{0.6, 0, 0.8}, line{0, -0.8, 0.6};
  const std::vector<double> p = numbers.take(4 * kLanes, 0, 1), q = numbers.take(8 * kLanes, 2, 3);
  expect_same_bits([&](const PairKernels& kernel) {
    return std::vector{
        kernel.parallel_sum(w.data(), d.data(), sign.data(), count),
        kernel.edge_pair(middle.data(), along.data(), 0.5, start.data(), line.data(), 2),
        kernel.edge_pair(start.data(), along.data(), 1, start.data(), along.data(), 1),
        kernel.quadrature({7, kLanes, p.data(), along.data()}, {14, 2 * kLanes, q.data(), line.data()})};
  });
}

TEST(PairKernels, CastShadowsAlikeOnEveryLevelOfProcessors) {
  Numbers numbers;
  const std::array<double, 3> origin{}, u{2, 0, 0}, v{0, 1, 0}, normal{0, 0, 1}, dual_u{0.5, 0, 0},
      dual_v{0, 1, 0}, down{0, 0, -1};
  const ShadowFrame frame{origin.data(), u.data(), v.data(), normal.data(), dual_u.data(), dual_v.data(), 2};
  // Quads of two groups at heights where they overlap, some higher than points; the last is seen from its front alone.
  std::vector<std::vector<double>> columns;
  std::vector<ShadowCorners> shadows;
  const std::array<double, 4> all{0, 0, 0, -1}, front{0, 0, 1, 0.4};
  for (std::size_t k = 0; k < kMostShadowCorners / 4; ++k) {
    const std::vector<double> at = numbers.take(3, -0.3, 0.3);
    const double height = 0.2 + 0.2 * static_cast<double>(k);
    columns.push_back({at[0], at[0] + 0.3, at[0] + 0.3, at[0]});
    columns.push_back({at[1], at[1], at[1] + 0.2, at[1] + 0.2});
    columns.push_back({height, height, height + at[2] / 2, height + at[2] / 2});
  }
  for (std::size_t k = 0; k < kMostShadowCorners / 4; ++k)
    shadows.push_back({columns[3 * k].data(), columns[3 * k + 1].data(), columns[3 * k + 2].data(), 4,
                       k == 3 ? front.data() : all.data(), k % 2});
  std::vector<std::vector<double>> points;
  for (std::size_t k = 0; k < 40; ++k) {
    points.push_back(numbers.take(kLanes, -1, 1));
    points.push_back(numbers.take(kLanes, -1, 1));
    points.push_back(numbers.take(kLanes, 0.3, 2));
  }
  for (const bool triangle : {false, true})
    expect_same_bits([&](const PairKernels& kernel) {
      std::vector<double> all_answers;
      for (std::size_t k = 0; k < points.size(); k += 3) {
        const std::array<const double*, 3> at{points[k].data(), points[k + 1].data(), points[k + 2].data()};
        std::array<std::array<double, kLanes>, 3> answer{};
        const std::array<double*, 3> answers{answer[0].data(), answer[1].data(), answer[2].data()};
        (triangle ? kernel.shadows_on_triangle : kernel.shadows_on_parallelogram)(
            at.data(), down.data(), frame, shadows.data(), shadows.size(), answers.data());
        for (const auto& values : answer) all_answers.insert(all_answers.end(), values.begin(), values.end());
      }
      return all_answers;
    });
}

}  // namespace
}  // namespace radiosity::test
