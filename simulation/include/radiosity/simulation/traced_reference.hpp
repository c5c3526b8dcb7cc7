// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "radiosity/formfactors/place.hpp"
#include "radiosity/formfactors/visibility.hpp"

namespace radiosity {

/// Irradiance at places on a mesh, places × bands in W/m²: for each the mean of `paths` random paths, without bias. Given by whoever
/// has a means that shares no form factors with what it is to judge: path_traced of rendering.
using TraceIrradiance =
    std::function<BandArray(const std::shared_ptr<const PatchMesh>& mesh, std::span<const Place> places,
                            Index paths, std::uint64_t seed)>;

/// What a TracedReference says of a radiosity. All are shares of the reflected light, of the band whose rms is largest.
struct TracedError {
  /// √((Σ d_i² − Σ s_i²) / Σ r_i²), 0 where noise explains all of it: d_i = B_i − E_i − r_i on the patches or clusters i that
  /// were traced, r_i the light that they reflect, of standard error s_i. It is that of RelativeError, of the means of patches.
  double rms = 0;
  double standard_error = 0;  ///< of rms, of noise and of having traced some patches only
  double mean = 0;            ///< Σ d_i / Σ r_i
  double mean_standard_error = 0;
};

/// The light that patches reflect, or clusters of them, by tracing: an independent reference for solutions on their mesh. They are
/// taken evenly by area; in each round every one is traced from other random places on it, so that the mean over rounds is that of the patch, and the rounds
/// tell its standard error. What materials mirror or let through is absorbed, as radiosity has it.
class TracedReference {
 public:
  /// Throws InputError unless there are patches to trace, more than 1.
  TracedReference(const Visibility& visibility, TraceIrradiance trace, Index count, std::uint64_t seed = 1);

  void add_round(Index paths);  ///< so many for each patch, four from a place

  Index patches() const { return static_cast<Index>(traced_.size()); }
  Index rounds() const { return rounds_; }
  /// √(Σ s_i² / Σ r_i²), in the band where it is largest.
  double noise() const;
  /// Of a radiosity of each patch, alike in a cluster. Throws InputError where the shape is not that of the mesh, or after fewer than
  /// two rounds. Patches whose radiosity is not a number do not count.
  TracedError error(const BandArray& radiosity) const;

 private:
  BandArray reflected() const;
  BandArray variance() const;  ///< s_i²

  std::shared_ptr<const PatchMesh> mesh_;
  TraceIrradiance trace_;
  std::uint64_t seed_;
  std::vector<Index> traced_;  ///< clusters, of large ones some more than once
  BandArray sum_, squares_;    ///< of the rounds, W/m²
  Index rounds_ = 0;
};

}  // namespace radiosity
