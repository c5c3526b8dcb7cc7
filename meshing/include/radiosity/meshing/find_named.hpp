// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

/// The row of a table of a family that has this name. Throws InputError that lists the names there are; `family` is its word.
template <class Table>
const auto& find_named(const Table& table, std::string_view family, std::string_view name) {
  std::string names;
  for (const auto& row : table) {
    if (row.name == name) return row;
    names += names.empty() ? "" : ", ";
    names += row.name;
  }
  throw InputError(std::string(family) + " '" + std::string(name) + "' is unknown; there are " + names);
}

}  // namespace radiosity
