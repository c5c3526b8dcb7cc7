// SPDX-License-Identifier: GPL-3.0-or-later
#include "shadow_share.hpp"

#include <algorithm>

#include "vectors.hpp"

namespace radiosity {
namespace {

constexpr double kNode = 0.3872983346207417;  // of the Gauss rule on [−½, ½]; the others are 0 and −kNode
constexpr double kOuter = 5.0 / 18, kInner = 8.0 / 18;

// Σ_b row[b] t^b through values at −kNode, 0, kNode.
RADIOSITY_INLINE void interpolate(const Lanes& low, const Lanes& middle, const Lanes& high, Lanes* row) {
  row[0] = middle;
  row[1] = (high - low) * (0.5 / kNode);
  row[2] = (low + high - 2 * middle) * (0.5 / (kNode * kNode));
}

// K = Σ_ab k[a][b] u^a v^b as P = Σ_ab p[a][b] u^a v^(b+1); below the square, and above it or the diagonal, ∫ P du = Σ_k side[k] u^(k+1).
template <bool kTriangle>
struct Kernel {
  static constexpr std::size_t kTopTerms = kTriangle ? 6 : 3;
  Lanes p[3][3], bottom[3], top[kTopTerms], all;

  RADIOSITY_INLINE void fit(const Lanes (&k)[3][3]) {  // k[a][b] at u_a, v_b
    Lanes along_v[3][3];
    for (std::size_t a = 0; a < 3; ++a) interpolate(k[a][0], k[a][1], k[a][2], along_v[a]);
    for (std::size_t b = 0; b < 3; ++b) {
      Lanes column[3];
      interpolate(along_v[0][b], along_v[1][b], along_v[2][b], column);
      for (std::size_t a = 0; a < 3; ++a) p[a][b] = column[a] * (1.0 / static_cast<double>(b + 1));
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const double share = 1.0 / static_cast<double>(a + 1);
      const Lanes even = 0.25 * p[a][1], odd = 0.5 * p[a][0] + 0.125 * p[a][2];
      bottom[a] = share * (even - odd);
      if constexpr (!kTriangle) top[a] = share * (even + odd);
    }
    if constexpr (kTriangle) {
      top[0] = Lanes{};
      top[1] = p[0][0] * (1.0 / 2);
      top[2] = (p[0][1] + p[1][0]) * (1.0 / 3);
      top[3] = (p[0][2] + p[1][1] + p[2][0]) * (1.0 / 4);
      top[4] = (p[1][2] + p[2][1]) * (1.0 / 5);
      top[5] = p[2][2] * (1.0 / 6);
    }
    const Lanes right = Lanes{} + 0.5, left = Lanes{} - 0.5;
    all = above(right) - above(left) - (below(right) - below(left));
  }
  RADIOSITY_INLINE Lanes at(const Lanes& u, const Lanes& v) const {
    const Lanes s0 = p[0][0] + v * (p[0][1] + v * p[0][2]);
    const Lanes s1 = p[1][0] + v * (p[1][1] + v * p[1][2]);
    const Lanes s2 = p[2][0] + v * (p[2][1] + v * p[2][2]);
    return v * (s0 + u * (s1 + u * s2));
  }
  RADIOSITY_INLINE Lanes below(const Lanes& u) const {
    return u * (bottom[0] + u * (bottom[1] + u * bottom[2]));
  }
  RADIOSITY_INLINE Lanes above(const Lanes& u) const {
    Lanes sum = top[kTopTerms - 1];
    for (std::size_t k = kTopTerms - 1; k-- > 0;) sum = top[k] + u * sum;
    return u * sum;
  }
};

RADIOSITY_INLINE Lanes smaller(const Lanes& a, const Lanes& b) {
  return select(greater(a, b), b, a);
}
RADIOSITY_INLINE Lanes larger(const Lanes& a, const Lanes& b) {
  return select(greater(a, b), a, b);
}

// ∫ P du along the edge from (u0, v0) to (u1, v1), both held to q.
template <bool kTriangle>
RADIOSITY_INLINE Lanes along_edge(const Kernel<kTriangle>& kernel, const Lanes& u0, const Lanes& v0,
                                  const Lanes& u1, const Lanes& v1) {
  const Lanes zero{}, one = zero + 1, tiny = zero + 1e-200;
  const auto not_zero = [&](const Lanes& x)
                            RADIOSITY_INLINED { return select(greater(absolute(x), tiny), x, tiny); };
  const Lanes du = u1 - u0, dv = v1 - v0;
  const auto u_at = [&](const Lanes& t) RADIOSITY_INLINED { return u0 + t * du; };
  // Where the edge is within the strip |u| ≤ ½.
  const Lanes per_u = 1 / not_zero(du);
  const Lanes ua = (-0.5 - u0) * per_u, ub = (0.5 - u0) * per_u;
  const Lanes begin = smaller(larger(smaller(ua, ub), zero), one);
  const Lanes end = larger(smaller(larger(ua, ub), one), begin);
  // And there neither below q nor above it: both heights over its sides are linear along the edge.
  const Lanes low = v0 + 0.5, high = kTriangle ? u0 - v0 : 0.5 - v0;
  const Lanes low_slope = not_zero(dv), high_slope = not_zero(kTriangle ? du - dv : -dv);
  const Lanes cross_low = -low / low_slope, cross_high = -high / high_slope;
  const LaneBits low_rises = greater(low_slope, zero), high_rises = greater(high_slope, zero);
  const Lanes from = larger(select(low_rises, cross_low, begin), select(high_rises, cross_high, begin));
  const Lanes to = smaller(select(low_rises, end, cross_low), select(high_rises, end, cross_high));
  const Lanes enter = smaller(larger(from, begin), end);
  const Lanes leave = larger(smaller(to, end), enter);
  const auto held = [&](const Lanes& t, const Lanes& t0,
                        const Lanes& t1) RADIOSITY_INLINED {  // of all of [t0, t1], t one of its ends
    const LaneBits is_above = greater(low + t * dv, high + t * (kTriangle ? du - dv : -dv));
    const Lanes ua0 = u_at(t0), ua1 = u_at(t1);
    return select(is_above, kernel.above(ua1) - kernel.above(ua0), kernel.below(ua1) - kernel.below(ua0));
  };
  const Lanes middle = (enter + leave) * 0.5, half = (leave - enter) * 0.5;
  const Lanes offset = half * (2 * kNode);
  Lanes inside = 2 * kInner * kernel.at(u_at(middle), v0 + middle * dv);
  inside += 2 * kOuter * kernel.at(u_at(middle - offset), v0 + (middle - offset) * dv);
  inside += 2 * kOuter * kernel.at(u_at(middle + offset), v0 + (middle + offset) * dv);
  return inside * half * du + held(begin, begin, enter) + held(end, leave, end);
}

struct Frame {
  const double *origin, *u, *v, *normal, *dual_u, *dual_v;
  double area;
};
struct Corners {
  const double *u, *v, *h;
  std::size_t count;
  const double* plane;
  std::size_t group;
};

RADIOSITY_INLINE Lanes product(const double* a, const Lanes& x, const Lanes& y, const Lanes& z) {
  return a[0] * x + a[1] * y + a[2] * z;
}

// Of eight points.
template <bool kTriangle>
RADIOSITY_INLINE void add_sums(const double* const* points, const double* normal, const Frame& q,
                               const Corners* shadows, std::size_t count, double* const* answers) {
  const Lanes x = load(points[0]) - q.origin[0], y = load(points[1]) - q.origin[1],
              z = load(points[2]) - q.origin[2];
  const Lanes h = product(q.normal, x, y, z), u = product(q.dual_u, x, y, z), v = product(q.dual_v, x, y, z);
  constexpr double kNodes[3] = {-kNode, 0, kNode};
  Lanes values[3][3];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) {
      const Lanes r0 = kNodes[a] * q.u[0] + kNodes[b] * q.v[0] - x,
                  r1 = kNodes[a] * q.u[1] + kNodes[b] * q.v[1] - y,
                  r2 = kNodes[a] * q.u[2] + kNodes[b] * q.v[2] - z;
      const Lanes s = r0 * r0 + r1 * r1 + r2 * r2;
      values[a][b] = h * product(normal, r0, r1, r2) / (s * s);
    }
  Kernel<kTriangle> kernel;
  kernel.fit(values);
  const Lanes zero{}, one = zero + 1;
  Lanes hidden{};
  LaneBits whole{}, unsure{};
  struct Box {
    Lanes low_u, high_u, low_v, high_v;
  };
  Box boxes[ShadowShare::kMost];
  for (std::size_t n = 0; n < count; ++n) {
    const Corners& shadow = shadows[n];
    // Where the line from the point through a corner meets the plane of q.
    const auto project = [&](std::size_t k, Lanes& at_u, Lanes& at_v) RADIOSITY_INLINED {
      const Lanes per_h = 1 / larger(h - shadow.h[k], zero + 1e-200);
      at_u = (h * shadow.u[k] - u * shadow.h[k]) * per_h;
      at_v = (h * shadow.v[k] - v * shadow.h[k]) * per_h;
    };
    Lanes first_u, first_v;
    project(0, first_u, first_v);
    Box box{first_u, first_u, first_v, first_v};
    Lanes u0 = first_u, v0 = first_v, sum{}, highest = zero + shadow.h[0];
    for (std::size_t k = 1; k <= shadow.count; ++k) {
      Lanes u1 = first_u, v1 = first_v;
      if (k < shadow.count) {
        project(k, u1, v1);
        highest = larger(highest, zero + shadow.h[k]);
        box = {smaller(box.low_u, u1), larger(box.high_u, u1), smaller(box.low_v, v1),
               larger(box.high_v, v1)};
      }
      sum += along_edge(kernel, u0, v0, u1, v1);
      u0 = u1;
      v0 = v1;
    }
    const LaneBits front = greater(product(shadow.plane, x, y, z) - shadow.plane[3], zero);
    const LaneBits too_high = front & greater(highest, 0.999 * h);
    const Lanes mine = select(front & ~too_high, absolute(sum), zero);
    hidden += mine;
    whole |= greater(mine, (1 - 1e-12) * kernel.all);
    unsure |= too_high;
    // Within q; empty where the point does not see the shadow.
    boxes[n] = {select(front, larger(box.low_u, zero - 0.5), one),
                select(front, smaller(box.high_u, zero + 0.5), -one),
                select(front, larger(box.low_v, zero - 0.5), one),
                select(front, smaller(box.high_v, zero + 0.5), -one)};
    constexpr double kApart = 1e-9;
    for (std::size_t m = 0; m < n; ++m) {
      if (shadows[m].group == shadow.group) continue;
      const Box &a = boxes[m], &b = boxes[n];
      unsure |= greater(smaller(a.high_u, b.high_u) - larger(a.low_u, b.low_u), zero + kApart) &
                greater(smaller(a.high_v, b.high_v) - larger(a.low_v, b.low_v), zero + kApart);
    }
  }
  const Lanes seen = select(whole, zero, kernel.all - smaller(hidden, kernel.all));
  store(load(answers[0]) + q.area * kernel.all, answers[0]);
  store(load(answers[1]) + q.area * seen, answers[1]);
  store(load(answers[2]) + select(unsure & ~whole, one, zero), answers[2]);
}

RADIOSITY_CLONES void add_of_parallelogram(const double* const* points, const double* normal, const Frame& q,
                                           const Corners* shadows, std::size_t count,
                                           double* const* answers) {
  add_sums<false>(points, normal, q, shadows, count, answers);
}
RADIOSITY_CLONES void add_of_triangle(const double* const* points, const double* normal, const Frame& q,
                                      const Corners* shadows, std::size_t count, double* const* answers) {
  add_sums<true>(points, normal, q, shadows, count, answers);
}

}  // namespace

