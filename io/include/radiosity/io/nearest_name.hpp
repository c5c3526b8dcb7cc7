// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace radiosity {

/// Insertions, deletions and substitutions that turn one word into the other [Levenshtein1966].
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name with the least edit distance; the first of several. `known` must not be empty.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

}  // namespace radiosity
