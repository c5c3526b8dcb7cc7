// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

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

/// n(λ) = a₀ + a₁/λ² + a₂/λ⁴ + …, λ in µm.
struct Cauchy {
  std::vector<double> a;
};
/// n(λ)² = 1 + Σ b_k λ² / (λ² − c_k), λ and √c in µm; as many c as b.
struct Sellmeier {
  std::vector<double> b, c;
};
using Dispersion = std::variant<Cauchy, Sellmeier>;

/// n at a wavelength in nm; not a number where the formula has none.
double refractive_index(const Dispersion& dispersion, double wavelength_nm);

/// The yellow line of helium: the wavelength of an index that is given without one.
inline constexpr double kDLine_nm = 587.5618;

/// A glass or crystal whose index is known over the spectrum, at 20 to 22 °C, against air.
struct Glass {
  std::string_view name;
  Sellmeier sellmeier;
  double from_nm, to_nm;      ///< where the formula holds
  std::string_view citation;  ///< key of references.bib
};
std::span<const Glass> glasses();

/// That of the name, case and blanks ignored; null where there is none.
const Glass* find_glass(std::string_view name);

}  // namespace radiosity
