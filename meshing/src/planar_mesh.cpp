// SPDX-License-Identifier: GPL-3.0-or-later
#include "planar_mesh.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace radiosity {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
constexpr Index kUnnumbered = -1;

struct VertexInfo {
  Index number = kUnnumbered;
};
enum class Region { unvisited, inside, outside };
struct FaceInfo {
  Region region = Region::unvisited;
};
using Data = CGAL::Triangulation_data_structure_2<
    CGAL::Triangulation_vertex_base_with_info_2<VertexInfo, Kernel>,
    CGAL::Constrained_triangulation_face_base_2<Kernel,
                                                CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>>;
// Kept edges that cross (a polygon that intersects itself) get a point at the crossing.
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Data, CGAL::Exact_predicates_tag>;
using Point = Kernel::Point_2;
using Vertex = Triangulation::Vertex_handle;
using Face = Triangulation::Face_handle;
using Edges = std::span<const std::array<Index, 2>>;

Vec2 position(const Vertex& v) {
  return {v->point().x(), v->point().y()};
}

class Mesher {
 public:
  Mesher(std::vector<Vec2> points, Edges boundary, Edges lines)
      : points_(std::move(points)), boundary_(boundary), lines_(lines) {
    std::vector<Vertex> vertices(points_.size());
    Face hint;
    for (const std::size_t p : spread_out()) {
      vertices[p] = insert(points_[p], hint);
      Index& number = vertices[p]->info().number;
      if (number == kUnnumbered || static_cast<Index>(p) < number) number = static_cast<Index>(p);
      hint = vertices[p]->face();
    }
    for (const Edges edges : {boundary_, lines_})
      for (const auto& [a, b] : edges)
        if (vertices[a] != vertices[b]) triangulation_.insert_constraint(vertices[a], vertices[b]);
    mark_regions();
  }

  void add_lattice(double spacing) {
    Vec2 lower = points_[boundary_[0][0]], upper = lower;
    double longest = 0;
    Vec2 phase = lower;
    for (const auto& [a, b] : boundary_) {
      lower = lower.cwiseMin(points_[a]);
      upper = upper.cwiseMax(points_[a]);
    }
    const double clearance = 0.6 * spacing;
    if ((upper - lower).minCoeff() <= 2 * clearance) return;
    // The first row is half a step off the points of the lowest edge parallel to the rows, as in a mesh of
    // equilateral triangles.
    for (const auto& [a, b] : boundary_) {
      const Vec2 &p = points_[a], &q = points_[b];
      if (std::abs(p.y() - q.y()) > 1e-6 * spacing || std::abs(p.x() - q.x()) <= longest * (1 + 1e-6))
        continue;
      longest = std::abs(p.x() - q.x());
      phase = (p + q) / 2;
    }
    const Buckets kept(*this, spacing, clearance);
    const double row_height = spacing * std::sqrt(0.75);
    std::vector<Vec2> added;
    for (const auto& [row, from, to] : inner_intervals(phase.y(), row_height)) {
      const double y = phase.y() + static_cast<double>(row) * row_height;
      const double start = phase.x() + (row % 2 == 0 ? 0.5 : 0.0) * spacing;
      const auto first = static_cast<long>(std::ceil((from - start) / spacing));
      const auto last = static_cast<long>(std::floor((to - start) / spacing));
      for (long column = first; column <= last; ++column) {
        const Vec2 p(start + static_cast<double>(column) * spacing, y);
        if (kept.clear(p)) added.push_back(p);
      }
    }
    Face near;
    for (const Vec2& p : added) near = add(p, near)->face();
    mark_regions();
  }

