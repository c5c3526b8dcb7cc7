// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity {

/// Seconds that `assemble` would take for all rows, extrapolated from about `rows` of them that are spread over the mesh, at
/// even shares of the work per thread. Stops sampling after `patience` seconds. Closing the rows is not in it.
double estimate_seconds(const FormFactorMethod& method, Index patches, Index rows = 32, double patience = 2);

}  // namespace radiosity
