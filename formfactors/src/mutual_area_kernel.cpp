// SPDX-License-Identifier: GPL-3.0-or-later
#include <numbers>

#include "pair_kernels.hpp"
#include "vectors.hpp"

namespace radiosity {
namespace {

// Σ_k K_k t^k of K(t) along an axis, times s₀², of K = N(t) / s(t)², N = n₀ + n₁ t, s = s₀ (1 + a t + b t²).
inline Doubles second(const Doubles& n0, const Doubles& n1, const Doubles& a, const Doubles& b) {
  return n0 * (3 * a * a - 2 * b) - 2 * n1 * a;
}
inline Doubles fourth(const Doubles& n0, const Doubles& n1, const Doubles& a, const Doubles& b) {
  const Doubles a2 = a * a;
  return n0 * (3 * b * b + a2 * (5 * a2 - 12 * b)) + n1 * a * (6 * b - 4 * a2);
}

// One patch, `p` with kLanes between its columns, and those of a block.
struct Pairs {
  const double* p;
  const double* q;

  double of_p(std::size_t column) const { return p[column * kLanes]; }
  Doubles of_q(std::size_t column) const { return load(q + column * kLanes); }
  // Of vectors at these columns.
  template <class A, class B>
  static Doubles dot(const A& a, const B& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  struct OfP {
    double c[3];
    double operator[](std::size_t k) const { return c[k]; }
  };
  struct OfQ {
    Doubles c[3];
    const Doubles& operator[](std::size_t k) const { return c[k]; }
  };
  OfP vector_of_p(std::size_t column) const { return {{of_p(column), of_p(column + 1), of_p(column + 2)}}; }
  OfQ vector_of_q(std::size_t column) const { return {{of_q(column), of_q(column + 1), of_q(column + 2)}}; }

  // Σ w_a w_b K of points that start at `first`, π left out.
  Doubles product(std::size_t first_p, std::size_t count_p, std::size_t first_q, std::size_t count_q) const {
    const OfP np = vector_of_p(kNormal), cp = vector_of_p(kCentroid);
    const OfQ nq = vector_of_q(kNormal), cq = vector_of_q(kCentroid);
    Doubles sum{};
    for (std::size_t b = first_q; b < first_q + 4 * count_q; b += 4) {
      const OfQ y = vector_of_q(b);
      // The height of a point over the other plane is that of all sight lines that end there.
      const Doubles weight =
          of_q(b + 3) * (np[0] * (y[0] - cp[0]) + np[1] * (y[1] - cp[1]) + np[2] * (y[2] - cp[2]));
      Doubles inner{};
      for (std::size_t a = first_p; a < first_p + 4 * count_p; a += 4) {
        const OfP x = vector_of_p(a);
        const Doubles height = nq[0] * (x[0] - cq[0]) + nq[1] * (x[1] - cq[1]) + nq[2] * (x[2] - cq[2]);
        const Doubles r0 = y[0] - x[0], r1 = y[1] - x[1], r2 = y[2] - x[2];
        const Doubles s = r0 * r0 + r1 * r1 + r2 * r2;
        inner += of_p(a + 3) * height / (s * s);
      }
      sum += weight * inner;
    }
    return sum;
  }

  Doubles mutual_areas(std::size_t points_p, std::size_t points_q) const {
    const OfP np = vector_of_p(kNormal), cp = vector_of_p(kCentroid);
    const OfQ nq = vector_of_q(kNormal), cq = vector_of_q(kCentroid);
    const OfQ r{{cq[0] - cp[0], cq[1] - cp[1], cq[2] - cp[2]}};
    const Doubles s = dot(r, r);
    const auto beyond = [&](std::size_t column) {
      const Doubles reach = of_p(column) + of_q(column);
      return s > reach * reach;
    };
    const Longs far = beyond(kFarReach), middle = beyond(kMiddleReach) & ~far,
                least = beyond(kLeastReach) & ~far & ~middle;
    Doubles area = kNearPair;

    if (any(far | middle)) {
      const Doubles inverse = 1 / s;
      const Doubles a0 = dot(np, r), b0 = -dot(nq, r), n0 = a0 * b0;
      Doubles second_sum = n0, fourth_sum{};
      for (std::size_t k = 0; k < 2; ++k) {
        const OfP u = vector_of_p(kAxisU + 3 * k);
        const OfQ v = vector_of_q(kAxisU + 3 * k);
        const Doubles n_u = a0 * dot(nq, u), a_u = -2 * inverse * dot(u, r),
                      b_u = inverse * of_p(kMomentU + k);
        const Doubles n_v = b0 * dot(np, v), a_v = 2 * inverse * dot(v, r),
                      b_v = inverse * of_q(kMomentU + k);
        second_sum += second(n0, n_u, a_u, b_u) + second(n0, n_v, a_v, b_v);
        fourth_sum += fourth(n0, n_u, a_u, b_u) + fourth(n0, n_v, a_v, b_v);
      }
      const Doubles weight = of_p(kArea) * of_q(kArea) * (inverse * inverse);
      area = select(far, weight * second_sum, area);
      if (any(middle)) {
        const Doubles gauss = product(kColumns, kGaussPoints, kColumns, kGaussPoints);
        // Over an edge t has the fourth moment 9/5 in units of its second one squared; over the two points it is 1.
        area = select(middle, gauss + 0.8 * weight * fourth_sum, area);
      }
    }
    if (any(least)) {
      constexpr std::size_t kFirst = kColumns + 4 * kGaussPoints;
      area = select(least, product(kFirst, points_p, kFirst, points_q), area);
    }
    const Doubles scaled = area * std::numbers::inv_pi;
    return select(far | middle | least, max(scaled, 0), area);
  }
};

}  // namespace

void RADIOSITY_KERNEL::mutual_areas(const double* p, std::size_t points_p, const double* data,
                                    const ColumnBlock* block, const ColumnBlock* end, double* areas) {
  for (; block != end; ++block, areas += kLanes)
    store(areas, Pairs{p, data + block->start}.mutual_areas(points_p, block->points));
}

}  // namespace radiosity
