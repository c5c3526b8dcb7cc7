// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/formfactors/form_factor_matrix.hpp"
#include "radiosity/meshing/coarsen.hpp"

namespace radiosity {

/// F between larger patches from F between their members,
///   F_IJ = Σ_i∈I A_i/A_I Σ_j∈J F_ij,
/// exact where F is: rows keep their sums, pairs their reciprocity. One pass over F. A union that is not planar sees itself, F_II > 0.
/// Of several ranks each has the rows of F that it owns, and gets those of the result.
/// Throws InputError where the numbers of patches do not agree.
FormFactorMatrix aggregate(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                           const Coarsening& coarsening, const Ranks* ranks = nullptr);

}  // namespace radiosity
