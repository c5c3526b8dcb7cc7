// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "radiosity/meshing/camera.hpp"

namespace radiosity {

/// Writes a Python script that shows a solution (.vtp, written by its absolute name) in ParaView as docs/paraview.md tells to do
/// by hand. `pvpython FILE.py PICTURE.png` saves the picture. Throws IoError.
void write_paraview_script(const std::filesystem::path& script, const std::filesystem::path& solution,
                           const Camera& camera);

}  // namespace radiosity
