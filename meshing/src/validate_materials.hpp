// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "radiosity/meshing/material.hpp"

namespace radiosity {

/// Throws InputError unless there is a material, each is valid, all have the same bands and no two one name.
void validate(std::span<const Material> materials);

}  // namespace radiosity
