// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

// Errors e relative to the reflected radiosity r = B − E, both n × bands. Patches whose e is not a number do not count.

/// Σ A_i e_i² / Σ A_i r_i² per band; 0 where nothing is reflected.
Eigen::ArrayXd mean_square(const Eigen::ArrayXd& areas, const BandArray& error, const BandArray& reflected);
/// Its root in the band where it is largest.
double relative_rms(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected);
/// Largest |e_i| / r_i, of the patches that reflect 1 % of the mean r or more.
double largest_share(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected);

/// Per patch, the largest of the bands of |B_i − R_i| / mean(R − E); 0 where the reference R is not a number.
Eigen::ArrayXd error_map(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference);

}  // namespace radiosity
