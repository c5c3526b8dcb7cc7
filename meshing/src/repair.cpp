// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "surface.hpp"

namespace radiosity {

double Surface::diagonal() const {
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (const Index c : corners) {
    lower = lower.cwiseMin(points[c]);
    upper = upper.cwiseMax(points[c]);
  }
  return (upper - lower).norm();
}

std::string name_faces(const std::vector<Index>& faces) {
  constexpr std::size_t kNamed = 5;
  std::string text = faces.size() == 1 ? "face" : "faces";
  for (std::size_t k = 0; k < std::min(faces.size(), kNamed); ++k)
    text += fmt::format("{} {}", k == 0 ? "" : k + 1 == faces.size() ? " and" : ",", faces[k]);
  if (faces.size() > kNamed) text += fmt::format(" and {} more", faces.size() - kNamed);
  return text;
}

std::string name_materials(const MaterialPairs& pairs, const Scene& scene, std::string_view between) {
  std::vector<std::pair<std::array<Index, 2>, Index>> sorted(pairs.begin(), pairs.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  constexpr std::size_t kNamed = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(sorted.size(), kNamed); ++k) {
    const auto& [a, b] = sorted[k].first;
    text += fmt::format("{}{} of '{}' {} '{}'", k == 0 ? "" : ", ", sorted[k].second,
                        scene.materials()[a].name, between, scene.materials()[b].name);
  }
  if (sorted.size() > kNamed) text += fmt::format(" and {} more combinations", sorted.size() - kNamed);
  return text;
}

namespace {

/// The least of all rotations of the loop.
std::vector<Index> canonical(std::span<const Index> loop) {
  const Index least = *std::min_element(loop.begin(), loop.end());
  std::vector<Index> best;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    if (loop[k] != least) continue;
    std::vector<Index> rotated(loop.begin() + static_cast<std::ptrdiff_t>(k), loop.end());
    rotated.insert(rotated.end(), loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(k));
    if (best.empty() || rotated < best) best = std::move(rotated);
  }
  return best;
}

/// Cuts a loop that goes round several times in the same steps down to one round. Tells whether it did.
bool unwind(std::vector<Index>& loop) {
  const auto n = static_cast<std::ptrdiff_t>(loop.size());
  for (std::ptrdiff_t round = 3; 2 * round <= n; ++round) {
    if (n % round != 0 || !std::equal(loop.begin() + round, loop.end(), loop.begin())) continue;
    loop.resize(static_cast<std::size_t>(round));
    return true;
  }
  return false;
}

struct LoopHash {
  std::size_t operator()(const std::vector<Index>& loop) const {
    std::uint64_t hash = 0x9e3779b97f4a7c15;
    for (const Index v : loop)
      hash = (hash ^ static_cast<std::uint64_t>(v)) * 0xff51afd7ed558ccd + (hash >> 29);
    return static_cast<std::size_t>(hash);
  }
};

struct Neighbour {
  Index polygon;
  bool agrees;  ///< the common edge runs in opposite directions, so the orientations fit
};

/// Two polygons on the same side of their common edge, in one plane, are no neighbours: they cover one another.
bool cover_one_another(const Surface& surface, Index a, Index b) {
  const polygon::Plane p(surface.points, surface.loop(a)), q(surface.points, surface.loop(b));
  return p.n.dot(q.n) > 1 - tolerance::kPlanarity;
}

/// Per polygon, its neighbours over edges that belong to exactly two polygons.
std::vector<std::vector<Neighbour>> neighbours(const Surface& surface) {
  const std::vector<EdgeSide> sides = edge_sides(surface);
  std::vector<std::vector<Neighbour>> result(surface.count());
  for (std::size_t k = 0, next; k < sides.size(); k = next) {
    for (next = k + 1; next < sides.size() && sides[next].key == sides[k].key;) ++next;
    if (next - k != 2 || sides[k].polygon == sides[k + 1].polygon) continue;
    const bool agrees = sides[k].forward != sides[k + 1].forward;
    if (!agrees && cover_one_another(surface, sides[k].polygon, sides[k + 1].polygon)) continue;
    result[sides[k].polygon].push_back({sides[k + 1].polygon, agrees});
    result[sides[k + 1].polygon].push_back({sides[k].polygon, agrees});
  }
  return result;
}

/// Turns faces over so that neighbours agree. Which of the two ways a connected surface faces is decided by
/// the larger area of its faces as given, never by what would look outward.
void orient(Surface& surface, Repairs& repairs, std::vector<std::string>& warnings) {
  const auto adjacent = neighbours(surface);
  constexpr std::uint8_t kUnseen = 0, kAsGiven = 1, kTurned = 2;
  std::vector<std::uint8_t> state(surface.count(), kUnseen);
  std::vector<Index> flipped, one_sided;
  for (Index seed = 0; seed < surface.count(); ++seed) {
    if (state[seed] != kUnseen) continue;
    std::vector<Index> component{seed};
    state[seed] = kAsGiven;
    bool orientable = true;
    double area[2] = {0, 0};
    for (std::size_t k = 0; k < component.size(); ++k) {
      const Index p = component[k];
      area[state[p] == kTurned] += polygon::area_vector(surface.points, surface.loop(p)).norm();
      for (const auto& [other, agrees] : adjacent[p]) {
        const std::uint8_t wanted = agrees == (state[p] == kAsGiven) ? kAsGiven : kTurned;
        if (state[other] == kUnseen) {
          state[other] = wanted;
          component.push_back(other);
        } else if (state[other] != wanted) {
          orientable = false;
        }
      }
    }
    if (!orientable) {
      one_sided.push_back(surface.face[seed]);
      continue;
    }
    // Equal but for rounding: the first face stays.
    const std::uint8_t turn = area[1] > area[0] * (1 + 1e-9) ? kAsGiven : kTurned;
    for (const Index p : component) {
      if (state[p] != turn) continue;
      flipped.push_back(surface.face[p]);
      std::reverse(surface.corners.begin() + surface.start[p] + 1,
                   surface.corners.begin() + surface.start[p + 1]);
    }
  }
  std::sort(flipped.begin(), flipped.end());
  repairs.flipped_faces = static_cast<Index>(flipped.size());
  if (!flipped.empty())
    warnings.push_back(fmt::format(
        "{} {} turned over: {} corners ran against the larger area of the connected surface",
        name_faces(flipped), flipped.size() == 1 ? "was" : "were", flipped.size() == 1 ? "its" : "their"));
  if (!one_sided.empty())
    warnings.push_back(
        fmt::format("the surface connected to {} cannot be given a front (as a Möbius strip cannot); "
                    "its faces stay as they are in the file",
                    name_faces(one_sided)));
}

}  // namespace

