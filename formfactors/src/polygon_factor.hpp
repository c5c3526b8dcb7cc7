// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// A planar polygon with what the factors need of it.
struct Polygon {
  Polygon(std::vector<Vec3> corners, const Vec3& unit_normal);

  std::vector<Vec3> corners;  ///< counter-clockwise about normal
  Vec3 normal;                ///< unit
  Vec3 centroid;
  double area;
  double radius;  ///< of the sphere round the centroid that holds the corners

  /// Quadrature rules of degree 5 and 3 over the polygon: columns x, y, z and weight of `stride` numbers each. The first `size` weights
  /// add up to the area; those that fill up a vector of four are 0.
  struct Rule {
    std::size_t size = 0, stride = 0;
    std::vector<double> columns;
  };
  Rule rule, coarse_rule;
};

/// The part of `a` in front of b's plane, where that is neither all of it nor nothing; `visible` says whether anything is.
std::optional<Polygon> front_part(const Polygon& a, const Polygon& b, bool& visible);

/// Unoccluded A_i F_ij in m² between two planar polygons that lie in front of each other's plane (see front_part):
///   A_i F_ij = 1/(2π) ∮_i ∮_j ln|x − y| dx·dy   [Sparrow1963]
/// The inner integral is closed, the outer one a Gauss rule graded towards where the contours come near each other;
/// parallel edges are closed altogether. Far pairs, where the contour form cancels, take a product Gauss rule
/// of the kernel cosθ cosθ' / (π r²).
double mutual_area(const Polygon& p, const Polygon& q);

}  // namespace radiosity
