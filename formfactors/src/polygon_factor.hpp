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
  bool parallelogram;
  double radius;  ///< of the sphere round the centroid that holds the corners

  struct Edge {
    Vec3 start;
    Vec3 direction;  // unit
    double length;
  };
  std::vector<Edge> edges;  ///< those with a length

  /// Quadrature of degree 5 over the polygon: columns x, y, z and weight of `stride` numbers each. The first `size` weights
  /// add up to the area; those that fill up vectors are 0.
  struct Rule {
    std::size_t size = 0, stride = 0;
    std::vector<double> columns;
  };
  Rule rule;
};

/// The part of `a` in front of b's plane, where that is neither all of it nor nothing; `visible` says whether anything is.
std::optional<Polygon> front_part(const Polygon& a, const Polygon& b, bool& visible);

/// Unoccluded A_i F_ij in m² between two planar polygons that lie in front of each other's plane (see front_part):
///   A_i F_ij = 1/(2π) ∮_i ∮_j ln|x − y| dx·dy   [Sparrow1963]
/// The inner integral is closed, the outer one a Gauss rule graded towards where the contours come near each other;
/// parallel edges are closed altogether. Pairs further apart than `far` · (sum of their radii), where the contour form cancels, take
/// the product of their quadratures of the kernel cosθ cosθ' / (π r²).
double mutual_area(const Polygon& p, const Polygon& q, double far);

}  // namespace radiosity
