// SPDX-License-Identifier: GPL-3.0-or-later
#include "local_lighting.hpp"

namespace radiosity {

void local_lighting(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n,
                    Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>> result) {
  const Material& material = scene.mesh->material_of(patch);
  if (scene.ambient.size() > 0)
    result = scene.ambient.transpose();
  else
    result.setZero();
  for (const Light& light : scene.lights) {
    if (light.kind != LightKind::directional && n.dot(light.position - x) <= 0) continue;
    const Arriving from = arriving(light, x);
    const double cosine = n.dot(from.to);
    if (cosine > 0 && from.share > 0) result += cosine * from.share * light.intensity.transpose();
  }
  result = material.emission.transpose() + material.reflectance.transpose() * result;
}

void local_lighting(const ViewScene& scene, const Fragment& fragment,
                    Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>> result) {
  const Vec3 n = fragment.values.matrix();
  const double length = n.norm();
  local_lighting(scene, fragment.patch, fragment.x,
                 length > 0 ? Vec3(n / length) : scene.mesh->normal(fragment.patch), result);
}

BandArray rows(const std::vector<Vec3>& normals) {
  BandArray result(static_cast<Eigen::Index>(normals.size()), 3);
  for (Eigen::Index k = 0; k < result.rows(); ++k) result.row(k) = normals[k].transpose().array();
  return result;
}

}  // namespace radiosity