ShadowShare::ShadowShare(std::span<const Vec3> corners, const Vec3& normal)
    : triangle_(corners.size() == 3), normal_(normal) {
  // The longest side of a triangle is the diagonal.
  std::size_t first = 0;
  const auto diagonal = [&](std::size_t k) { return (corners[(k + 2) % 3] - corners[k]).squaredNorm(); };
  for (std::size_t k = 1; triangle_ && k < 3; ++k)
    if (diagonal(k) > diagonal(first)) first = k;
  const auto corner = [&](std::size_t k) -> const Vec3& { return corners[(first + k) % corners.size()]; };
  origin_ = (corner(0) + corner(2)) / 2;
  u_ = corner(1) - corner(0);
  v_ = corner(2) - corner(1);
  dual_u_ = v_.cross(normal_) / u_.dot(v_.cross(normal_));
  dual_v_ = normal_.cross(u_) / v_.dot(normal_.cross(u_));
}

void ShadowShare::add(std::span<const Vec3> polygon, std::size_t group, const Vec3* normal) {
  Shadow& shadow = shadows_.emplace_back();
  for (const Vec3& corner : polygon) {
    const Vec3 r = corner - origin_;
    shadow.u.push_back(dual_u_.dot(r));
    shadow.v.push_back(dual_v_.dot(r));
    shadow.h.push_back(normal_.dot(r));
  }
  shadow.group = group;
  shadow.plane = {0, 0, 0, -1};
  if (normal) shadow.plane = {normal->x(), normal->y(), normal->z(), normal->dot(polygon[0] - origin_)};
}

