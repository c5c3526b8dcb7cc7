// SPDX-License-Identifier: GPL-3.0-or-later
#include "pair_kernels.hpp"
#include "vectors.hpp"

namespace radiosity {
namespace {

constexpr double kNode = 0.3872983346207417;  // of the Gauss rule on [−½, ½]; the others are 0 and −kNode
constexpr double kOuter = 5.0 / 18, kInner = 8.0 / 18;

// Σ_b row[b] t^b through values at −kNode, 0, kNode.
inline void interpolate(const Doubles& low, const Doubles& middle, const Doubles& high, Doubles* row) {
  row[0] = middle;
  row[1] = (high - low) * (0.5 / kNode);
  row[2] = (low + high - 2 * middle) * (0.5 / (kNode * kNode));
}

// K = Σ_ab k[a][b] u^a v^b as P = Σ_ab p[a][b] u^a v^(b+1); below the square, and above it or the diagonal, ∫ P du = Σ_k side[k] u^(k+1).
template <bool kTriangle>
struct Kernel {
  static constexpr std::size_t kTopTerms = kTriangle ? 6 : 3;
  Doubles p[3][3], bottom[3], top[kTopTerms], all;

  void fit(const Doubles (&k)[3][3]) {  // k[a][b] at u_a, v_b
    Doubles along_v[3][3];
    for (std::size_t a = 0; a < 3; ++a) interpolate(k[a][0], k[a][1], k[a][2], along_v[a]);
    for (std::size_t b = 0; b < 3; ++b) {
      Doubles column[3];
      interpolate(along_v[0][b], along_v[1][b], along_v[2][b], column);
      for (std::size_t a = 0; a < 3; ++a) p[a][b] = column[a] * (1.0 / static_cast<double>(b + 1));
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const double share = 1.0 / static_cast<double>(a + 1);
      const Doubles even = 0.25 * p[a][1], odd = 0.5 * p[a][0] + 0.125 * p[a][2];
      bottom[a] = share * (even - odd);
      if constexpr (!kTriangle) top[a] = share * (even + odd);
    }
    if constexpr (kTriangle) {
      top[0] = 0;
      top[1] = p[0][0] * (1.0 / 2);
      top[2] = (p[0][1] + p[1][0]) * (1.0 / 3);
      top[3] = (p[0][2] + p[1][1] + p[2][0]) * (1.0 / 4);
      top[4] = (p[1][2] + p[2][1]) * (1.0 / 5);
      top[5] = p[2][2] * (1.0 / 6);
    }
    const Doubles right = 0.5, left = -0.5;
    all = above(right) - above(left) - (below(right) - below(left));
  }
  Doubles at(const Doubles& u, const Doubles& v) const {
    const Doubles s0 = p[0][0] + v * (p[0][1] + v * p[0][2]);
    const Doubles s1 = p[1][0] + v * (p[1][1] + v * p[1][2]);
    const Doubles s2 = p[2][0] + v * (p[2][1] + v * p[2][2]);
    return v * (s0 + u * (s1 + u * s2));
  }
  Doubles below(const Doubles& u) const { return u * (bottom[0] + u * (bottom[1] + u * bottom[2])); }
  Doubles above(const Doubles& u) const {
    Doubles sum = top[kTopTerms - 1];
    for (std::size_t k = kTopTerms - 1; k-- > 0;) sum = top[k] + u * sum;
    return u * sum;
  }
};

constexpr double kTiny = 1e-90;
inline Doubles not_zero(const Doubles& x) {
  return select(abs(x) > kTiny, x, kTiny);
}

// ∫ P du along the edge from (u0, v0) to (u1, v1), both held to q.
template <bool kTriangle>
inline Doubles along_edge(const Kernel<kTriangle>& kernel, const Doubles& u0, const Doubles& v0,
                          const Doubles& u1, const Doubles& v1) {
  // Where the edge is within the strip |u| ≤ ½.
  if (!any((max(u0, u1) > -0.5) & (0.5 > min(u0, u1)))) return 0;
  const Doubles du = u1 - u0, dv = v1 - v0;
  const auto u_at = [&](const Doubles& t) { return u0 + t * du; };
  const Doubles low_slope = not_zero(dv), high_slope = kTriangle ? not_zero(du - dv) : -low_slope;
  const Doubles u_slope = not_zero(du);
  // Of all three slopes by one division.
  const Doubles per_low_high = 1 / (u_slope * (kTriangle ? low_slope * high_slope : low_slope));
  const Doubles per_u = per_low_high * (kTriangle ? low_slope * high_slope : low_slope);
  const Doubles per_low = per_low_high * (kTriangle ? u_slope * high_slope : u_slope);
  const Doubles per_high = kTriangle ? per_low_high * (u_slope * low_slope) : -per_low;
  const Doubles ua = (-0.5 - u0) * per_u, ub = (0.5 - u0) * per_u;
  const Doubles begin = min(max(min(ua, ub), 0), 1);
  const Doubles end = max(min(max(ua, ub), 1), begin);
  // And there neither below q nor above it: both heights over its sides are linear along the edge.
  const Doubles low = v0 + 0.5, high = kTriangle ? u0 - v0 : 0.5 - v0;
  const Doubles cross_low = -low * per_low, cross_high = -high * per_high;
  const Longs low_rises = low_slope > 0, high_rises = high_slope > 0;
  const Doubles from = max(select(low_rises, cross_low, begin), select(high_rises, cross_high, begin));
  const Doubles to = min(select(low_rises, end, cross_low), select(high_rises, end, cross_high));
  const Doubles enter = min(max(from, begin), end);
  const Doubles leave = max(min(to, end), enter);
  Doubles sum{};
  if (any(leave > enter)) {
    const Doubles middle = (enter + leave) * 0.5, half = (leave - enter) * 0.5;
    const Doubles offset = half * (2 * kNode);
    Doubles inside = 2 * kInner * kernel.at(u_at(middle), v0 + middle * dv);
    inside += 2 * kOuter * kernel.at(u_at(middle - offset), v0 + (middle - offset) * dv);
    inside += 2 * kOuter * kernel.at(u_at(middle + offset), v0 + (middle + offset) * dv);
    sum = inside * half * du;
  }
  const auto held = [&](const Doubles& t, const Doubles& t0,
                        const Doubles& t1) {  // of all of [t0, t1], t one of its ends
    if (!any(t1 > t0)) return;
    const Longs is_above = low + t * dv > high + t * (kTriangle ? du - dv : -dv);
    const Doubles ua0 = u_at(t0), ua1 = u_at(t1);
    sum += select(is_above, kernel.above(ua1) - kernel.above(ua0), kernel.below(ua1) - kernel.below(ua0));
  };
  held(begin, begin, enter);
  held(end, leave, end);
  return sum;
}

// A shadow in the plane of q: its corners, and where it is seen at all the box of what is within q's. `turn` is 1 where it is
// counter-clockwise, −1 elsewhere.
struct Projected {
  Doubles *u, *v;
  std::size_t count;
  Doubles turn, low_u, high_u, low_v, high_v;

