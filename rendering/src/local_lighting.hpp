// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "rasteriser.hpp"

namespace radiosity {

/// What a point x of a patch shows under local lighting, π L in W/m² [Phong1975]: of the lights and the ambient irradiance, without a
/// question of who stands in their way,
///   E + ρ (H_a + Σ H_l max(0, n·l)),   H_l = I f_att s from direction l (see Light).
/// n is a unit vector, on the side of the front. result: one per band.
void local_lighting(const ViewScene& scene, Index patch, const Vec3& x, const Vec3& n,
                    Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>> result);

/// The same of a sample whose values are a normal: an interpolated one, which is made a unit vector again.
void local_lighting(const ViewScene& scene, const Fragment& fragment,
                    Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>> result);

/// A row for each vertex, as they are interpolated.
BandArray rows(const std::vector<Vec3>& normals);

}  // namespace radiosity
