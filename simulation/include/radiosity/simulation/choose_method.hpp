// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/scene_settings.hpp"

namespace radiosity {

inline constexpr std::string_view kAutoMethod = "auto";

struct ChosenMethod {
  const FormFactorMethodInfo* info = nullptr;
  FormFactorOptions options;  ///< as they were asked for
  std::unique_ptr<FormFactorMethod> method;
  std::string why;  ///< empty where the settings name it
};

/// The method that the settings name. Where they name none, or "auto": closed forms of pairs where no patch hides another, `where_few`
/// where patches are few, otherwise rays.
ChosenMethod choose_method(const Visibility& visibility, const SceneSettings& settings,
                           std::string_view where_few = "analytic");

}  // namespace radiosity
