// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "radiosity/meshing/light.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// What light arrives at x.
struct Arriving {
  Vec3 to;          ///< unit, from x towards the light
  double distance;  ///< m; ∞ of directional lights
  double share;     ///< f_att s: a surface that faces the light receives I · share
};
Arriving arriving(const Light& light, const Vec3& x);

/// Each emitting facet as a spot at the centroid of its power, e = 1 as diffuse emitters have it, I = Σ A E / π and attenuation
/// (A/π, 0, 1): the irradiance E A / (π d² + A), which is exact on the axis of a disk of that area and never above E.
std::vector<Light> lights_of_emitters(const PatchMesh& mesh);

/// What the lights of local pipelines leave out, light reflected more than once, spread evenly over everything: the irradiance
///   H_a = ρ̄ Ē / (1 − ρ̄),   Ē = Σ A E / Σ A,   ρ̄ = Σ A ρ / Σ A
/// per band in W/m², the ambient term of progressive radiosity [Cohen1988] after direct light. 0 where nothing absorbs. The power of lights
/// that are no surfaces and fall with the square of the distance counts as emitted.
BandValues ambient_irradiance(const PatchMesh& mesh, std::span<const Light> lights = {});

}  // namespace radiosity
