// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/camera.hpp"

namespace radiosity {

/// The image plane of a camera at distance 1: image point (u, v), u from the left and v from the top, both in [0, 1], is seen along
///   forward + (2u − 1) right + (1 − 2v) up
/// forward is a unit vector; right and up are perpendicular to it and to each other, half the image's width and height long.
class Pinhole {
 public:
  /// Throws InputError on an angle outside (0, 180)°, or where position, target and up do not span a plane.
  Pinhole(const Camera& camera, int width, int height);

  const Vec3& position() const { return position_; }
  const Vec3& forward() const { return forward_; }
  const Vec3& right() const { return right_; }
  const Vec3& up() const { return up_; }
  Vec3 direction(double u, double v) const { return forward_ + (2 * u - 1) * right_ + (1 - 2 * v) * up_; }

 private:
  Vec3 position_, forward_, right_, up_;
};

}  // namespace radiosity
