// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace radiosity {

/// What gnuplot writes to standard output for this script. It runs as a process of its own, without a shell and without files
/// of the user's. Throws IoError where it cannot be started or complains.
std::string gnuplot(const std::string& script);

}  // namespace radiosity
