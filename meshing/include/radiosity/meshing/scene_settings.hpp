// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "radiosity/meshing/camera.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace radiosity {

struct NoElements {};  ///< light is told of the patches
struct ElementSize {   ///< light is gathered for pieces of the patches with no edge longer than this
  double metres;
};
struct AutoElements {};  ///< small where light changes, and only there
using ElementOptions = std::variant<NoElements, ElementSize, AutoElements>;

/// What a scene file may set beside the scene itself. Absent: the default of the part concerned.
struct SceneSettings {
  std::optional<PatchOptions> patches = {};
  std::optional<ElementOptions> elements = {};
  std::optional<Index> element_samples = {};
  std::optional<std::string> method = {};
  std::optional<Index> samples = {}, resolution = {};
  std::optional<double> factor_tolerance = {};
  std::optional<std::uint64_t> seed = {};
  std::optional<std::string> solver = {};
  std::optional<double> tolerance = {};
  std::optional<Index> max_iterations = {};
  std::optional<double> relaxation = {};
  std::optional<bool> ambient = {};
  std::optional<Camera> camera = {};
  std::map<std::string, Camera> cameras = {};  ///< others, by name
};

}  // namespace radiosity
