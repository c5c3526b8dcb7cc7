// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/patch_locator.hpp"

#include <algorithm>
#include <cmath>

#include "facet_axes.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

FacetAxes::FacetAxes(const PatchMesh& mesh, const Facet& facet) {
  const auto corners = mesh.corners(facet.patches[0]);
  origin = mesh.vertex(corners[0]);
  u = (mesh.vertex(corners[1]) - origin).normalized();
  v = facet.pieces[0].normal.cross(u).normalized();
  Eigen::AlignedBox2d first;
  for (const Index c : corners) first.extend(flat(mesh.vertex(c)));
  constexpr double kRectangle = 0.999;  // of its bounding box: the grid only has to fit, not to be exact
  if (corners.size() == 4 && mesh.area(facet.patches[0]) >= kRectangle * first.volume()) cell = first.sizes();
  for (const Index i : facet.patches) {
    area += mesh.area(i);
    for (const Index c : mesh.corners(i)) box.extend(flat(mesh.vertex(c)));
  }
}

PatchLocator::PatchLocator(const PatchMesh& mesh, const Facet& facet) {
  if (facet.patches.size() == 1) {
    origin_ = u_ = v_ = Vec3::Zero();
    cells_ = {{{0, 0, 1}, {facet.patches[0], facet.patches[0]}}};
    return;
  }
  const FacetAxes axes(mesh, facet);
  const Eigen::Vector2d extent = axes.box.sizes();
  // Where patches are rectangles, the cells take their size.
  Eigen::Vector2d cell = axes.cell.value_or(
      Eigen::Vector2d::Constant(std::sqrt(axes.area / 8 / static_cast<double>(facet.patches.size()))));
  // Memory stays in proportion to the patches, whatever their shape.
  const double cells = extent.cwiseQuotient(cell).prod();
  const double most = 16 + 12 * static_cast<double>(facet.patches.size());
  if (cells > most) cell *= std::sqrt(cells / most);
  const auto count = [](double length, double step) {
    return static_cast<int>(std::clamp(std::round(length / step), 1.0, 1e6));
  };
  columns_ = count(extent.x(), cell.x());
  rows_ = count(extent.y(), cell.y());
  origin_ = axes.origin + axes.box.min().x() * axes.u + axes.box.min().y() * axes.v;
  u_ = columns_ / extent.x() * axes.u;
  v_ = rows_ / extent.y() * axes.v;

  const auto cell_count = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_);
  std::vector<std::vector<std::uint32_t>> lists(cell_count);
  std::vector<Triangle> triangles;
  std::vector<std::array<Eigen::Vector2d, 3>> corners;  // of triangles
  constexpr double kInside = 1e-6;  // a triangle that only touches a cell does not reach into it
  for (const Index i : facet.patches) {
    for (const auto& t : mesh.triangles(i)) {
      std::array<Eigen::Vector2d, 3> p;
      Eigen::AlignedBox2d reach;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 x = mesh.vertex(t[k]) - origin_;
        p[k] = {x.dot(u_), x.dot(v_)};
        reach.extend(p[k]);
      }
      std::array<Eigen::Vector3d, 3> edge;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector2d along = (p[(k + 1) % 3] - p[k]).normalized();
        edge[k] = {-along.y(), along.x(), along.y() * p[k].x() - along.x() * p[k].y()};
      }
      const auto number = static_cast<std::uint32_t>(triangles.size());
      corners.push_back(p);
      Triangle& triangle = triangles.emplace_back();
      triangle.patch = i;
      for (int k = 0; k < 3; ++k) triangle.distance.row(k) = edge[k].cast<float>();
      const int x1 = std::min(columns_ - 1, static_cast<int>(reach.max().x() - kInside));
      const int y1 = std::min(rows_ - 1, static_cast<int>(reach.max().y() - kInside));
      for (int y = std::max(0, static_cast<int>(reach.min().y() + kInside)); y <= y1; ++y) {
        for (int x = std::max(0, static_cast<int>(reach.min().x() + kInside)); x <= x1; ++x) {
          const bool outside = std::any_of(edge.begin(), edge.end(), [&](const Eigen::Vector3d& e) {
            return e.x() * (e.x() > 0 ? x + 1 : x) + e.y() * (e.y() > 0 ? y + 1 : y) + e.z() < kInside;
          });
          if (!outside)
            lists[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(x)]
                .push_back(number);
        }
      }
    }
  }
  // A line of which all of the triangles of the first one's patch lie on the inner side, and all others on the outer one.
  const auto divide = [&](const std::vector<std::uint32_t>& list) -> std::optional<Cell> {
    const Index inside = triangles[list[0]].patch;
    const auto other =
        std::find_if(list.begin(), list.end(), [&](std::uint32_t t) { return triangles[t].patch != inside; });
    const Index outside = other == list.end() ? inside : triangles[*other].patch;
    if (outside == inside) return Cell{{0, 0, 1}, {inside, inside}};
    for (const std::uint32_t t : list) {
      if (triangles[t].patch != inside) continue;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3f line = triangles[t].distance.row(k);
        const bool divides = std::all_of(list.begin(), list.end(), [&](std::uint32_t u) {
          const Index patch = triangles[u].patch;
          const double side = patch == inside ? 1 : -1;
          return (patch == inside || patch == outside) &&
                 std::all_of(corners[u].begin(), corners[u].end(), [&](const Eigen::Vector2d& x) {
                   return side * line.cast<double>().dot(Eigen::Vector3d(x.x(), x.y(), 1)) >
                          -tolerance::kOnLine;
                 });
        });
        if (divides) return Cell{line, {inside, outside}};
      }
    }
    return std::nullopt;
  };
  cells_.reserve(cell_count);
  for (const auto& list : lists) {
    if (list.empty()) {  // asked for by rounding only
      const Index near =
          !cells_.empty() && cells_.back().sides[0] >= 0 ? cells_.back().sides[0] : facet.patches[0];
      cells_.push_back({{0, 0, 1}, {near, near}});
    } else if (const auto divided = divide(list)) {
      cells_.push_back(*divided);
    } else {
      cells_.push_back(
          {{0, 0, 1}, {-1 - static_cast<Index>(triangles_.size()), static_cast<Index>(list.size())}});
      for (const std::uint32_t t : list) triangles_.push_back(triangles[t]);
    }
  }
}

Index PatchLocator::among_several(const Cell& cell, const Eigen::Vector2f& p) const {
  const Eigen::Vector3f q(p.x(), p.y(), 1);
  const Triangle* const first = &triangles_[-1 - cell.sides[0]];
  Index best = first->patch;
  float deepest = -std::numeric_limits<float>::max();
  for (const Triangle* t = first; t != first + cell.sides[1]; ++t) {
    const float depth = (t->distance * q).minCoeff();
    if (depth >= 0) return t->patch;
    if (depth > deepest) {
      deepest = depth;
      best = t->patch;
    }
  }
  return best;
}

}  // namespace radiosity
