// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/simulation/probe.hpp"

/// An independent reference for irradiance: no patches, no form factors, no linear system.
namespace radiosity::test {

struct PathTraced {
  BandValues irradiance, standard_error;  ///< W/m², one per band
};

/// Irradiance at a sensor, the mean over `paths` independent random paths with the standard error of that mean. At each point y
/// of a path, the sensor first, light of the lamps is taken from a point z, uniform on all that emits, of area A:
///   A V E(z) cosθ cosθ' / (π |y − z|²)
/// and the rest from the point where a cosine-distributed ray ends: ρ times the irradiance there, found in the same way, with
/// Russian roulette of probability max ρ. What lamps emit towards such rays was counted already.
/// `patch` is the one that the sensor lies on (kNothing: none). The mesh may be as coarse as the geometry allows.
PathTraced path_traced(const Visibility& visibility, const Sensor& sensor, Index patch, Index paths,
                       std::uint64_t seed);

}  // namespace radiosity::test
