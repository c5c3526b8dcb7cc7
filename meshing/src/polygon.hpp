// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

/// Geometry of single polygons. All differences are taken before products, so that polygons 10⁷ m from the
/// origin keep the accuracy of their coordinates.
namespace radiosity {

using Vec2 = Eigen::Vector2d;

/// 2·(signed area) of the parallelogram a, b.
inline double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

inline std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// One number for the undirected edge a, b.
inline std::uint64_t edge_key(Index a, Index b) {
  const auto [low, high] = std::minmax(a, b);
  return (static_cast<std::uint64_t>(low) << 32) | static_cast<std::uint64_t>(high);
}

/// For each point the first one at the same position (0 and −0 are the same).
std::vector<Index> first_equal(std::span<const Vec3> points);

namespace polygon {

/// Half the Newell vector, ½ Σ (v_k − v_0) × (v_{k+1} − v_0).
Vec3 area_vector(std::span<const Vec3> points, std::span<const Index> corners);

double longest_edge(std::span<const Vec3> points, std::span<const Index> corners);

/// Greatest |coordinate| of the corners: their rounding is this times the machine epsilon.
double magnitude(std::span<const Vec3> points, std::span<const Index> corners);

/// Distance that means the same place as far as rounding goes: tolerance::kDegenerateHeight · magnitude.
double rounding(std::span<const Vec3> points, std::span<const Index> corners);

/// An orthonormal frame in the mean plane: origin at the mean of the corners, u along the longest edge,
/// n = u × v the front normal. The polygon must have an area.
struct Plane {
  Vec3 origin, u, v, n;

  Plane(std::span<const Vec3> points, std::span<const Index> corners);

  Vec2 project(const Vec3& x) const { return {u.dot(x - origin), v.dot(x - origin)}; }
  Vec3 lift(const Vec2& p) const { return origin + (p.x() * u + p.y() * v); }
  double height(const Vec3& x) const { return n.dot(x - origin); }
};

std::vector<Vec2> project(const Plane& plane, std::span<const Vec3> points, std::span<const Index> corners);

/// No corner further from the mean plane than tolerance::kPlanarity · diameter.
bool is_planar(const Plane& plane, std::span<const Vec3> points, std::span<const Index> corners);

/// Every turn of the ring is to the left by more than `sine`, and the ring goes round once.
bool is_convex(std::span<const Vec2> ring, double sine);
/// The same in the mean plane.
bool is_convex(std::span<const Vec3> points, std::span<const Index> corners, double sine);

/// Even–odd rule; an edge walked twice does not count.
bool contains(std::span<const Vec2> ring, const Vec2& p);

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b);

/// Triangles that cover a polygon, as positions 0 … n−1 in its list of corners, in its sense of rotation:
/// convex ones by a fan or the shorter diagonal, others by constrained Delaunay triangulation. Those of a polygon whose
/// edges cross overlap.
std::vector<std::array<Index, 3>> triangles(std::span<const Vec3> points, std::span<const Index> corners);

}  // namespace polygon
}  // namespace radiosity
