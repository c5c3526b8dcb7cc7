// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "radiosity/io/read_scene.hpp"

namespace radiosity {

/// A scene for another process of the same program, on a machine of the same kind: geometry, materials, set-ups, and the settings that
/// a solve takes. Cameras, lights, warnings and the name of the mesh are left out.
std::string scene_bytes(const LoadedScene& loaded);
/// Throws InputError on bytes that are no scene.
LoadedScene scene_of_bytes(const std::string& bytes);

}  // namespace radiosity