Surface repair(const Scene& scene, Repairs& repairs, std::vector<std::string>& warnings) {
  const std::vector<Index> first = first_equal(scene.vertices());
  for (std::size_t v = 0; v < first.size(); ++v) repairs.merged_vertices += at(first[v]) == v ? 0 : 1;
  Surface surface;
  surface.points = scene.vertices();
  std::vector<Index> degenerate, duplicate, unwound, loop;
  MaterialPairs other_material;
  std::unordered_map<std::vector<Index>, Index, LoopHash> seen;
  const auto two_sided = [&](Index f) { return scene.two_sided(f); };
  // A face with two sides is the same either way round.
  const auto earlier = [&](Index f) -> std::optional<Index> {
    if (const auto found = seen.find(canonical(loop)); found != seen.end()) return found->second;
    if (!two_sided(f)) return {};
    const auto found = seen.find(canonical(std::vector<Index>(loop.rbegin(), loop.rend())));
    return found != seen.end() && two_sided(found->second) ? std::optional(found->second) : std::nullopt;
  };
  for (Index f = 0; f < scene.face_count(); ++f) {
    loop.clear();
    for (const Index c : scene.corners(f))
      if (loop.empty() || loop.back() != first[c]) loop.push_back(first[c]);
    while (loop.size() > 1 && loop.back() == loop.front()) loop.pop_back();
    if (unwind(loop)) unwound.push_back(f);
    const auto height = [&] {
      return 2 * polygon::area_vector(surface.points, loop).norm() /
             polygon::longest_edge(surface.points, loop);
    };
    if (loop.size() < 3 || !(height() > polygon::rounding(surface.points, loop))) {
      degenerate.push_back(f);
      continue;
    }
    if (const std::optional<Index> first_face = earlier(f)) {
      duplicate.push_back(f);
      if (scene.material(f) != scene.material(*first_face))
        ++other_material[{scene.material(*first_face), scene.material(f)}];
      continue;
    }
    seen.emplace(canonical(loop), f);
    surface.add(loop, f, scene.material(f));
  }
  repairs.degenerate_faces = static_cast<Index>(degenerate.size());
  repairs.duplicate_faces = static_cast<Index>(duplicate.size());
  repairs.unwound_faces = static_cast<Index>(unwound.size());
  if (surface.count() == 0)
    throw InputError(fmt::format("none of the {} faces has an area beyond the rounding of its coordinates",
                                 scene.face_count()));
  const auto were = [](const std::vector<Index>& faces) { return faces.size() == 1 ? "was" : "were"; };
  if (!degenerate.empty())
    warnings.push_back(fmt::format("{} {} dropped: no area beyond the rounding of the coordinates",
                                   name_faces(degenerate), were(degenerate)));
  if (!duplicate.empty())
    warnings.push_back(fmt::format("{} {} dropped: the same corners in the same order as an earlier face{}",
                                   name_faces(duplicate), were(duplicate),
                                   other_material.empty()
                                       ? ""
                                       : fmt::format(", whose material stays (instead of another: {})",
                                                     name_materials(other_material, scene, "over"))));
  if (!unwound.empty())
    warnings.push_back(fmt::format("{} {} cut down to one round of corners: they went round several times",
                                   name_faces(unwound), were(unwound)));
  orient(surface, repairs, warnings);
  return surface;
}

Surface split_non_planar(const Surface& surface) {
  Surface result;
  result.points = surface.points;
  for (Index p = 0; p < surface.count(); ++p) {
    const auto loop = surface.loop(p);
    if (polygon::is_planar(polygon::Plane(surface.points, loop), surface.points, loop)) {
      result.add(loop, surface.face[p], surface.material[p]);
      continue;
    }
    for (const auto& [a, b, c] : polygon::triangles(surface.points, loop)) {
      const std::array<Index, 3> triangle{loop[a], loop[b], loop[c]};
      if (2 * polygon::area_vector(surface.points, triangle).norm() >
          polygon::longest_edge(surface.points, triangle) * polygon::rounding(surface.points, triangle))
        result.add(triangle, surface.face[p], surface.material[p]);
    }
  }
  return result;
}

}  // namespace radiosity
