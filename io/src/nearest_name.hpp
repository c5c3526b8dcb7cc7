// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace radiosity {

/// The name with the least edit distance (insertions, deletions, substitutions [Levenshtein1966]); the first
/// of several. `known` must not be empty.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

}  // namespace radiosity
