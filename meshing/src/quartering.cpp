// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/quartering.hpp"

#include <limits>

#include "polygon.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/facets.hpp"

namespace radiosity {

Quartering::Quartering(const PatchMesh& mesh) : mesh_(mesh), vertices_(mesh.vertices()) {
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const auto c = mesh.corners(i);
    cells_.push_back({i, 0, static_cast<Index>(corners_.size()), static_cast<Index>(c.size())});
    corners_.insert(corners_.end(), c.begin(), c.end());
  }
}

std::span<const Index> Quartering::corners(const Cell& cell) const {
  return std::span(corners_).subspan(at(cell.first_corner), at(cell.corners));
}

void Quartering::add(Index patch, int depth, std::initializer_list<Index> corners) {
  if (corners_.size() + corners.size() > at(std::numeric_limits<Index>::max()))
    throw InputError("elements: they have more corners than can be numbered");
  cells_.push_back({patch, depth, static_cast<Index>(corners_.size()), static_cast<Index>(corners.size())});
  corners_.insert(corners_.end(), corners);
}

// The same point for both sides of an edge, to the bit.
Index Quartering::middle(Index a, Index b) {
  const auto [found, is_new] = middles_.try_emplace(edge_key(a, b), static_cast<Index>(vertices_.size()));
  if (is_new) {
    const Vec3 &from = vertices_[std::min(a, b)], &to = vertices_[std::max(a, b)];
    vertices_.push_back(from + 0.5 * (to - from));
  }
  return found->second;
}

bool Quartering::is_cut(Index a, Index b) const {
  return middles_.contains(edge_key(a, b));
}

void Quartering::walk_edge(Index a, Index b, std::vector<Index>& out) const {
  const auto found = middles_.find(edge_key(a, b));
  if (found == middles_.end()) {
    out.push_back(a);
    return;
  }
  walk_edge(a, found->second, out);
  walk_edge(found->second, b, out);
}

void Quartering::cut(Index number) {
  const Cell cell = cells_[number];
  const auto span = corners(cell);
  const std::vector<Index> c(span.begin(), span.end());
  const Index first = cell_count();
  const int depth = cell.depth + 1;
  if (c.size() == 3) {
    const Index ab = middle(c[0], c[1]), bc = middle(c[1], c[2]), ca = middle(c[2], c[0]);
    add(cell.patch, depth, {c[0], ab, ca});
    add(cell.patch, depth, {ab, c[1], bc});
    add(cell.patch, depth, {ca, bc, c[2]});
    add(cell.patch, depth, {ab, bc, ca});
  } else if (c.size() == 4 && polygon::is_convex(vertices_, c, 0)) {
    const Index ab = middle(c[0], c[1]), bc = middle(c[1], c[2]), cd = middle(c[2], c[3]),
                da = middle(c[3], c[0]);
    const auto centre = static_cast<Index>(vertices_.size());
    const Vec3 &x = vertices_[ab], &y = vertices_[cd];
    vertices_.push_back(x + 0.5 * (y - x));
    add(cell.patch, depth, {c[0], ab, centre, da});
    add(cell.patch, depth, {ab, c[1], bc, centre});
    add(cell.patch, depth, {centre, bc, c[2], cd});
    add(cell.patch, depth, {da, centre, cd, c[3]});
  } else {
    for (const auto& t : mesh_.triangles(cell.patch)) add(cell.patch, depth, {t[0], t[1], t[2]});
  }
  cells_[number].first_child = first;
  cells_[number].children = cell_count() - first;
}

void Quartering::cut(std::span<const Index> cells) {
  for (const Index cell : cells)
    if (cells_[cell].children == 0) cut(cell);
  // An edge of a leaf may have a middle, but its halves may not.
  const auto is_cut_twice = [&](const Cell& cell) {
    const auto c = corners(cell);
    for (std::size_t k = 0; k < c.size(); ++k) {
      const Index a = c[k], b = c[(k + 1) % c.size()];
      const auto found = middles_.find(edge_key(a, b));
      if (found != middles_.end() && (is_cut(a, found->second) || is_cut(found->second, b))) return true;
    }
    return false;
  };
  for (bool again = true; again;) {
    again = false;
    for (Index i = 0; i < cell_count(); ++i) {
      if (cells_[i].children > 0 || !is_cut_twice(cells_[i])) continue;
      cut(i);
      again = true;
    }
  }
}

Quartering::Leaves Quartering::leaves() const {
  PatchMesh::Arrays arrays;
  arrays.vertices = vertices_;
  arrays.materials = mesh_.materials();
  arrays.symmetry = mesh_.symmetry();
  std::vector<Index> parent, leaf_cells, open;
  for (Index i = 0; i < mesh_.patch_count(); ++i) {
    open.assign(1, i);
    while (!open.empty()) {
      const Index number = open.back();
      const Cell& cell = cells_[number];
      open.pop_back();
      if (cell.children > 0) {
        for (Index k = cell.children; k-- > 0;) open.push_back(cell.first_child + k);
        continue;
      }
      const auto c = corners(cell);
      for (std::size_t k = 0; k < c.size(); ++k) walk_edge(c[k], c[(k + 1) % c.size()], arrays.corners);
      arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
      arrays.patch_surface.push_back(mesh_.surface(i));
      arrays.patch_material.push_back(mesh_.material(i));
      parent.push_back(i);
      leaf_cells.push_back(number);
    }
  }
  if (mesh_.facets()) arrays.facets = with_pieces(*mesh_.facets(), parent);
  return {{PatchMesh(std::move(arrays)), {std::move(parent), mesh_.patch_count()}}, std::move(leaf_cells)};
}

}  // namespace radiosity