void ShadowShare::Points::fill() {
  while (columns[0].size() % kLanes != 0) {
    for (std::size_t k = 0; k < 3; ++k) columns[k].push_back(columns[k].back());
    columns[3].push_back(0);
  }
  for (auto* answers : {&all, &seen, &unsure}) answers->assign(columns[0].size(), 0);
}

void ShadowShare::add_to(Points& points, const Vec3& normal) const {
  const Frame frame{origin_.data(), u_.data(),      v_.data(),          normal_.data(),
                    dual_u_.data(), dual_v_.data(), u_.cross(v_).norm()};
  std::array<Corners, kMost> corners;
  for (std::size_t n = 0; n < shadows_.size(); ++n) {
    const Shadow& s = shadows_[n];
    corners[n] = {s.u.data(), s.v.data(), s.h.data(), s.u.size(), s.plane.data(), s.group};
  }
  const auto& columns = points.columns;
  for (std::size_t k = 0; k < columns[0].size(); k += kLanes) {
    const double* const at[3] = {&columns[0][k], &columns[1][k], &columns[2][k]};
    double* const answers[3] = {&points.all[k], &points.seen[k], &points.unsure[k]};
    (triangle_ ? add_of_triangle : add_of_parallelogram)(at, normal.data(), frame, corners.data(),
                                                         shadows_.size(), answers);
  }
}

}  // namespace radiosity
