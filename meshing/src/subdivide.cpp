// SPDX-License-Identifier: GPL-3.0-or-later
#include "subdivide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "planar_mesh.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

/// The points on every edge for one size.
struct Subdivision::Division {
  const Subdivision& subdivision;
  std::vector<Index> count;  ///< pieces per edge
  std::vector<Index> first;  ///< per edge: number of its first inner point

  Index pieces(Use use) const { return count[use.edge]; }
  /// The k-th point on the way of `use`, 0 … pieces.
  Index point(Use use, Index k) const {
    const Edge& edge = subdivision.edges_[use.edge];
    const Index n = count[use.edge], step = use.forward ? k : n - k;
    return step == 0 ? edge.a : step == n ? edge.b : first[use.edge] + step - 1;
  }
};

Subdivision::Subdivision(const Surface& surface, const Contacts& contacts,
                         std::span<const std::uint8_t> coarse)
    : points_(surface.points) {
  auto line = contacts.lines.begin();
  for (Index p = 0; p < surface.count(); ++p) {
    const auto first = line;
    while (line != contacts.lines.end() && line->polygon == p) ++line;
    add_polygon(surface, contacts, p, {first, line}, coarse[p] != 0 ? kCoarse : 1);
  }
  DisjointSets same(edges_.size());
  for (const Polygon& polygon : polygons_) {
    if (!polygon.grid) continue;
    for (std::size_t k = 0; k < 2; ++k)
      same.unite(uses_[polygon.first + k].edge, uses_[polygon.first + k + 2].edge);
  }
  for (std::size_t e = 0; e < edges_.size(); ++e) same_count_.push_back(same.root(static_cast<Index>(e)));
}

Subdivision::Use Subdivision::use(Index from, Index to, bool crease, double coarseness) {
  const auto [low, high] = std::minmax(from, to);
  auto& numbers = coarseness > 1 ? coarse_edge_numbers_ : edge_numbers_;
  const auto [entry, is_new] = numbers.emplace(edge_key(from, to), static_cast<Index>(edges_.size()));
  if (is_new) edges_.push_back({low, high, (points_[high] - points_[low]).norm(), false, coarseness});
  if (crease) edges_[entry->second].crease = true;
  return {entry->second, from == low};
}

Index Subdivision::on_edge(Index v, Index a, Index b, double slack) {
  const auto [low, high] = std::minmax(a, b);
  const Vec3 &x = points_[v], &from = points_[low];
  const Vec3 along = (points_[high] - from).normalized();
  const Vec3 foot = from + along.dot(x - from) * along;
  if ((x - foot).norm() <= slack) return v;
  const auto [entry, is_new] = feet_.emplace(std::array{low, high, v}, static_cast<Index>(points_.size()));
  if (is_new) points_.push_back(foot);
  return entry->second;
}

