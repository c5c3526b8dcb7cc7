// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// A connected planar part of the surface, seen from one side, as it was before it was cut into patches: a wall, whatever
/// the number of its patches. Architecture has few of them; who hides whom is asked of them.
struct Facet {
  struct Piece {
    std::vector<Vec3> corners;  ///< convex, counter-clockwise about normal
    Vec3 normal;                ///< unit, front
  };
  std::vector<Index> patches;  ///< ascending
  std::vector<Piece> pieces;   ///< cover the same points as the patches, without overlap
  static constexpr std::size_t kNoBack = static_cast<std::size_t>(-1);
  std::size_t back =
      kNoBack;  ///< the facet with the same corners that is seen from the other side: a sheet has two
};

}  // namespace radiosity
