// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Which patch of a facet lies at a point of its plane: a uniform grid in the plane, aligned with the patches where they
/// are a grid themselves. Most cells hold one patch, or two on either side of a line; the others list the triangles that
/// reach into them.
class PatchLocator {
 public:
  PatchLocator(const PatchMesh& mesh, const Facet& facet);

  /// Position in units of the grid's cells.
  Eigen::Vector2f flat(const Vec3& x) const {
    return {static_cast<float>((x - origin_).dot(u_)), static_cast<float>((x - origin_).dot(v_))};
  }

  /// The patch at p; near a border within rounding, one of its neighbours; outside the facet, a patch nearby.
  Index at(const Eigen::Vector2f& p) const {
    const Cell& cell = cells_[cell_at(p)];
    const bool outside = cell.line.x() * p.x() + cell.line.y() * p.y() + cell.line.z() < 0;
    const Index patch = cell.sides[outside];
    return patch >= 0 ? patch : among_several(cell, p);
  }

  /// Has the memory that at(p) will look at brought near.
  void prefetch(const Eigen::Vector2f& p) const { __builtin_prefetch(&cells_[cell_at(p)]); }

 private:
  struct Triangle {
    Index patch;
    Eigen::Matrix<float, 3, 3> distance;  ///< row k · (x, y, 1): distance inside edge k
  };
  // One place in memory to look at, and no branch that a processor would have to foresee.
  struct Cell {
    Eigen::Vector3f line;        // · (x, y, 1) ≥ 0: sides[0]
    std::array<Index, 2> sides;  // patches; of a cell of several: −1 − (first of its triangles), their number
  };

  std::size_t cell_at(const Eigen::Vector2f& p) const {
    const int column = std::clamp(static_cast<int>(p.x()), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(p.y()), 0, rows_ - 1);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  Index among_several(const Cell& cell, const Eigen::Vector2f& p) const;

  Vec3 origin_, u_, v_;  // x ↦ ((x − origin)·u, (x − origin)·v) in cells
  int columns_ = 1, rows_ = 1;
  std::vector<Cell> cells_;
  std::vector<Triangle> triangles_;  // of cells of several
};

}  // namespace radiosity
