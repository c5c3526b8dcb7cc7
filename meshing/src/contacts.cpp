// SPDX-License-Identifier: GPL-3.0-or-later
#include "contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr Index kNone = -1;

using Edge = std::array<Index, 2>;
constexpr Edge kNoEdge{kNone, kNone};

/// Where on a polygon a point is: at a corner, else on an edge, else anywhere.
struct Place {
  Index corner = kNone;
  Edge edge = kNoEdge;
};

struct End {
  Vec3 x;
  Place on;  ///< on the polygon that the line belongs to
};

class ContactFinder {
 public:
  ContactFinder(Surface& surface, double distance)
      : surface_(surface),
        distance_(distance),
        narrow_gap_(tolerance::kModelled / tolerance::kContact * distance) {
    contacts_.distance = distance;
    planes_.reserve(surface.count());
    takes_part_.reserve(surface.count());
    for (Index p = 0; p < surface.count(); ++p) {
      const auto loop = surface.loop(p);
      planes_.emplace_back(surface.points, loop);
      // Lines on a sliver that is hardly wider than the contact distance would touch both its sides.
      const double width =
          2 * polygon::area_vector(surface.points, loop).norm() / polygon::longest_edge(surface.points, loop);
      takes_part_.push_back(width > 4 * distance && polygon::is_planar(planes_.back(), surface.points, loop));
    }
  }

  Contacts run() {
    for (const auto& [i, j] : pairs()) meet(i, j);
    auto& lines = contacts_.lines;
    const auto order = [](const Contacts::Line& l) {
      return std::tuple(l.polygon, edge_key(l.a, l.b), l.parent, l.a);
    };
    std::sort(lines.begin(), lines.end(), [&](const auto& x, const auto& y) { return order(x) < order(y); });
    const auto same = [](const auto& x, const auto& y) {
      return x.polygon == y.polygon && edge_key(x.a, x.b) == edge_key(y.a, y.b);
    };
    lines.erase(std::unique(lines.begin(), lines.end(), same), lines.end());
    for (std::size_t k = 0, next; k < lines.size(); k = next) {
      for (next = k; next < lines.size() && lines[next].polygon == lines[k].polygon;) ++next;
      cross_lines(std::span(lines).subspan(k, next - k));
    }
    auto& coincident = contacts_.coincident;
    std::sort(coincident.begin(), coincident.end());
    coincident.erase(std::unique(coincident.begin(), coincident.end()), coincident.end());
    return std::move(contacts_);
  }

 private:
  const Vec3& point(Index v) const { return surface_.points[v]; }

  /// Pairs (i < j) of polygons whose boxes overlap and of which neither is on one side of the other's plane.
  std::vector<std::array<Index, 2>> pairs() const {
    std::vector<Index> polygons;
    std::vector<Eigen::AlignedBox3d> boxes;
    polygons.reserve(planes_.size());
    boxes.reserve(planes_.size());
    for (Index p = 0; p < surface_.count(); ++p) {
      if (!takes_part_[p]) continue;
      Eigen::AlignedBox3d box;
      for (const Index c : surface_.loop(p)) box.extend(point(c));
      box.min().array() -= narrow_gap_;
      box.max().array() += narrow_gap_;
      polygons.push_back(p);
      boxes.push_back(box);
    }
    std::vector<std::array<Index, 2>> found;
    for_each_pair_that_meets(boxes, [&](std::size_t a, std::size_t b) {
      const auto [i, j] = std::minmax(polygons[a], polygons[b]);
      if (surface_.face[i] != surface_.face[j] && ((reaches(j, i) && reaches(i, j)) || face_each_other(i, j)))
        found.push_back({i, j});
    });
    std::sort(found.begin(), found.end());
    return found;
  }

  /// Height of j's corner over the plane of i, 0 within the contact distance.
  double height(Index i, Index corner) const {
    const double h = planes_[i].height(point(corner));
    return std::abs(h) <= distance_ ? 0 : h;
  }

