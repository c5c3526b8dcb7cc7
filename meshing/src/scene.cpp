// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/scene.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <unordered_map>

#include "polygon.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "validate_materials.hpp"

namespace radiosity {

void validate(std::span<const Material> materials) {
  if (materials.empty()) throw InputError("there are no materials; every face needs one");
  std::unordered_map<std::string, std::size_t> seen;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& material = materials[m];
    validate(material);
    if (material.reflectance.size() != materials[0].reflectance.size())
      throw InputError(fmt::format("material '{}' has {} bands but material '{}' has {}; all need the same",
                                   material.name, material.reflectance.size(), materials[0].name,
                                   materials[0].reflectance.size()));
    if (!seen.emplace(material.name, m).second)
      throw InputError(fmt::format("materials {} and {} have the same name '{}'; names must differ",
                                   seen[material.name], m, material.name));
  }
}

void Scene::Arrays::add_face(std::span<const Index> face_corners, Index material) {
  corners.insert(corners.end(), face_corners.begin(), face_corners.end());
  face_start.push_back(static_cast<Index>(corners.size()));
  face_material.push_back(material);
}

Scene::Scene(Arrays arrays) : arrays_(std::move(arrays)) {
  constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<Index>::max());
  const auto& [vertices, corners, face_start, face_material, materials, two_sided, symmetry] = arrays_;
  if (face_material.empty()) throw InputError("the mesh has no faces");
  if (corners.size() > kMost || vertices.size() > kMost)
    throw InputError(
        fmt::format("the mesh has {} vertices and {} face corners; at most {} of each are possible",
                    vertices.size(), corners.size(), kMost));
  validate(std::span<const Material>(materials));

  lower_ = Vec3::Constant(std::numeric_limits<double>::infinity());
  upper_ = -lower_;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3& x = vertices[v];
    if (!x.allFinite())
      throw InputError(
          fmt::format("vertex {}: its coordinates ({}, {}, {}) are not finite", v, x.x(), x.y(), x.z()));
  }
  if (face_start.size() != face_material.size() + 1 || face_start.front() != 0 ||
      static_cast<std::size_t>(face_start.back()) != corners.size())
    throw InputError(
        fmt::format("face_start has {} entries from {} to {}; {} faces with {} corners need {} from 0 to {}",
                    face_start.size(), face_start.empty() ? 0 : face_start.front(),
                    face_start.empty() ? 0 : face_start.back(), face_material.size(), corners.size(),
                    face_material.size() + 1, corners.size()));
  if (!two_sided.empty() && two_sided.size() != face_material.size())
    throw InputError(fmt::format("two_sided has {} entries for {} faces; it needs one for each, or none",
                                 two_sided.size(), face_material.size()));
  for (std::size_t f = 0; f < face_material.size(); ++f) {
    const Index first = face_start[f], last = face_start[f + 1];
    if (static_cast<std::size_t>(last) > corners.size())
      throw InputError(
          fmt::format("face {}: face_start ends it at corner {}, of {}", f, last, corners.size()));
    if (last - first < 3)
      throw InputError(fmt::format("face {}: it has {} corners; at least 3 are needed", f, last - first));
    if (face_material[f] < 0 || static_cast<std::size_t>(face_material[f]) >= materials.size())
      throw InputError(fmt::format("face {}: material {} is not one of the {} materials (0 to {})", f,
                                   face_material[f], materials.size(), materials.size() - 1));
    for (Index c = first; c < last; ++c) {
      const Index v = corners[c];
      if (v < 0 || static_cast<std::size_t>(v) >= vertices.size())
        throw InputError(fmt::format("face {}, corner {}: vertex {} is not one of the {} vertices", f,
                                     c - first, v, vertices.size()));
      lower_ = lower_.cwiseMin(vertices[v]);
      upper_ = upper_.cwiseMax(vertices[v]);
    }
  }
  settle(arrays_.symmetry, vertices, corners, face_start, tolerance::kContact * (upper_ - lower_).norm());
}

