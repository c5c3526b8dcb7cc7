// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/pinhole.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

Pinhole::Pinhole(const Camera& camera, int width, int height) : position_(camera.position) {
  if (!(camera.vertical_fov_deg > 0 && camera.vertical_fov_deg < 180))
    throw InputError(
        fmt::format("{}: vertical_fov_deg {} is outside (0, 180)", title(camera), camera.vertical_fov_deg));
  forward_ = (camera.target - camera.position).normalized();
  const Vec3 right = forward_.cross(camera.up.normalized());
  // Also false for what is not a number: position equal to target, or up = 0.
  if (!(right.norm() > 1e-9))
    throw InputError(title(camera) +
                     ": position, target and up must span a plane: up is parallel to the line of sight");
  const double half_height = std::tan(camera.vertical_fov_deg * std::numbers::pi / 360);
  up_ = right.normalized().cross(forward_) * half_height;
  right_ = right.normalized() * half_height * width / height;
}

}  // namespace radiosity
