// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace radiosity {

/// Index of refraction against vacuum, for visible light as a whole.
struct RefractiveIndex {
  std::string_view name;
  double value;
};

/// What scene files know by name: rounded values as textbooks of ray tracing tabulate them; where they depend on wavelength or
/// direction (crystals with two of them have two entries), give a number.
std::span<const RefractiveIndex> refractive_indices();

/// That of a name of the table, case and blanks ignored.
std::optional<double> refractive_index(std::string_view name);

}  // namespace radiosity
