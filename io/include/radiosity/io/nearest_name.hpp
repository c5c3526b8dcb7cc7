// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace radiosity {

/// Insertions, deletions and substitutions that turn one word into the other [Levenshtein1966].
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name with the least edit distance, the first of several; nothing where even that changes more than a third (rounded
/// up) of the longer word: a far name suggests what nobody meant.
std::optional<std::string> nearest_name(std::string_view name, const std::vector<std::string>& known);

/// "'a', 'b', 'c' and 4 more"
std::string name_some(const std::vector<std::string>& names);

}  // namespace radiosity
