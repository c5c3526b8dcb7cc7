// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace radiosity {

/// Whether the whole name fits the pattern: * stands for any characters, also none, ? for one.
bool matches_pattern(std::string_view pattern, std::string_view name);

/// The keys that serve a name before all others: the name itself, else the longest pattern that it fits. Several where patterns are
/// equally long; none where no key fits.
std::vector<std::string> keys_for(const std::string& name, std::span<const std::string> keys);

}  // namespace radiosity
