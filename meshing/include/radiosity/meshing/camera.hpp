// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// A pinhole camera. Lengths in metres.
struct Camera {
  Vec3 position{0, 0, 0};
  Vec3 target{0, 0, -1};
  Vec3 up{0, 1, 0};  ///< need not be perpendicular to the line of sight, only not parallel to it
  double vertical_fov_deg = 40;
  std::string name = {};  ///< for messages
};

/// "camera 'door'", "camera" of one without a name.
inline std::string title(const Camera& camera) {
  return camera.name.empty() ? "camera" : "camera '" + camera.name + "'";
}

}  // namespace radiosity
