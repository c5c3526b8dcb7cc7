// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

enum class LightKind { point, directional, spot };

/// A light without extent, for the pipelines that make pictures; radiosity has light of surfaces alone. A surface at x that faces it
/// receives
///   H = I f_att(d) s  W/m²,   f_att = 1 / (c1 + c2 d + c3 d²),   d the distance in m
/// where s = 1 of a point, and of a spot, θ the angle between its axis and the way to x,
///   s = cosᵉθ · min(1, (cosθ − cosθ_o) / (cosθ_i − cosθ_o)),   0 where θ ≥ θ_o
/// for its inner and outer half-angle, θ_i ≤ θ_o ≤ 90°. A directional light is infinitely far away: H = I. With the attenuation
/// (0, 0, 1), I of points and spots is the radiant intensity in W/sr, along the axis of spots.
struct Light {
  std::string name = {};
  LightKind kind = LightKind::point;
  Vec3 position{0, 0, 0};     ///< m; not of directional lights
  Vec3 direction{0, 0, -1};   ///< unit, the way that the light goes: the axis of a spot; not of points
  BandValues intensity = {};  ///< I ≥ 0, one per band
  std::array<double, 3> attenuation{0, 0, 1};  ///< c1, c2 (1/m), c3 (1/m²); not of directional lights
  double exponent = 1;                         ///< e ≥ 0 of spots
  double cos_inner = 0, cos_outer = 0;         ///< 0 ≤ cosθ_o ≤ cosθ_i ≤ 1 of spots
  bool surface = false;  ///< it stands for an emitting surface of the scene, which mirrors show
};

/// s of a spot in a direction with that cosine to its axis.
double spot_share(const Light& light, double cosine);

/// ∫ s dω over all directions, sr: a light with attenuation (0, 0, 1) has the power I times it. 4π of a point, in closed form of a spot;
/// 0 of a directional light, which has no power.
double solid_angle(const Light& light);

/// Throws InputError naming light, value and rule, unless it has `bands` bands, 0 ≤ I < ∞, a direction of length 1 where it needs one,
/// finite numbers, e ≥ 0, angles in order, and attenuations that are not negative and not all 0.
void validate(const Light& light, Index bands);

}  // namespace radiosity
