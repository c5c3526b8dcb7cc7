// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/light.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

Arriving arriving(const Light& light, const Vec3& x) {
  if (light.kind == LightKind::directional)
    return {-light.direction, std::numeric_limits<double>::infinity(), 1};
  const Vec3 way = light.position - x;
  const double d = way.norm();
  const auto& [c1, c2, c3] = light.attenuation;
  Arriving result{d > 0 ? Vec3(way / d) : Vec3(-light.direction), d, 1 / (c1 + c2 * d + c3 * d * d)};
  if (light.kind == LightKind::spot) result.share *= spot_share(light, -result.to.dot(light.direction));
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

BandValues ambient_irradiance(const PatchMesh& mesh, std::span<const Light> lights) {
  const double area = mesh.areas().sum();
  const auto mean = [&](const BandArray& values) {
    return BandValues((values.colwise() * mesh.areas()).colwise().sum().transpose() / area);
  };
  const BandValues reflected = mean(mesh.reflectance()), absorbed = mean(mesh.absorptance());
  BandValues emitted = mean(mesh.emission());
  for (const Light& light : lights)
    if (!light.surface && light.attenuation == std::array<double, 3>{0, 0, 1})
      emitted += solid_angle(light) / area * light.intensity;
  return (absorbed > 0).select(emitted * reflected / absorbed, 0.0);
}

}  // namespace radiosity
