// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/refractive_index.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string>

namespace radiosity {
namespace {

// Vacuum is exact; air at standard temperature and pressure, water at 20 °C.
constexpr std::array kIndices{RefractiveIndex{"vacuum", 1.0},
                              RefractiveIndex{"air", 1.00029},
                              RefractiveIndex{"acetone", 1.36},
                              RefractiveIndex{"alcohol", 1.329},
                              RefractiveIndex{"amorphous selenium", 2.92},
                              RefractiveIndex{"calcspar 1", 1.66},
                              RefractiveIndex{"calcspar 2", 1.486},
                              RefractiveIndex{"carbon disulfide", 1.63},
                              RefractiveIndex{"chromium oxide", 2.705},
                              RefractiveIndex{"copper oxide", 2.705},
                              RefractiveIndex{"crown glass", 1.52},
                              RefractiveIndex{"crystal", 2.0},
                              RefractiveIndex{"diamond", 2.417},
                              RefractiveIndex{"emerald", 1.57},
                              RefractiveIndex{"ethyl alcohol", 1.36},
                              RefractiveIndex{"fluorite", 1.434},
                              RefractiveIndex{"fused quartz", 1.46},
                              RefractiveIndex{"heaviest flint glass", 1.89},
                              RefractiveIndex{"heavy flint glass", 1.65},
                              RefractiveIndex{"glass", 1.5},
                              RefractiveIndex{"ice", 1.309},
                              RefractiveIndex{"iodine crystal", 3.34},
                              RefractiveIndex{"lapis lazuli", 1.61},
                              RefractiveIndex{"light flint glass", 1.575},
                              RefractiveIndex{"liquid carbon dioxide", 1.2},
                              RefractiveIndex{"polystyrene", 1.55},
                              RefractiveIndex{"quartz 1", 1.644},
                              RefractiveIndex{"quartz 2", 1.553},
                              RefractiveIndex{"ruby", 1.77},
                              RefractiveIndex{"sapphire", 1.77},
                              RefractiveIndex{"sodium chloride 1", 1.544},
                              RefractiveIndex{"sodium chloride 2", 1.644},
                              RefractiveIndex{"sugar solution 30 %", 1.38},
                              RefractiveIndex{"sugar solution 80 %", 1.49},
                              RefractiveIndex{"topaz", 1.61},
                              RefractiveIndex{"water", 1.333},
                              RefractiveIndex{"zinc crown glass", 1.517}};

// Coefficients of the manufacturer's data sheets and of the papers; the tests compare n_d and the Abbe number with those published.
const std::vector<Glass>& all_glasses() {
  static const std::vector<Glass> glasses{
      {"BK7",
       {{1.03961212, 0.231792344, 1.01046945}, {0.00600069867, 0.0200179144, 103.560653}},
       300,
       2500,
       "Schott2017"},
      {"F2",
       {{1.34533359, 0.209073176, 0.937357162}, {0.00997743871, 0.0470450767, 111.886764}},
       320,
       2500,
       "Schott2017"},
      {"SF10",
       {{1.62153902, 0.256287842, 1.64447552}, {0.0122241457, 0.0595736775, 147.468793}},
       380,
       2500,
       "Schott2017"},
      {"SF11",
       {{1.73759695, 0.313747346, 1.89878101}, {0.013188707, 0.0623068142, 155.23629}},
       370,
       2500,
       "Schott2017"},
      {"fused silica",
       {{0.6961663, 0.4079426, 0.8974794},
        {0.0684043 * 0.0684043, 0.1162414 * 0.1162414, 9.896161 * 9.896161}},
       210,
       3710,
       "Malitson1965"},
      {"calcium fluoride",
       {{0.5675888, 0.4710914, 3.8484723},
        {0.050263605 * 0.050263605, 0.1003909 * 0.1003909, 34.649040 * 34.649040}},
       230,
       9700,
       "Malitson1963"}};
  return glasses;
}

std::string plain(std::string_view name) {
  std::string result;
  for (const unsigned char c : name)
    if (std::isspace(c) == 0) result += static_cast<char>(std::tolower(c));
  return result;
}

}  // namespace

std::span<const RefractiveIndex> refractive_indices() {
  return kIndices;
}

std::optional<double> refractive_index(std::string_view name) {
  const auto found = std::find_if(kIndices.begin(), kIndices.end(), [&](const RefractiveIndex& entry) {
    return plain(entry.name) == plain(name);
  });
  if (found == kIndices.end()) return {};
  return found->value;
}

double refractive_index(const Dispersion& dispersion, double wavelength_nm) {
  const double square = wavelength_nm * wavelength_nm * 1e-6;  // λ², µm²
  if (const auto* const cauchy = std::get_if<Cauchy>(&dispersion)) {
    double sum = 0;
    for (auto a = cauchy->a.rbegin(); a != cauchy->a.rend(); ++a) sum = sum / square + *a;
    return sum;
  }
  const auto& [b, c] = std::get<Sellmeier>(dispersion);
  double sum = 1;
  for (std::size_t k = 0; k < b.size(); ++k) sum += b[k] * square / (square - c[k]);
  return std::sqrt(sum);
}

std::span<const Glass> glasses() {
  return all_glasses();
}

const Glass* find_glass(std::string_view name) {
  const auto found = std::find_if(all_glasses().begin(), all_glasses().end(),
                                  [&](const Glass& glass) { return plain(glass.name) == plain(name); });
  return found == all_glasses().end() ? nullptr : &*found;
}

}  // namespace radiosity
