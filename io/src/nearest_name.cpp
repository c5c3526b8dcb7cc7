// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/nearest_name.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace radiosity {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
    }
  }
  return row.back();
}

std::optional<std::string> nearest_name(std::string_view name, const std::vector<std::string>& known) {
  const auto nearest =
      std::min_element(known.begin(), known.end(), [&](const std::string& a, const std::string& b) {
        return edit_distance(name, a) < edit_distance(name, b);
      });
  if (nearest == known.end()) return {};
  const std::size_t near = (std::max(name.size(), nearest->size()) + 2) / 3;
  if (edit_distance(name, *nearest) > near) return {};
  return *nearest;
}

std::string name_some(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 3;
  const std::size_t named = names.size() <= kNamed + 1 ? names.size() : kNamed;  // "and 1 more" is no shorter
  std::string text;
  for (std::size_t k = 0; k < named; ++k)
    text += fmt::format("{}'{}'", k == 0 ? "" : k + 1 == names.size() ? " and " : ", ", names[k]);
  if (names.size() > named) text += fmt::format(" and {} more", names.size() - named);
  return text;
}

}  // namespace radiosity