  struct Sides {
    int above = 0, below = 0, on = 0;
  };
  Sides sides(Index j, Index i) const {
    Sides count;
    for (const Index c : surface_.loop(j)) {
      const double h = height(i, c);
      ++(h > 0 ? count.above : h < 0 ? count.below : count.on);
    }
    return count;
  }
  bool reaches(Index j, Index i) const {
    const Sides s = sides(j, i);
    return (s.above > 0 && s.below > 0) || s.on > 1;
  }

  void meet(Index i, Index j) {
    const Sides i_over_j = sides(i, j), j_over_i = sides(j, i);
    const bool ij = imprint_edges(i, j), ji = imprint_edges(j, i);
    if (face_each_other(i, j)) {
      imprint_over_gap(i, j);
      imprint_over_gap(j, i);
    }
    const bool in_one_plane = i_over_j.above + i_over_j.below == 0 && j_over_i.above + j_over_i.below == 0;
    if (in_one_plane) {
      if (ij || ji || same_region(i, j))
        contacts_.coincident.push_back(
            {std::min(surface_.face[i], surface_.face[j]), std::max(surface_.face[i], surface_.face[j])});
      if (surface_.material[i] == surface_.material[j] && planes_[i].n.dot(planes_[j].n) > 0) {
        // Of two that lie in each other the later one goes.
        if (!ji && lies_in(j, i))
          contacts_.contained.push_back({j, i});
        else if (!ij && lies_in(i, j))
          contacts_.contained.push_back({i, j});
      }
    }
    if (i_over_j.above > 0 && i_over_j.below > 0 && j_over_i.above > 0 && j_over_i.below > 0)
      pass_through(i, j);
  }

