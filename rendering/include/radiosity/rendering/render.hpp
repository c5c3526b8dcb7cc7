// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/camera.hpp"
#include "radiosity/rendering/tone_map.hpp"

namespace radiosity {

/// One colour for each patch, white where there is none. `samples`² rays per pixel; encoded values are averaged.
Image paint(const Visibility& visibility, const std::vector<Rgb8>& patch_colours, const Camera& camera,
            int width, int height, int samples = 3);

/// A camera that has the whole mesh in view, looking in at an open side where there is one; see
/// docs/formats.md.
Camera automatic_camera(const PatchMesh& mesh);

}  // namespace radiosity
