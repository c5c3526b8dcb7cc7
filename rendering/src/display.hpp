// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "radiosity/rendering/tone_map.hpp"

namespace radiosity {

using Rgb = Eigen::Array3d;

/// Linear → sRGB [IEC61966-2-1].
inline double srgb_encode(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Display value of one row of radiosities, each channel in [0, 1].
template <class Row>
Rgb display(const Row& radiosity, double exposure) {
  const Rgb linear = radiosity.size() == 3 ? Rgb(radiosity[0], radiosity[1], radiosity[2])
                                           : Rgb(Rgb::Constant(radiosity.mean()));
  return (exposure * linear).max(0.0).min(1.0).unaryExpr(&srgb_encode);
}

inline Rgb8 bytes(const Rgb& encoded) {
  Rgb8 result{};
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = static_cast<std::uint8_t>(std::lround(255 * encoded[static_cast<Eigen::Index>(k)]));
  return result;
}

}  // namespace radiosity
