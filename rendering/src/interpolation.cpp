// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace radiosity {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The weights of a convex quad's corners at x: inverse of x = (1−u)(1−v) c0 + u(1−v) c1 + uv c2 + (1−u)v c3.
/// With h = x − c0, e = c1 − c0, f = c3 − c0, g = c0 − c1 + c2 − c3, v is a root of
///   (g×f) v² + (e×f + h×g) v + h×e = 0.
std::array<double, 4> bilinear_weights(const std::array<Eigen::Vector2d, 4>& c, const Eigen::Vector2d& x) {
  const Eigen::Vector2d h = x - c[0], e = c[1] - c[0], f = c[3] - c[0], g = c[0] - c[1] + c[2] - c[3];
  const double k2 = cross(g, f), k1 = cross(e, f) + cross(h, g), k0 = cross(h, e);
  // Roots q/k2 and k0/q: neither cancels, and k2 = 0 (parallel edges) needs no case of its own.
  const double q = -0.5 * (k1 + std::copysign(std::sqrt(std::max(k1 * k1 - 4 * k0 * k2, 0.0)), k1));
  const auto outside = [](double t) { return std::isfinite(t) ? std::max({-t, t - 1, 0.0}) : HUGE_VAL; };
  const double v1 = k0 / q, v2 = q / k2;
  const double v = std::clamp(outside(v1) <= outside(v2) ? v1 : v2, 0.0, 1.0);
  const Eigen::Vector2d along = e + v * g;
  const double length = along.squaredNorm();
  const double u = length > 0 ? std::clamp((h - v * f).dot(along) / length, 0.0, 1.0) : 0.0;
  return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
}

}  // namespace

BandValues interpolate(const PatchMesh& mesh, const BandArray& values, Index patch, const Vec3& x) {
  const auto sum = [&](std::span<const Index> vertices, std::span<const double> weights) {
    BandValues result = BandValues::Zero(values.cols());
    for (std::size_t k = 0; k < vertices.size(); ++k)
      result += weights[k] * values.row(vertices[k]).transpose();
    return result;
  };
  // Dropping the axis along which the normal is longest keeps the shape and its interpolation weights.
  Eigen::Index axis = 0;
  mesh.normal(patch).cwiseAbs().maxCoeff(&axis);
  const auto flat = [axis](const Vec3& p) { return Eigen::Vector2d(p[(axis + 1) % 3], p[(axis + 2) % 3]); };

  const auto corners = mesh.corners(patch);
  if (corners.size() == 4) {
    std::array<Eigen::Vector2d, 4> c;
    for (std::size_t k = 0; k < 4; ++k) c[k] = flat(mesh.vertex(corners[k]));
    const double sign = mesh.normal(patch)[axis];
    bool convex = true;
    for (std::size_t k = 0; k < 4; ++k)
      convex = convex && sign * cross(c[(k + 1) % 4] - c[k], c[(k + 2) % 4] - c[(k + 1) % 4]) > 0;
    if (convex) return sum(corners, bilinear_weights(c, flat(x)));
  }
  // The triangle that holds x: the one whose smallest barycentric coordinate is the largest.
  double best = -HUGE_VAL;
  std::array<double, 3> best_weights{};
  std::span<const Index> best_triangle;
  for (const auto& triangle : mesh.triangles(patch)) {
    const auto a = flat(mesh.vertex(triangle[0])), b = flat(mesh.vertex(triangle[1])),
               c = flat(mesh.vertex(triangle[2])), p = flat(x);
    const double whole = cross(b - a, c - a);
    if (whole == 0) continue;
    const std::array<double, 3> weights{cross(b - p, c - p) / whole, cross(c - p, a - p) / whole,
                                        cross(a - p, b - p) / whole};
    const double least = *std::min_element(weights.begin(), weights.end());
    if (least > best) {
      best = least;
      best_weights = weights;
      best_triangle = triangle;
    }
  }
  return sum(best_triangle, best_weights);
}

}  // namespace radiosity
