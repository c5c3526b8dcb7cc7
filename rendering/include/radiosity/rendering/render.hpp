// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/camera.hpp"
#include "radiosity/rendering/tone_map.hpp"

namespace radiosity {

struct Image {
  int width = 0, height = 0;
  std::vector<Rgb8> pixels;  ///< sRGB, row by row from the top
};

/// The second pass: visible surface by ray casting, vertex radiosities interpolated over the patch that was
/// hit (bilinear on quads, barycentric on triangles and on the triangles of other polygons), no lighting
/// step. `samples`² rays per pixel are averaged after tone mapping. Backs of patches and the void are black.
Image render(const Visibility& visibility, const BandArray& vertex_radiosity, const Camera& camera, int width,
             int height, double exposure, int samples = 3);

/// The same view with one colour for each patch, white where there is none.
Image paint(const Visibility& visibility, const std::vector<Rgb8>& patch_colours, const Camera& camera,
            int width, int height, int samples = 3);

/// A camera that has the whole mesh in view, looking in at an open side where there is one; see
/// docs/formats.md.
Camera automatic_camera(const PatchMesh& mesh);

}  // namespace radiosity
