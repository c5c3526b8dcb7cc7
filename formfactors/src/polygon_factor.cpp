// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon_factor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pair_kernels.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

using Edge = Polygon::Edge;

Vec3 at(const Edge& e, double s) {
  return e.start + s * e.direction;
}

double distance(const Vec3& x, const Edge& e) {
  const double t = std::clamp((x - e.start).dot(e.direction), 0.0, e.length);
  return (x - at(e, t)).norm();
}

// Over [s0, s1] of e and all of f. Halved until the pieces are short compared with their distance
// from f: then the 8-point rule errs by about 1e-10. Where the edges touch, the halving ends at 1e-5 of the edge: the
// integrand is continuous, and what the rule misses of its kink is of the order of the square of that.
double graded(const Edge& e, const Edge& f, double s0, double s1) {
  const double h = s1 - s0;
  const double middle = (s0 + s1) / 2;
  const Vec3 x = at(e, middle);
  if (h > 1e-5 * e.length && distance(x, f) < 1.5 * h)
    return graded(e, f, s0, middle) + graded(e, f, middle, s1);
  return pair_kernel().edge_pair(x.data(), e.direction.data(), h, f.start.data(), f.direction.data(),
                                 f.length);
}

// Σ sign G of pairs of parallel edges, G''(w) = ln √(w² + d²), both constants of integration 0:
//   G = (w² − d²) ln(w² + d²) / 4 − 3 w² / 4 + w d arctan(w / d)
struct ParallelTerms {
  static constexpr std::size_t kMost = 64;
  std::array<double, kMost> w, d, sign;
  std::size_t count = 0;
  double sum = 0;

  void add(double at_w, double at_d, double with_sign) {
    w[count] = at_w;
    d[count] = at_d;
    sign[count] = with_sign;
    if (++count == kMost) evaluate();
  }
  void evaluate() {
    while (count % kLanes != 0) {
      w[count] = d[count] = sign[count] = 0;
      ++count;
    }
    sum += pair_kernel().parallel_sum(w.data(), d.data(), sign.data(), count);
    count = 0;
  }
};

// A_i F_ij in contour form.
double contour_mutual_area(std::span<const Edge> p, std::span<const Edge> q) {
  ParallelTerms parallel;
  double sum = 0;
  for (const Edge& e : p) {
    for (const Edge& f : q) {
      const double cosine = e.direction.dot(f.direction);
      if (std::abs(cosine) <= tolerance::kParallel) continue;
      if (e.direction.cross(f.direction).squaredNorm() > tolerance::kParallel * tolerance::kParallel) {
        sum += cosine * graded(e, f, 0, e.length);
        continue;
      }
      const Vec3 r = f.start - e.start;
      const double d = r.cross(e.direction).norm();
      const double t0 = r.dot(e.direction);
      const double t1 = t0 + cosine * f.length;
      // t runs backwards along antiparallel edges; so does the sign of dx·dy: the integral comes out signed.
      parallel.add(e.length - t0, d, 1);
      parallel.add(-t0, d, -1);
      parallel.add(e.length - t1, d, -1);
      parallel.add(-t1, d, 1);
    }
  }
  parallel.evaluate();
  return (sum + parallel.sum) / (2 * std::numbers::pi);
}

RuleColumns columns_of(const Polygon& p) {
  return {p.rule.size, p.rule.stride, p.rule.columns.data(), p.normal.data()};
}

struct Node {
  Vec3 x;
  double weight;
};

Polygon::Rule rule_of(const std::vector<Node>& nodes) {
  Polygon::Rule rule{nodes.size(), (nodes.size() + kLanes - 1) / kLanes * kLanes, {}};
  rule.columns.resize(4 * rule.stride);
  for (std::size_t k = 0; k < rule.stride && !nodes.empty(); ++k) {
    const Node& node = nodes[std::min(k, nodes.size() - 1)];  // the last again and again, without a weight
    for (std::size_t c = 0; c < 3; ++c)
      rule.columns[c * rule.stride + k] = node.x[static_cast<Eigen::Index>(c)];
    rule.columns[3 * rule.stride + k] = k < nodes.size() ? node.weight : 0;
  }
  return rule;
}

