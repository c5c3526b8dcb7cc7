// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>

namespace radiosity {

/// f ≥ 0 in single precision, rounded towards zero: rows never exceed the sums that they stand for, and what they lack goes to a
/// diagonal that is never negative.
inline float rounded_down(double f) {
  const auto nearest = static_cast<float>(f);
  const std::uint32_t above = static_cast<double>(nearest) > f ? 1 : 0;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) - above);
}

}  // namespace radiosity