  void halve_edges_longer_than(double longest) {
    // Longest first, so that a point halves an edge that is the longest of both its triangles. Two or three
    // rounds do where the lattice is finer than `longest`; the limit guards the case that it is not.
    for (int round = 0; round < 20; ++round) {
      struct Long {
        double squared;
        Vertex a, b;
      };
      std::vector<Long> edges;
      for (const auto& edge : triangulation_.finite_edges()) {
        if (triangulation_.is_constrained(edge) || edge.first->info().region != Region::inside) continue;
        const Vertex a = edge.first->vertex(Triangulation::cw(edge.second));
        const Vertex b = edge.first->vertex(Triangulation::ccw(edge.second));
        const double squared = (position(a) - position(b)).squaredNorm();
        if (squared <= longest * longest * (1 + 1e-9)) continue;
        const bool ordered = a->info().number < b->info().number;
        edges.push_back({squared, ordered ? a : b, ordered ? b : a});
      }
      if (edges.empty()) return;
      const auto order = [](const Long& edge) {
        return std::tuple(-edge.squared, edge.a->info().number, edge.b->info().number);
      };
      std::sort(edges.begin(), edges.end(),
                [&](const Long& x, const Long& y) { return order(x) < order(y); });
      for (const Long& edge : edges)
        if (triangulation_.is_edge(edge.a, edge.b))
          add((position(edge.a) + position(edge.b)) / 2, edge.a->face());
      mark_regions();
    }
  }

  PlanarMesh result() {
    for (const Vertex v : triangulation_.finite_vertex_handles())
      if (v->info().number == kUnnumbered) number(v, position(v));
    PlanarMesh mesh{points_, {}};
    for (const Face f : triangulation_.finite_face_handles()) {
      if (f->info().region != Region::inside) continue;
      std::array<Index, 3> corners;
      for (int k = 0; k < 3; ++k) corners[k] = f->vertex(k)->info().number;
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      mesh.triangles.push_back(corners);
    }
    // The order of CGAL's faces may depend on their addresses.
    std::sort(mesh.triangles.begin(), mesh.triangles.end());
    return mesh;
  }

 private:
  /// An order in which insertion takes O(n log n): in their own order the points along two sides of a strip take O(n²).
  std::vector<std::size_t> spread_out() const {
    using Numbered = std::pair<Point, std::size_t>;
    std::vector<Numbered> numbered;
    for (std::size_t p = 0; p < points_.size(); ++p)
      numbered.emplace_back(Point(points_[p].x(), points_[p].y()), p);
    using Map = CGAL::First_of_pair_property_map<Numbered>;
    CGAL::spatial_sort(numbered.begin(), numbered.end(),
                       CGAL::Spatial_sort_traits_adapter_2<Kernel, Map>(Map()));
    std::vector<std::size_t> order;
    for (const auto& [point, p] : numbered) order.push_back(p);
    return order;
  }

  /// Where the line y = phase + row · height runs inside the boundary.
  struct Interval {
    long row;
    double from, to;
  };

