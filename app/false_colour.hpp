// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "radiosity/meshing/camera.hpp"
#include "radiosity/meshing/patch_mesh.hpp"
#include "stages.hpp"

namespace radiosity::app {

/// `view --false-colour`: an array of a solved file in colours that stand for its values, or the values themselves.
int view_false_colour(Job& job, const std::function<Camera(const PatchMesh&)>& camera_for);

}  // namespace radiosity::app
