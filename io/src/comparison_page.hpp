// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "radiosity/io/comparison.hpp"

namespace radiosity {

/// The whole page: comparison_page.html, into which trade.json and the pictures (PNG) are put. `trade_json` holds no '<', so that
/// nothing in it ends its element.
std::string comparison_page(const std::string& trade_json, const Comparison& comparison,
                            const ComparisonOrigin& origin);

}  // namespace radiosity