  /// By row, then from left to right. Where a row meets a boundary edge is asked of the edge, so that a long face across the
  /// axes costs what its boundary and its inside ask for, and not what the box around it would.
  std::vector<Interval> inner_intervals(double phase, double height) const {
    std::vector<std::pair<long, double>> crossings;
    for (const auto& [i, j] : boundary_) {
      Vec2 a = points_[i], b = points_[j];
      if (a.y() > b.y()) std::swap(a, b);
      // Edges are half open: a row through a corner meets one of two edges that go on upwards or downwards there.
      const auto row_at_or_above = [&](double y) {
        return static_cast<long>(std::ceil((y - phase) / height));
      };
      for (long row = row_at_or_above(a.y()); row < row_at_or_above(b.y()); ++row) {
        const double y = phase + static_cast<double>(row) * height;
        crossings.emplace_back(row, a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
      }
    }
    std::sort(crossings.begin(), crossings.end());
    std::vector<Interval> intervals;
    for (std::size_t k = 0; k + 1 < crossings.size(); k += 2)
      intervals.push_back({crossings[k].first, crossings[k].second, crossings[k + 1].second});
    return intervals;
  }

  /// Kept edges by square cells of one spacing.
  class Buckets {
   public:
    Buckets(const Mesher& mesher, double cell, double clearance)
        : clearance_(clearance), cell_(cell), origin_(mesher.points_[mesher.boundary_[0][0]]) {
      const Vec2 reach = Vec2::Constant(clearance);
      for (const Edges edges : {mesher.boundary_, mesher.lines_})
        for (const auto& [a, b] : edges) {
          const Vec2 &p = mesher.points_[a], &q = mesher.points_[b];
          const Cell from = cell_of(p.cwiseMin(q) - reach), to = cell_of(p.cwiseMax(q) + reach);
          for (Cell c = from; c[1] <= to[1]; ++c[1])
            for (c[0] = from[0]; c[0] <= to[0]; ++c[0]) segments_.push_back({c, p, q});
        }
      std::stable_sort(segments_.begin(), segments_.end(),
                       [](const Segment& x, const Segment& y) { return x.cell < y.cell; });
    }
    bool clear(const Vec2& p) const {
      const auto [first, last] =
          std::equal_range(segments_.begin(), segments_.end(), Segment{cell_of(p), p, p},
                           [](const Segment& x, const Segment& y) { return x.cell < y.cell; });
      return std::none_of(first, last, [&](const Segment& s) {
        return polygon::distance_to_segment(p, s.from, s.to) < clearance_;
      });
    }

   private:
    using Cell = std::array<long, 2>;
    struct Segment {
      Cell cell;
      Vec2 from, to;
    };
    Cell cell_of(const Vec2& p) const {
      const Vec2 cell = ((p - origin_) / cell_).array().floor();
      return {static_cast<long>(cell.x()), static_cast<long>(cell.y())};
    }
    double clearance_, cell_;
    Vec2 origin_;
    std::vector<Segment> segments_;  ///< by cell
  };

  Vertex insert(const Vec2& p, Face hint) {
    return hint == nullptr ? triangulation_.insert(Point(p.x(), p.y()))
                           : triangulation_.insert(Point(p.x(), p.y()), hint);
  }

  void number(Vertex v, const Vec2& p) {
    v->info().number = static_cast<Index>(points_.size());
    points_.push_back(p);
  }

  Vertex add(const Vec2& p, Face hint) {
    const Vertex v = insert(p, hint);
    if (v->info().number == kUnnumbered) number(v, p);
    return v;
  }

  /// Regions bounded by kept edges are wholly inside or outside; a point of the largest triangle of each
  /// decides. (Counting how often the way from infinity crosses the boundary fails where a boundary edge
  /// runs through another point of the boundary.)
  void mark_regions() {
    for (const Face f : triangulation_.all_face_handles()) f->info().region = Region::unvisited;
    std::vector<Vec2> ends;
    std::vector<Face> region;
    const auto visit = [&](Face start) {
      region.assign(1, start);
      start->info().region = Region::outside;
      for (std::size_t k = 0; k < region.size(); ++k)
        for (int side = 0; side < 3; ++side) {
          const Face next = region[k]->neighbor(side);
          if (region[k]->is_constrained(side) || next->info().region != Region::unvisited) continue;
          next->info().region = Region::outside;
          region.push_back(next);
        }
    };
    if (triangulation_.dimension() < 2) return;
    visit(triangulation_.infinite_face());
    for (const Face f : triangulation_.finite_face_handles()) {
      if (f->info().region != Region::unvisited) continue;
      visit(f);
      double largest = -1;
      Vec2 centre = Vec2::Zero();
      for (const Face g : region) {
        const Vec2 a = position(g->vertex(0)), b = position(g->vertex(1)), c = position(g->vertex(2));
        const double area = cross(b - a, c - a);
        if (area > largest) {
          largest = area;
          centre = (a + b + c) / 3;
        }
      }
      if (!inside_boundary(centre)) continue;
      for (const Face g : region) g->info().region = Region::inside;
    }
  }

  bool inside_boundary(const Vec2& p) const {
    bool inside = false;
    for (const auto& [i, j] : boundary_) {
      Vec2 a = points_[i], b = points_[j];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      if (a.y() > b.y()) std::swap(a, b);
      if (cross(b - a, p - a) > 0) inside = !inside;
    }
    return inside;
  }

  std::vector<Vec2> points_;
  Edges boundary_, lines_;
  Triangulation triangulation_;
};

}  // namespace

PlanarMesh mesh_polygon(std::vector<Vec2> points, Edges boundary, Edges lines, double spacing,
                        double longest) {
  Mesher mesher(std::move(points), boundary, lines);
  if (std::isfinite(spacing)) {
    mesher.add_lattice(spacing);
    mesher.halve_edges_longer_than(longest);
  }
  return mesher.result();
}

}  // namespace radiosity
