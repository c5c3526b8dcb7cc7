// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <string>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Which sides of a face radiate and reflect. The other side of a `front` face is opaque and black; `automatic` is front until
/// decide_sides gives the scene's faces sides of their own.
enum class Sides { front, both, automatic };

/// A surface finish. Radiosity takes its diffuse part, and what else it does with light for absorbed.
struct Material {
  std::string name;
  BandValues reflectance;  ///< ρ ∈ [0, 1], one per band: what is reflected diffusely
  BandValues emission;     ///< E ≥ 0, radiant exitance in W/m² leaving the surface, one per band
  Sides sides = Sides::front;
  /// 1 − ρ where it is given as a number of its own: ρ = 1 − 10⁻¹², as a double, would be off by 10⁻⁴ of it. Empty: the
  /// difference, which is exact.
  BandValues absorptance = {};
  /// `emission` is the power in W per band that all patches of the material emit together. A PatchMesh has it in W/m².
  bool emits_power = false;

  // What pipelines that follow rays add, as shares of the light that arrives: ρ + k_s + k_t ≤ 1 in each band.
  BandValues specular = {};      ///< k_s: reflected about the mirror's direction; empty: none
  BandValues transmission = {};  ///< k_t: refracted through the surface; empty: none
  /// Exponent n of the lobe cosⁿ of the angle to the mirror's direction; ∞: a mirror.
  double shininess = std::numeric_limits<double>::infinity();
  double refractive_index = 1;  ///< of what is behind the front, against what is outside
  /// Of a material that refracts each band by its own index, one per band; empty: refractive_index is that of all.
  BandValues refractive_indices = {};
};

/// 1 − ρ per band.
BandValues absorptance(const Material& material);

/// k_s or k_t per band, zeros where it is empty.
BandValues specular(const Material& material);
BandValues transmission(const Material& material);

/// Throws InputError, naming material, band, value and rule, unless reflectance and emission (and absorptance, where it is
/// given) have the same, non-zero number of bands, 0 ≤ ρ ≤ 1, 0 ≤ E < ∞, ρ is 1 − absorptance as a double, k_s and k_t are empty or have as many
/// bands and are at least 0, ρ + k_s + k_t ≤ 1 but for rounding, the shininess is at least 0 and the refractive indices are positive and one, or one per band.
void validate(const Material& material);

}  // namespace radiosity
