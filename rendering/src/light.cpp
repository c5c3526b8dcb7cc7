// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/light.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/facets.hpp"

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
  if (light.kind == LightKind::spot && !(light.exponent >= 0 && std::isfinite(light.exponent)))
    fail(fmt::format("exponent {} is not finite and at least 0", light.exponent));
}

Arriving arriving(const Light& light, const Vec3& x) {
  if (light.kind == LightKind::directional)
    return {-light.direction, std::numeric_limits<double>::infinity(), 1};
  const Vec3 way = light.position - x;
  const double d = way.norm();
  const auto& [c1, c2, c3] = light.attenuation;
  Arriving result{d > 0 ? Vec3(way / d) : Vec3(-light.direction), d, 1 / (c1 + c2 * d + c3 * d * d)};
  if (light.kind == LightKind::spot) {
    const double cosine = -result.to.dot(light.direction);
    // std::pow(cosine, 1) is cosine, and takes longer than all the rest.
    result.share *= cosine > 0 ? light.exponent == 1 ? cosine : std::pow(cosine, light.exponent) : 0;
  }
  return result;
}

std::vector<Light> lights_of_emitters(const PatchMesh& mesh) {
  std::vector<Light> lights;
  const auto facets = carried_or_found_facets(mesh);
  for (const Facet& facet : *facets) {
    Light light{.kind = LightKind::spot, .intensity = BandValues::Zero(mesh.bands()), .surface = true};
    double area = 0, power = 0;
    for (const Index i : facet.patches) {
      const BandValues w = mesh.area(i) * mesh.material_of(i).emission;
      if (!(w.sum() > 0)) continue;
      light.name = mesh.material_of(i).name;
      light.direction = mesh.normal(i);
      light.intensity += w / std::numbers::pi;
      light.position += w.sum() * mesh.centroid(i);
      power += w.sum();
      area += mesh.area(i);
    }
    if (!(power > 0)) continue;
    light.position /= power;
    light.attenuation[0] = area / std::numbers::pi;
    lights.push_back(std::move(light));
  }
  return lights;
}

BandValues ambient_irradiance(const PatchMesh& mesh) {
  const double area = mesh.areas().sum();
  const auto mean = [&](const BandArray& values) {
    return BandValues((values.colwise() * mesh.areas()).colwise().sum().transpose() / area);
  };
  const BandValues reflected = mean(mesh.reflectance()), absorbed = mean(mesh.absorptance());
  return (absorbed > 0).select(mean(mesh.emission()) * reflected / absorbed, 0.0);
}

}  // namespace radiosity