void Subdivision::add_polygon(const Surface& surface, const Contacts& contacts, Index number,
                              std::span<const Contacts::Line> lines, double coarseness) {
  const auto loop = surface.loop(number);
  Polygon polygon{surface.face[number],
                  uses_.size(),
                  0,
                  0,
                  false,
                  polygon::area_vector(surface.points, loop).norm(),
                  coarseness};
  const double slack =
      tolerance::kCoplanar / tolerance::kContact * contacts.distance + polygon::rounding(points_, loop);
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Index a = loop[k], b = loop[(k + 1) % loop.size()];
    const bool crease = contacts.creases.contains(edge_key(a, b));
    std::vector<Index> way = contacts.chain(points_, a, b);
    for (std::size_t s = 1; s + 1 < way.size(); ++s) way[s] = on_edge(way[s], a, b, slack);
    for (std::size_t s = 0; s + 1 < way.size(); ++s)
      uses_.push_back(use(way[s], way[s + 1], crease, coarseness));
  }
  polygon.boundary = uses_.size() - polygon.first;

  if (!lines.empty()) {
    const polygon::Plane plane(surface.points, loop);
    // Points within the contact distance of one another become one, those of the boundary first.
    std::vector<Index> kept;
    for (std::size_t s = 0; s < polygon.boundary; ++s) {
      const Use& u = uses_[polygon.first + s];
      kept.push_back(u.forward ? edges_[u.edge].a : edges_[u.edge].b);
    }
    const auto left = [&](Index v) { return plane.project(points_[v]).x(); };
    std::set<std::pair<double, Index>> sorted;
    for (const Index v : kept) sorted.emplace(left(v), v);
    std::unordered_map<Index, Index> in_plane;
    const auto stand_in = [&](Index given) {
      Index v = given;
      if (const double height = plane.height(points_[v]); std::abs(height) > slack) {
        const auto [entry, is_new] = in_plane.emplace(v, static_cast<Index>(points_.size()));
        if (is_new) points_.push_back(points_[v] - height * plane.n);
        v = entry->second;
      }
      const double x = left(v);
      auto near = sorted.lower_bound({x - contacts.distance, 0});
      for (; near != sorted.end() && near->first <= x + contacts.distance; ++near)
        if (near->second == v || (points_[near->second] - points_[v]).norm() <= contacts.distance)
          return near->second;
      sorted.emplace(x, v);
      return v;
    };
    std::unordered_set<std::uint64_t> present;
    for (std::size_t s = 0; s < polygon.boundary; ++s) {
      const Edge& edge = edges_[uses_[polygon.first + s].edge];
      present.insert(edge_key(edge.a, edge.b));
    }
    for (const Contacts::Line& line : lines) {
      const std::vector<Index> way = contacts.chain(points_, line);
      for (std::size_t s = 0; s + 1 < way.size(); ++s) {
        const Index a = stand_in(way[s]), b = stand_in(way[s + 1]);
        if (a != b && present.insert(edge_key(a, b)).second) uses_.push_back(use(a, b, true, coarseness));
      }
    }
    polygon.lines = uses_.size() - polygon.first - polygon.boundary;
  }
  if (polygon.boundary == 4 && loop.size() == 4 && polygon.lines == 0)
    polygon.grid = polygon::is_convex(surface.points, loop, tolerance::kPlanarity);
  polygons_.push_back(polygon);
}

std::vector<double> Subdivision::edge_counts(double size) const {
  std::vector<double> wanted(edges_.size(), 1);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Edge& edge = edges_[e];
    const std::array<Index, 2> ends{edge.a, edge.b};
    const double length = edge.length * (1 - tolerance::kWholePieces) - polygon::rounding(points_, ends);
    double& most = wanted[same_count_[e]];
    most = std::max(most, std::ceil(length / (edge.coarseness * size)));
  }
  return wanted;
}

double Subdivision::expected(const Polygon& polygon, const std::vector<double>& wanted, double size) const {
  const auto count = [&](std::size_t k) { return wanted[same_count_[uses_[polygon.first + k].edge]]; };
  if (polygon.grid) return count(0) * count(1);
  double sum = polygon.area / std::pow(polygon.coarseness * size, 2);
  for (std::size_t k = 0; k < polygon.boundary + polygon.lines; ++k) sum += count(k);
  return sum;
}

double Subdivision::expected(double size) const {
  const std::vector<double> wanted = edge_counts(size);
  double sum = 0;
  for (const Polygon& polygon : polygons_) sum += expected(polygon, wanted, size);
  return sum;
}

void Subdivision::require_possible(const std::vector<double>& wanted, double size) const {
  // A piece has at most four corners, and corners are numbered, too.
  constexpr auto kMost = static_cast<double>(std::numeric_limits<Index>::max());
  double pieces = 0, inner_points = 0, most = 0;
  const Polygon* largest = nullptr;
  for (std::size_t e = 0; e < edges_.size(); ++e) inner_points += wanted[same_count_[e]] - 1;
  for (const Polygon& polygon : polygons_) {
    const double own = expected(polygon, wanted, size);
    pieces += own;
    if (own <= most) continue;
    most = own;
    largest = &polygon;
  }
  if (std::max(pieces, inner_points + static_cast<double>(points_.size())) > kMost / 4)
    throw InputError(fmt::format(
        "patch size {} m: it would give about {:.2g} patches; their corners must be less than 2^31", size,
        std::max(pieces, inner_points)));
  if (most <= tolerance::kMostPiecesOfFace) return;
  double longest = 0;
  for (std::size_t k = 0; k < largest->boundary; ++k)
    longest = std::max(longest, edges_[uses_[largest->first + k].edge].length);
  throw InputError(fmt::format(
      "face {}: with an edge of {:.4g} m and a patch size of {:.4g} m it would give about {:.2g} patches; "
      "at most {:.0f} are possible for one face",
      largest->face, longest, size, most, tolerance::kMostPiecesOfFace));
}

