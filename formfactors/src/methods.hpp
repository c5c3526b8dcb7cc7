// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity {

namespace item_buffer {
struct Kernel;
}

std::unique_ptr<FormFactorMethod> make_analytic(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemisphere(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility&, const FormFactorOptions&);
std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility&, const FormFactorOptions&,
                                                const item_buffer::Kernel&);

}  // namespace radiosity
