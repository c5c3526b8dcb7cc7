// SPDX-License-Identifier: GPL-3.0-or-later
#include "shadow_share.hpp"

#include <algorithm>
#include <bit>

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

constexpr double kTiny = 1e-90;
RADIOSITY_INLINE Lanes not_zero(const Lanes& x) {
  return select(greater(absolute(x), Lanes{} + kTiny), x, Lanes{} + kTiny);
}

// ∫ P du along the edge from (u0, v0) to (u1, v1), both held to q.
template <bool kTriangle>
RADIOSITY_INLINE Lanes along_edge(const Kernel<kTriangle>& kernel, const Lanes& u0, const Lanes& v0,
                                  const Lanes& u1, const Lanes& v1) {
  const Lanes zero{}, one = zero + 1;
  // Where the edge is within the strip |u| ≤ ½.
  if (!any(greater(larger(u0, u1), zero - 0.5) & greater(zero + 0.5, smaller(u0, u1)))) return zero;
  const Lanes du = u1 - u0, dv = v1 - v0;
  const auto u_at = [&](const Lanes& t) RADIOSITY_INLINED { return u0 + t * du; };
  const Lanes low_slope = not_zero(dv), high_slope = kTriangle ? not_zero(du - dv) : -low_slope;
  const Lanes u_slope = not_zero(du);
  // Of all three slopes by one division.
  const Lanes per_low_high = 1 / (u_slope * (kTriangle ? low_slope * high_slope : low_slope));
  const Lanes per_u = per_low_high * (kTriangle ? low_slope * high_slope : low_slope);
  const Lanes per_low = per_low_high * (kTriangle ? u_slope * high_slope : u_slope);
  const Lanes per_high = kTriangle ? per_low_high * (u_slope * low_slope) : -per_low;
  const Lanes ua = (-0.5 - u0) * per_u, ub = (0.5 - u0) * per_u;
  const Lanes begin = smaller(larger(smaller(ua, ub), zero), one);
  const Lanes end = larger(smaller(larger(ua, ub), one), begin);
  // And there neither below q nor above it: both heights over its sides are linear along the edge.
  const Lanes low = v0 + 0.5, high = kTriangle ? u0 - v0 : 0.5 - v0;
  const Lanes cross_low = -low * per_low, cross_high = -high * per_high;
  const LaneBits low_rises = greater(low_slope, zero), high_rises = greater(high_slope, zero);
  const Lanes from = larger(select(low_rises, cross_low, begin), select(high_rises, cross_high, begin));
  const Lanes to = smaller(select(low_rises, end, cross_low), select(high_rises, end, cross_high));
  const Lanes enter = smaller(larger(from, begin), end);
  const Lanes leave = larger(smaller(to, end), enter);
  Lanes sum{};
  if (any(greater(leave, enter))) {
    const Lanes middle = (enter + leave) * 0.5, half = (leave - enter) * 0.5;
    const Lanes offset = half * (2 * kNode);
    Lanes inside = 2 * kInner * kernel.at(u_at(middle), v0 + middle * dv);
    inside += 2 * kOuter * kernel.at(u_at(middle - offset), v0 + (middle - offset) * dv);
    inside += 2 * kOuter * kernel.at(u_at(middle + offset), v0 + (middle + offset) * dv);
    sum = inside * half * du;
  }
  const auto held = [&](const Lanes& t, const Lanes& t0,
                        const Lanes& t1) RADIOSITY_INLINED {  // of all of [t0, t1], t one of its ends
    if (!any(greater(t1, t0))) return;
    const LaneBits is_above = greater(low + t * dv, high + t * (kTriangle ? du - dv : -dv));
    const Lanes ua0 = u_at(t0), ua1 = u_at(t1);
    sum += select(is_above, kernel.above(ua1) - kernel.above(ua0), kernel.below(ua1) - kernel.below(ua0));
  };
  held(begin, begin, enter);
  held(end, leave, end);
  return sum;
}

// A shadow in the plane of q: its corners, and where it is seen at all the box of what is within q's. `turn` is 1 where it is
// counter-clockwise, −1 elsewhere.
struct Projected {
  Lanes *u, *v;
  std::size_t count;
  Lanes turn, low_u, high_u, low_v, high_v;

  // Where the edge from (u0, v0) along (du, dv) is in it.
  RADIOSITY_INLINE void cut(const Lanes& u0, const Lanes& v0, const Lanes& du, const Lanes& dv, Lanes& enter,
                            Lanes& leave) const {
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = k + 1 == count ? 0 : k + 1;
      const Lanes fu = turn * (u[next] - u[k]), fv = turn * (v[next] - v[k]);
      const Lanes slope = not_zero(fu * dv - fv * du);
      const Lanes cross = (fv * (u0 - u[k]) - fu * (v0 - v[k])) / slope;
      const LaneBits rises = greater(slope, Lanes{});
      enter = select(rises, larger(enter, cross), enter);
      leave = select(rises, leave, smaller(leave, cross));
    }
  }
};

