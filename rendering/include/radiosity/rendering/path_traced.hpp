// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "radiosity/formfactors/place.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

struct PathTraced {
  BandArray irradiance, standard_error;  ///< places × bands, W/m²
};

/// Irradiance by the rendering equation, an independent reference: no form factors, no linear system. The mean over `paths` random
/// paths of the pipeline "path-tracing", which start here as if from a surface that gives back all light, with the standard error of
/// that mean. The mesh may be as coarse as the geometry allows. One stream of random numbers per place and path. Throws InputError on
/// fewer than two paths.
PathTraced path_traced(std::shared_ptr<const PatchMesh> mesh, std::span<const Place> places, Index paths,
                       std::uint64_t seed = 1);

}  // namespace radiosity
