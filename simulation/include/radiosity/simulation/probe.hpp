// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/progress.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// A place to measure irradiance at: a small surface that faces along `normal`.
struct Sensor {
  Vec3 position;  ///< m
  Vec3 normal;    ///< any length but 0
};

/// The first sensors.
struct PartialProbe {
  BandArray irradiance, standard_error;  ///< done × bands, W/m²
};

struct ProbeOptions {
  Index samples = 1152;                    ///< rays per sensor, rounded up to 32 k²
  std::span<const Index> samples_of = {};  ///< each sensor, in place of `samples`, where it is not empty
  std::uint64_t seed = 1;                  ///< of the random numbers, one stream per sensor
  std::span<const Index> patch =
      {};  ///< of each sensor, the one that it lies on; empty where that is not known, which costs more
  Progress progress = {};
  std::shared_ptr<const Ranks> ranks = {};  ///< share the sensors; null: this process measures at all of them
  /// Of an earlier call of the same that was ended: so many sensors are taken as they are.
  std::shared_ptr<const PartialProbe> partial = {};
  /// Called on the calling thread each time that some hundred sensors more are done, and with the last one; `state` copies them.
  std::function<void(Index done, const std::function<PartialProbe()>& state)> save = {};
};

struct ProbeResult {
  BandArray irradiance;  ///< H, sensors × bands, W/m²
  BandArray
      standard_error;     ///< of H through sampling, the same shape; what B itself is wrong by is not in it
  Index samples = 0;      ///< rays per sensor that were cast
  bool completed = true;  ///< false: `progress` asked to stop, and sensors not reached are 0
};

/// Irradiance from the radiosities of a solved mesh, gathered afresh at each sensor with visibility:
///   H = Σ_{j∈S} F(x→j) (B_j − B̂) + (1/K) Σ_k [B(y_k) − (B_j − B̂ if y_k is on a patch j∈S)]
/// S: the lamps, their factors exact (see PointFactors). K rays, cosine-distributed, two in each stratum of the
/// hemisphere, meet the scene at y_k. What S gives is taken from what rays find there, so nothing counts twice and S takes the
/// variance out of the sum; any B̂ leaves the mean as it is, and with the mean radiosity of the patches outside of S rays find no
/// edge between what is in S and what is not. Inside a patch
///   B(y) = B_j + g_j·(y − c_j),   g_j = 1/A_j ∮ B ν ds,
/// linear with the mean kept (c_j centroid, ν outward normal of the border, B linear between the radiosities of the vertices).
/// The standard error is that of the strata, √(Σ_s (a_s − b_s)²) / K for the two rays of each.
///
/// radiosity is patches × bands, vertex_radiosity vertices × bands. Throws InputError on other shapes, positions that are not
/// finite, normals that are not finite or 0, and samples outside [1, 2^20].
ProbeResult probe(const Visibility& visibility, const BandArray& radiosity, const BandArray& vertex_radiosity,
                  std::span<const Sensor> sensors, const ProbeOptions& options = {});

}  // namespace radiosity
