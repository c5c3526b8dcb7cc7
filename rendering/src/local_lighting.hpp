// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "rasteriser.hpp"

namespace radiosity {

/// Local lighting [Phong1975] of a point x of a patch, π L in W/m², of the lights and the ambient irradiance, without a question of who
/// stands in their way: the sum of
///   E + ρ (H_a + Σ H_l max(0, n·l)), the same from everywhere, and
///   Σ H_l k_s max(0, r·v)ˢ over the lights with n·l > 0, the highlights, where the shininess s is finite,
/// with H_l = I f_att s of the light in direction l (see Light), v towards the eye, and r = 2 (n·l) n − l. n is a unit vector, on
/// the side of the front.
using Bands = Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>>;
void light_diffusely(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n, Bands result);
void add_highlights(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n, const Vec3& eye,
                    Bands result);

/// A surface of the material has highlights.
bool has_highlights(const Material& material);

/// Both, of a sample whose values are a normal: an interpolated one, which is made a unit vector again.
void light(const ViewScene& scene, const Fragment& fragment, const Vec3& eye, Bands result);

/// What the air between leaves of a sample: exp(−d / length), d the distance to the eye (depth cueing).
inline double through_air(const Fragment& fragment, const Vec3& eye, double length) {
  return std::exp(-(fragment.x - eye).norm() / length);
}

/// A row for each vertex, as they are interpolated.
BandArray rows(const std::vector<Vec3>& normals);

}  // namespace radiosity
