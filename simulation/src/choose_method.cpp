// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/choose_method.hpp"

#include <fmt/format.h>

namespace radiosity {
namespace {

// Pairs cost n² and are the most accurate; sampled rows cost n and are the fastest where pairs are many.
constexpr Index kFewPatches = 2000;

}  // namespace

ChosenMethod choose_method(const Visibility& visibility, const SceneSettings& settings,
                           std::string_view where_few) {
  ChosenMethod chosen;
  std::string_view name = settings.method ? *settings.method : kAutoMethod;
  if (name == kAutoMethod) {
    if (visibility.convex()) {
      name = "analytic";
      chosen.why = "no patch hides another, so every factor is a closed form";
    } else if (visibility.mesh().patch_count() <= kFewPatches) {
      name = where_few;
      chosen.why =
          fmt::format("{} patches or fewer: accurate factors of every pair are affordable", kFewPatches);
    } else {
      name = "hemisphere";
      chosen.why = fmt::format("more than {} patches: sampling rays is faster than pairs", kFewPatches);
    }
  }
  chosen.info = &find_form_factor_method(name);
  chosen.options.samples = settings.samples.value_or(0);
  chosen.options.resolution = settings.resolution.value_or(0);
  chosen.options.tolerance = settings.factor_tolerance.value_or(0);
  chosen.options.seed = settings.seed.value_or(chosen.options.seed);
  chosen.method = chosen.info->make(visibility, chosen.options);
  return chosen;
}

}  // namespace radiosity
