// SPDX-License-Identifier: GPL-3.0-or-later
#include "winding_number.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radiosity {
namespace {

constexpr std::size_t kLeaf = 8;

/// A group is far where it is further away than this many of its radii: the first term left out is of the order of the
/// third power of the inverse.
constexpr double kFar = 3;

Vec3 centroid(const std::array<Vec3, 3>& t) {
  return (t[0] + t[1] + t[2]) / 3;
}

}  // namespace

double solid_angle(const std::array<Vec3, 3>& t, const Vec3& q) {
  const Vec3 a = t[0] - q, b = t[1] - q, c = t[2] - q;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

WindingNumber::WindingNumber(const std::vector<Facet>& facets) {
  for (const Facet& facet : facets)
    for (const Facet::Piece& piece : facet.pieces)
      for (std::size_t k = 1; k + 1 < piece.corners.size(); ++k)
        triangles_.push_back({piece.corners[0], piece.corners[k], piece.corners[k + 1]});
  if (!triangles_.empty()) build(0, triangles_.size());
}

void WindingNumber::build(std::size_t first, std::size_t last) {
  const std::size_t number = nodes_.size();
  Node node{.first = first, .last = last};
  add_moments(node);
  nodes_.push_back(node);
  if (last - first <= kLeaf) return;
  Vec3 lower = centroid(triangles_[first]), upper = lower;
  for (std::size_t k = first; k < last; ++k) {
    lower = lower.cwiseMin(centroid(triangles_[k]));
    upper = upper.cwiseMax(centroid(triangles_[k]));
  }
  Eigen::Index axis;
  (upper - lower).maxCoeff(&axis);
  const std::size_t middle = first + (last - first) / 2;
  const auto begin = triangles_.begin();
  std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                   begin + static_cast<std::ptrdiff_t>(last), [&](const Triangle& a, const Triangle& b) {
                     return centroid(a)[axis] < centroid(b)[axis];
                   });
  build(first, middle);
  nodes_[number].right = nodes_.size();
  build(middle, last);
}

void WindingNumber::add_moments(Node& node) const {
  const auto first = triangles_.begin() + static_cast<std::ptrdiff_t>(node.first);
  const auto last = triangles_.begin() + static_cast<std::ptrdiff_t>(node.last);
  double area = 0;
  Vec3 mean = Vec3::Zero(), moment = Vec3::Zero();
  for (auto t = first; t != last; ++t) {
    const double a = ((*t)[1] - (*t)[0]).cross((*t)[2] - (*t)[0]).norm() / 2;
    area += a;
    moment += a * (centroid(*t) - centroid(*first));
    mean += (centroid(*t) - centroid(*first)) / static_cast<double>(node.last - node.first);
  }
  node.centre = centroid(*first) + (area > 0 ? Vec3(moment / area) : mean);
  for (auto t = first; t != last; ++t) {
    const Vec3 a = (*t)[0] - node.centre, b = (*t)[1] - node.centre, c = (*t)[2] - node.centre;
    for (const Vec3& corner : {a, b, c}) node.radius = std::max(node.radius, corner.norm());
    const Vec3 n = (b - a).cross(c - a) / 2, y = (a + b + c) / 3;
    // ∫ y yᵀ dA / A = ¾ ȳ ȳᵀ + (a aᵀ + b bᵀ + c cᵀ) / 12
    const Eigen::Matrix3d second =
        0.75 * y * y.transpose() + (a * a.transpose() + b * b.transpose() + c * c.transpose()) / 12;
    node.order0 += n;
    node.order1 += n * y.transpose();
    for (Eigen::Index i = 0; i < 3; ++i) node.order2[i] += n[i] * second;
    node.traces += 2 * second * n + second.trace() * n;
  }
}

/// With r = q − centre: n·G(r − y) = n·r/r³ − Σ n_i y_j ∂_j G_i + ½ Σ n_i y_j y_k ∂_j ∂_k G_i + …,
///   ∂_j G_i = δ_ij / r³ − 3 r_i r_j / r⁵,
///   ∂_j ∂_k G_i = −3 (δ_ij r_k + δ_ik r_j + δ_jk r_i) / r⁵ + 15 r_i r_j r_k / r⁷.
double WindingNumber::far_field(const Node& node, const Vec3& q) {
  const Vec3 r = q - node.centre;
  const double squared = r.squaredNorm();
  double cubic = 0;
  for (Eigen::Index i = 0; i < 3; ++i) cubic += r[i] * r.dot(node.order2[i] * r);
  return (node.order0.dot(r) - node.order1.trace() +
          (3 * r.dot(node.order1 * r) - 1.5 * node.traces.dot(r) + 7.5 * cubic / squared) / squared) /
         (squared * std::sqrt(squared));
}

double WindingNumber::sum(std::size_t first, std::size_t last, const Vec3& q) const {
  double total = 0;
  for (std::size_t k = first; k < last; ++k) total -= solid_angle(triangles_[k], q);
  return total;
}

double WindingNumber::operator()(const Vec3& q) const {
  double total = 0;
  std::vector<std::size_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::size_t number = open.back();
    open.pop_back();
    const Node& node = nodes_[number];
    if ((q - node.centre).squaredNorm() > kFar * kFar * node.radius * node.radius) {
      total += far_field(node, q);
    } else if (node.right == 0) {
      total += sum(node.first, node.last, q);
    } else {
      open.push_back(node.right);
      open.push_back(number + 1);
    }
  }
  return total / (4 * std::numbers::pi);
}

}  // namespace radiosity
