// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "radiosity/meshing/curved_shape.hpp"
#include "radiosity/meshing/light.hpp"
#include "radiosity/meshing/scene.hpp"
#include "radiosity/meshing/scene_settings.hpp"

namespace radiosity {

struct LoadedScene {
  Scene scene;
  SceneSettings settings;
  std::vector<LightingSetup> setups;  ///< by name
  std::filesystem::path mesh_file;    ///< the mesh itself, where SCENE is a scene file that names it
  std::vector<std::string> warnings;  ///< what was odd about the file: a sentence each
  std::vector<Light> lights = {};     ///< by name; pictures show them, radiosity does not
  BandValues wavelengths_nm = {};     ///< of the bands; empty: not given
};

/// What happens to a material that a face names but nothing defines. Where only geometry matters (form factors), it may be
/// allowed: it then absorbs everything and emits nothing.
enum class MissingMaterials { refuse, allow };

/// The chord error of a shape, m, in place of the one that the scene file says.
using ChordError = std::function<double(const CurvedShape&)>;

/// Reads a mesh (.obj .ply .stl .off .gltf .glb .dae .ifc .vtp .vtu …) or a scene file (.toml) that names one
/// and adds what a mesh cannot say; see docs/formats.md. Coordinates end in metres. A mesh without materials
/// gets one material, "default", with reflectance 0.5 and no emission. Throws IoError (missing file, unknown
/// extension, cannot be parsed) or InputError (breaks a rule); the message names file, line where there is
/// one, object, value and rule.
LoadedScene read_scene(const std::filesystem::path& file, MissingMaterials missing = MissingMaterials::refuse,
                       const ChordError& chord_error = {});

/// Throws InputError, saying how to add a lamp, when no material in use emits.
void require_emission(const Scene& scene, const std::filesystem::path& file);

}  // namespace radiosity
