// SPDX-License-Identifier: GPL-3.0-or-later
#include "ray_caster.hpp"

#include <cmath>

#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

RayCaster::RayCaster(const PatchMesh& mesh)
    : visibility_(mesh),
      end_(tolerance::kAtEmitter * mesh.diagonal()),
      sheet_(static_cast<std::size_t>(mesh.patch_count())) {
  for (const Facet& facet : visibility_.facets())
    for (const Index i : facet.patches) sheet_[i] = facet.back != Facet::kNoBack;
  for (const Material& material : mesh.materials()) {
    Finish::Bands index = Finish::Bands::Constant(mesh.bands(), material.refractive_index);
    if (material.refractive_indices.size() > 0) index = material.refractive_indices.transpose();
    finishes_.push_back({material.reflectance.transpose(), specular(material).transpose(),
                         transmission(material).transpose(), material.emission.transpose(),
                         material.shininess, index, (index != index[0]).any(),
                         (transmission(material) > 0).any()});
  }
}

std::optional<SurfaceHit> RayCaster::cast(const Vec3& origin, const Vec3& direction, Index from) const {
  ++rays_.local();
  const Visibility::Hit hit = visibility_.first_hit(origin, direction, from);
  if (hit.patch < 0) return {};
  const PatchMesh& mesh = visibility_.mesh();
  const Vec3& normal = mesh.normal(hit.patch);
  const double cosine = normal.dot(direction), height = normal.dot(mesh.centroid(hit.patch) - origin);
  const bool grazing = std::abs(cosine) < tolerance::kGrazingCosine;
  const double distance = grazing ? hit.distance : height / cosine;
  Vec3 x = origin + distance * direction;
  if (grazing) x -= normal.dot(x - mesh.centroid(hit.patch)) * normal;
  return SurfaceHit{hit.patch, hit.front, distance, x, hit.front ? normal : Vec3(-normal)};
}

void RayCaster::dim(const SurfaceHit& at, const Vec3& direction, double distance, Finish::Bands& light,
                    bool straight_only) const {
  Vec3 x = at.x;
  Index from = at.patch;
  for (int k = 0; k < tolerance::kLongestPath && (light > 0).any(); ++k) {
    const auto met = cast(x, direction, from);
    if (!met || ends(*met, distance)) return;
    if (straight_only && sheet_[met->patch] == 0 && (finish(met->patch).index != 1).any()) break;
    light *= finish(met->patch).transmitted;
    x = met->x;
    from = met->patch;
    distance -= met->distance;
  }
  light.setZero();
}

std::optional<Vec3> RayCaster::through(const SurfaceHit& hit, const Vec3& n, const Vec3& direction,
                                       Index band) const {
  if (sheet_[hit.patch] != 0) return direction;
  const double index = finish(hit.patch).index[band];
  return refracted(direction, n, hit.front ? 1 / index : index);
}

std::optional<Vec3> refracted(const Vec3& d, const Vec3& n, double eta) {
  const double cosine = -d.dot(n);
  const double square = 1 - eta * eta * (1 - cosine * cosine);  // cos²θ₂
  if (square < 0) return {};
  return Vec3(eta * d + (eta * cosine - std::sqrt(square)) * n).normalized();
}

}  // namespace radiosity
