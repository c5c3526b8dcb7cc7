// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/light.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

void validate(const Light& light, Index bands) {
  const auto fail = [&](const std::string& rule) {
    throw InputError(fmt::format("light '{}': {}", light.name, rule));
  };
  if (light.intensity.size() != bands)
    fail(fmt::format("intensity has {} bands, but the scene has {}", light.intensity.size(), bands));
  for (Index b = 0; b < bands; ++b)
    if (!(light.intensity[b] >= 0 && std::isfinite(light.intensity[b])))
      fail(fmt::format("intensity {} in band {} is not finite and at least 0", light.intensity[b], b));
  const auto& [c1, c2, c3] = light.attenuation;
  const double sum = c1 + c2 + c3;
  if (light.kind != LightKind::directional &&
      !(std::min({c1, c2, c3}) >= 0 && sum > 0 && std::isfinite(sum) && light.position.allFinite()))
    fail(fmt::format("attenuation {} {} {} must be finite, not negative and not all 0, at a finite position",
                     c1, c2, c3));
  if (light.kind != LightKind::point && !(std::abs(light.direction.norm() - 1) < 1e-9))
    fail(fmt::format("direction {} {} {} is not of length 1", light.direction.x(), light.direction.y(),
                     light.direction.z()));
  if (light.kind != LightKind::spot) return;
  if (!(light.exponent >= 0 && std::isfinite(light.exponent)))
    fail(fmt::format("exponent {} is not finite and at least 0", light.exponent));
  if (!(light.cos_outer >= 0 && light.cos_inner >= light.cos_outer && light.cos_inner <= 1 &&
        light.cos_outer < 1))
    fail(fmt::format(
        "the cosines of its cone, inner {} and outer {}, are not 0 ≤ outer ≤ inner ≤ 1, outer < 1",
        light.cos_inner, light.cos_outer));
}

double spot_share(const Light& light, double cosine) {
  if (!(cosine > light.cos_outer)) return 0;
  // std::pow(cosine, 1) is cosine, and takes longer than all the rest.
  const double share = light.exponent == 0   ? 1
                       : light.exponent == 1 ? cosine
                                             : std::pow(cosine, light.exponent);
  if (cosine >= light.cos_inner) return share;
  return share * (cosine - light.cos_outer) / (light.cos_inner - light.cos_outer);
}

double solid_angle(const Light& light) {
  using std::numbers::pi;
  if (light.kind == LightKind::directional) return 0;
  if (light.kind == LightKind::point) return 4 * pi;
  // 2π ∫ uᵉ du up to 1, with the ramp of the cone from u_o to u_i.
  const double e = light.exponent, inner = light.cos_inner, outer = light.cos_outer;
  const auto integral = [&](double power) {  // of u^power from the outer to the inner cosine
    return (std::pow(inner, power + 1) - std::pow(outer, power + 1)) / (power + 1);
  };
  double sum = (1 - std::pow(inner, e + 1)) / (e + 1);
  if (inner > outer) sum += (integral(e + 1) - outer * integral(e)) / (inner - outer);
  return 2 * pi * sum;
}

}  // namespace radiosity
