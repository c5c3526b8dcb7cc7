// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/material.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

BandValues absorptance(const Material& material) {
  return material.absorptance.size() > 0 ? material.absorptance : BandValues(1 - material.reflectance);
}

namespace {

BandValues or_zeros(const BandValues& values, const Material& material) {
  return values.size() > 0 ? values : BandValues(BandValues::Zero(material.reflectance.size()));
}

}  // namespace

BandValues specular(const Material& material) {
  return or_zeros(material.specular, material);
}

BandValues transmission(const Material& material) {
  return or_zeros(material.transmission, material);
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
  for (const auto& [word, values] :
       {std::pair{"specular", &material.specular}, std::pair{"transmission", &material.transmission}}) {
    if (values->size() > 0 && values->size() != bands)
      throw InputError(fmt::format("material '{}': {} has {} bands but reflectance has {}", material.name,
                                   word, values->size(), bands));
    for (Eigen::Index b = 0; b < values->size(); ++b)
      if (!((*values)[b] >= 0 && (*values)[b] <= 1))
        throw InputError(fmt::format("material '{}', band {}: {} {} is outside [0, 1]", material.name, b,
                                     word, (*values)[b]));
  }
  const BandValues ks = specular(material), kt = transmission(material);
  for (Eigen::Index b = 0; b < bands; ++b)
    if (const double sum = material.reflectance[b] + ks[b] + kt[b]; sum > 1 + tolerance::kShares)
      throw InputError(fmt::format(
          "material '{}', band {}: reflectance {} + specular {} + transmission {} is {}, above 1: no surface "
          "gives back more light than arrives",
          material.name, b, material.reflectance[b], ks[b], kt[b], sum));
  if (!(material.shininess >= 0))
    throw InputError(
        fmt::format("material '{}': shininess {} is not at least 0", material.name, material.shininess));
  const BandValues& indices = material.refractive_indices;
  if (indices.size() > 0 && indices.size() != bands)
    throw InputError(fmt::format("material '{}': {} refractive indices, but reflectance has {} bands",
                                 material.name, indices.size(), bands));
  for (Eigen::Index b = -1; b < indices.size(); ++b)
    if (const double index = b < 0 ? material.refractive_index : indices[b];
        !(index > 0 && std::isfinite(index)))
      throw InputError(fmt::format("material '{}'{}: refractive index {} is not positive and finite",
                                   material.name, b < 0 ? "" : fmt::format(", band {}", b), index));
}

}  // namespace radiosity