  /// Lines of i along the edges of j that lie in its plane. Tells whether one runs through i's interior.
  bool imprint_edges(Index i, Index j) {
    const auto loop = surface_.loop(j), own = surface_.loop(i);
    bool found = false;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Edge edge{loop[k], loop[(k + 1) % loop.size()]};
      if (height(i, edge[0]) != 0 || height(i, edge[1]) != 0) continue;
      bool shared = false;
      for (std::size_t e = 0; e < own.size() && !shared; ++e)
        shared = edge_key(own[e], own[(e + 1) % own.size()]) == edge_key(edge[0], edge[1]);
      if (shared) continue;
      clip(i, j, {point(edge[0]), {edge[0], kNoEdge}}, {point(edge[1]), {edge[1], kNoEdge}}, edge,
           [&](Index a, Index b) {
             found = true;
             contacts_.lines.push_back({i, a, b, edge});
           });
    }
    return found;
  }

  bool face_each_other(Index i, Index j) const {
    return planes_[i].n.dot(planes_[j].n) < static_cast<double>(tolerance::kOpposed);
  }

  /// Lines of i below the edges of j that are over it with a narrow gap between. A patch of i that reached out from under j would
  /// carry the light that falls beside j to all of j.
  void imprint_over_gap(Index i, Index j) {
    const auto loop = surface_.loop(j);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Index a = loop[k], b = loop[(k + 1) % loop.size()];
      const double from = height(i, a), to = height(i, b);
      if (std::min(from, to) < 0 || std::max(from, to) == 0 || std::max(from, to) > narrow_gap_) continue;
      const auto below = [&](Index corner, double h) {
        return h == 0 ? End{point(corner), {corner, kNoEdge}} : End{point(corner) - h * planes_[i].n, {}};
      };
      clip(i, j, below(a, from), below(b, to), kNoEdge, [&](Index c, Index d) {
        contacts_.lines.push_back({i, c, d, {c, d}});
      });
    }
  }

  /// Of two polygons in one plane, no edge of i through the interior of j: whether a point of that is in i.
  bool lies_in(Index j, Index i) const {
    const auto loop = surface_.loop(j);
    double largest = 0;
    Vec3 inside = Vec3::Zero();
    for (const auto& [a, b, c] : polygon::triangles(surface_.points, loop)) {
      const std::array<Index, 3> corners{loop[a], loop[b], loop[c]};
      const double area = polygon::area_vector(surface_.points, corners).norm();
      if (area <= largest) continue;
      largest = area;
      inside = (point(corners[0]) + point(corners[1]) + point(corners[2])) / 3;
    }
    return largest > 0 && polygon::contains(polygon::project(planes_[i], surface_.points, surface_.loop(i)),
                                            planes_[i].project(inside));
  }

  /// The lines in which the interiors of i and j cross.
  void pass_through(Index i, Index j) {
    struct Crossing {
      double s;
      End end;
    };
    const Vec3 direction = planes_[i].n.cross(planes_[j].n);
    const auto loop = surface_.loop(j);
    std::vector<Crossing> crossings;
    const auto add = [&](const Vec3& x, Place on) {
      crossings.push_back({direction.dot(x - planes_[i].origin), {x, on}});
    };
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Index a = loop[k], b = loop[(k + 1) % loop.size()];
      const double from = height(i, a), to = height(i, b);
      if (from == 0) add(point(a), {a, kNoEdge});
      if (from * to < 0) {
        // From the lower to the higher number, so that the polygon across the edge finds the same bits.
        const bool forward = a < b;
        const Vec3 &p = point(forward ? a : b), &q = point(forward ? b : a);
        const double t = forward ? from / (from - to) : to / (to - from);
        add(p + t * (q - p), {kNone, {a, b}});
      }
    }
    std::stable_sort(crossings.begin(), crossings.end(),
                     [](const Crossing& x, const Crossing& y) { return x.s < y.s; });
    const std::vector<Vec2> ring = polygon::project(planes_[j], surface_.points, loop);
    for (std::size_t k = 0; k + 1 < crossings.size(); ++k) {
      const End &from = crossings[k].end, &to = crossings[k + 1].end;
      const Vec2 middle = planes_[j].project((from.x + to.x) / 2);
      if ((to.x - from.x).norm() <= distance_ || nearest_edge(ring, middle) != kNone ||
          !polygon::contains(ring, middle))
        continue;
      clip(i, j, from, to, kNoEdge, [&](Index a, Index b) {
        contacts_.lines.push_back({i, a, b, {a, b}});
        contacts_.lines.push_back({j, a, b, {a, b}});
      });
    }
  }

  /// Vertex radiosities are interpolated from one to the other.
  bool smooth(Index i, Index j) const {
    return surface_.material[i] == surface_.material[j] &&
           planes_[i].n.dot(planes_[j].n) >= tolerance::kSmoothCosine;
  }

  /// Number of an edge within the contact distance of p, or kNone.
  Index nearest_edge(std::span<const Vec2> ring, const Vec2& p) const {
    for (std::size_t k = 0; k < ring.size(); ++k)
      if (polygon::distance_to_segment(p, ring[k], ring[(k + 1) % ring.size()]) <= distance_)
        return static_cast<Index>(k);
    return kNone;
  }

  /// Calls use(a, b) with the end points of each part of the line from → to that runs through the interior
  /// of i. The line belongs to the other polygon; `edge` is its edge that the line runs along, if any. Parts along an edge of i
  /// give both edges each other's ends where the surface is smooth, and make that edge a crease elsewhere.
  template <class Use>
  void clip(Index i, Index other, const End& from, const End& to, Edge edge, const Use& use) {
    struct Stop {
      double s;
      Place on;     ///< i
      int end = 0;  ///< 1: from, 2: to
    };
    const polygon::Plane& plane = planes_[i];
    const auto loop = surface_.loop(i);
    const Vec2 p = plane.project(from.x), q = plane.project(to.x);
    const double length = (q - p).norm();
    if (length <= distance_) return;
    const Vec2 direction = (q - p) / length;
    const std::vector<Vec2> ring = polygon::project(plane, surface_.points, loop);
    std::vector<Stop> stops{{0, {}, 1}, {length, {}, 2}};
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec2 &c = ring[k], &d = ring[(k + 1) % loop.size()];
      const Edge own{loop[k], loop[(k + 1) % loop.size()]};
      const double hc = cross(direction, c - p), hd = cross(direction, d - p);
      const auto add = [&](const Vec2& x, Place on) {
        const double s = direction.dot(x - p);
        if (s >= -distance_ && s <= length + distance_) stops.push_back({std::clamp(s, 0.0, length), on});
      };
      if (std::abs(hc) <= distance_) add(c, {loop[k], kNoEdge});
      if (std::abs(hc) > distance_ && std::abs(hd) > distance_ && (hc > 0) != (hd > 0))
        add(c + hc / (hc - hd) * (d - c), {kNone, own});
      if (polygon::distance_to_segment(p, c, d) <= distance_) stops.push_back({0, {kNone, own}});
      if (polygon::distance_to_segment(q, c, d) <= distance_) stops.push_back({length, {kNone, own}});
    }
    std::stable_sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) { return a.s < b.s; });
    // Stops at one place become one.
    std::vector<Stop> merged;
    for (const Stop& stop : stops) {
      if (merged.empty() || stop.s - merged.back().s > distance_) {
        merged.push_back(stop);
        continue;
      }
      Stop& last = merged.back();
      if (last.end == 0) last.end = stop.end;
      if (last.on.corner == kNone) last.on.corner = stop.on.corner;
      if (last.on.edge == kNoEdge) last.on.edge = stop.on.edge;
    }
    const auto resolved = [&](const Stop& stop) {
      const End there = stop.end == 1   ? from
                        : stop.end == 2 ? to
                                        : End{from.x + stop.s / length * (to.x - from.x), {kNone, edge}};
      return resolve(there, stop.on);
    };
    for (std::size_t k = 0; k + 1 < merged.size(); ++k) {
      const Vec2 middle = p + (merged[k].s + merged[k + 1].s) / 2 * direction;
      const Index along = nearest_edge(ring, middle);
      if (along == kNone && !polygon::contains(ring, middle)) continue;
      const double part = merged[k + 1].s - merged[k].s;
      if (edge != kNoEdge) contacts_.covered[edge_key(edge[0], edge[1])] += part;
      if (along != kNone) {
        const std::uint64_t key = edge_key(loop[along], loop[at(along + 1) % loop.size()]);
        contacts_.covered[key] += part;
        if (smooth(i, other)) {
          contacts_.partly_shared.insert(key);
          resolved(merged[k]);
          resolved(merged[k + 1]);
        } else {
          contacts_.creases.insert(key);
        }
        continue;
      }
      const Index a = resolved(merged[k]), b = resolved(merged[k + 1]);
      if (a != b) use(a, b);
    }
  }

  /// The point for a place on two polygons: an existing one if there is one. It becomes a point of the edges
  /// it lies on, so that the polygons across them have it too.
  Index resolve(const End& end, const Place& on) {
    Index v = on.corner;
    if (v == kNone && on.edge != kNoEdge) v = find_on_edge(on.edge, end.x);
    if (v == kNone) v = end.on.corner;
    if (v == kNone && end.on.edge != kNoEdge) v = find_on_edge(end.on.edge, end.x);
    if (v == kNone) v = find_or_create(end.x);
    if (on.corner == kNone && on.edge != kNoEdge) v = keep_on_edge(on.edge, v);
    if (end.on.corner == kNone && end.on.edge != kNoEdge) keep_on_edge(end.on.edge, v);
    return v;
  }

  Index find_on_edge(Edge edge, const Vec3& x) const {
    for (const Index end : edge)
      if ((point(end) - x).norm() <= distance_) return end;
    const auto found = contacts_.splits.find(edge_key(edge[0], edge[1]));
    if (found == contacts_.splits.end()) return kNone;
    for (const Index v : found->second)
      if ((point(v) - x).norm() <= distance_) return v;
    return kNone;
  }

  /// The point that stands for v on the edge from now on: one within the contact distance, else v itself.
  Index keep_on_edge(Edge edge, Index v) {
    const Index existing = find_on_edge(edge, point(v));
    if (existing != kNone) return existing;
    contacts_.splits[edge_key(edge[0], edge[1])].push_back(v);
    return v;
  }

  Index find_or_create(const Vec3& x) {
    const double cell = 4 * distance_;
    const auto key = [](const Eigen::Vector3i& c) {
      return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.x())) * 73856093U) ^
             (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.y())) * 19349663U << 16) ^
             (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.z())) * 83492791U << 32);
    };
    const auto cell_of = [&](const Vec3& y) {
      return Eigen::Vector3i(((y - planes_[0].origin) / cell).array().floor().cast<int>());
    };
    const Eigen::Vector3i low = cell_of(x - Vec3::Constant(distance_)),
                          high = cell_of(x + Vec3::Constant(distance_));
    for (int cx = low.x(); cx <= high.x(); ++cx)
      for (int cy = low.y(); cy <= high.y(); ++cy)
        for (int cz = low.z(); cz <= high.z(); ++cz)
          if (const auto found = created_.find(key({cx, cy, cz})); found != created_.end())
            for (const Index v : found->second)
              if ((point(v) - x).norm() <= distance_) return v;
    const auto v = static_cast<Index>(surface_.points.size());
    surface_.points.push_back(x);
    created_[key(cell_of(x))].push_back(v);
    return v;
  }

  /// Two polygons that cover the same region of one plane with edges of their own. Two that share all their
  /// corners are the two sides of a sheet.
  bool same_region(Index i, Index j) const {
    const auto a = surface_.loop(i), b = surface_.loop(j);
    std::vector<Index> corners_a(a.begin(), a.end()), corners_b(b.begin(), b.end());
    std::sort(corners_a.begin(), corners_a.end());
    std::sort(corners_b.begin(), corners_b.end());
    if (corners_a == corners_b) return false;
    for (const Index c : a)
      if (nearest_edge(polygon::project(planes_[i], surface_.points, b), planes_[i].project(point(c))) ==
          kNone)
        return false;
    const double area_a = polygon::area_vector(surface_.points, a).norm();
    const double area_b = polygon::area_vector(surface_.points, b).norm();
    return std::abs(area_a - area_b) <= distance_ * polygon::longest_edge(surface_.points, a) * 4;
  }

  /// Points where lines of one polygon cross, end on or overlap each other.
  void cross_lines(std::span<const Contacts::Line> lines) {
    if (lines.size() < 2) return;
    const polygon::Plane& plane = planes_[lines[0].polygon];
    struct Segment {
      Contacts::Line line;
      Vec2 p, q;
      double left, right;
    };
    std::vector<Segment> segments;
    for (const auto& line : lines) {
      const Vec2 p = plane.project(point(line.a)), q = plane.project(point(line.b));
      segments.push_back(
          {line, p, q, std::min(p.x(), q.x()) - distance_, std::max(p.x(), q.x()) + distance_});
    }
    std::stable_sort(segments.begin(), segments.end(),
                     [](const Segment& x, const Segment& y) { return x.left < y.left; });
    for (std::size_t k = 0; k < segments.size(); ++k)
      for (std::size_t l = k + 1; l < segments.size() && segments[l].left <= segments[k].right; ++l) {
        const Segment &x = segments[k], &y = segments[l];
        if (std::min(x.p.y(), x.q.y()) > std::max(y.p.y(), y.q.y()) + distance_ ||
            std::min(y.p.y(), y.q.y()) > std::max(x.p.y(), x.q.y()) + distance_)
          continue;
        const bool end_on_other = end_on(x.line.a, x.p, y) | end_on(x.line.b, x.q, y) |
                                  end_on(y.line.a, y.p, x) | end_on(y.line.b, y.q, x);
        if (end_on_other) continue;
        const Vec2 dx = x.q - x.p, dy = y.q - y.p;
        const double p = cross(dy, x.p - y.p), q = cross(dy, x.q - y.p);
        if (p * q >= 0 || cross(dx, y.p - x.p) * cross(dx, y.q - x.p) >= 0) continue;
        const Vec3 crossing = point(x.line.a) + p / (p - q) * (point(x.line.b) - point(x.line.a));
        Index v = find_on_edge(x.line.parent, crossing);
        if (v == kNone) v = find_on_edge(y.line.parent, crossing);
        if (v == kNone) v = find_or_create(crossing);
        v = keep_on_edge(x.line.parent, v);
        keep_on_edge(y.line.parent, v);
      }
  }

  /// Keeps v on the line of `segment` if it lies on it, or tells that it is one of its ends.
  template <class Segment>
  bool end_on(Index v, const Vec2& position, const Segment& segment) {
    if (v == segment.line.a || v == segment.line.b) return true;
    if (polygon::distance_to_segment(position, segment.p, segment.q) > distance_) return false;
    keep_on_edge(segment.line.parent, v);
    return true;
  }

  Surface& surface_;
  double distance_, narrow_gap_;
  std::unordered_map<std::uint64_t, std::vector<Index>> created_;  ///< by cell of 4 contact distances
  std::vector<polygon::Plane> planes_;
  std::vector<bool> takes_part_;
  Contacts contacts_;
};

