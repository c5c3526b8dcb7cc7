// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/rendering/light.hpp"

namespace radiosity {

/// What is drawn: planar polygons with materials, and what lights them. The mesh of a bare scene is that of make_patches with KeepFaces:
/// repaired faces. Patches share a vertex only where the surface is smooth, so that values of vertices (normals, radiosities) are
/// interpolated across its edges, and creases stay sharp.
struct ViewScene {
  std::shared_ptr<const PatchMesh> mesh;
  std::optional<BandArray> vertex_radiosity =
      {};                          ///< vertices × bands, W/m²: the solution, where there is one
  std::vector<Light> lights = {};  ///< of local lighting
  BandValues ambient = {};         ///< irradiance H_a per band, W/m², of local lighting; empty: none
};

/// Throws InputError unless there is a mesh, and radiosity, lights and ambient have its vertices and bands.
void validate(const ViewScene& scene);

/// Unit normals of the vertices: the mean of those of the patches round each, weighted by their angles at it [ThurmerWuthrich1998],
/// which does not depend on how the surface is divided. Where patches share no vertex it is the patch's own.
std::vector<Vec3> vertex_normals(const PatchMesh& mesh);

}  // namespace radiosity
