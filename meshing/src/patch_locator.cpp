// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/patch_locator.hpp"

#include <algorithm>
#include <cmath>
#include <span>

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

struct PatchLocator::Triangle {
  Index patch;
  std::array<Vec3, 3> corners;  // (x, y, 1)
  std::array<Vec3, 3> edges;    // · (x, y, 1): distance inside edge k, which starts at corner k
};

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
  constexpr double kInside = 1e-6;  // a triangle that only touches a cell does not reach into it
  for (const Index i : facet.patches) {
    for (const auto& t : mesh.triangles(i)) {
      const auto number = static_cast<std::uint32_t>(triangles.size());
      Triangle& triangle = triangles.emplace_back();
      triangle.patch = i;
      Eigen::AlignedBox3d reach;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 x = mesh.vertex(t[k]) - origin_;
        triangle.corners[k] = {x.dot(u_), x.dot(v_), 1};
        reach.extend(triangle.corners[k]);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& from = triangle.corners[k];
        const Vec3 along = (triangle.corners[(k + 1) % 3] - from).normalized();
        triangle.edges[k] = {-along.y(), along.x(), along.y() * from.x() - along.x() * from.y()};
      }
      const int x1 = std::min(columns_ - 1, static_cast<int>(reach.max().x() - kInside));
      const int y1 = std::min(rows_ - 1, static_cast<int>(reach.max().y() - kInside));
      for (int y = std::max(0, static_cast<int>(reach.min().y() + kInside)); y <= y1; ++y) {
        for (int x = std::max(0, static_cast<int>(reach.min().x() + kInside)); x <= x1; ++x) {
          const bool outside = std::any_of(triangle.edges.begin(), triangle.edges.end(), [&](const Vec3& e) {
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
  cells_.reserve(cell_count);
  std::vector<const Triangle*> within;
  for (std::size_t k = 0; k < cell_count; ++k) {
    if (lists[k].empty()) {  // asked for by rounding only
      const Index near =
          !cells_.empty() && cells_.back().sides[0] >= 0 ? cells_.back().sides[0] : facet.patches[0];
      cells_.push_back({{0, 0, 1}, {near, near}});
      continue;
    }
    within.clear();
    for (const std::uint32_t t : lists[k]) within.push_back(&triangles[t]);
    cells_.push_back(divide(within));
  }
}

// By the line along an edge that leaves least triangles on its fuller side.
PatchLocator::Division PatchLocator::divide(std::span<const Triangle* const> triangles) {
  const auto alone = [](std::span<const Triangle* const> some) {
    return std::all_of(some.begin(), some.end(),
                       [&](const Triangle* t) { return t->patch == some[0]->patch; });
  };
  const Index first = triangles[0]->patch;
  if (alone(triangles)) return {{0, 0, 1}, {first, first}};

  enum Reach { kInside = 1, kOutside = 2 };
  const auto reach = [](const Triangle& t, const Vec3& line) {
    const double a = line.dot(t.corners[0]), b = line.dot(t.corners[1]), c = line.dot(t.corners[2]);
    return (std::max({a, b, c}) > tolerance::kOnLine ? kInside : 0) |
           (std::min({a, b, c}) < -tolerance::kOnLine ? kOutside : 0);
  };
  const Vec3* line = nullptr;
  std::size_t fewest = triangles.size();
  for (const Triangle* of : triangles) {
    for (const Vec3& edge : of->edges) {
      std::size_t inside = 0, outside = 0;
      for (const Triangle* t : triangles) {
        const int reached = reach(*t, edge);
        inside += (reached & kInside) != 0 ? 1 : 0;
        outside += (reached & kOutside) != 0 ? 1 : 0;
      }
      if (std::max(inside, outside) >= fewest || std::min(inside, outside) == 0) continue;
      fewest = std::max(inside, outside);
      line = &edge;
    }
  }
  if (line == nullptr) return {{0, 0, 1}, {first, first}};  // one over the other, by rounding
  Division division{line->cast<float>(), {}};
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<const Triangle*> side;
    for (const Triangle* t : triangles)
      if ((reach(*t, *line) & (k == 0 ? kInside : kOutside)) != 0) side.push_back(t);
    division.sides[k] = side[0]->patch;
    if (alone(side)) continue;
    divided_.push_back(divide(side));
    division.sides[k] = -static_cast<Index>(divided_.size());
  }
  return division;
}

}  // namespace radiosity
