// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/view_scene.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

void validate(const ViewScene& scene) {
  if (!scene.mesh) throw InputError("there is no mesh to draw");
  if (!scene.mesh->symmetry().none())
    throw InputError(
        "the mesh is one cell of a symmetric scene: pictures show the whole, PatchMesh::unfolded");
  const PatchMesh& mesh = *scene.mesh;
  if (scene.vertex_radiosity && (scene.vertex_radiosity->rows() != mesh.vertex_count() ||
                                 scene.vertex_radiosity->cols() != mesh.bands()))
    throw InputError(fmt::format("vertex radiosity is {} x {}, but the mesh has {} vertices and {} bands",
                                 scene.vertex_radiosity->rows(), scene.vertex_radiosity->cols(),
                                 mesh.vertex_count(), mesh.bands()));
  for (const Light& light : scene.lights) validate(light, mesh.bands());
  if (scene.ambient.size() > 0 && scene.ambient.size() != mesh.bands())
    throw InputError(fmt::format("ambient irradiance has {} bands, but the mesh has {}", scene.ambient.size(),
                                 mesh.bands()));
}

std::vector<Vec3> vertex_normals(const PatchMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices().size(), Vec3::Zero());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const auto corners = mesh.corners(i);
    for (std::size_t k = 0, n = corners.size(); k < n; ++k) {
      const Vec3 a = mesh.vertex(corners[(k + 1) % n]) - mesh.vertex(corners[k]);
      const Vec3 b = mesh.vertex(corners[(k + n - 1) % n]) - mesh.vertex(corners[k]);
      // From 0 to 2π: above π where the corner is reflex.
      double angle = std::atan2(mesh.normal(i).dot(a.cross(b)), a.dot(b));
      if (angle < 0) angle += 2 * std::numbers::pi;
      normals[corners[k]] += angle * mesh.normal(i);
    }
  }
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    Vec3& n = normals[v];
    // The patches of a spike may cancel; a keyhole's bridge ends at an angle of 0.
    if (n.norm() > 0)
      n.normalize();
    else if (!mesh.vertex_patches(v).empty())
      n = mesh.normal(mesh.vertex_patches(v)[0]);
  }
  return normals;
}

}  // namespace radiosity
