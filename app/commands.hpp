// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "options.hpp"

namespace radiosity::app {

inline constexpr int kDone = 0, kBadInput = 1, kBadUsage = 2, kNotConverged = 3;  ///< exit statuses

/// The subcommands; each gives its exit status and throws radiosity::Error.
int run_solve(const Options& options);
int run_factors(const Options& options);
int run_inspect(const Options& options);
int run_view(const Options& options);
int run_probe(const Options& options);
int run_compare(const Options& options);

}  // namespace radiosity::app