/// Appends to `way` what follows its last point up to b. Parts between points of an edge may be edges with points of their own; of
/// those only what goes forward counts, by the place s along the whole edge: within the contact distance points of two edges
/// may lie between one another.
class Way {
 public:
  Way(const Contacts& contacts, const std::vector<Vec3>& points, Index from, Index to)
      : contacts_(contacts),
        points_(points),
        origin_(points[from]),
        along_(points[to] - origin_),
        way_{from} {
    extend(from, to);
  }
  std::vector<Index> points() && { return std::move(way_); }

 private:
  double place(Index v) const { return along_.dot(points_[v] - origin_); }

  /// Each call's part of the way is strictly shorter than its caller's.
  void extend(Index a, Index b) {
    const double from = place(a), to = place(b);
    std::vector<std::pair<double, Index>> between;
    if (const auto found = contacts_.splits.find(edge_key(a, b)); found != contacts_.splits.end())
      for (const Index v : found->second)
        if (const double s = place(v); s > from && s < to) between.emplace_back(s, v);
    if (between.empty()) {
      way_.push_back(b);
      return;
    }
    std::sort(between.begin(), between.end());
    Index last = a;
    for (const auto& [s, v] : between) {
      if (s <= place(last)) continue;  // at the same place
      extend(last, v);
      last = v;
    }
    extend(last, b);
  }