  // Where the edge from (u0, v0) along (du, dv) is in it.
  void cut(const Doubles& u0, const Doubles& v0, const Doubles& du, const Doubles& dv, Doubles& enter,
           Doubles& leave) const {
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = k + 1 == count ? 0 : k + 1;
      const Doubles fu = turn * (u[next] - u[k]), fv = turn * (v[next] - v[k]);
      const Doubles slope = not_zero(fu * dv - fv * du);
      const Doubles cross = (fv * (u0 - u[k]) - fu * (v0 - v[k])) / slope;
      const Longs rises = slope > 0;
      enter = select(rises, max(enter, cross), enter);
      leave = select(rises, leave, min(leave, cross));
    }
  }
};

// ∫ P du along what of the edges of a shadow lies in any of some others, where these may overlap it.
constexpr std::size_t kMostOverlaps = 4;
template <bool kTriangle>
inline Doubles along_edges_within(const Kernel<kTriangle>& kernel, const Projected& a,
                                  const Projected* const* others, const Longs* overlaps, std::size_t count) {
  Doubles sum{};
  for (std::size_t k = 0; k < a.count; ++k) {
    const std::size_t next = k + 1 == a.count ? 0 : k + 1;
    const Doubles u0 = a.u[k], v0 = a.v[k], du = a.u[next] - u0, dv = a.v[next] - v0;
    // What lies in each, in two, …: a set for each number in binary, which counts with the sign of its size.
    Doubles enter[1 << kMostOverlaps], leave[1 << kMostOverlaps];
    enter[0] = 0;
    leave[0] = 1;
    for (std::size_t set = 1; set < std::size_t{1} << count; ++set) {
      const std::size_t rest = set & (set - 1);
      const auto newest = static_cast<std::size_t>(__builtin_ctzll(set));
      enter[set] = enter[rest];
      leave[set] = leave[rest];
      if (!any(leave[rest] > enter[rest])) continue;
      const std::size_t single = std::size_t{1} << newest;
      if (set == single) {
        others[newest]->cut(u0, v0, du, dv, enter[set], leave[set]);
        leave[set] = select(overlaps[newest], leave[set], 0);
      } else {
        enter[set] = max(enter[rest], enter[single]);
        leave[set] = min(leave[rest], leave[single]);
      }
      enter[set] = min(enter[set], 1);
      leave[set] = max(leave[set], enter[set]);
      if (!any(leave[set] > enter[set])) continue;
      const Doubles along = along_edge(kernel, u0 + enter[set] * du, v0 + enter[set] * dv,
                                       u0 + leave[set] * du, v0 + leave[set] * dv);
      sum += __builtin_popcountll(set) % 2 == 1 ? along : -along;
    }
  }
  return sum;
}

inline Doubles product(const double* a, const Doubles& x, const Doubles& y, const Doubles& z) {
  return a[0] * x + a[1] * y + a[2] * z;
}

struct Range {
  double low, high;
};
inline Range range_of(const double* values, std::size_t count) {
  Range range{values[0], values[0]};
  for (std::size_t k = 1; k < count; ++k) {
    range.low = values[k] < range.low ? values[k] : range.low;
    range.high = values[k] > range.high ? values[k] : range.high;
  }
  return range;
}

constexpr double kBelow = 1 - 1e-4;

// Of eight points.
template <bool kTriangle>
inline void add_sums(const double* const* points, const double* normal, const ShadowFrame& q,
                     const ShadowCorners* shadows, std::size_t count, double* const* answers) {
  const Doubles x = load(points[0]) - q.origin[0], y = load(points[1]) - q.origin[1],
                z = load(points[2]) - q.origin[2];
  const Doubles h = product(q.normal, x, y, z), u = product(q.dual_u, x, y, z),
                v = product(q.dual_v, x, y, z);
  constexpr double kNodes[3] = {-kNode, 0, kNode};
  Doubles values[3][3];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) {
      const Doubles r0 = kNodes[a] * q.u[0] + kNodes[b] * q.v[0] - x,
                    r1 = kNodes[a] * q.u[1] + kNodes[b] * q.v[1] - y,
                    r2 = kNodes[a] * q.u[2] + kNodes[b] * q.v[2] - z;
      const Doubles s = r0 * r0 + r1 * r1 + r2 * r2;
      values[a][b] = h * product(normal, r0, r1, r2) / (s * s);
    }
  Kernel<kTriangle> kernel;
  kernel.fit(values);
  Doubles hidden{};
  Longs whole{}, unsure{};
  Doubles corner_u[2 * kMostShadowCorners], corner_v[2 * kMostShadowCorners];
  Projected projected[kMostShadows];
  std::size_t corners = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const ShadowCorners& shadow = shadows[n];
    Projected& to = projected[n];
    to.u = corner_u + corners;
    to.v = corner_v + corners;
    to.count = 0;
    // Where the line from the point through (a, b) at a height over q meets the plane of q.
    const auto add = [&](const Doubles& a, const Doubles& b, const Doubles& height) {
      const Doubles per_h = 1 / max(h - height, kTiny);
      to.u[to.count] = (h * a - u * height) * per_h;
      to.v[to.count++] = (h * b - v * height) * per_h;
    };
    // What is nearly as high as the point, or higher, casts no shadow.
    const Doubles limit = kBelow * h;
    Longs too_high{};
    for (std::size_t k = 0; k < shadow.count; ++k) too_high |= shadow.h[k] > limit;
    if (!any(too_high)) {
      for (std::size_t k = 0; k < shadow.count; ++k) add(shadow.u[k], shadow.v[k], shadow.h[k]);
    } else {
      // Every corner and where the edge behind it passes the limit, each in its place or in that of the one before it.
      Doubles last_u = 0, last_v = 0, last_h = 0;
      const auto cut = [&](std::size_t k) {
        const std::size_t next = k + 1 == shadow.count ? 0 : k + 1;
        const double from = shadow.h[k], to_h = shadow.h[next];
        const Longs crosses = (from > limit) ^ (to_h > limit);
        const Doubles t = select(crosses, limit - from, 0) / (from == to_h ? 1 : to_h - from);
        last_u = select(crosses, shadow.u[k] + t * (shadow.u[next] - shadow.u[k]), last_u);
        last_v = select(crosses, shadow.v[k] + t * (shadow.v[next] - shadow.v[k]), last_v);
        last_h = select(crosses, limit, last_h);
        return any(crosses);
      };
      // What is then lost between the limit and the point has its shadow at ten thousand times its distance: outside of q, unless it is
      // right beside the point.
      const Range of_u = range_of(shadow.u, shadow.count), of_v = range_of(shadow.v, shadow.count);
      const Doubles beside_u = (1 - kBelow) * (abs(u) + 1), beside_v = (1 - kBelow) * (abs(v) + 1);
      unsure |= too_high & (h > range_of(shadow.h, shadow.count).low) & (of_u.high + beside_u > u) &
                (u > of_u.low - beside_u) & (of_v.high + beside_v > v) & (v > of_v.low - beside_v);
      for (std::size_t k = 0; k < shadow.count; ++k) cut(k);
      for (std::size_t k = 0; k < shadow.count; ++k) {
        const Longs below = ~(shadow.h[k] > limit);
        last_u = select(below, shadow.u[k], last_u);
        last_v = select(below, shadow.v[k], last_v);
        last_h = select(below, shadow.h[k], last_h);
        if (any(below)) add(last_u, last_v, last_h);
        if (cut(k)) add(last_u, last_v, last_h);
      }
    }
    corners += to.count;
    // Shadows differ in size by a little, so that of edges that two share one is within the other shadow or neither.
    const double larger_by = 1 + 1e-11 * static_cast<double>(n);
    Doubles middle_u{}, middle_v{};
    for (std::size_t k = 0; k < to.count; ++k) {
      middle_u += to.u[k] * (1 / static_cast<double>(to.count));
      middle_v += to.v[k] * (1 / static_cast<double>(to.count));
    }
    Doubles low_u{}, high_u{}, low_v{}, high_v{};
    for (std::size_t k = 0; k < to.count; ++k) {
      to.u[k] = middle_u + larger_by * (to.u[k] - middle_u);
      to.v[k] = middle_v + larger_by * (to.v[k] - middle_v);
      low_u = k == 0 ? to.u[k] : min(low_u, to.u[k]);
      high_u = k == 0 ? to.u[k] : max(high_u, to.u[k]);
      low_v = k == 0 ? to.v[k] : min(low_v, to.v[k]);
      high_v = k == 0 ? to.v[k] : max(high_v, to.v[k]);
    }
    // Within q; empty where the point does not see the shadow, or that is beside q.
    Longs meets = product(shadow.plane, x, y, z) - shadow.plane[3] > 0;
    if constexpr (kTriangle) meets &= high_u > low_v;
    to.low_u = select(meets, max(low_u, -0.5), 1);
    to.high_u = select(meets, min(high_u, 0.5), -1);
    to.low_v = select(meets, max(low_v, -0.5), 1);
    to.high_v = select(meets, min(high_v, 0.5), -1);
    meets = (to.high_u > to.low_u) & (to.high_v > to.low_v);
    if (!any(meets)) continue;
    Doubles sum{}, twice_area{};
    for (std::size_t k = 0; k < to.count; ++k) {
      const std::size_t next = k + 1 == to.count ? 0 : k + 1;
      sum += along_edge(kernel, to.u[k], to.v[k], to.u[next], to.v[next]);
      twice_area +=
          (to.u[k] - to.u[0]) * (to.v[next] - to.v[0]) - (to.u[next] - to.u[0]) * (to.v[k] - to.v[0]);
    }
    to.turn = select(twice_area > 0, Doubles(1), -1);
    const Doubles mine = select(meets, abs(sum), 0);
    hidden += mine;
    whole |= mine > (1 - 1e-12) * kernel.all;
  }
  for (std::size_t n = 0; n < count; ++n) {
    const Projected* others[kMostOverlaps];
    Longs overlaps[kMostOverlaps];
    std::size_t found = 0;
    for (std::size_t m = 0; m < count; ++m) {
      if (shadows[m].group == shadows[n].group) continue;
      const Projected &a = projected[m], &b = projected[n];
      constexpr double kApart = 1e-9;
      const Longs near = (min(a.high_u, b.high_u) - max(a.low_u, b.low_u) > kApart) &
                         (min(a.high_v, b.high_v) - max(a.low_v, b.low_v) > kApart) & ~whole & ~unsure;
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
  whole |= ~unsure & (hidden > (1 - kRounding) * kernel.all);
  const Doubles seen = select(whole, 0, kernel.all - min(hidden, kernel.all));
  store(answers[0], load(answers[0]) + q.area * kernel.all);
  store(answers[1], load(answers[1]) + q.area * seen);
  store(answers[2], load(answers[2]) + select(unsure & ~whole, Doubles(1), 0));
}

}  // namespace

void RADIOSITY_KERNEL::shadows_on_parallelogram(const double* const* points, const double* normal,
                                                const ShadowFrame& q, const ShadowCorners* shadows,
                                                std::size_t count, double* const* answers) {
  add_sums<false>(points, normal, q, shadows, count, answers);
}
void RADIOSITY_KERNEL::shadows_on_triangle(const double* const* points, const double* normal,
                                           const ShadowFrame& q, const ShadowCorners* shadows,
                                           std::size_t count, double* const* answers) {
  add_sums<true>(points, normal, q, shadows, count, answers);
}

}  // namespace radiosity
