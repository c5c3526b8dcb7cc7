// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

/// Geometry of single polygons that every module shares. All differences are taken before products, so that polygons 10⁷ m from
/// the origin keep the accuracy of their coordinates.
namespace radiosity::polygon {

/// The part of a polygon where n·(x − on) ≥ 0 (Sutherland and Hodgman); corners within `slack` of that plane count as on it.
/// Non-convex polygons may come out with pairs of coincident, opposite edges: their contour integrals cancel.
std::vector<Vec3> clip(std::span<const Vec3> polygon, const Vec3& n, const Vec3& on, double slack = 0);

/// The sine of the turn at every corner, counter-clockwise about n, is above `least_sine`, and no edge leaves the plane
/// perpendicular to n by more than tolerance::kGrazed of its length.
bool is_convex(std::span<const Vec3> corners, const Vec3& n, double least_sine);

/// x(u, v) = (1−u)(1−v) c₀ + u(1−v) c₁ + uv c₂ + (1−u)v c₃ over the unit square.
class BilinearQuad {
 public:
  explicit BilinearQuad(std::span<const Vec3> c)
      : origin_(c[0]), u_(c[1] - c[0]), v_(c[3] - c[0]), twist_(c[2] - c[1] - v_) {}

  Vec3 at(double u, double v) const { return origin_ + (u * u_ + v * v_ + u * v * twist_); }

  /// ∂x/∂u × ∂x/∂v: area vector per du dv.
  Vec3 area_vector(double u, double v) const { return (u_ + v * twist_).cross(v_ + u * twist_); }

 private:
  Vec3 origin_, u_, v_, twist_;
};

}  // namespace radiosity::polygon