Pieces Subdivision::outlines() const {
  Pieces result;
  result.points = points_;
  for (std::size_t p = 0; p < polygons_.size(); ++p) {
    for (std::size_t k = 0; k < polygons_[p].boundary; ++k) {
      const Use& use = uses_[polygons_[p].first + k];
      const Edge& edge = edges_[use.edge];
      result.corners.push_back(use.forward ? edge.a : edge.b);
    }
    result.start.push_back(static_cast<Index>(result.corners.size()));
    result.polygon.push_back(static_cast<Index>(p));
  }
  return result;
}

Pieces Subdivision::pieces(double size) const {
  const std::vector<double> wanted = edge_counts(size);
  require_possible(wanted, size);
  Pieces result;
  result.points = points_;
  Division division{*this, std::vector<Index>(edges_.size()), std::vector<Index>(edges_.size())};
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Edge& edge = edges_[e];
    const auto n = static_cast<Index>(wanted[same_count_[e]]);
    division.count[e] = n;
    division.first[e] = static_cast<Index>(result.points.size());
    const Vec3 &a = points_[edge.a], &b = points_[edge.b];
    for (Index k = 1; k < n; ++k) result.points.push_back(a + static_cast<double>(k) / n * (b - a));
    if (!edge.crease) continue;
    const Use whole{static_cast<Index>(e), true};
    for (Index k = 0; k < n; ++k)
      result.creases.insert(edge_key(division.point(whole, k), division.point(whole, k + 1)));
  }
  for (std::size_t p = 0; p < polygons_.size(); ++p) {
    const Polygon& polygon = polygons_[p];
    const auto count = [&](std::size_t k) { return division.pieces(uses_[polygon.first + k]); };
    if (polygon.grid)
      add_grid(polygon, division, result);
    else if (polygon.boundary == 3 && polygon.lines == 0 && count(0) == count(1) && count(1) == count(2))
      add_triangle(polygon, division, result);
    else
      add_mesh(polygon, division, polygon.coarseness * size, result);
    result.polygon.resize(result.start.size() - 1, static_cast<Index>(p));
  }
  return result;
}

namespace {

void add_piece(Pieces& pieces, std::initializer_list<Index> corners) {
  pieces.corners.insert(pieces.corners.end(), corners);
  pieces.start.push_back(static_cast<Index>(pieces.corners.size()));
}

}  // namespace

