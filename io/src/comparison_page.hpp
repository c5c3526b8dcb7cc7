// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "radiosity/io/comparison.hpp"

namespace radiosity {

/// Runs that no other beats in both seconds and error, by rising seconds.
std::vector<std::size_t> front_runs(const Comparison& comparison);

/// The whole page: HTML with its diagrams (SVG, by gnuplot) and pictures (PNG) in it.
std::string comparison_page(const Comparison& comparison, const ComparisonOrigin& origin);

}  // namespace radiosity
