// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity {

/// A number for the shape of the patches and their order: corners, to the last bit, and nothing else.
std::uint64_t digest(const PatchMesh& mesh);

/// F as HDF5, which h5py, MATLAB and Julia read: docs/formats.md names the data sets. What was found of it when it was assembled is
/// beside it. The file appears under its name only when complete. Throws IoError when it cannot be written.
void write_form_factors(const std::filesystem::path& file, const FormFactorMatrix& form_factors,
                        const PatchMesh& mesh, const FormFactorFacts& facts, const std::string& version,
                        const std::string& command);

/// What such a file says of itself.
struct FormFactorFileFacts {
  std::string method;
  FormFactorOptions options;
  Index patches = 0;
};
/// Throws IoError where it is not such a file.
FormFactorFileFacts read_form_factor_facts(const std::filesystem::path& file);

/// Throws IoError where it is not such a file, InputError where it is of other patches than these, or holds what is no F. Of several
/// ranks each reads the rows that it owns.
AssembledFormFactors read_form_factors(const std::filesystem::path& file, const PatchMesh& mesh,
                                       const Ranks* ranks = nullptr);

}  // namespace radiosity