// The 3 × 3 Gauss points of the bilinear map of a convex quad; nothing where the map folds.
std::vector<Node> tensor_nodes(const std::vector<Vec3>& c, const Vec3& normal) {
  constexpr std::size_t n = 3;
  constexpr std::array<double, n> x{0.1127016653792583, 0.5, 0.8872983346207417},
      w{5.0 / 18, 8.0 / 18, 5.0 / 18};
  std::vector<Node> nodes;
  nodes.reserve(n * n);
  const polygon::BilinearQuad quad(c);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double jacobian = normal.dot(quad.area_vector(x[i], x[j]));
      if (jacobian <= 0) return {};
      nodes.push_back({quad.at(x[i], x[j]), w[i] * w[j] * jacobian});
    }
  }
  return nodes;
}

// The 7-point rule of degree 5 on each triangle of a fan with signed areas [Radon1948].
std::vector<Node> fan_nodes(const std::vector<Vec3>& c, const Vec3& normal) {
  std::vector<Node> nodes;
  nodes.reserve(7 * c.size());
  const double root = std::sqrt(15.0);
  for (std::size_t k = 1; k + 1 < c.size(); ++k) {
    const double area = normal.dot((c[k] - c[0]).cross(c[k + 1] - c[0])) / 2;
    const std::array<Vec3, 3> corner{c[0], c[k], c[k + 1]};
    const Vec3 centre = (c[0] + c[k] + c[k + 1]) / 3;
    nodes.push_back({centre, area * 9 / 40});
    for (const Vec3& v : corner) {
      const double inner = (6 - root) / 21;
      const double outer = (6 + root) / 21;
      nodes.push_back({v + inner * (3 * (centre - v)), area * (155 - root) / 1200});
      nodes.push_back({v + outer * (3 * (centre - v)), area * (155 + root) / 1200});
    }
  }
  return nodes;
}

}  // namespace

Polygon::Polygon(std::vector<Vec3> c, const Vec3& unit_normal) : corners(std::move(c)), normal(unit_normal) {
  Vec3 moment = Vec3::Zero();
  area = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const double a = normal.dot((corners[k] - corners[0]).cross(corners[k + 1] - corners[0])) / 2;
    area += a;
    moment += a * ((corners[k] - corners[0]) + (corners[k + 1] - corners[0])) / 3;
  }
  centroid = corners.empty() ? Vec3::Zero() : corners[0];
  if (area > 0) centroid += moment / area;
  radius = 0;
  for (const Vec3& v : corners) radius = std::max(radius, (v - centroid).norm());
  parallelogram = corners.size() == 4 &&
                  (corners[0] - corners[1] + corners[2] - corners[3]).norm() <= tolerance::kParallel * radius;
  if (corners.size() == 4) rule = rule_of(tensor_nodes(corners, normal));
  if (rule.size == 0) rule = rule_of(fan_nodes(corners, normal));
  edges.reserve(corners.size());
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 d = corners[(k + 1) % corners.size()] - corners[k];
    const double length = d.norm();
    if (length > 0) edges.push_back({corners[k], d / length, length});
  }
}

std::optional<Polygon> front_part(const Polygon& a, const Polygon& b, bool& visible) {
  // Heights over b's plane, relative to a point of that plane, so that distant scenes lose nothing.
  const double slack = tolerance::kOnPlane * (a.radius + b.radius + (a.centroid - b.centroid).norm());
  visible = b.normal.dot(a.centroid - b.centroid) > a.radius + slack;
  if (visible) return std::nullopt;  // all of the sphere round it
  bool above = false;
  bool below = false;
  for (const Vec3& v : a.corners) {
    const double h = b.normal.dot(v - b.centroid);
    above = above || h > slack;
    below = below || h < -slack;
  }
  visible = above;
  if (!above || !below) return std::nullopt;
  Polygon part(polygon::clip(a.corners, b.normal, b.centroid, slack), a.normal);
  visible = part.area > 0;
  return part;
}

double mutual_area(const Polygon& p, const Polygon& q, double far) {
  const double r = (p.centroid - q.centroid).norm();
  // The cosines have opposite signs: r points from one to the other.
  const double area = r > far * (p.radius + q.radius)
                          ? -pair_kernel().quadrature(columns_of(p), columns_of(q))
                          : contour_mutual_area(p.edges, q.edges);
  return std::clamp(area, 0.0, std::min(p.area, q.area));  // rounding may leave that range by 1e-16
}

}  // namespace radiosity
