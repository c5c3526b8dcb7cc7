// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/refractive_index.hpp"

#include <algorithm>
#include <array>
#include <cctype>
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

}  // namespace radiosity
