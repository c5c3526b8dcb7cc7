// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/facets.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

#include "planar_mesh.hpp"
#include "polygon.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

using Loop = std::vector<Index>;

/// Pieces of one planar polygon of the file, seen from one side; or a single patch.
struct Face {
  std::vector<Index> patches;  // ascending
  Vec3 normal, centre;
  double deviation = 0;  // m: how far off the plane the corners are
};

class WallFinder {
 public:
  explicit WallFinder(const PatchMesh& mesh)
      : mesh_(mesh),
        position_(first_equal(mesh.vertices())),
        rounding_(tolerance::kDegenerateHeight *
                  std::max(mesh.lower().cwiseAbs().maxCoeff(), mesh.upper().cwiseAbs().maxCoeff())),
        slack_(tolerance::kCoplanar * mesh.diagonal() + rounding_),
        face_of_(mesh.patch_count()) {}

  std::vector<Facet> find() {
    find_faces();
    find_neighbours();
    std::vector<Index> all(mesh_.patch_count());
    std::iota(all.begin(), all.end(), 0);
    std::vector<Facet> out;
    for (const auto& group : connected(all, [&](Index a, Index b) { return coplanar(a, b); })) {
      if (add_outline(group, out)) continue;
      // The union has no outline: each face on its own.
      for (const auto& face : connected(group, [&](Index a, Index b) { return face_of_[a] == face_of_[b]; }))
        if (!add_outline(face, out))
          for (const Index i : face) out.push_back({{i}, whole(i)});
    }
    std::sort(out.begin(), out.end(),
              [](const Facet& a, const Facet& b) { return a.patches[0] < b.patches[0]; });
    find_backs(out);
    return out;
  }

