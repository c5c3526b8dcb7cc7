// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross products of Vec3
#include <cstdint>

namespace radiosity {

/// Number of a patch, vertex, face or material. 32 bits: F of 2^31 patches would not fit any machine.
using Index = std::int32_t;

using Vec3 = Eigen::Vector3d;

/// One row per patch (or vertex), one column per band. Row-major, so that a pass over F reads all bands of a
/// patch together.
using BandArray = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// One value per band.
using BandValues = Eigen::ArrayXd;

}  // namespace radiosity
