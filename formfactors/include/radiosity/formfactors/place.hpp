// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Where irradiance is measured.
struct Place {
  Vec3 position;  ///< m
  Vec3 normal;    ///< any length but 0
  Index patch;    ///< that it lies on; Visibility::kNothing: none
};

}  // namespace radiosity