Index Scene::bands() const {
  return static_cast<Index>(arrays_.materials.front().reflectance.size());
}

std::span<const Index> Scene::corners(Index face) const {
  const Index first = arrays_.face_start[face];
  return std::span(arrays_.corners).subspan(first, arrays_.face_start[face + 1] - first);
}

Vec3 Scene::area_vector(Index face) const {
  return polygon::area_vector(arrays_.vertices, corners(face));
}

double Scene::material_area(Index material) const {
  double area = 0;
  for (Index f = 0; f < face_count(); ++f)
    if (this->material(f) == material) area += (two_sided(f) ? 2 : 1) * area_vector(f).norm();
  return area;
}

Scene Scene::with_materials(std::vector<Material> materials) const {
  if (materials.size() != arrays_.materials.size())
    throw InputError(fmt::format("{} materials were given for a scene that has {}", materials.size(),
                                 arrays_.materials.size()));
  Arrays arrays = arrays_;
  arrays.materials = std::move(materials);
  return Scene(std::move(arrays));
}

Scene Scene::with_two_sided(std::vector<std::uint8_t> two_sided) const {
  Arrays arrays = arrays_;
  arrays.two_sided = std::move(two_sided);
  return Scene(std::move(arrays));
}

bool emits(const Scene& scene) {
  for (Index f = 0; f < scene.face_count(); ++f)
    if ((scene.materials()[scene.material(f)].emission > 0).any()) return true;
  return false;
}

namespace {

// All that a material has for each band; what it does not say is empty.
std::array<BandValues*, 6> values_per_band(Material& material) {
  return {&material.reflectance, &material.emission,     &material.absorptance,
          &material.specular,    &material.transmission, &material.refractive_indices};
}

}  // namespace

Scene with_setups(const Scene& scene, std::span<const LightingSetup> setups) {
  const auto bands = static_cast<Eigen::Index>(scene.bands());
  const auto count = static_cast<Eigen::Index>(setups.size());
  std::vector<Material> materials = scene.materials();
  for (const LightingSetup& setup : setups) {
    if (setup.factors.size() != materials.size())
      throw InputError(fmt::format("set-up '{}': {} factors for {} materials", setup.name,
                                   setup.factors.size(), materials.size()));
    for (const double factor : setup.factors)
      if (!(factor >= 0 && std::isfinite(factor)))
        throw InputError(fmt::format("set-up '{}': factor {} is negative or not finite", setup.name, factor));
  }
  for (std::size_t m = 0; m < materials.size(); ++m) {
    Material& material = materials[m];
    const BandValues emission = material.emission;
    material.emission = emission.replicate(count + 1, 1).eval();
    for (Eigen::Index k = 0; k < count; ++k)
      material.emission.segment((k + 1) * bands, bands) *= setups[k].factors[m];
    for (BandValues* values : values_per_band(material))
      if (values != &material.emission && values->size() > 0)
        *values = values->replicate(count + 1, 1).eval();
  }
  return scene.with_materials(std::move(materials));
}

std::vector<Material> select_bands(std::span<const Material> materials, Index first, Index count) {
  std::vector<Material> selected(materials.begin(), materials.end());
  for (Material& material : selected)
    for (BandValues* values : values_per_band(material))
      if (values->size() > 0) *values = values->segment(first, count).eval();
  return selected;
}

Scene merge_equal_bands(const Scene& scene) {
  if (scene.bands() == 1) return scene;
  std::vector<Material> materials = scene.materials();
  for (Material& material : materials) {
    for (BandValues* values : values_per_band(material)) {
      if (values->size() == 0) continue;
      if ((*values != (*values)[0]).any()) return scene;
      *values = BandValues::Constant(1, (*values)[0]).eval();
    }
  }
  return scene.with_materials(std::move(materials));
}

}  // namespace radiosity
