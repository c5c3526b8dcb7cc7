// SPDX-License-Identifier: GPL-3.0-or-later
#include "name_patterns.hpp"

#include <algorithm>

namespace radiosity {

bool matches_pattern(std::string_view pattern, std::string_view name) {
  // Where a character does not fit, the last * takes one more; earlier ones need not change.
  std::size_t p = 0, n = 0, star = std::string_view::npos, taken = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      taken = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++taken;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

std::vector<std::string> keys_for(const std::string& name, std::span<const std::string> keys) {
  if (std::find(keys.begin(), keys.end(), name) != keys.end()) return {name};
  std::vector<std::string> best;
  for (const std::string& key : keys) {
    if (key.find_first_of("*?") == std::string::npos || !matches_pattern(key, name)) continue;
    if (!best.empty() && key.size() > best.front().size()) best.clear();
    if (best.empty() || key.size() == best.front().size()) best.push_back(key);
  }
  return best;
}

}  // namespace radiosity
