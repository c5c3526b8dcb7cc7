// SPDX-License-Identifier: GPL-3.0-or-later
#include "methods.hpp"

#include <fmt/format.h>

#include <array>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/find_named.hpp"

namespace radiosity {
namespace {

constexpr std::array<FormFactorMethodInfo, 3> kMethods{{
    {"analytic",
     "exact unoccluded factor of each pair × visible fraction by exact shadows",
     "Sparrow1963",
     {.samples = 36, .tolerance = kFactorTolerance},
     make_analytic},
    {"hemisphere",
     "cosine-distributed rays from points spread over the patch",
     "Nusselt1928, Malley1988",
     {.samples = 1024},
     make_hemisphere},
    {"hemicube",
     "item buffer on the five faces of half a cube over points of the patch",
     "CohenGreenberg1985",
     {.samples = 4, .resolution = 128},
     make_hemicube},
}};

}  // namespace

std::span<const FormFactorMethodInfo> form_factor_methods() {
  return kMethods;
}

const FormFactorMethodInfo& find_form_factor_method(std::string_view name) {
  return find_named(kMethods, "form factor method", name);
}

std::unique_ptr<FormFactorMethod> FormFactorMethodInfo::make(const Visibility& visibility,
                                                             FormFactorOptions options) const {
  const auto fill = [](std::string_view setting, Index& value, Index standard, Index largest) {
    if (standard == 0) return;
    if (value < 0)
      throw InputError(fmt::format("{}: {} is negative; 0 takes the default {}", setting, value, standard));
    if (value > largest)
      throw InputError(fmt::format("{}: {} is above the largest value, {}", setting, value, largest));
    if (value == 0) value = standard;
  };
  fill("samples", options.samples, defaults.samples, 1 << 20);
  fill("resolution", options.resolution, defaults.resolution, 1 << 12);
  if (defaults.has_tolerance()) {
    if (options.tolerance == 0) options.tolerance = defaults.tolerance;
    if (!(options.tolerance >= 1e-9 && options.tolerance <= 0.01))
      throw InputError(fmt::format("factor tolerance: {:g} is outside [1e-9, 0.01]", options.tolerance));
  }
  return factory(visibility, options);
}

}  // namespace radiosity
