// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "radiosity/meshing/scene.hpp"

namespace radiosity {

/// The surface in connected parts: sheets, and the skins of solids and rooms. Two faces are joined where an edge (end points equal
/// to the bit) belongs to them and to no third: a partition that stands in a room is a part of its own.
struct SurfaceParts {
  std::vector<Index> part;  ///< per face of the scene; −1 where repair drops it
  std::vector<std::uint8_t>
      closed;  ///< per part: each of its edges belongs to an even number of faces, so it has an inside
};

/// Of the faces as make_patches repairs them.
SurfaceParts surface_parts(const Scene& scene);

}  // namespace radiosity
