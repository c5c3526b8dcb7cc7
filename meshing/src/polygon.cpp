// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "planar_mesh.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

std::vector<Index> first_equal(std::span<const Vec3> points) {
  std::vector<Index> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    const Vec3 &p = points[a], &q = points[b];
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool equal = k > 0 && points[order[k]] == points[order[k - 1]];
    first[order[k]] = equal ? first[order[k - 1]] : order[k];
  }
  return first;
}

namespace polygon {

Vec3 area_vector(std::span<const Vec3> points, std::span<const Index> corners) {
  const Vec3& first = points[corners[0]];
  Vec3 sum = Vec3::Zero(), previous = points[corners[1]] - first;
  for (std::size_t k = 2; k < corners.size(); ++k) {
    const Vec3 next = points[corners[k]] - first;
    sum += previous.cross(next);
    previous = next;
  }
  return sum / 2;
}

double longest_edge(std::span<const Vec3> points, std::span<const Index> corners) {
  double squared = 0;
  for (std::size_t k = 0; k < corners.size(); ++k)
    squared =
        std::max(squared, (points[corners[(k + 1) % corners.size()]] - points[corners[k]]).squaredNorm());
  return std::sqrt(squared);
}

double magnitude(std::span<const Vec3> points, std::span<const Index> corners) {
  double greatest = 0;
  for (const Index c : corners) greatest = std::max(greatest, points[c].cwiseAbs().maxCoeff());
  return greatest;
}

double rounding(std::span<const Vec3> points, std::span<const Index> corners) {
  return tolerance::kDegenerateHeight * magnitude(points, corners);
}

Plane::Plane(std::span<const Vec3> points, std::span<const Index> corners) {
  const Vec3& first = points[corners[0]];
  Vec3 mean = Vec3::Zero(), longest = Vec3::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3& a = points[corners[k]];
    const Vec3 edge = points[corners[(k + 1) % corners.size()]] - a;
    mean += a - first;
    // Of equal edges the first, whatever rounding says.
    if (edge.squaredNorm() > longest.squaredNorm() * (1 + tolerance::kPlanarity)) longest = edge;
  }
  origin = first + mean / static_cast<double>(corners.size());
  n = area_vector(points, corners).normalized();
  u = (longest - n.dot(longest) * n).normalized();
  v = n.cross(u);
}

std::vector<Vec2> project(const Plane& plane, std::span<const Vec3> points, std::span<const Index> corners) {
  std::vector<Vec2> ring;
  ring.reserve(corners.size());
  for (const Index c : corners) ring.push_back(plane.project(points[c]));
  return ring;
}

bool is_planar(const Plane& plane, std::span<const Vec3> points, std::span<const Index> corners) {
  if (corners.size() == 3) return true;
  Vec3 lower = points[corners[0]], upper = lower;
  double deviation = 0;
  for (const Index c : corners) {
    lower = lower.cwiseMin(points[c]);
    upper = upper.cwiseMax(points[c]);
    deviation = std::max(deviation, std::abs(plane.height(points[c])));
  }
  return deviation <= tolerance::kPlanarity * (upper - lower).norm() + rounding(points, corners);
}

bool is_convex(std::span<const Vec2> ring, double sine) {
  double turning = 0;
  for (std::size_t k = 0, n = ring.size(); k < n; ++k) {
    const Vec2 in = ring[(k + 1) % n] - ring[k], out = ring[(k + 2) % n] - ring[(k + 1) % n];
    const double area = cross(in, out);
    const double product = in.norm() * out.norm();
    const bool turns_back = in.dot(out) < 0 && area <= tolerance::kPlanarity * product;  // the tip of a spike
    if (!(area > sine * product) || turns_back) return false;
    turning += std::atan2(area, in.dot(out));
  }
  return turning < 3 * std::numbers::pi;
}

std::vector<Vec3> clip(std::span<const Vec3> polygon, const Vec3& n, const Vec3& on, double slack) {
  std::vector<Vec3> kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double ha = n.dot(a - on), hb = n.dot(b - on);
    if (ha >= -slack) kept.push_back(a);
    if ((ha < -slack && hb > slack) || (ha > slack && hb < -slack))
      kept.push_back(a + ha / (ha - hb) * (b - a));
  }
  return kept;
}

bool is_convex(std::span<const Vec3> points, std::span<const Index> corners, double sine) {
  return is_convex(project(Plane(points, corners), points, corners), sine);
}

bool is_convex(std::span<const Vec3> corners, const Vec3& n, double least_sine) {
  for (std::size_t k = 0, count = corners.size(); k < count; ++k) {
    const Vec3 e = corners[(k + 1) % count] - corners[k], f = corners[(k + 2) % count] - corners[k];
    if (!(n.dot(e.cross(f)) > least_sine * e.norm() * f.norm()) ||
        std::abs(n.dot(e)) > tolerance::kGrazed * e.norm())
      return false;
  }
  return true;
}

bool contains(std::span<const Vec2> ring, const Vec2& p) {
  bool inside = false;
  for (std::size_t k = 0, n = ring.size(); k < n; ++k) {
    // From the lower to the upper end, so that an edge walked both ways counts exactly twice.
    Vec2 a = ring[k], b = ring[(k + 1) % n];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (a.y() > b.y()) std::swap(a, b);
    if (cross(b - a, p - a) > 0) inside = !inside;
  }
  return inside;
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp(along.dot(p - a) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * along).norm();
}

namespace {

double signed_area(const Vec2& a, const Vec2& b, const Vec2& c) {
  return cross(b - a, c - a) / 2;
}

}  // namespace

std::vector<std::array<Index, 3>> triangles(std::span<const Vec3> points, std::span<const Index> corners) {
  const auto n = static_cast<Index>(corners.size());
  if (n == 3) return {{0, 1, 2}};
  const Plane plane(points, corners);
  const std::vector<Vec2> ring = project(plane, points, corners);
  if (n == 4) {
    const auto smaller_area = [&](std::size_t k) {
      return std::min(signed_area(ring[k], ring[k + 1], ring[(k + 2) % 4]),
                      signed_area(ring[k], ring[(k + 2) % 4], ring[(k + 3) % 4]));
    };
    const double from_0 = smaller_area(0), from_1 = smaller_area(1);
    if (from_0 > 0 || from_1 > 0) {
      const auto length = [&](std::size_t a, std::size_t b) {
        return (points[corners[a]] - points[corners[b]]).squaredNorm();
      };
      // At a corner that is straight but for rounding only one diagonal gives two triangles with an area.
      const double least = 1e-6 * std::max(from_0, from_1);
      const bool take_0 = from_1 <= least || (from_0 > least && length(0, 2) <= length(1, 3));
      if (take_0) return {{0, 1, 2}, {0, 2, 3}};
      return {{1, 2, 3}, {1, 3, 0}};
    }
  } else if (is_convex(ring, tolerance::kPlanarity)) {
    std::vector<std::array<Index, 3>> fan;
    for (Index k = 1; k + 1 < n; ++k) fan.push_back({0, k, k + 1});
    return fan;
  }
  std::vector<std::array<Index, 2>> edges;
  for (Index k = 0; k < n; ++k) edges.push_back({k, (k + 1) % n});
  PlanarMesh mesh = mesh_polygon(ring, edges);
  if (mesh.points.size() == ring.size()) return std::move(mesh.triangles);
  // Edges that cross need points of their own; triangles of the corners then overlap.
  std::vector<std::array<Index, 3>> fan;
  for (Index k = 1; k + 1 < n; ++k) fan.push_back({0, k, k + 1});
  return fan;
}

}  // namespace polygon
}  // namespace radiosity
