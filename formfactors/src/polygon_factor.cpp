// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon_factor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "vector_clones.hpp"

namespace radiosity {
namespace {

// Gauss–Legendre rule of 8 points on [0, 1].
constexpr std::array<double, 4> kGaussX{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                        0.9602898564975363};
constexpr std::array<double, 4> kGaussW{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                        0.1012285362903763};

// G with G''(w) = ln √(w² + d²), both constants of integration 0.
double double_integral_of_log(double w, double d) {
  const double q = w * w + d * d;
  if (q == 0) return 0;
  const double arc = d > 0 ? w * d * std::atan(w / d) : 0;
  return (w * w - d * d) * std::log(q) / 4 - 0.75 * w * w + arc;
}

struct Edge {
  Vec3 start;
  Vec3 direction;  // unit
  double length;
  Vec3 at(double s) const { return start + s * direction; }
};

double distance(const Vec3& x, const Edge& e) {
  const double t = std::clamp((x - e.start).dot(e.direction), 0.0, e.length);
  return (x - e.at(t)).norm();
}

// ∫_e ln|x − y| |dy| in closed form.
double log_potential(const Vec3& x, const Edge& e) {
  const Vec3 r = x - e.start;
  const double p = r.dot(e.direction);
  const double w = e.length - p;
  const double d2 = r.cross(e.direction).squaredNorm();
  const double near = p * p + d2;
  const double far = w * w + d2;
  double sum = -e.length;
  if (far > 0) sum += w * std::log(far) / 2;
  if (near > 0) sum += p * std::log(near) / 2;
  if (d2 > 0) {
    const double d = std::sqrt(d2);
    sum += d * std::atan2(d * e.length, d2 - p * w);  // d times the angle under which x sees e
  }
  return sum;
}

// ∫∫ ln|x − y| |dx| |dy| over [s0, s1] of e and all of f. Halved until the pieces are short compared with their distance
// from f: then the 8-point rule errs by about 1e-10. Where the edges touch, the halving ends at 1e-5 of the edge: the
// integrand is continuous, and what the rule misses of its kink is of the order of the square of that.
double graded(const Edge& e, const Edge& f, double s0, double s1) {
  const double h = s1 - s0;
  const double middle = (s0 + s1) / 2;
  if (distance(e.at(middle), f) < 1.5 * h && h > 1e-5 * e.length) {
    return graded(e, f, s0, middle) + graded(e, f, middle, s1);
  }
  double sum = 0;
  for (std::size_t k = 0; k < kGaussX.size(); ++k) {
    const double offset = kGaussX[k] * h / 2;
    sum += kGaussW[k] * (log_potential(e.at(middle - offset), f) + log_potential(e.at(middle + offset), f));
  }
  return sum * h / 2;
}

// ∫∫ ln|x − y| dx·dy over two edges.
double edge_pair(const Edge& e, const Edge& f) {
  const double cosine = e.direction.dot(f.direction);
  if (std::abs(cosine) <= tolerance::kParallel) return 0;
  if (e.direction.cross(f.direction).norm() > tolerance::kParallel) return cosine * graded(e, f, 0, e.length);
  const Vec3 r = f.start - e.start;
  const double d = r.cross(e.direction).norm();
  const double t0 = r.dot(e.direction);
  const double t1 = t0 + cosine * f.length;
  // t runs backwards along antiparallel edges; so does the sign of dx·dy: the integral comes out signed.
  return double_integral_of_log(e.length - t0, d) - double_integral_of_log(-t0, d) -
         double_integral_of_log(e.length - t1, d) + double_integral_of_log(-t1, d);
}

void edges_of(std::span<const Vec3> polygon, std::vector<Edge>& edges) {
  edges.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 d = polygon[(k + 1) % polygon.size()] - polygon[k];
    const double length = d.norm();
    if (length > 0) edges.push_back({polygon[k], d / length, length});
  }
}

// A_i F_ij in contour form.
double contour_mutual_area(std::span<const Vec3> p, std::span<const Vec3> q) {
  thread_local std::vector<Edge> pe, qe;
  edges_of(p, pe);
  edges_of(q, qe);
  double sum = 0;
  for (const Edge& e : pe) {
    for (const Edge& f : qe) sum += edge_pair(e, f);
  }
  return sum / (2 * std::numbers::pi);
}

template <std::size_t kLanes>
struct Vector {
  using Doubles [[gnu::vector_size(kLanes * sizeof(double))]] = double;
};

// Adds weight · cosθ cosθ' / r² of a point x, y, z, weight on polygon p and of as many points of q as there are lanes.
template <std::size_t kLanes>
RADIOSITY_INLINE void add_kernels(const double* x, const double* p_normal, const double* points,
                                  std::size_t stride, const double* q_normal,
                                  typename Vector<kLanes>::Doubles& sum) {
  typename Vector<kLanes>::Doubles r[3], weight;
  for (std::size_t c = 0; c < 3; ++c) {
    std::memcpy(&r[c], points + c * stride, sizeof r[c]);
    r[c] -= x[c];
  }
  std::memcpy(&weight, points + 3 * stride, sizeof weight);
  const auto r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  const auto cosines = (p_normal[0] * r[0] + p_normal[1] * r[1] + p_normal[2] * r[2]) *
                       (q_normal[0] * r[0] + q_normal[1] * r[1] + q_normal[2] * r[2]);
  sum += x[3] * weight * cosines / (r2 * r2);
}

// Kernel cosθ cosθ' / (π r²) summed over the two product rules, up to its sign. Points behind the other plane do not occur here.
RADIOSITY_CLONES double quadrature(const Polygon::Rule& p, const double* p_normal, const Polygon::Rule& q,
                                   const double* q_normal) {
  Vector<8>::Doubles eight{};
  Vector<4>::Doubles four{};
  const double* const points = q.columns.data();
  for (std::size_t i = 0; i < p.size; ++i) {
    double x[4];
    for (std::size_t c = 0; c < 4; ++c) x[c] = p.columns[c * p.stride + i];
    std::size_t k = 0;
    for (; k + 8 <= q.stride; k += 8) add_kernels<8>(x, p_normal, points + k, q.stride, q_normal, eight);
    if (k < q.stride) add_kernels<4>(x, p_normal, points + k, q.stride, q_normal, four);
  }
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += eight[k] + eight[k + 4] + four[k];
  return sum / std::numbers::pi;
}

struct Node {
  Vec3 x;
  double weight;
};

Polygon::Rule columns_of(const std::vector<Node>& nodes) {
  Polygon::Rule rule{nodes.size(), (nodes.size() + 3) / 4 * 4, {}};
  rule.columns.resize(4 * rule.stride);
  for (std::size_t k = 0; k < rule.stride && !nodes.empty(); ++k) {
    const Node& node = nodes[std::min(k, nodes.size() - 1)];  // the last again and again, without a weight
    for (std::size_t c = 0; c < 3; ++c)
      rule.columns[c * rule.stride + k] = node.x[static_cast<Eigen::Index>(c)];
    rule.columns[3 * rule.stride + k] = k < nodes.size() ? node.weight : 0;
  }
  return rule;
}

// The n × n Gauss points of the bilinear map of a convex quad; nothing where the map folds.
template <std::size_t n>
std::vector<Node> tensor_nodes(const std::vector<Vec3>& c, const Vec3& normal, const std::array<double, n>& x,
                               const std::array<double, n>& w) {
  std::vector<Node> nodes;
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
  if (corners.size() == 4) {
    rule = columns_of(tensor_nodes<3>(corners, normal, {0.1127016653792583, 0.5, 0.8872983346207417},
                                      {5.0 / 18, 8.0 / 18, 5.0 / 18}));
    coarse_rule =
        columns_of(tensor_nodes<2>(corners, normal, {0.2113248654051871, 0.7886751345948129}, {0.5, 0.5}));
  }
  if (rule.size == 0) rule = columns_of(fan_nodes(corners, normal));
  if (coarse_rule.size == 0) coarse_rule = rule;
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

double mutual_area(const Polygon& p, const Polygon& q) {
  const double r = (p.centroid - q.centroid).norm();
  const double reach = p.radius + q.radius;
  // The cosines have opposite signs: r points from one to the other.
  const auto far = [&](const Polygon::Rule& a, const Polygon::Rule& b) {
    return -quadrature(a, p.normal.data(), b, q.normal.data());
  };
  const double area = r > tolerance::kVeryFarPair * reach ? far(p.coarse_rule, q.coarse_rule)
                      : r > tolerance::kFarPair * reach   ? far(p.rule, q.rule)
                                                          : contour_mutual_area(p.corners, q.corners);
  return std::clamp(area, 0.0, std::min(p.area, q.area));  // rounding may leave that range by 1e-16
}

}  // namespace radiosity
