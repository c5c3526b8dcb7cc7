// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Which sides of a face radiate and reflect. The other side of a `front` face is opaque and black; `automatic` is front until
/// decide_sides gives the scene's faces sides of their own.
enum class Sides { front, both, automatic };

/// A diffuse surface finish.
struct Material {
  std::string name;
  BandValues reflectance;  ///< ρ ∈ [0, 1], one per band
  BandValues emission;     ///< E ≥ 0, radiant exitance in W/m² leaving the surface, one per band
  Sides sides = Sides::front;
  /// 1 − ρ where it is given as a number of its own: ρ = 1 − 10⁻¹², as a double, would be off by 10⁻⁴ of it. Empty: the
  /// difference, which is exact.
  BandValues absorptance = {};
  /// `emission` is the power in W per band that all patches of the material emit together. A PatchMesh has it in W/m².
  bool emits_power = false;
};

/// 1 − ρ per band.
BandValues absorptance(const Material& material);

/// Throws InputError, naming material, band, value and rule, unless reflectance and emission (and absorptance, where it is
/// given) have the same, non-zero number of bands, 0 ≤ ρ ≤ 1, 0 ≤ E < ∞, and ρ is 1 − absorptance as a double.
void validate(const Material& material);

}  // namespace radiosity