 private:
  static void find_backs(std::vector<Facet>& all) {
    const auto before = [](const Vec3& a, const Vec3& b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    };
    std::vector<std::vector<Vec3>> corners;
    for (const Facet& facet : all) {
      std::vector<Vec3>& own = corners.emplace_back();
      for (const Facet::Piece& piece : facet.pieces)
        own.insert(own.end(), piece.corners.begin(), piece.corners.end());
      std::sort(own.begin(), own.end(), before);
      own.erase(std::unique(own.begin(), own.end()), own.end());
    }
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::lexicographical_compare(corners[a].begin(), corners[a].end(), corners[b].begin(),
                                          corners[b].end(), before);
    });
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
      Facet &a = all[order[k]], &b = all[order[k + 1]];
      if (corners[order[k]] != corners[order[k + 1]] || a.pieces[0].normal.dot(b.pieces[0].normal) >= 0)
        continue;
      a.back = order[k + 1];
      b.back = order[k];
    }
  }

  struct Side {
    std::uint64_t key;
    Index patch, from, to;
    Index neighbour = -1;  // the patch on the other side of the edge, if it may be in one plane with this one
  };

  // Polygons of the file are planar up to kPlanarity, and so are the patches of one, whatever rounding did to its corners.
  void find_faces() {
    std::map<Index, std::vector<Index>> by_surface;
    for (Index i = 0; i < mesh_.patch_count(); ++i) by_surface[mesh_.surface(i)].push_back(i);
    for (const auto& [surface, patches] : by_surface) {
      std::array<std::vector<Index>, 2> sides;  // front, and back where both count
      for (const Index i : patches)
        sides[mesh_.normal(i).dot(mesh_.normal(patches[0])) < 0 ? 1 : 0].push_back(i);
      for (auto& side : sides)
        if (!side.empty()) add_faces(std::move(side));
    }
  }

  void add_faces(std::vector<Index> patches) {
    Face face{std::move(patches), Vec3::Zero(), Vec3::Zero()};
    double area = 0;
    Vec3 lower = mesh_.centroid(face.patches[0]), upper = lower;
    for (const Index i : face.patches) {
      face.normal += mesh_.area(i) * mesh_.normal(i);
      face.centre += mesh_.area(i) * (mesh_.centroid(i) - mesh_.centroid(face.patches[0]));
      area += mesh_.area(i);
    }
    face.normal.normalize();
    face.centre = face.centre / area + mesh_.centroid(face.patches[0]);
    for (const Index i : face.patches) {
      for (const Index v : mesh_.corners(i)) {
        const Vec3& x = mesh_.vertex(v);
        lower = lower.cwiseMin(x);
        upper = upper.cwiseMax(x);
        face.deviation = std::max(face.deviation, std::abs(face.normal.dot(x - face.centre)));
      }
    }
    const bool planar = face.deviation <= 2 * tolerance::kPlanarity * (upper - lower).norm() + rounding_;
    if (planar || face.patches.size() == 1) {
      for (const Index i : face.patches) face_of_[i] = static_cast<Index>(faces_.size());
      faces_.push_back(std::move(face));
    } else {
      for (const Index i : face.patches) add_faces({i});
    }
  }

  bool reaches_out(const Face& face, const Face& of) const {
    for (const Index i : face.patches)
      for (const Index v : mesh_.corners(i))
        if (std::abs(of.normal.dot(mesh_.vertex(v) - of.centre)) > slack_) return true;
    return false;
  }
  // The normal of a sliver is rounding, so the plane of the other one may do.
  bool coplanar(Index a, Index b) {
    const auto [f, g] = std::minmax(face_of_[a], face_of_[b]);
    if (f == g) return true;
    const Face &one = faces_[f], &other = faces_[g];
    if (!(one.normal.dot(other.normal) > 0.5)) return false;
    const auto [known, fresh] = coplanar_.try_emplace({f, g}, false);
    if (fresh) known->second = !(reaches_out(one, other) && reaches_out(other, one));
    return known->second;
  }

  void find_neighbours() {
    for (Index i = 0; i < mesh_.patch_count(); ++i) {
      const auto c = mesh_.corners(i);
      side_start_.push_back(sides_.size());
      for (std::size_t k = 0; k < c.size(); ++k) {
        const Index from = position_[c[k]], to = position_[c[(k + 1) % c.size()]];
        sides_.push_back({edge_key(from, to), i, from, to});
      }
    }
    side_start_.push_back(sides_.size());
    std::vector<std::size_t> order(sides_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return sides_[a].key != sides_[b].key ? sides_[a].key < sides_[b].key : a < b;
    });
    for (std::size_t k = 0, next; k < order.size(); k = next) {
      for (next = k + 1; next < order.size() && sides_[order[next]].key == sides_[order[k]].key;) ++next;
      for (std::size_t p = k; p < next; ++p) {
        for (std::size_t q = p + 1; q < next; ++q) {
          Side &a = sides_[order[p]], &b = sides_[order[q]];
          if (a.neighbour >= 0 || b.neighbour >= 0 || a.from != b.to || a.from == a.to ||
              a.patch == b.patch || !coplanar(a.patch, b.patch))
            continue;
          a.neighbour = b.patch;
          b.neighbour = a.patch;
        }
      }
    }
  }

  // The patches in groups that hang together over edges on whose sides `joined` holds, ordered by their first patches.
  template <class Joined>
  std::vector<std::vector<Index>> connected(const std::vector<Index>& patches, const Joined& joined) {
    DisjointSets sets(mesh_.patch_count());
    for (const Index i : patches)
      for (std::size_t s = side_start_[i]; s < side_start_[i + 1]; ++s)
        if (const Index j = sides_[s].neighbour; j >= 0 && joined(i, j)) sets.unite(i, j);
    std::unordered_map<Index, std::size_t> number;
    std::vector<std::vector<Index>> groups;
    for (const Index i : patches) {
      const auto [found, fresh] = number.try_emplace(sets.root(i), groups.size());
      if (fresh) groups.emplace_back();
      groups[found->second].push_back(i);
    }
    return groups;
  }

  bool add_outline(const std::vector<Index>& group, std::vector<Facet>& out) const {
    if (group.size() == 1 && !has_straight_corners(group[0])) return false;
    std::vector<Facet::Piece> pieces = outline(group);
    if (pieces.empty()) return false;
    out.push_back({group, std::move(pieces)});
    return true;
  }

  // Points of other patches lie on the edges of one that is not cut.
  bool has_straight_corners(Index i) const {
    const auto c = mesh_.corners(i);
    return c.size() > 4 && polygon::is_planar(polygon::Plane(mesh_.vertices(), c), mesh_.vertices(), c);
  }

  // A patch that is a facet of its own; where it is not planar, every triangle has its own plane.
  std::vector<Facet::Piece> whole(Index i) const {
    const auto c = mesh_.corners(i);
    const polygon::Plane plane(mesh_.vertices(), c);
    if (c.size() > 3 && polygon::is_planar(plane, mesh_.vertices(), c)) {
      if (polygon::is_convex(polygon::project(plane, mesh_.vertices(), c), -tolerance::kStraight)) {
        Facet::Piece piece{{}, mesh_.normal(i)};
        for (const Index v : c) piece.corners.push_back(mesh_.vertex(v));
        return {std::move(piece)};
      }
      std::vector<Loop> loops;
      for (const auto& t : mesh_.triangles(i)) loops.push_back({t[0], t[1], t[2]});
      return lift(join_convex(std::move(loops), [&](Index v) { return plane.project(mesh_.vertex(v)); }),
                  mesh_.normal(i), [&](Index v) { return mesh_.vertex(v); });
    }
    std::vector<Facet::Piece> pieces;
    for (const auto& t : mesh_.triangles(i)) {
      const Vec3 &a = mesh_.vertex(t[0]), &b = mesh_.vertex(t[1]), &d = mesh_.vertex(t[2]);
      pieces.push_back({{a, b, d}, c.size() == 3 ? mesh_.normal(i) : (b - a).cross(d - a).normalized()});
    }
    return pieces;
  }

  // Convex pieces of the union of coplanar patches; none where their boundary does not enclose the same area.
  std::vector<Facet::Piece> outline(const std::vector<Index>& group) const {
    double total = 0;
    Vec3 normal = Vec3::Zero();
    for (const Index i : group) {
      total += mesh_.area(i);
      normal += mesh_.area(i) * mesh_.normal(i);
    }
    normal.normalize();
    const Vec3 origin = mesh_.centroid(group[0]);
    const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);

    double deviation = 0;
    for (const Index i : group) deviation = std::max(deviation, faces_[face_of_[i]].deviation);
    std::map<Index, std::vector<Index>> next;  // boundary edges by their start
    for (const Index i : group) {
      for (const Index c : mesh_.corners(i))
        if (std::abs(normal.dot(mesh_.vertex(c) - origin)) > 4 * std::max(slack_, deviation)) return {};
      for (std::size_t s = side_start_[i]; s < side_start_[i + 1]; ++s)
        if (!std::binary_search(group.begin(), group.end(), sides_[s].neighbour))
          next[sides_[s].from].push_back(sides_[s].to);
    }
    const auto flat = [&](Index p) {
      return Vec2(u.dot(mesh_.vertex(p) - origin), v.dot(mesh_.vertex(p) - origin));
    };
    drop_straight(next, flat);

    std::vector<Index> numbers;
    std::vector<Vec2> points;
    std::map<Index, Index> local;
    for (const auto& [from, ends] : next) {
      local[from] = static_cast<Index>(points.size());
      numbers.push_back(from);
      points.push_back(flat(from));
    }
    std::vector<std::array<Index, 2>> boundary;
    for (const auto& [from, ends] : next)
      for (const Index to : ends) {
        if (!local.contains(to)) return {};  // an edge that leads nowhere
        boundary.push_back({local[from], local[to]});
      }
    if (boundary.size() < 3) return {};

    std::vector<Loop> loops;
    if (Loop loop = single_loop(boundary); !loop.empty()) {
      std::vector<Vec2> ring;
      for (const Index p : loop) ring.push_back(points[p]);
      if (polygon::is_convex(ring, -tolerance::kStraight)) loops.push_back(std::move(loop));
    }
    if (loops.empty()) {
      const std::size_t given = points.size();
      PlanarMesh planar = mesh_polygon(points, boundary);
      if (planar.points.size() > given) return {};  // the boundary crosses itself
      for (const auto& t : planar.triangles) loops.push_back({t[0], t[1], t[2]});
      loops = join_convex(std::move(loops), [&](Index p) { return points[p]; });
    }
    double covered = 0;
    for (const Loop& loop : loops)
      for (std::size_t k = 1; k + 1 < loop.size(); ++k)
        covered += cross(points[loop[k]] - points[loop[0]], points[loop[k + 1]] - points[loop[0]]) / 2;
    if (std::abs(covered - total) > tolerance::kPlanarity * total) return {};
    return lift(loops, normal, [&](Index p) { return mesh_.vertex(numbers[p]); });
  }

  // Removes the points at which the boundary goes straight on.
  template <class Flat>
  void drop_straight(std::map<Index, std::vector<Index>>& next, const Flat& flat) const {
    std::map<Index, std::vector<Index>> previous;
    for (const auto& [from, ends] : next)
      for (const Index to : ends) previous[to].push_back(from);
    for (auto it = next.begin(); it != next.end();) {
      const Index p = it->first;
      const auto before = previous.find(p);
      if (it->second.size() == 1 && before != previous.end() && before->second.size() == 1) {
        const Index a = before->second[0], b = it->second[0];
        const Vec2 e = flat(p) - flat(a), f = flat(b) - flat(p);
        if (a != b && e.dot(f) > 0 &&
            std::abs(cross(e, f)) <=
                tolerance::kStraight * e.norm() * f.norm() + rounding_ * (e + f).norm()) {
          std::replace(next[a].begin(), next[a].end(), p, b);
          std::replace(previous[b].begin(), previous[b].end(), p, a);
          it = next.erase(it);
          continue;
        }
      }
      ++it;
    }
  }

  static Loop single_loop(const std::vector<std::array<Index, 2>>& boundary) {
    std::map<Index, Index> next;
    for (const auto& [from, to] : boundary)
      if (!next.try_emplace(from, to).second) return {};
    Loop loop{boundary[0][0]};
    for (Index p = next[loop[0]]; p != loop[0]; p = next[p]) {
      loop.push_back(p);
      if (loop.size() > boundary.size() || !next.contains(p)) return {};
    }
    return loop.size() == boundary.size() ? loop : Loop{};
  }

  // Takes away the edges between two pieces while what comes out is convex.
  template <class Flat>
  static std::vector<Loop> join_convex(std::vector<Loop> loops, const Flat& flat) {
    const auto find = [](const Loop& loop, Index from, Index to) -> std::size_t {
      for (std::size_t k = 0; k < loop.size(); ++k)
        if (loop[k] == from && loop[(k + 1) % loop.size()] == to) return k;
      return loop.size();
    };
    std::map<std::pair<Index, Index>, std::size_t> owner;
    for (std::size_t l = 0; l < loops.size(); ++l)
      for (std::size_t k = 0; k < loops[l].size(); ++k)
        owner[{loops[l][k], loops[l][(k + 1) % loops[l].size()]}] = l;
    std::vector<std::pair<Index, Index>> diagonals;
    for (const auto& [edge, l] : owner)
      if (edge.first < edge.second && owner.contains({edge.second, edge.first})) diagonals.push_back(edge);
    for (const auto& [a, b] : diagonals) {
      const std::size_t l = owner[{a, b}], m = owner[{b, a}];
      if (l == m) continue;
      Loop joined = loops[l], other = loops[m];
      std::rotate(joined.begin(), joined.begin() + static_cast<std::ptrdiff_t>(find(joined, a, b) + 1),
                  joined.end());  // b … a
      std::rotate(other.begin(), other.begin() + static_cast<std::ptrdiff_t>(find(other, b, a) + 1),
                  other.end());  // a … b
      joined.insert(joined.end(), other.begin() + 1, other.end() - 1);
      std::vector<Vec2> ring;
      for (const Index p : joined) ring.push_back(flat(p));
      if (!polygon::is_convex(ring, -tolerance::kStraight)) continue;
      for (std::size_t k = 0; k < other.size(); ++k) owner[{other[k], other[(k + 1) % other.size()]}] = l;
      loops[l] = std::move(joined);
      loops[m].clear();
    }
    std::erase_if(loops, [](const Loop& loop) { return loop.empty(); });
    return loops;
  }

  template <class Position>
  static std::vector<Facet::Piece> lift(const std::vector<Loop>& loops, const Vec3& normal,
                                        const Position& position) {
    std::vector<Facet::Piece> pieces;
    for (const Loop& loop : loops) {
      Facet::Piece piece{{}, normal};
      for (const Index p : loop) piece.corners.push_back(position(p));
      pieces.push_back(std::move(piece));
    }
    return pieces;
  }

  const PatchMesh& mesh_;
  std::vector<Index> position_;
  double rounding_, slack_;  // m
  std::vector<Side> sides_;
  std::vector<std::size_t> side_start_;
  std::vector<Face> faces_;
  std::vector<Index> face_of_;                        // of patches
  std::map<std::pair<Index, Index>, bool> coplanar_;  // of faces
};

}  // namespace

std::vector<Facet> facets(const PatchMesh& mesh) {
  return WallFinder(mesh).find();
}

std::shared_ptr<const std::vector<Facet>> carried_or_found_facets(const PatchMesh& mesh) {
  return mesh.facets() ? mesh.facets() : std::make_shared<const std::vector<Facet>>(facets(mesh));
}

std::shared_ptr<const std::vector<Facet>> with_pieces(std::vector<Facet> facets,
                                                      std::span<const Index> whole_of) {
  std::size_t count = 0;
  for (const Facet& facet : facets) count += facet.patches.size();
  std::vector<std::size_t> facet_of(count);
  for (std::size_t f = 0; f < facets.size(); ++f) {
    for (const Index whole : facets[f].patches) facet_of[whole] = f;
    facets[f].patches.clear();
  }
  for (std::size_t i = 0; i < whole_of.size(); ++i)
    facets[facet_of[whole_of[i]]].patches.push_back(static_cast<Index>(i));
  if (std::any_of(facets.begin(), facets.end(), [](const Facet& facet) { return facet.patches.empty(); }))
    return nullptr;
  return std::make_shared<const std::vector<Facet>>(std::move(facets));
}

}  // namespace radiosity