// ∫ P du along what of the edges of a shadow lies in any of some others, where these may overlap it.
constexpr std::size_t kMostOverlaps = 4;
template <bool kTriangle>
RADIOSITY_INLINE Lanes along_edges_within(const Kernel<kTriangle>& kernel, const Projected& a,
                                          const Projected* const* others, const LaneBits* overlaps,
                                          std::size_t count) {
  const Lanes zero{}, one = zero + 1;
  Lanes sum{};
  for (std::size_t k = 0; k < a.count; ++k) {
    const std::size_t next = k + 1 == a.count ? 0 : k + 1;
    const Lanes u0 = a.u[k], v0 = a.v[k], du = a.u[next] - u0, dv = a.v[next] - v0;
    // What lies in each, in two, …: a set for each number in binary, which counts with the sign of its size.
    Lanes enter[1 << kMostOverlaps], leave[1 << kMostOverlaps];
    enter[0] = zero;
    leave[0] = one;
    for (std::size_t set = 1; set < std::size_t{1} << count; ++set) {
      const std::size_t rest = set & (set - 1);
      const auto newest = static_cast<std::size_t>(std::countr_zero(set));
      enter[set] = enter[rest];
      leave[set] = leave[rest];
      if (!any(greater(leave[rest], enter[rest]))) continue;
      const std::size_t single = std::size_t{1} << newest;
      if (set == single) {
        others[newest]->cut(u0, v0, du, dv, enter[set], leave[set]);
        leave[set] = select(overlaps[newest], leave[set], zero);
      } else {
        enter[set] = larger(enter[rest], enter[single]);
        leave[set] = smaller(leave[rest], leave[single]);
      }
      enter[set] = smaller(enter[set], one);
      leave[set] = larger(leave[set], enter[set]);
      if (!any(greater(leave[set], enter[set]))) continue;
      const Lanes along = along_edge(kernel, u0 + enter[set] * du, v0 + enter[set] * dv, u0 + leave[set] * du,
                                     v0 + leave[set] * dv);
      sum += std::popcount(set) % 2 == 1 ? along : -along;
    }
  }
  return sum;
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

constexpr double kBelow = 1 - 1e-4;

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
  Lanes corner_u[2 * ShadowShare::kMostCorners], corner_v[2 * ShadowShare::kMostCorners];
  Projected projected[ShadowShare::kMost];
  std::size_t corners = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const Corners& shadow = shadows[n];
    Projected& to = projected[n];
    to.u = corner_u + corners;
    to.v = corner_v + corners;
    to.count = 0;
    // Where the line from the point through (a, b) at a height over q meets the plane of q.
    const auto add = [&](const Lanes& a, const Lanes& b, const Lanes& height) RADIOSITY_INLINED {
      const Lanes per_h = 1 / larger(h - height, zero + kTiny);
      to.u[to.count] = (h * a - u * height) * per_h;
      to.v[to.count++] = (h * b - v * height) * per_h;
    };
    // What is nearly as high as the point, or higher, casts no shadow.
    const Lanes limit = kBelow * h;
    LaneBits too_high{};
    for (std::size_t k = 0; k < shadow.count; ++k) too_high |= greater(zero + shadow.h[k], limit);
    if (!any(too_high)) {
      for (std::size_t k = 0; k < shadow.count; ++k)
        add(zero + shadow.u[k], zero + shadow.v[k], zero + shadow.h[k]);
    } else {
      // Every corner and where the edge behind it passes the limit, each in its place or in that of the one before it.
      Lanes last_u = zero, last_v = zero, last_h = zero;
      const auto cut = [&](std::size_t k) RADIOSITY_INLINED {
        const std::size_t next = k + 1 == shadow.count ? 0 : k + 1;
        const double from = shadow.h[k], to_h = shadow.h[next];
        const LaneBits crosses = greater(zero + from, limit) ^ greater(zero + to_h, limit);
        const Lanes t = select(crosses, limit - from, zero) / (from == to_h ? 1 : to_h - from);
        last_u = select(crosses, shadow.u[k] + t * (shadow.u[next] - shadow.u[k]), last_u);
        last_v = select(crosses, shadow.v[k] + t * (shadow.v[next] - shadow.v[k]), last_v);
        last_h = select(crosses, limit, last_h);
        return any(crosses);
      };
      // What is then lost between the limit and the point has its shadow at ten thousand times its distance: outside of q, unless it is
      // right beside the point.
      const auto [low_u, high_u] = std::minmax_element(shadow.u, shadow.u + shadow.count);
      const auto [low_v, high_v] = std::minmax_element(shadow.v, shadow.v + shadow.count);
      const Lanes beside_u = (1 - kBelow) * (absolute(u) + 1), beside_v = (1 - kBelow) * (absolute(v) + 1);
      unsure |= too_high & greater(h, zero + *std::min_element(shadow.h, shadow.h + shadow.count)) &
                greater(*high_u + beside_u, u) & greater(u, *low_u - beside_u) &
                greater(*high_v + beside_v, v) & greater(v, *low_v - beside_v);
      for (std::size_t k = 0; k < shadow.count; ++k) cut(k);
      for (std::size_t k = 0; k < shadow.count; ++k) {
        const LaneBits below = ~greater(zero + shadow.h[k], limit);
        last_u = select(below, zero + shadow.u[k], last_u);
        last_v = select(below, zero + shadow.v[k], last_v);
        last_h = select(below, zero + shadow.h[k], last_h);
        if (any(below)) add(last_u, last_v, last_h);
        if (cut(k)) add(last_u, last_v, last_h);
      }
    }
    corners += to.count;
    // Shadows differ in size by a little, so that of edges that two share one is within the other shadow or neither.
    const double larger_by = 1 + 1e-11 * static_cast<double>(n);
    Lanes middle_u{}, middle_v{};
    for (std::size_t k = 0; k < to.count; ++k) {
      middle_u += to.u[k] * (1 / static_cast<double>(to.count));
      middle_v += to.v[k] * (1 / static_cast<double>(to.count));
    }
    Lanes low_u{}, high_u{}, low_v{}, high_v{};
    for (std::size_t k = 0; k < to.count; ++k) {
      to.u[k] = middle_u + larger_by * (to.u[k] - middle_u);
      to.v[k] = middle_v + larger_by * (to.v[k] - middle_v);
      low_u = k == 0 ? to.u[k] : smaller(low_u, to.u[k]);
      high_u = k == 0 ? to.u[k] : larger(high_u, to.u[k]);
      low_v = k == 0 ? to.v[k] : smaller(low_v, to.v[k]);
      high_v = k == 0 ? to.v[k] : larger(high_v, to.v[k]);
    }
    // Within q; empty where the point does not see the shadow, or that is beside q.
    LaneBits meets = greater(product(shadow.plane, x, y, z) - shadow.plane[3], zero);
    if constexpr (kTriangle) meets &= greater(high_u, low_v);
    to.low_u = select(meets, larger(low_u, zero - 0.5), one);
    to.high_u = select(meets, smaller(high_u, zero + 0.5), -one);
    to.low_v = select(meets, larger(low_v, zero - 0.5), one);
    to.high_v = select(meets, smaller(high_v, zero + 0.5), -one);
    meets = greater(to.high_u, to.low_u) & greater(to.high_v, to.low_v);
    if (!any(meets)) continue;
    Lanes sum{}, twice_area{};
    for (std::size_t k = 0; k < to.count; ++k) {
      const std::size_t next = k + 1 == to.count ? 0 : k + 1;
      sum += along_edge(kernel, to.u[k], to.v[k], to.u[next], to.v[next]);
      twice_area +=
          (to.u[k] - to.u[0]) * (to.v[next] - to.v[0]) - (to.u[next] - to.u[0]) * (to.v[k] - to.v[0]);
    }
    to.turn = select(greater(twice_area, zero), one, -one);
    const Lanes mine = select(meets, absolute(sum), zero);
    hidden += mine;
    whole |= greater(mine, (1 - 1e-12) * kernel.all);
  }
  for (std::size_t n = 0; n < count; ++n) {
    const Projected* others[kMostOverlaps];
    LaneBits overlaps[kMostOverlaps];
    std::size_t found = 0;
    for (std::size_t m = 0; m < count; ++m) {
      if (shadows[m].group == shadows[n].group) continue;
      const Projected &a = projected[m], &b = projected[n];
      constexpr double kApart = 1e-9;
      const LaneBits near = greater(smaller(a.high_u, b.high_u) - larger(a.low_u, b.low_u), zero + kApart) &
                            greater(smaller(a.high_v, b.high_v) - larger(a.low_v, b.low_v), zero + kApart) &
                            ~whole & ~unsure;
      if (!any(near)) continue;
      if (found == kMostOverlaps) {
        unsure |= near;
        continue;
      }
      others[found] = &projected[m];
      overlaps[found++] = near;
    }
    if (found > 0)
      hidden += projected[n].turn * along_edges_within(kernel, projected[n], others, overlaps, found);
  }
  constexpr double kRounding = 1e-9;
  whole |= ~unsure & greater(hidden, (1 - kRounding) * kernel.all);
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