  const Contacts& contacts_;
  const std::vector<Vec3>& points_;
  Vec3 origin_, along_;
  std::vector<Index> way_;
};

}  // namespace

std::vector<Index> Contacts::chain(const std::vector<Vec3>& points, Index a, Index b) const {
  // From the lower to the higher number, so that both polygons of an edge get the same points.
  std::vector<Index> way = Way(*this, points, std::min(a, b), std::max(a, b)).points();
  if (a > b) std::reverse(way.begin(), way.end());
  return way;
}

std::vector<Index> Contacts::chain(const std::vector<Vec3>& points, const Line& line) const {
  const Vec3& from = points[line.a];
  const Vec3 along = points[line.b] - from;
  const double length = along.norm();
  std::vector<Index> parent = chain(points, line.parent[0], line.parent[1]);
  if (along.dot(points[line.parent[1]] - points[line.parent[0]]) < 0)
    std::reverse(parent.begin(), parent.end());
  std::vector<Index> way{line.a};
  for (const Index v : parent) {
    const double s = along.dot(points[v] - from) / length;
    if (v != line.a && v != line.b && s > distance && s < length - distance) way.push_back(v);
  }
  way.push_back(line.b);
  return way;
}

Contacts find_contacts(Surface& surface, double distance) {
  return ContactFinder(surface, distance).run();
}

}  // namespace radiosity
