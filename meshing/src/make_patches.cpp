// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/make_patches.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "contacts.hpp"
#include "join_near.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/facets.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "subdivide.hpp"
#include "surface.hpp"

namespace radiosity {
namespace {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

Pieces whole_faces(const Surface& surface) {
  Pieces pieces{surface.points, surface.corners, surface.start, {}, {}};
  pieces.polygon.resize(surface.count());
  std::iota(pieces.polygon.begin(), pieces.polygon.end(), 0);
  return pieces;
}

/// For each corner of each piece, the first corner that shares its vertex. Pieces share the vertices of an
/// edge when the surface is smooth over it.
std::vector<Index> shared_corners(const Pieces& pieces, const Surface& surface) {
  DisjointSets same(pieces.corners.size());
  struct Side {
    std::uint64_t key;
    Index piece, corner, next;  ///< the edge runs from corner to next
  };
  std::vector<Side> sides;
  sides.reserve(pieces.corners.size());
  std::vector<Vec3> normals;
  normals.reserve(pieces.polygon.size());
  for (std::size_t p = 0; p < pieces.polygon.size(); ++p) {
    const Index first = pieces.start[p], last = pieces.start[p + 1];
    normals.push_back(
        polygon::area_vector(pieces.points, std::span(pieces.corners).subspan(first, last - first))
            .normalized());
    for (Index c = first; c < last; ++c) {
      const Index next = c + 1 < last ? c + 1 : first;
      sides.push_back({edge_key(pieces.corners[c], pieces.corners[next]), static_cast<Index>(p), c, next});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.key != b.key ? a.key < b.key : a.corner < b.corner;
  });
  for (std::size_t k = 0, next; k < sides.size(); k = next) {
    for (next = k + 1; next < sides.size() && sides[next].key == sides[k].key;) ++next;
    if (next - k != 2) continue;
    const Side &a = sides[k], &b = sides[k + 1];
    const auto material = [&](const Side& side) { return surface.material[pieces.polygon[side.piece]]; };
    const bool opposed = pieces.corners[a.corner] == pieces.corners[b.next];
    if (!opposed || a.piece == b.piece || material(a) != material(b) ||
        normals[a.piece].dot(normals[b.piece]) < tolerance::kSmoothCosine || pieces.creases.contains(a.key))
      continue;
    same.unite(a.corner, b.next);
    same.unite(a.next, b.corner);
  }
  std::vector<Index> first(pieces.corners.size());
  for (std::size_t c = 0; c < first.size(); ++c) first[c] = same.root(static_cast<Index>(c));
  return first;
}

/// Clusters of the fronts of pieces.
struct Joined {
  std::vector<Index> cluster;  // per piece
  Index count = 0;             // with those of backs, which are joined as their fronts are
};

/// wall_area: per polygon, of the facet that it is part of.
Joined join_small(const Pieces& pieces, const Surface& surface, const Scene& scene,
                  std::span<const double> wall_area, double size) {
  constexpr double kSmallWall = 1.0 / 2, kSliver = 1.0 / 16;  // of the square of the size
  std::vector<Joinable> items;
  items.reserve(pieces.polygon.size());
  for (std::size_t p = 0; p < pieces.polygon.size(); ++p) {
    const auto first = at(pieces.start[p]), count = at(pieces.start[p + 1]) - first;
    const auto corners = std::span(pieces.corners).subspan(first, count);
    const Index polygon = pieces.polygon[p];
    Joinable& item = items.emplace_back();
    item.centroid = Vec3::Zero();
    for (const Index c : corners) {
      item.box.extend(pieces.points[c]);
      item.centroid += pieces.points[c] / static_cast<double>(count);
    }
    const Vec3 area_vector = polygon::area_vector(pieces.points, corners);
    item.area = area_vector.norm();
    item.normal = area_vector / item.area;
    const double square = size * size;
    const bool small = std::isfinite(size) &&
                       (wall_area[at(polygon)] <= kSmallWall * square || item.area <= kSliver * square);
    item.kind = small ? 2 * surface.material[polygon] + (scene.two_sided(surface.face[polygon]) ? 1 : 0) : -1;
  }
  Joined out{join_near(items, size)};
  std::vector<std::uint8_t> seen(pieces.polygon.size(), 0);
  for (std::size_t p = 0; p < pieces.polygon.size(); ++p)
    if (std::exchange(seen[at(out.cluster[p])], 1) == 0)
      out.count += scene.two_sided(surface.face[pieces.polygon[p]]) ? 2 : 1;
  return out;
}

/// Which patch of a mesh of whole polygons a piece, or its back, belongs to: fronts are numbered as the polygons, then backs.
struct Whole {
  std::vector<Index> back;  // per polygon; −1: it has none
  Index of(Index polygon, bool of_back) const { return of_back ? back[polygon] : polygon; }
};

Whole number_wholes(const Surface& surface, const Scene& scene) {
  Whole out;
  Index next = surface.count();
  for (Index p = 0; p < surface.count(); ++p)
    out.back.push_back(scene.two_sided(surface.face[p]) ? next++ : -1);
  return out;
}

/// `of_wholes` are facets of the mesh of whole polygons; null: they are not known. `cluster`: of pieces; none where it is empty.
PatchMesh to_mesh(const Pieces& pieces, const Surface& surface, const Scene& scene,
                  const std::vector<Facet>* of_wholes = nullptr, std::span<const Index> cluster = {}) {
  const std::vector<Index> shared = shared_corners(pieces, surface);
  PatchMesh::Arrays arrays;
  std::vector<Index> whole_of;  // patches
  const Whole wholes = number_wholes(surface, scene);
  arrays.materials = scene.materials();
  arrays.symmetry = scene.symmetry();
  // Vertices are numbered in the order of their first use.
  const auto add_patches = [&](bool back) {
    std::vector<Index> vertex_of(pieces.corners.size(), -1);
    for (std::size_t p = 0; p < pieces.polygon.size(); ++p) {
      const Index polygon = pieces.polygon[p], material = surface.material[polygon];
      if (back && !scene.two_sided(surface.face[polygon])) continue;
      const Index first = pieces.start[p], n = pieces.start[p + 1] - first;
      for (Index k = 0; k < n; ++k) {
        const Index corner = first + (back ? (n - k) % n : k);
        Index& vertex = vertex_of[shared[corner]];
        if (vertex < 0) {
          vertex = static_cast<Index>(arrays.vertices.size());
          arrays.vertices.push_back(pieces.points[pieces.corners[corner]]);
        }
        arrays.corners.push_back(vertex);
      }
      arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
      arrays.patch_surface.push_back(surface.face[polygon]);
      arrays.patch_material.push_back(material);
      whole_of.push_back(wholes.of(polygon, back));
      if (!cluster.empty()) arrays.patch_cluster.push_back(2 * cluster[p] + (back ? 1 : 0));
    }
  };
  add_patches(false);
  add_patches(true);
  if (of_wholes != nullptr) arrays.facets = with_pieces(*of_wholes, whole_of);
  return PatchMesh(std::move(arrays));
}

/// Edges of one-sided faces that no other face shares, that do not lie on another face, and where no image of the scene begins.
Index open_edges(const Surface& surface, const Contacts& contacts, const Scene& scene) {
  std::vector<std::pair<std::uint64_t, Index>> sides;
  for (Index p = 0; p < surface.count(); ++p) {
    const auto loop = surface.loop(p);
    for (std::size_t k = 0; k < loop.size(); ++k)
      sides.emplace_back(edge_key(loop[k], loop[(k + 1) % loop.size()]), p);
  }
  std::sort(sides.begin(), sides.end());
  Index open = 0;
  for (std::size_t k = 0, next; k < sides.size(); k = next) {
    const std::uint64_t key = sides[k].first;
    for (next = k + 1; next < sides.size() && sides[next].first == key;) ++next;
    if (next - k != 1 || scene.two_sided(surface.face[sides[k].second])) continue;
    const Vec3 &a = surface.points[key >> 32], &b = surface.points[key & 0xffffffffU];
    if (goes_on(scene.symmetry(), a, b, scene.lower(), scene.upper(), contacts.distance)) continue;
    const double length = (a - b).norm();
    const auto covered = contacts.covered.find(key);
    if (covered == contacts.covered.end() || covered->second < length * (1 - 1e-3) - 2 * contacts.distance)
      ++open;
  }
  return open;
}

void warn_of_odd_facts(const Surface& surface, const Contacts& contacts, const Scene& scene,
                       std::vector<std::string>& warnings) {
  constexpr std::size_t kNamed = 3;
  if (!contacts.coincident.empty()) {
    std::string pairs;
    for (std::size_t k = 0; k < std::min(kNamed, contacts.coincident.size()); ++k)
      pairs += fmt::format("{}faces {} and {}", k == 0 ? "" : ", ", contacts.coincident[k][0],
                           contacts.coincident[k][1]);
    if (contacts.coincident.size() > kNamed)
      pairs += fmt::format(" and {} more pairs", contacts.coincident.size() - kNamed);
    MaterialPairs materials;
    for (const auto& [a, b] : contacts.coincident) {
      const auto [low, high] = std::minmax({scene.material(a), scene.material(b)});
      ++materials[{low, high}];
    }
    warnings.push_back(fmt::format(
        "{} coincide ({}): where they lie face to face they see nothing; where they face the same way, "
        "which of them light meets is not defined",
        pairs, name_materials(materials, scene, "and")));
  }
  if (const Index open = open_edges(surface, contacts, scene); open > 0)
    warnings.push_back(fmt::format("the surface is open: {} {} to one face only, so light may leave there",
                                   open, open == 1 ? "edge belongs" : "edges belong"));
}

bool is_triangle_or_convex_quad(const Surface& surface, Index polygon) {
  const auto loop = surface.loop(polygon);
  if (loop.size() != 4) return loop.size() == 3;
  return polygon::is_convex(surface.points, loop, tolerance::kPlanarity);
}

/// Lamps that reflect nothing: B = E wherever they are cut, so that only form factors ask for small pieces.
std::vector<std::uint8_t> known_radiosity(const Surface& surface, const Scene& scene) {
  std::vector<std::uint8_t> out;
  for (const Index m : surface.material) {
    const Material& material = scene.materials()[m];
    out.push_back((material.emission > 0).any() && (material.reflectance == 0).all() ? 1 : 0);
  }
  return out;
}

/// Drops the faces that lie wholly in others of the same material that face the same way; of two that lie in each other the later
/// one. Returns their numbers.
std::vector<Index> drop_contained(Surface& faces, Surface& polygons, const Contacts& contacts) {
  std::vector<std::uint8_t> gone(polygons.count());
  for (const auto& [inner, outer] : contacts.contained)
    if (gone[outer] == 0) gone[inner] = 1;
  // A face stays as long as one of its polygons does.
  std::unordered_set<Index> staying;
  for (Index p = 0; p < polygons.count(); ++p)
    if (gone[p] == 0) staying.insert(polygons.face[p]);
  const auto without = [&](const Surface& surface) {
    Surface left;
    left.points = surface.points;
    for (Index p = 0; p < surface.count(); ++p)
      if (staying.contains(surface.face[p])) left.add(surface.loop(p), surface.face[p], surface.material[p]);
    return left;
  };
  std::vector<Index> dropped;
  for (const Index f : faces.face)
    if (!staying.contains(f)) dropped.push_back(f);
  if (dropped.empty()) return dropped;
  faces = without(faces);
  polygons = without(polygons);
  return dropped;
}

struct Sized {
  Pieces pieces;
  double size;
  Joined joined = {};
};

/// Per polygon, the area of the facet that it is part of, m².
std::vector<double> wall_areas(const PatchMesh& wholes, const std::vector<Facet>& walls) {
  std::vector<double> out(at(wholes.patch_count()), 0);
  for (const Facet& wall : walls) {
    double area = 0;
    for (const Index polygon : wall.patches) area += wholes.area(polygon);
    for (const Index polygon : wall.patches) out[at(polygon)] = area;
  }
  return out;
}

/// The size whose number of clusters comes closest to the target.
Sized fit(const Subdivision& subdivision, const Surface& surface, const Scene& scene,
          std::span<const double> wall_area, Index target) {
  if (target < 1) throw InputError(fmt::format("patches: a target of {} patches is not at least 1", target));
  const auto off = [&](const Joined& joined) { return std::log(static_cast<double>(joined.count) / target); };
  double area = 0;
  for (Index p = 0; p < surface.count(); ++p)
    area += polygon::area_vector(surface.points, surface.loop(p)).norm() *
            (scene.two_sided(surface.face[p]) ? 2 : 1);
  double size = std::sqrt(area / target);
  // Long and narrow faces have more patches along their edges than their area asks for.
  constexpr double kFarOff = 8;
  while (subdivision.expected(size) > kFarOff * std::max<double>(target, surface.count()) &&
         std::isfinite(size))
    size *= 2;
  constexpr int kRounds = 6;
  std::optional<Sized> best;
  for (int round = 0; round < kRounds && (!best || std::abs(off(best->joined)) > 0.05); ++round) {
    Pieces pieces = subdivision.pieces(size);
    Joined joined = join_small(pieces, surface, scene, wall_area, size);
    const double here = off(joined);
    const double next = size * std::exp(here / 2);
    if (!best || std::abs(here) < std::abs(off(best->joined)))
      best = {std::move(pieces), size, std::move(joined)};
    size = next;
  }
  return *std::move(best);
}

}  // namespace

Patches make_patches(const Scene& scene, const PatchOptions& options) {
  if (const auto* wanted = std::get_if<PatchSize>(&options); wanted && !(wanted->metres > 0))
    throw InputError(fmt::format("patches: size {} m is not positive", wanted->metres));
  Repairs repairs;
  std::vector<std::string> warnings;
  Surface faces = repair(scene, repairs, warnings);
  Surface polygons = split_non_planar(faces);
  const double contact = tolerance::kContact * polygons.diagonal();
  Contacts contacts = find_contacts(polygons, contact);
  if (const std::vector<Index> dropped = drop_contained(faces, polygons, contacts); !dropped.empty()) {
    repairs.duplicate_faces += static_cast<Index>(dropped.size());
    warnings.push_back(
        fmt::format("{} {} dropped: within another face of the same material that faces the same way",
                    name_faces(dropped), dropped.size() == 1 ? "was" : "were"));
    contacts = find_contacts(polygons, contact);
  }
  warn_of_odd_facts(faces, contacts, scene, warnings);
  if (std::holds_alternative<KeepFaces>(options)) {
    PatchMesh mesh = to_mesh(whole_faces(faces), faces, scene);
    return {std::move(mesh), repairs, std::move(warnings), 0};
  }

  repairs.split_edges =
      static_cast<Index>(std::count_if(contacts.partly_shared.begin(), contacts.partly_shared.end(),
                                       [&](std::uint64_t edge) { return contacts.splits.contains(edge); }));
  const Subdivision subdivision(polygons, contacts, known_radiosity(polygons, scene));
  bool cut_seen = false;
  for (Index p = 0; p < polygons.count(); ++p) {
    // Pieces of one face follow one another; a face counts with its first (cut) piece.
    const Index face = polygons.face[p];
    const bool first = p == 0 || polygons.face[p - 1] != face;
    if (first) cut_seen = false;
    if (subdivision.is_cut(p) && !cut_seen) {
      ++repairs.cut_faces;
      cut_seen = true;
    }
    if (!first) continue;
    const bool split = p + 1 < polygons.count() && polygons.face[p + 1] == face;
    repairs.non_planar_faces += split ? 1 : 0;
    repairs.triangulated_faces += split || !is_triangle_or_convex_quad(polygons, p) ? 1 : 0;
  }
  // What hides and is hidden: the polygons before they are cut.
  const PatchMesh wholes = to_mesh(subdivision.outlines(), polygons, scene);
  const std::vector<Facet> walls = facets(wholes);
  const std::vector<double> wall_area = wall_areas(wholes, walls);
  const Sized sized =
      std::visit(Overloaded{[&](const AutoPatches& wanted) {
                              return fit(subdivision, polygons, scene, wall_area, wanted.target);
                            },
                            [&](const PatchSize& wanted) {
                              Pieces pieces = subdivision.pieces(wanted.metres);
                              Joined joined = join_small(pieces, polygons, scene, wall_area, wanted.metres);
                              return Sized{std::move(pieces), wanted.metres, std::move(joined)};
                            },
                            [&](const KeepFaces&) -> Sized { return {}; }},
                 options);
  return {to_mesh(sized.pieces, polygons, scene, &walls, sized.joined.cluster), repairs, std::move(warnings),
          std::isfinite(sized.size) ? sized.size : 0};
}

}  // namespace radiosity
