// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Per band a power of two near the largest value, 1 where all are 0. Light is proportional to emission, but squares of it are
/// not: those of 1e160 W/m² exceed what a double holds, and those of 1e-170 vanish. Division by a power of two changes no bits.
inline BandValues light_unit(const BandArray& light) {
  return light.abs().colwise().maxCoeff().transpose().unaryExpr([](double largest) {
    return largest > 0 && std::isfinite(largest) ? std::exp2(std::clamp(std::ilogb(largest), -1000, 1000))
                                                 : 1;
  });
}

}  // namespace radiosity
