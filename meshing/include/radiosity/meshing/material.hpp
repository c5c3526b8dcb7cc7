// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Which sides of a face radiate and reflect. The other side of a `front` face is opaque and black.
enum class Sides { front, both };

/// A diffuse surface finish.
struct Material {
  std::string name;
  BandValues reflectance;  ///< ρ ∈ [0, 1], one per band
  BandValues emission;     ///< E ≥ 0, radiant exitance in W/m² leaving the surface, one per band
  Sides sides = Sides::front;
};

/// Throws InputError, naming material, band, value and rule, unless reflectance and emission have the same,
/// non-zero number of bands, 0 ≤ ρ ≤ 1 and 0 ≤ E < ∞.
void validate(const Material& material);

}  // namespace radiosity
