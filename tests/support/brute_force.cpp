// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/brute_force.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace radiosity::test {
namespace {

using Polygon = std::vector<Vec3>;
using Triangle = std::array<Vec3, 3>;

/// The half-space n·y ≥ d.
struct HalfSpace {
  Vec3 n;
  double d;
  double of(const Vec3& y) const { return n.dot(y) - d; }
};

/// The part of a convex polygon in a half-space (Sutherland, Hodgman).
Polygon clipped(const Polygon& polygon, const HalfSpace& keep) {
  Polygon out;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double fa = keep.of(a), fb = keep.of(b);
    if (fa >= 0) out.push_back(a);
    if ((fa > 0 && fb < 0) || (fa < 0 && fb > 0)) out.push_back(a + fa / (fa - fb) * (b - a));
  }
  if (out.size() < 3) out.clear();
  return out;
}

Triangle triangle(const PatchMesh& mesh, const std::array<Index, 3>& corners) {
  return {mesh.vertex(corners[0]), mesh.vertex(corners[1]), mesh.vertex(corners[2])};
}

/// Lambert: F = 1/(2π) Σ_k n·Γ_k for a polygon above the horizon, counter-clockwise as seen from x or not.
double lambert(const Polygon& polygon, const Vec3& x, const Vec3& n) {
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = polygon[k] - x, b = polygon[(k + 1) % polygon.size()] - x;
    const Vec3 axis = a.cross(b);
    const double sine = axis.norm();
    if (sine > 0) sum += std::atan2(sine, a.dot(b)) * n.dot(axis) / sine;
  }
  return std::abs(sum) / (2 * std::numbers::pi);
}

/// Length below which two things are in the same plane, for a mesh of ordinary size.
double contact(const PatchMesh& mesh) {
  return 1e-10 * mesh.diagonal();
}

std::vector<Triangle> possible_occluders(const PatchMesh& mesh, Index i, Index j) {
  const double eps = contact(mesh);
  std::vector<Triangle> found;
  for (Index k = 0; k < mesh.patch_count(); ++k) {
    if (k == i || k == j) continue;
    const auto distances = [&](Index plane, Index of) {
      double low = 1e300, high = -1e300;
      for (const Index v : mesh.corners(of)) {
        const double d = mesh.normal(plane).dot(mesh.vertex(v) - mesh.centroid(plane));
        low = std::min(low, d);
        high = std::max(high, d);
      }
      return std::pair(low, high);
    };
    const auto [i_low, i_high] = distances(k, i);
    const auto [j_low, j_high] = distances(k, j);
    const bool between = (i_low < -eps && j_high > eps) || (i_high > eps && j_low < -eps);
    if (!between || distances(i, k).second <= eps || distances(j, k).second <= eps) continue;
    for (const auto& t : mesh.triangles(k)) found.push_back(triangle(mesh, t));
  }
  return found;
}

double point_factor(const PatchMesh& mesh, const Vec3& x, const Vec3& n, Index j,
                    const std::vector<Triangle>& occluders) {
  const double eps = contact(mesh);
  if (mesh.normal(j).dot(x - mesh.centroid(j)) <= 0) return 0;
  std::vector<Polygon> visible;
  for (const auto& t : mesh.triangles(j)) {
    const Triangle corners = triangle(mesh, t);
    Polygon p = clipped({corners.begin(), corners.end()}, {n, n.dot(x)});
    if (!p.empty()) visible.push_back(std::move(p));
  }
  for (const Triangle& t : occluders) {
    if (visible.empty()) return 0;
    Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    const double height = normal.dot(t[0] - x);
    if (std::abs(height) <= eps) continue;  // seen edge-on
    if (height < 0) normal = -normal;
    const HalfSpace beyond{normal, normal.dot(t[0]) + eps};
    std::array<HalfSpace, 4> shadow{beyond, beyond, beyond, beyond};
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 side = (t[k] - x).cross(t[(k + 1) % 3] - x).normalized();
      if (side.dot(t[(k + 2) % 3] - x) < 0) side = -side;
      shadow[k + 1] = {side, side.dot(x)};
    }
    std::vector<Polygon> left;
    for (Polygon rest : visible) {
      for (const HalfSpace& h : shadow) {
        Polygon outside = clipped(rest, {-h.n, -h.d});
        if (!outside.empty()) left.push_back(std::move(outside));
        rest = clipped(rest, h);
        if (rest.empty()) break;
      }
    }
    visible = std::move(left);
  }
  double sum = 0;
  for (const Polygon& p : visible) sum += lambert(p, x, n);
  return sum;
}

}  // namespace

double brute_force_point_factor(const PatchMesh& mesh, const Vec3& x, const Vec3& n, Index from, Index j) {
  return point_factor(mesh, x, n, j, possible_occluders(mesh, from, j));
}

double brute_force_form_factor(const PatchMesh& mesh, Index i, Index j, double tolerance) {
  if (i == j) return 0;
  const auto occluders = possible_occluders(mesh, i, j);
  const double total = mesh.area(i);
  const auto area = [](const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2; };

  // Three Gauss–Legendre points each way; u = 0 is the corner where the square is collapsed to a triangle.
  const double h = std::sqrt(0.6) / 2;
  const std::array<double, 3> node{0.5 - h, 0.5, 0.5 + h}, weight{5.0 / 18, 8.0 / 18, 5.0 / 18};
  const auto integral = [&](const Triangle& t) {
    double sum = 0;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) {
        const double u = node[a], v = node[b];
        const Vec3 x = t[0] + u * ((1 - v) * (t[1] - t[0]) + v * (t[2] - t[0]));
        sum += weight[a] * weight[b] * 2 * u * point_factor(mesh, x, mesh.normal(i), j, occluders);
      }
    return sum * area(t);
  };
  const auto adapt = [&](const auto& self, const Triangle& t, double whole, int depth) -> double {
    const Vec3 a = (t[1] + t[2]) / 2, b = (t[2] + t[0]) / 2, c = (t[0] + t[1]) / 2;
    const std::array<Triangle, 4> parts{Triangle{t[0], c, b}, Triangle{c, t[1], a}, Triangle{b, a, t[2]},
                                        Triangle{a, b, c}};
    std::array<double, 4> sums;
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += sums[k] = integral(parts[k]);
    if (depth >= 9 || std::abs(sum - whole) <= tolerance * area(t)) return sum;
    double refined = 0;
    for (std::size_t k = 0; k < 4; ++k) refined += self(self, parts[k], sums[k], depth + 1);
    return refined;
  };
  double sum = 0;
  for (const auto& corners : mesh.triangles(i)) {
    const Triangle t = triangle(mesh, corners);
    sum += adapt(adapt, t, integral(t), 0);
  }
  return sum / total;
}

}  // namespace radiosity::test
