// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// tan Ω/2 = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)   for corners a, b, c seen from q [VanOosterom1983].
double solid_angle(const std::array<Vec3, 3>& t, const Vec3& q);

/// Winding numbers of points about polygons, w = Σ Ω / 4π, positive where a point sees fronts. A tree of the polygons'
/// triangles sums what is far from a point by Taylor series of the dipole field,
///   w(q) = 1/4π ∫ n·G(q − x) dA,  G(v) = v / |v|³,
/// to second order about the middle of each group [Barill2018].
class WindingNumber {
 public:
  explicit WindingNumber(const std::vector<Facet>& facets);

  /// Off by less than 0.005; O(log n).
  double operator()(const Vec3& q) const;

 private:
  using Triangle = std::array<Vec3, 3>;
  struct Node {
    std::size_t first, last;  // of triangles_
    std::size_t right = 0;    // the other child follows its parent; 0: a leaf
    Vec3 centre = Vec3::Zero();
    double radius = 0;
    // With y = x − centre: ∫ n dA, ∫ n_i y_j dA, ∫ n_i y_j y_k dA for i = 0 … 2, and 2 ∫ n_i y_i y_k + n_k y² dA.
    Vec3 order0 = Vec3::Zero();
    Eigen::Matrix3d order1 = Eigen::Matrix3d::Zero();
    std::array<Eigen::Matrix3d, 3> order2{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(),
                                          Eigen::Matrix3d::Zero()};
    Vec3 traces = Vec3::Zero();
  };

  void build(std::size_t first, std::size_t last);
  void add_moments(Node& node) const;
  static double far_field(const Node& node, const Vec3& q);
  double sum(std::size_t first, std::size_t last, const Vec3& q) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace radiosity
