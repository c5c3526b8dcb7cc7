// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace radiosity {

/// Called now and then by long work with the fraction done, in [0, 1] and never falling; never from two
/// threads at once. Returning false asks the work to stop as soon as it can. An empty function means: nobody
/// is watching.
using Progress = std::function<bool(double fraction)>;

}  // namespace radiosity
