// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "radiosity/meshing/facets.hpp"

namespace radiosity {

/// Which patch of a facet lies at a point of its plane: a uniform grid in the plane, aligned with the patches where they
/// are a grid themselves, whose cells list the triangles that reach into them. Most queries end at a cell of one patch.
class PatchLocator {
 public:
  PatchLocator(const PatchMesh& mesh, const Facet& facet);

  /// Position in units of the grid's cells.
  Eigen::Vector2f flat(const Vec3& x) const {
    return {static_cast<float>((x - origin_).dot(u_)), static_cast<float>((x - origin_).dot(v_))};
  }

  /// The patch at p; near a border within rounding, one of its neighbours; outside the facet, a patch nearby.
  Index at(const Eigen::Vector2f& p) const {
    const int column = std::clamp(static_cast<int>(p.x()), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(p.y()), 0, rows_ - 1);
    const auto cell =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
    const Index only = only_[cell];
    return only >= 0 ? only : among_several(cell, p);
  }

 private:
  struct Triangle {
    Index patch;
    Eigen::Matrix<float, 3, 3> distance;  ///< row k · (x, y, 1): distance inside edge k
  };
  static constexpr Index kSeveral = -1;

  Index among_several(std::size_t cell, const Eigen::Vector2f& p) const;

  Vec3 origin_, u_, v_;  // x ↦ ((x − origin)·u, (x − origin)·v) in cells
  int columns_ = 1, rows_ = 1;
  std::vector<Index> only_;  // per cell: its patch, or kSeveral
  std::vector<std::uint32_t> start_;
  std::vector<std::uint32_t> reaching_;  // triangles of each cell
  std::vector<Triangle> triangles_;
};

}  // namespace radiosity
