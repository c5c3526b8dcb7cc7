// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_rules.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>

namespace radiosity {
namespace {

using Points = std::vector<Sample2>;

// The square of the shortest vector (a, b) ≠ 0 of integers with a + g b ≡ 0 modulo n, by Gauss's reduction.
std::int64_t shortest_dual(std::int64_t n, std::int64_t g) {
  const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1]; };
  std::array<std::int64_t, 2> a{n, 0}, b{-g, 1};
  for (;;) {
    if (dot(a, a) < dot(b, b)) std::swap(a, b);
    const std::int64_t square = dot(b, b);
    if (2 * std::abs(dot(a, b)) <= square) return square;
    const auto times = std::llround(static_cast<double>(dot(a, b)) / static_cast<double>(square));
    for (std::size_t k = 0; k < 2; ++k) a[k] -= times * b[k];
  }
}

// Calls f(u, v) for the points (k + ½) (1, g) / n modulo 1, in units of 1 / (2 n).
template <class F>
void for_each_in_lattice(std::int64_t n, std::int64_t g, F&& f) {
  for (std::int64_t u = 1, v = g; u < 2 * n; u += 2) {
    f(u, v);
    v += 2 * g;
    if (v >= 2 * n) v -= 2 * n;
  }
}

Points lattice(std::int64_t n, std::int64_t g) {
  Points points;
  const auto scaled = [&](std::int64_t x) { return static_cast<double>(x) / static_cast<double>(2 * n); };
  for_each_in_lattice(n, g, [&](std::int64_t u, std::int64_t v) {
    points.push_back({scaled(u), scaled(v)});
  });
  return points;
}

constexpr std::int64_t kFewAsked = 16;

// Of the lattices of n points, both projections of which are midpoints, those without a short dual vector, the best first. Those about
// the golden ratio are asked.
std::vector<std::int64_t> generators(std::int64_t n, std::int64_t asked) {
  const std::int64_t golden = static_cast<std::int64_t>(0.618 * static_cast<double>(n)) | 1;
  std::vector<std::pair<std::int64_t, std::int64_t>> found;
  for (std::int64_t k = 0; k < std::min(asked, n / 2); ++k)
    if (const std::int64_t g = (golden + 2 * k) % n; std::gcd(g, n) == 1)
      found.emplace_back(shortest_dual(n, g), g);
  std::ranges::stable_sort(found, std::greater{}, &std::pair<std::int64_t, std::int64_t>::first);
  std::vector<std::int64_t> out;
  for (const auto& [square, g] : found)
    if (2 * square >= found[0].first) out.push_back(g);
  return out;
}

// Mean and second moments.
struct Moments {
  explicit Moments(const Points& points) {
    const double weight = 1 / static_cast<double>(points.size());
    for (const auto [u, v] : points) mean += weight * Eigen::Vector2d(u, v);
    for (const auto [u, v] : points) {
      const Eigen::Vector2d d = Eigen::Vector2d(u, v) - mean;
      second += weight * d * d.transpose();
    }
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
};

// Of the least mixed second moment.
Points on_square(std::int64_t n) {
  std::int64_t best = 1;
  double least = std::numeric_limits<double>::infinity();
  for (const std::int64_t g : generators(n, std::max(kFewAsked, 65536 / n))) {
    double mixed = 0;
    for_each_in_lattice(
        n, g, [&](std::int64_t u, std::int64_t v) { mixed += static_cast<double>((u - n) * (v - n)); });
    if (std::abs(mixed) < least) {
      least = std::abs(mixed);
      best = g;
    }
  }
  return lattice(n, best);
}

// Σ (error of the mean of u^a v^b)² over all of degree 3 and 4 on the triangle, where it is 2 a! b! / (a + b + 2)!.
double cubic_error(const Points& points) {
  constexpr std::array<double, 7> kFactorial{1, 1, 2, 6, 24, 120, 720};
  double sum = 0;
  for (const std::size_t degree : {3U, 4U})
    for (std::size_t a = 0; a <= degree; ++a) {
      double mean = 0;
      for (const auto [u, v] : points) {
        double product = 1;
        for (std::size_t k = 0; k < degree; ++k) product *= k < a ? u : v;
        mean += product;
      }
      const double error = mean / static_cast<double>(points.size()) -
                           2 * kFactorial[a] * kFactorial[degree - a] / kFactorial[degree + 2];
      sum += error * error;
    }
  return sum;
}

// The half of a lattice of 2n, moved and sheared until its moments are those of the triangle.
Points on_triangle(std::int64_t n) {
  const Eigen::Matrix2d to = Eigen::Matrix2d{{1.0 / 18, -1.0 / 36}, {-1.0 / 36, 1.0 / 18}}.llt().matrixL();
  Points best;
  double least = std::numeric_limits<double>::infinity();
  const auto ask = [&](std::int64_t g) {
    Points points = lattice(2 * n, g);
    std::erase_if(points, [](const Sample2& p) { return p.u + p.v >= 1; });
    if (points.size() != static_cast<std::size_t>(n)) return;
    const Moments moments(points);
    const Eigen::Matrix2d from = moments.second.llt().matrixL(), map = to * from.inverse();
    for (auto& [u, v] : points) {
      const Eigen::Vector2d x =
          Eigen::Vector2d::Constant(1.0 / 3) + map * (Eigen::Vector2d(u, v) - moments.mean);
      u = x[0];
      v = x[1];
    }
    const bool inside = std::all_of(points.begin(), points.end(),
                                    [](const Sample2& p) { return p.u > 0 && p.v > 0 && p.u + p.v < 1; });
    if (const double error = cubic_error(points); inside && error < least) {
      least = error;
      best.swap(points);
    }
  };
  for (std::int64_t asked = std::max(kFewAsked, 8192 / n); best.empty(); asked *= 2)
    for (const std::int64_t g : generators(2 * n, asked)) ask(g);
  return best;
}

}  // namespace

PointRules::PointRules(std::size_t most) {
  rules_.push_back({{{0.5, 0.5}}, {{1.0 / 3, 1.0 / 3}}});
  rules_.push_back({{{0.25, 0.25}, {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}},
                    {{1.0 / 6, 1.0 / 6}, {1.0 / 3, 1.0 / 3}, {2.0 / 3, 1.0 / 6}, {1.0 / 6, 2.0 / 3}}});
  for (std::size_t n = 8;; n += std::max<std::size_t>(8, std::bit_floor(n) / 4)) {
    const auto count = static_cast<std::int64_t>(n);
    rules_.push_back({on_square(count), on_triangle(count)});
    if (n >= most) break;
  }
}

const PointRules::Rule& PointRules::at(double points, std::size_t first) const {
  const auto size = [](const Rule& rule) { return static_cast<double>(rule.square.size()); };
  const auto more = std::partition_point(rules_.begin() + static_cast<std::ptrdiff_t>(first), rules_.end(),
                                         [&](const Rule& rule) { return size(rule) < points; });
  if (more == rules_.end()) return rules_.back();
  if (more == rules_.begin() + static_cast<std::ptrdiff_t>(first)) return *more;
  return points - size(more[-1]) < size(*more) - points ? more[-1] : *more;
}

}  // namespace radiosity
