// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "radiosity/formfactors/form_factor_matrix.hpp"

namespace radiosity {

/// Writes F (its diagonal remainder included) as "matrix coordinate real general", 1-based, row by row, with
/// `comment` (may hold several lines) in the header. scipy.io.mmread, MATLAB's mmread and Julia's
/// MatrixMarket read it. Values are written with 9 significant digits, so single precision comes back to the
/// bit. Throws IoError when the file cannot be written.
void write_matrix_market(const std::filesystem::path& file, const FormFactorRows& form_factors,
                         const std::string& comment);

}  // namespace radiosity
