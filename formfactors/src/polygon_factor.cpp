// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon_factor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "vectors.hpp"

namespace radiosity {
namespace {

using Edge = Polygon::Edge;

constexpr double kSmallest = std::numeric_limits<double>::min();  // of normal numbers

// Gauss–Legendre rule of 8 points on [−1, 1].
constexpr std::array<double, kLanes> kGaussX{-0.9602898564975363, -0.7966664774136267, -0.5255324099163290,
                                             -0.1834346424956498, 0.1834346424956498,  0.5255324099163290,
                                             0.7966664774136267,  0.9602898564975363};
constexpr std::array<double, kLanes> kGaussW{0.1012285362903763, 0.2223810344533745, 0.3137066458778873,
                                             0.3626837833783620, 0.3626837833783620, 0.3137066458778873,
                                             0.2223810344533745, 0.1012285362903763};

Vec3 at(const Edge& e, double s) {
  return e.start + s * e.direction;
}

double distance(const Vec3& x, const Edge& e) {
  const double t = std::clamp((x - e.start).dot(e.direction), 0.0, e.length);
  return (x - at(e, t)).norm();
}

// ∫ ∫_f ln|x − y| |dy| |dx| over the part of length h about `middle` of an edge, by 8 points x; the inner integral is closed:
//   w ln √(w² + d²) + p ln √(p² + d²) − l + d · (the angle under which x sees f),
// where p and w = l − p are the parts of f before and after the foot of x, and d is the distance from its line.
RADIOSITY_CLONES double part_of_edge_pair(const double* middle, const double* direction, double h,
                                          const double* start, const double* line, double length) {
  const Lanes s = load(kGaussX.data()) * (h / 2);
  Lanes r[3];
  for (std::size_t c = 0; c < 3; ++c) r[c] = middle[c] - start[c] + s * direction[c];
  const Lanes p = r[0] * line[0] + r[1] * line[1] + r[2] * line[2];
  const Lanes w = length - p;
  const Lanes x0 = r[1] * line[2] - r[2] * line[1], x1 = r[2] * line[0] - r[0] * line[2],
              x2 = r[0] * line[1] - r[1] * line[0];
  const Lanes d2 = x0 * x0 + x1 * x1 + x2 * x2;
  const Lanes d = square_root(d2);
  const Lanes near = p * p + d2, far = w * w + d2;
  const auto log_of = [](const Lanes& x) RADIOSITY_INLINED {
    return natural_log(select(greater(x, Lanes{} + kSmallest), x, Lanes{} + 1));
  };
  const Lanes values = load(kGaussW.data()) * (w * log_of(far) / 2 + p * log_of(near) / 2 - length +
                                               d * upper_angle(d * length, d2 - p * w));
  double sum = 0;
  for (std::size_t k = 0; k < kLanes; ++k) sum += values[k];
  return sum * h / 2;
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
  return part_of_edge_pair(x.data(), e.direction.data(), h, f.start.data(), f.direction.data(), f.length);
}

RADIOSITY_CLONES double parallel_sum(const double* w_of, const double* d_of, const double* sign,
                                     std::size_t count) {
  Lanes sum{};
  for (std::size_t k = 0; k < count; k += kLanes) {
    const Lanes w = load(w_of + k), d = load(d_of + k);
    const Lanes width = absolute(w);
    const Lanes w2 = w * w, d2 = d * d, q = w2 + d2;
    const Lanes log = natural_log(select(greater(q, Lanes{} + kSmallest), q, Lanes{} + 1));
    sum += load(sign + k) * ((w2 - d2) * log / 4 - 0.75 * w2 + width * d * upper_angle(width, d));
  }
  double out = 0;
  for (std::size_t k = 0; k < kLanes; ++k) out += sum[k];
  return out;
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
    sum += parallel_sum(w.data(), d.data(), sign.data(), count);
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

// Kernel cosθ cosθ' / (π r²) summed over the two product rules, up to its sign. Points behind the other plane do not occur here.
RADIOSITY_CLONES double quadrature(const Polygon::Rule& p, const double* p_normal, const Polygon::Rule& q,
                                   const double* q_normal) {
  Lanes sum{};
  for (std::size_t i = 0; i < p.size; ++i) {
    for (std::size_t k = 0; k < q.stride; k += kLanes) {
      Lanes r[3];
      for (std::size_t c = 0; c < 3; ++c)
        r[c] = load(q.columns.data() + c * q.stride + k) - p.columns[c * p.stride + i];
      const Lanes s = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
      const Lanes cosines = (p_normal[0] * r[0] + p_normal[1] * r[1] + p_normal[2] * r[2]) *
                            (q_normal[0] * r[0] + q_normal[1] * r[1] + q_normal[2] * r[2]);
      sum += p.columns[3 * p.stride + i] * load(q.columns.data() + 3 * q.stride + k) * cosines / (s * s);
    }
  }
  double out = 0;
  for (std::size_t k = 0; k < kLanes; ++k) out += sum[k];
  return out / std::numbers::pi;
}

struct Node {
  Vec3 x;
  double weight;
};

Polygon::Rule columns_of(const std::vector<Node>& nodes) {
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
  if (corners.size() == 4) rule = columns_of(tensor_nodes(corners, normal));
  if (rule.size == 0) rule = columns_of(fan_nodes(corners, normal));
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
                          ? -quadrature(p.rule, p.normal.data(), q.rule, q.normal.data())
                          : contour_mutual_area(p.edges, q.edges);
  return std::clamp(area, 0.0, std::min(p.area, q.area));  // rounding may leave that range by 1e-16
}

}  // namespace radiosity
