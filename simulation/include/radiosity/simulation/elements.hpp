// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/progress.hpp"
#include "radiosity/simulation/probe.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

struct ElementGather {
  std::optional<double> size = {};  ///< m: no edge of an element is longer, but for those of lamps
  /// Without a size elements are halved where light differs most from one to the next, until what differs within them is this share
  /// of the reflected light (rms), or cannot be told from noise.
  double variation = 0.02;
  Index samples = 128;     ///< rays per element, rounded up to 32 k²
  std::uint64_t seed = 1;  ///< of the random numbers, one stream per element
  Progress progress = {};
  std::shared_ptr<const Ranks> ranks = {};           ///< see ProbeOptions
  std::shared_ptr<const PartialProbe> partial = {};  ///< see ProbeOptions
  std::function<void(Index done, const std::function<PartialProbe()>& state)> save = {};
};

/// Light on pieces of the patches: few patches carry the light that is exchanged, many elements show where it falls.
struct Elements {
  PatchMesh mesh;
  std::vector<Index> patch;  ///< per element: the patch that it is a piece of
  BandArray radiosity;       ///< B = E + ρ H, elements × bands, W/m²
  BandArray irradiance;      ///< H at the centroid
  BandArray vertex_radiosity;
  BandArray
      standard_error;  ///< of B through sampling; what the radiosities of the patches are wrong by is not in it
  double size = 0;     ///< m: as asked for, or else the longest edge of the smallest
  Index samples = 0;      ///< rays per element that were cast
  bool adaptive = false;  ///< no size was asked for

  /// √(Σ A_e σ_e² / Σ A_e (B_e − E_e)²) in the band where that is largest.
  double noise() const;
};

/// Final gather [Reichert1992]: the irradiance at each element's centroid by one more reflection, lamps by exact factors
/// with exact shadows, the rest by rays that meet linearly reconstructed radiosities (see probe). An element of a covered patch
/// receives nothing. With a size, patches are cut alike within a smooth surface, so neighbours fit together; lamps are left whole: they
/// look the same everywhere, and their pieces would be many lamps. Without one, patches are quartered (see Quartering), those that are
/// by themselves once, and then what takes the largest part in
///   Σ A_e D_e² / 12,   D_e² = max_n (B_e − B_n)² − 9 (σ_e² + σ_n²) ≥ 0,
/// n: elements with a vertex in common. (Light that rises evenly by D across an element differs from its mean by D/√12, rms.)
/// Nothing where `progress` asked to stop before there was light on all elements. Throws InputError on a size or variation that is not
/// positive, or gives more corners than can be numbered, and what probe refuses.
std::optional<Elements> gather_elements(const Visibility& visibility, const Solution& solution,
                                        const ElementGather& gather);

/// The patches themselves as elements, with light of their own for the members of clusters: gathered in the same way, and scaled so
/// that its mean over each cluster is that of the solution. Patches that are by themselves keep the solution. gather.samples is about the
/// mean number of rays: large members have more, small ones fewer. gather.size is handed on. Nothing where `progress` asked to stop.
std::optional<Elements> gather_members(const Visibility& visibility, const Solution& solution,
                                       const ElementGather& gather);

}  // namespace radiosity
