// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>

#include "contacts.hpp"

namespace radiosity {

/// Patches as polygons over points; at a place where several polygons meet there is one point.
struct Pieces {
  std::vector<Vec3> points;
  std::vector<Index> corners;
  std::vector<Index> start{0};
  std::vector<Index> polygon;                 ///< per piece: the polygon of the surface it was cut from
  std::unordered_set<std::uint64_t> creases;  ///< edges (edge_key) over which no surface is smooth
};

/// Everything about the subdivision of planar polygons that does not depend on the size of the pieces.
class Subdivision {
 public:
  /// Polygons that are `coarse` share no edges with others: theirs are divided as if the size were kCoarse times as large.
  Subdivision(const Surface& surface, const Contacts& contacts, std::span<const std::uint8_t> coarse);
  static constexpr double kCoarse = 4;

  /// Pieces with no edge longer than `size` (kCoarse times that), which may be infinite. Throws InputError when there would be too
  /// many, of all or of one face.
  Pieces pieces(double size) const;

  /// The polygons themselves, with the points of others that lie on their edges.
  Pieces outlines() const;

  /// About how many pieces that will be.
  double expected(double size) const;

  bool is_cut(Index polygon) const { return polygons_[polygon].lines > 0; }

 private:
  /// An edge between neighbouring points that must be kept, a < b. It is divided once for all its polygons.
  struct Edge {
    Index a, b;
    double length;
    bool crease;
    double coarseness;  ///< 1 or kCoarse
  };
  struct Use {
    Index edge;
    bool forward;  ///< from a to b
  };
  struct Polygon {
    Index face;
    std::size_t first;            ///< in uses_: the boundary in order, then the lines
    std::size_t boundary, lines;  ///< numbers of uses
    bool grid;
    double area;
    double coarseness;  ///< 1 or kCoarse
  };
  struct Division;

  void add_polygon(const Surface& surface, const Contacts& contacts, Index polygon,
                   std::span<const Contacts::Line> lines, double coarseness);
  /// The point that stands for v on the edge from a to b: points of other polygons may be off by the contact distance, but the
  /// polygon keeps its outline, and so its area and its plane.
  Index on_edge(Index v, Index a, Index b, double slack);
  Use use(Index from, Index to, bool crease, double coarseness);
  std::vector<double> edge_counts(double size) const;  ///< pieces, of the edge that same_count_ names
  double expected(const Polygon& polygon, const std::vector<double>& edge_counts, double size) const;
  void require_possible(const std::vector<double>& edge_counts, double size) const;
  void add_grid(const Polygon& polygon, const Division& division, Pieces& pieces) const;
  void add_triangle(const Polygon& polygon, const Division& division, Pieces& pieces) const;
  void add_mesh(const Polygon& polygon, const Division& division, double size, Pieces& pieces) const;

  std::vector<Vec3> points_;
  std::vector<Edge> edges_;
  std::unordered_map<std::uint64_t, Index> edge_numbers_, coarse_edge_numbers_;
  std::map<std::array<Index, 3>, Index> feet_;  ///< per edge and point
  std::vector<Use> uses_;
  std::vector<Polygon> polygons_;
  std::vector<Index> same_count_;  ///< per edge: the first of those that are opposite in grids
};

}  // namespace radiosity
