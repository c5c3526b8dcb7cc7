// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

enum class LightKind { point, directional, spot };

/// A light without extent, for the local pipelines and the shadow rays of ray tracing. A surface at x that faces it receives
///   H = I f_att(d) s  W/m²,   f_att = 1 / (c1 + c2 d + c3 d²),   d the distance in m
/// where s = 1 of a point, and cosᵉθ of a spot, θ < 90° the angle between its axis and the way to x (0 beyond). A directional light
/// is infinitely far away: H = I. With the attenuation (0, 0, 1), I of points and spots is the radiant intensity in W/sr, along the
/// axis of spots.
struct Light {
  std::string name = {};
  LightKind kind = LightKind::point;
  Vec3 position{0, 0, 0};     ///< m; not of directional lights
  Vec3 direction{0, 0, -1};   ///< unit, the way that the light goes: the axis of a spot; not of points
  BandValues intensity = {};  ///< I ≥ 0, one per band
  std::array<double, 3> attenuation{0, 0, 1};  ///< c1, c2 (1/m), c3 (1/m²); not of directional lights
  double exponent = 1;                         ///< e ≥ 0 of spots
  bool surface = false;  ///< it stands for an emitting surface of the scene, which mirrors show
};

/// Throws InputError naming light, value and rule, unless it has `bands` bands, 0 ≤ I < ∞, a direction of length 1 where it needs one,
/// finite numbers, e ≥ 0, and attenuations that are not negative and not all 0.
void validate(const Light& light, Index bands);

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
/// per band in W/m², the ambient term of progressive radiosity [Cohen1988] after direct light. 0 where nothing absorbs.
BandValues ambient_irradiance(const PatchMesh& mesh);

}  // namespace radiosity
