// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "radiosity/meshing/refine.hpp"

namespace radiosity {

/// Patches quartered here and there, again and again where it is asked for: trees of cells, of which the leaves tile the patches. Convex
/// quads become four quads, triangles four triangles, other polygons first the triangles that they consist of. Next to a leaf stand leaves
/// at most half or twice as long, and a leaf has the middles of its longer edges among its corners where its neighbours have them: no
/// cracks, and no vertices on an edge that is not theirs.
class Quartering {
 public:
  /// Cell i is patch i, whole. The mesh must outlive it.
  explicit Quartering(const PatchMesh& mesh);

  struct Leaves {
    Refinement refinement;    ///< its smaller patches are the leaves, those of a patch in a row
    std::vector<Index> cell;  ///< of each leaf
  };
  Leaves leaves() const;

  Index cell_count() const { return static_cast<Index>(cells_.size()); }
  /// How often its patch was cut until it came to be.
  int depth(Index cell) const { return cells_[cell].depth; }

  /// Cuts leaves, and others where neighbours would be more than twice as long. New cells are numbered from the former cell_count() on.
  /// A cell that was cut before stays as it is.
  void cut(std::span<const Index> cells);

 private:
  struct Cell {
    Index patch;
    int depth;
    Index first_corner, corners;           // in corners_
    Index first_child = -1, children = 0;  // cells
  };

  std::span<const Index> corners(const Cell& cell) const;
  void add(Index patch, int depth, std::initializer_list<Index> corners);
  void cut(Index cell);
  Index middle(Index a, Index b);
  bool is_cut(Index a, Index b) const;
  void walk_edge(Index a, Index b, std::vector<Index>& out) const;

  const PatchMesh& mesh_;
  std::vector<Vec3> vertices_;
  std::vector<Index> corners_;
  std::vector<Cell> cells_;
  std::unordered_map<std::uint64_t, Index> middles_;  // vertices, by edge
};

}  // namespace radiosity
