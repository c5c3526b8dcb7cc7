// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <numbers>

#include "pair_kernels.hpp"
#include "vectors.hpp"

namespace radiosity {
namespace {

constexpr double kSmallest = std::numeric_limits<double>::min();  // of normal numbers

// Gauss–Legendre rule of 8 points on [−1, 1].
constexpr double kGaussX[kLanes]{-0.9602898564975363, -0.7966664774136267, -0.5255324099163290,
                                 -0.1834346424956498, 0.1834346424956498,  0.5255324099163290,
                                 0.7966664774136267,  0.9602898564975363};
constexpr double kGaussW[kLanes]{0.1012285362903763, 0.2223810344533745, 0.3137066458778873,
                                 0.3626837833783620, 0.3626837833783620, 0.3137066458778873,
                                 0.2223810344533745, 0.1012285362903763};

// Of positive normal numbers, to 2 units in the last place or 3e-16: x = 2^e m with m within [1/√2, √2),
//   ln m = 2 artanh s = 2 (s + s³/3 + s⁵/5 + …),   s = (m − 1) / (m + 1), s² < 0.03.
inline Doubles natural_log(const Doubles& x) {
  constexpr std::int64_t kMantissa = 0x000fffffffffffff, kOne = 0x3ff0000000000000,
                         kHalf = 0x3fe0000000000000;
  constexpr std::int64_t kTwo52 = 0x4330000000000000;
  const auto bits = as<Longs>(x);
  Doubles m = as<Doubles>((bits & kMantissa) | kOne);
  // An integer k below 2^52 is, in the last bits of 2^52, the double 2^52 + k.
  Doubles e = as<Doubles>((bits >> 52) | kTwo52) - (0x1p52 + 1023);
  const Longs large = m > 0x1.6a09e667f3bcdp+0;
  m = select(large, as<Doubles>((bits & kMantissa) | kHalf), m);
  e = select(large, e + 1, e);
  const Doubles s = (m - 1) / (m + 1);
  const Doubles z = s * s;
  Doubles sum = z * (2.0 / 21) + 2.0 / 19;
  sum = sum * z + 2.0 / 17;
  sum = sum * z + 2.0 / 15;
  sum = sum * z + 2.0 / 13;
  sum = sum * z + 2.0 / 11;
  sum = sum * z + 2.0 / 9;
  sum = sum * z + 2.0 / 7;
  sum = sum * z + 2.0 / 5;
  sum = sum * z + 2.0 / 3;
  // ln 2 as the sum of a short number, which e multiplies exactly, and the rest.
  constexpr double kLn2 = 0x1.62e42fefa0000p-1, kLn2Rest = 0x1.cf79abc9e3b3ap-40;
  return e * kLn2 + (2 * s + (s * z * sum + e * kLn2Rest));
}

inline Doubles log_or_0(const Doubles& x) {
  return natural_log(select(x > kSmallest, x, 1));
}

// The angle of (x, y) with y ≥ 0, in [0, π]; 0 where both are 0. To 4e-16: t = min(|x|, y) / max(|x|, y) or, above tan π/8,
// (t − 1) / (t + 1), and the polynomial that equals arctan √z / √z at the Chebyshev points of [0, tan² π/8], to 2e-18.
inline Doubles upper_angle(const Doubles& y, const Doubles& x) {
  constexpr double kTanEighth = 0x1.a827999fcef32p-2, kQuarter = 0x1.921fb54442d18p-1;
  const Doubles width = abs(x);
  const Longs steep = y > width;
  const Doubles low = select(steep, width, y), high = select(steep, y, width);
  const Longs reduced = low > kTanEighth * high;
  const Doubles numerator = select(reduced, low - high, low), sum = select(reduced, low + high, high);
  const Doubles t = numerator / select(sum > 0, sum, 1);
  const Doubles z = t * t;
  Doubles p = z * -0.017805397205419446 + 0.03796525745386593;
  p = p * z - 0.05035102456601552;
  p = p * z + 0.05846878297330872;
  p = p * z - 0.06662951813629191;
  p = p * z + 0.07692045330902225;
  p = p * z - 0.09090896809064027;
  p = p * z + 0.11111110744919658;
  p = p * z - 0.14285714279250245;
  p = p * z + 0.19999999999940893;
  p = p * z - 0.3333333333333312;
  Doubles angle = t + t * z * p;
  angle = select(reduced, angle + kQuarter, angle);
  angle = select(steep, 2 * kQuarter - angle, angle);
  return select(x < 0, 4 * kQuarter - angle, angle);
}

double edge_pair(const double* middle, const double* direction, double h, const double* start,
                 const double* line, double length) {
  const Doubles s = load(kGaussX) * (h / 2);
  Doubles r[3];
  for (std::size_t c = 0; c < 3; ++c) r[c] = middle[c] - start[c] + s * direction[c];
  const Doubles p = r[0] * line[0] + r[1] * line[1] + r[2] * line[2];
  const Doubles w = length - p;
  const Doubles x0 = r[1] * line[2] - r[2] * line[1], x1 = r[2] * line[0] - r[0] * line[2],
                x2 = r[0] * line[1] - r[1] * line[0];
  const Doubles d2 = x0 * x0 + x1 * x1 + x2 * x2;
  const Doubles d = sqrt(d2);
  const Doubles near = p * p + d2, far = w * w + d2;
  const Doubles values = load(kGaussW) * (w * log_or_0(far) / 2 + p * log_or_0(near) / 2 - length +
                                          d * upper_angle(d * length, d2 - p * w));
  return sum_of(values) * h / 2;
}

double parallel_sum(const double* w_of, const double* d_of, const double* sign, std::size_t count) {
  Doubles sum{};
  for (std::size_t k = 0; k < count; k += kLanes) {
    const Doubles w = load(w_of + k), d = load(d_of + k);
    const Doubles width = abs(w);
    const Doubles w2 = w * w, d2 = d * d, q = w2 + d2;
    const Doubles log = log_or_0(q);
    sum += load(sign + k) * ((w2 - d2) * log / 4 - 0.75 * w2 + width * d * upper_angle(width, d));
  }
  return sum_of(sum);
}

double quadrature(const RuleColumns& p, const RuleColumns& q) {
  Doubles sum{};
  for (std::size_t i = 0; i < p.size; ++i) {
    for (std::size_t k = 0; k < q.stride; k += kLanes) {
      Doubles r[3];
      for (std::size_t c = 0; c < 3; ++c)
        r[c] = load(q.columns + c * q.stride + k) - p.columns[c * p.stride + i];
      const Doubles s = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
      const Doubles cosines = (p.normal[0] * r[0] + p.normal[1] * r[1] + p.normal[2] * r[2]) *
                              (q.normal[0] * r[0] + q.normal[1] * r[1] + q.normal[2] * r[2]);
      sum += p.columns[3 * p.stride + i] * load(q.columns + 3 * q.stride + k) * cosines / (s * s);
    }
  }
  return sum_of(sum) / std::numbers::pi;
}

}  // namespace

extern const PairKernels RADIOSITY_KERNEL::pair_kernels{
    RADIOSITY_LEVEL,          mutual_areas,       edge_pair, parallel_sum, quadrature,
    shadows_on_parallelogram, shadows_on_triangle};

}  // namespace radiosity
