// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "vector_clones.hpp"

/// Eight numbers at a time, in functions that are RADIOSITY_CLONES. Without fused multiply-add every processor gives the same bits.
namespace radiosity {

inline constexpr std::size_t kLanes = 8;
using Lanes [[gnu::vector_size(kLanes * sizeof(double))]] = double;
using LaneBits [[gnu::vector_size(kLanes * sizeof(double))]] = std::int64_t;

RADIOSITY_INLINE Lanes load(const double* from) {
  Lanes out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
RADIOSITY_INLINE void store(const Lanes& lanes, double* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

/// All bits where a > b. A loop: the compiler takes vector comparisons apart before it knows the processor.
RADIOSITY_INLINE LaneBits greater(const Lanes& a, const Lanes& b) {
  double x[kLanes], y[kLanes];
  std::int64_t mask[kLanes];
  store(a, x);
  store(b, y);
  for (std::size_t k = 0; k < kLanes; ++k) mask[k] = x[k] > y[k] ? -1 : 0;
  LaneBits out;
  std::memcpy(&out, mask, sizeof out);
  return out;
}
RADIOSITY_INLINE Lanes select(const LaneBits& mask, const Lanes& a, const Lanes& b) {
  return std::bit_cast<Lanes>((mask & std::bit_cast<LaneBits>(a)) | (~mask & std::bit_cast<LaneBits>(b)));
}
RADIOSITY_INLINE bool any(const LaneBits& mask) {
  std::int64_t bits = 0;
  for (std::size_t k = 0; k < kLanes; ++k) bits |= mask[k];
  return bits != 0;
}

RADIOSITY_INLINE Lanes absolute(const Lanes& x) {
  constexpr std::int64_t kAllButSign = 0x7fffffffffffffff;
  return std::bit_cast<Lanes>(std::bit_cast<LaneBits>(x) & kAllButSign);
}
RADIOSITY_INLINE Lanes square_root(const Lanes& x) {
  double root[kLanes];
  store(x, root);
  for (double& r : root) r = std::sqrt(r);
  return load(root);
}

/// Of positive normal numbers, to 2 units in the last place or 3e-16: x = 2^e m with m within [1/√2, √2),
///   ln m = 2 artanh s = 2 (s + s³/3 + s⁵/5 + …),   s = (m − 1) / (m + 1), s² < 0.03.
RADIOSITY_INLINE Lanes natural_log(const Lanes& x) {
  constexpr std::int64_t kMantissa = 0x000fffffffffffff, kOne = 0x3ff0000000000000,
                         kHalf = 0x3fe0000000000000;
  constexpr std::int64_t kTwo52 = 0x4330000000000000;
  const auto bits = std::bit_cast<LaneBits>(x);
  Lanes m = std::bit_cast<Lanes>((bits & kMantissa) | kOne);
  // An integer k below 2^52 is, in the last bits of 2^52, the double 2^52 + k.
  Lanes e = std::bit_cast<Lanes>((bits >> 52) | kTwo52) - (0x1p52 + 1023);
  const LaneBits large = greater(m, Lanes{} + 0x1.6a09e667f3bcdp+0);
  m = select(large, std::bit_cast<Lanes>((bits & kMantissa) | kHalf), m);
  e = select(large, e + 1, e);
  const Lanes s = (m - 1) / (m + 1);
  const Lanes z = s * s;
  Lanes sum = z * (2.0 / 21) + 2.0 / 19;
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

/// The angle of (x, y) with y ≥ 0, in [0, π]; 0 where both are 0. To 4e-16: t = min(|x|, y) / max(|x|, y) or, above tan π/8,
/// (t − 1) / (t + 1), and the polynomial that equals arctan √z / √z at the Chebyshev points of [0, tan² π/8], to 2e-18.
RADIOSITY_INLINE Lanes upper_angle(const Lanes& y, const Lanes& x) {
  constexpr double kTanEighth = 0x1.a827999fcef32p-2, kQuarter = 0x1.921fb54442d18p-1;
  const Lanes width = absolute(x);
  const LaneBits steep = greater(y, width);
  const Lanes low = select(steep, width, y), high = select(steep, y, width);
  const LaneBits reduced = greater(low, kTanEighth * high);
  const Lanes numerator = select(reduced, low - high, low), sum = select(reduced, low + high, high);
  const Lanes t = numerator / select(greater(sum, Lanes{}), sum, Lanes{} + 1);
  const Lanes z = t * t;
  Lanes p = z * -0.017805397205419446 + 0.03796525745386593;
  p = p * z - 0.05035102456601552;
  p = p * z + 0.05846878297330872;
  p = p * z - 0.06662951813629191;
  p = p * z + 0.07692045330902225;
  p = p * z - 0.09090896809064027;
  p = p * z + 0.11111110744919658;
  p = p * z - 0.14285714279250245;
  p = p * z + 0.19999999999940893;
  p = p * z - 0.3333333333333312;
  Lanes angle = t + t * z * p;
  angle = select(reduced, angle + kQuarter, angle);
  angle = select(steep, 2 * kQuarter - angle, angle);
  return select(greater(Lanes{}, x), 4 * kQuarter - angle, angle);
}

}  // namespace radiosity
