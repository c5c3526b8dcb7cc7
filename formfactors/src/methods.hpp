// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <memory>

#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity {

namespace item_buffer {
struct Kernel;
}

/// Every member of a cluster lies against another patch.
inline bool all_covered(const Visibility& visibility, Index cluster) {
  const auto members = visibility.mesh().members(cluster);
  return std::all_of(members.begin(), members.end(), [&](Index i) { return visibility.covered(i); });
}

std::unique_ptr<FormFactorMethod> make_analytic(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemisphere(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility&, const FormFactorOptions&,
                                                const item_buffer::Kernel&);

}  // namespace radiosity
