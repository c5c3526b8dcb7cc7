// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/material.hpp"

#include <fmt/format.h>

#include <cmath>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

BandValues absorptance(const Material& material) {
  return material.absorptance.size() > 0 ? material.absorptance : BandValues(1 - material.reflectance);
}

void validate(const Material& material) {
  const auto bands = material.reflectance.size();
  if (bands != material.emission.size())
    throw InputError(
        fmt::format("material '{}': reflectance has {} bands but emission has {}; they must be the same",
                    material.name, bands, material.emission.size()));
  if (bands == 0)
    throw InputError(
        fmt::format("material '{}': reflectance and emission need at least one band", material.name));
  const bool given = material.absorptance.size() > 0;
  if (given && material.absorptance.size() != bands)
    throw InputError(fmt::format("material '{}': absorptance has {} bands but reflectance has {}",
                                 material.name, material.absorptance.size(), bands));
  for (Eigen::Index b = 0; b < bands; ++b) {
    const double rho = material.reflectance[b], emission = material.emission[b];
    // Written so that NaN fails.
    if (!(rho >= 0 && rho <= 1))
      throw InputError(
          fmt::format("material '{}', band {}: reflectance {} is outside [0, 1]", material.name, b, rho));
    if (given && !(material.absorptance[b] >= 0 && 1 - material.absorptance[b] == rho))
      throw InputError(fmt::format("material '{}', band {}: absorptance {} is not 1 minus the reflectance {}",
                                   material.name, b, material.absorptance[b], rho));
    if (!(emission >= 0 && std::isfinite(emission)))
      throw InputError(fmt::format("material '{}', band {}: emission {} W{} is not finite and at least 0",
                                   material.name, b, emission, material.emits_power ? "" : "/m²"));
  }
}

}  // namespace radiosity
