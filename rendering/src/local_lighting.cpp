// SPDX-License-Identifier: GPL-3.0-or-later
#include "local_lighting.hpp"

#include <algorithm>
#include <cmath>

namespace radiosity {
namespace {

/// Calls f with each light whose light arrives in front, n·l, and what arrives of it.
template <class F>
void for_each_light(const ViewScene& scene, const Vec3& x, const Vec3& n, const F& f) {
  for (const Light& light : scene.lights) {
    if (light.kind != LightKind::directional && n.dot(light.position - x) <= 0) continue;
    const Arriving from = arriving(light, x);
    const double cosine = n.dot(from.to);
    if (cosine > 0 && from.share > 0) f(light, cosine, from);
  }
}

}  // namespace

void light_diffusely(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n, Bands result) {
  const Material& material = scene.mesh->material_of(patch);
  if (scene.ambient.size() > 0)
    result = scene.ambient.transpose();
  else
    result.setZero();
  for_each_light(scene, x, n, [&](const Light& light, double cosine, const Arriving& from) {
    result += cosine * from.share * light.intensity.transpose();
  });
  result = material.emission.transpose() + material.reflectance.transpose() * result;
}

void add_highlights(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n, const Vec3& eye,
                    Bands result) {
  const Material& material = scene.mesh->material_of(patch);
  if (!has_highlights(material)) return;
  const Vec3 v = (eye - x).normalized();
  for_each_light(scene, x, n, [&](const Light& light, double cosine, const Arriving& from) {
    const double along = std::max(0.0, (2 * cosine * n - from.to).dot(v));
    result +=
        std::pow(along, material.shininess) * from.share * (material.specular * light.intensity).transpose();
  });
}

bool has_highlights(const Material& material) {
  return material.specular.size() > 0 && std::isfinite(material.shininess);
}

void light(const ViewScene& scene, const Fragment& fragment, const Vec3& eye, Bands result) {
  Vec3 n = fragment.values.matrix();
  const double length = n.norm();
  n = length > 0 ? Vec3(n / length) : scene.mesh->normal(fragment.patch);
  light_diffusely(scene, fragment.patch, fragment.x, n, result);
  add_highlights(scene, fragment.patch, fragment.x, n, eye, result);
}

BandArray rows(const std::vector<Vec3>& normals) {
  BandArray result(static_cast<Eigen::Index>(normals.size()), 3);
  for (Eigen::Index k = 0; k < result.rows(); ++k) result.row(k) = normals[k].transpose().array();
  return result;
}

}  // namespace radiosity
