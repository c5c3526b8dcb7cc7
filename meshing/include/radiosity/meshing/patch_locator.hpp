// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Which patch of a facet lies at a point of its plane: a uniform grid in the plane, aligned with the patches where they
/// are a grid themselves. Most cells hold one patch, or two on either side of a line; where more meet, each side is divided in turn.
class alignas(64) PatchLocator {
 public:
  PatchLocator(const PatchMesh& mesh, const Facet& facet);

  /// Position in units of the grid's cells.
  Eigen::Vector2f flat(const Vec3& x) const {
    return {static_cast<float>((x - origin_).dot(u_)), static_cast<float>((x - origin_).dot(v_))};
  }

  /// The patch at p; near a border within rounding, one of its neighbours; outside the facet, a patch nearby.
  Index at(const Eigen::Vector2f& p) const {
    Index side = cells_[cell_at(p)].side_of(p);
    while (side < 0) side = divided_[static_cast<std::size_t>(-1 - side)].side_of(p);
    return side;
  }

  /// Has the memory that at(p) will look at brought near.
  void prefetch(const Eigen::Vector2f& p) const { __builtin_prefetch(&cells_[cell_at(p)]); }

 private:
  // One place in memory to look at, and no branch that a processor would have to foresee.
  struct Division {
    Eigen::Vector3f line;        // · (x, y, 1) ≥ 0: sides[0]
    std::array<Index, 2> sides;  // patches, or −1 − (the division of what lies there)
    Index side_of(const Eigen::Vector2f& p) const {
      return sides[line.x() * p.x() + line.y() * p.y() + line.z() < 0];
    }
  };
  struct Triangle;

  std::size_t cell_at(const Eigen::Vector2f& p) const {
    const int column = std::clamp(static_cast<int>(p.x()), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(p.y()), 0, rows_ - 1);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  Division divide(std::span<const Triangle* const> triangles);

  int columns_ = 1, rows_ = 1;
  std::vector<Division> cells_, divided_;
  Vec3 origin_, u_, v_;  // x ↦ ((x − origin)·u, (x − origin)·v) in cells
};

}  // namespace radiosity