/// x(s, t) = c_0 + s (c_1 − c_0) + t (c_3 − c_0) + s t (c_0 − c_1 + c_2 − c_3)
void Subdivision::add_grid(const Polygon& polygon, const Division& division, Pieces& pieces) const {
  const std::span<const Use> side = std::span(uses_).subspan(polygon.first, 4);
  const Index nu = division.pieces(side[0]), nv = division.pieces(side[1]);
  const Vec3 c0 = points_[division.point(side[0], 0)];
  const Vec3 along_u = points_[division.point(side[1], 0)] - c0;
  const Vec3 along_v = points_[division.point(side[3], 0)] - c0;
  const Vec3 twist = points_[division.point(side[2], 0)] - c0 - along_u - along_v;
  const auto inner = static_cast<Index>(pieces.points.size());
  for (Index j = 1; j < nv; ++j)
    for (Index i = 1; i < nu; ++i) {
      const double s = static_cast<double>(i) / nu, t = static_cast<double>(j) / nv;
      pieces.points.push_back(c0 + (s * along_u + t * along_v + s * t * twist));
    }
  const auto point = [&](Index i, Index j) {
    if (j == 0) return division.point(side[0], i);
    if (i == nu) return division.point(side[1], j);
    if (j == nv) return division.point(side[2], nu - i);
    if (i == 0) return division.point(side[3], nv - j);
    return inner + (j - 1) * (nu - 1) + i - 1;
  };
  for (Index j = 0; j < nv; ++j)
    for (Index i = 0; i < nu; ++i)
      add_piece(pieces, {point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
}

/// n² triangles similar to the whole, x = c_0 + i/n (c_1 − c_0) + j/n (c_2 − c_0).
void Subdivision::add_triangle(const Polygon& polygon, const Division& division, Pieces& pieces) const {
  const std::span<const Use> side = std::span(uses_).subspan(polygon.first, 3);
  const Index n = division.pieces(side[0]);
  const Vec3 c0 = points_[division.point(side[0], 0)];
  const Vec3 along_u = points_[division.point(side[1], 0)] - c0;
  const Vec3 along_v = points_[division.point(side[2], 0)] - c0;
  std::vector<Index> row_start{0};
  const auto inner = static_cast<Index>(pieces.points.size());
  for (Index j = 1; j < n; ++j) {
    row_start.push_back(static_cast<Index>(pieces.points.size()) - inner);
    for (Index i = 1; i < n - j; ++i)
      pieces.points.push_back(c0 +
                              (static_cast<double>(i) / n * along_u + static_cast<double>(j) / n * along_v));
  }
  const auto point = [&](Index i, Index j) {
    if (j == 0) return division.point(side[0], i);
    if (i + j == n) return division.point(side[1], j);
    if (i == 0) return division.point(side[2], n - j);
    return inner + row_start[j] + i - 1;
  };
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i + j < n; ++i) {
      add_piece(pieces, {point(i, j), point(i + 1, j), point(i, j + 1)});
      if (i + j + 1 < n) add_piece(pieces, {point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
    }
}

void Subdivision::add_mesh(const Polygon& polygon, const Division& division, double size,
                           Pieces& pieces) const {
  const std::span<const Use> uses = std::span(uses_).subspan(polygon.first, polygon.boundary + polygon.lines);
  std::vector<Index> numbers, loop;  // of the points that must be kept; of the boundary in order
  std::unordered_map<Index, Index> local;
  const auto local_number = [&](Index v) {
    const auto [entry, is_new] = local.emplace(v, static_cast<Index>(numbers.size()));
    if (is_new) numbers.push_back(v);
    return entry->second;
  };
  std::vector<std::array<Index, 2>> boundary, lines;
  double length = 0, moment = 0;
  for (std::size_t u = 0; u < uses.size(); ++u) {
    const Index n = division.pieces(uses[u]);
    for (Index k = 0; k < n; ++k) {
      const Index from = division.point(uses[u], k), to = division.point(uses[u], k + 1);
      if (u < polygon.boundary) loop.push_back(from);
      (u < polygon.boundary ? boundary : lines).push_back({local_number(from), local_number(to)});
    }
    const double edge_length = edges_[uses[u].edge].length;
    length += edge_length;
    moment += edge_length * edge_length / n;
  }
  // Mean length of the boundary's pieces. Short edges must not make the rest finer than the size asks for, and
  // a lattice as wide as the size would leave no room for the longer edges at its seam with the boundary.
  const double spacing = std::isfinite(size) ? std::clamp(moment / length, 0.5 * size, 0.85 * size) : size;

  const polygon::Plane plane(pieces.points, loop);
  const PlanarMesh mesh =
      mesh_polygon(polygon::project(plane, pieces.points, numbers), boundary, lines, spacing, size);
  const auto kept = static_cast<Index>(numbers.size()), added = static_cast<Index>(pieces.points.size());
  for (std::size_t p = numbers.size(); p < mesh.points.size(); ++p)
    pieces.points.push_back(plane.lift(mesh.points[p]));
  for (const auto& triangle : mesh.triangles) {
    std::array<Index, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = triangle[k] < kept ? numbers[triangle[k]] : added + triangle[k] - kept;
    // In the tip of a sliver pieces may vanish in the rounding of their coordinates.
    const double height = 2 * polygon::area_vector(pieces.points, corners).norm() /
                          polygon::longest_edge(pieces.points, corners);
    if (height > std::numeric_limits<double>::epsilon() * polygon::magnitude(pieces.points, corners))
      add_piece(pieces, {corners[0], corners[1], corners[2]});
  }
}

}  // namespace radiosity
