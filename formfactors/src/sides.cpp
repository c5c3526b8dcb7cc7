// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/sides.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <string_view>

#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/surface_parts.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "sampling.hpp"

namespace radiosity {
namespace {

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

constexpr int kRaysAlong = 8;
constexpr int kRays = kRaysAlong * kRaysAlong;

/// What 64 directions from all over one side of a patch meet first. Kept apart from the sums, so that threads do not change their bits.
struct Glance {
  Index from = 0;
  std::array<Visibility::Hit, kRays> hits;

  int fronts() const {
    return static_cast<int>(std::count_if(hits.begin(), hits.end(), [](const Visibility::Hit& h) {
      return h.patch != Visibility::kNothing && h.front;
    }));
  }
};

/// `side`: 1 the front, −1 the back.
Glance glance(const Visibility& visibility, Index from, int side, RandomStream random) {
  const PatchMesh& mesh = visibility.mesh();
  Glance result;
  result.from = from;
  const PatchSampler patch(mesh, from);
  const Vec3 n = side * mesh.normal(from);
  Vec3 t, b;
  tangents(n, t, b);
  const Vec3 lift = tolerance::kContact * mesh.diagonal() * n;
  const Sample2 shift{random.uniform(), random.uniform()};
  for (int k = 0; k < kRays; ++k) {
    const Sample2 disk = concentric_disk(
        {(k % kRaysAlong + random.uniform()) / kRaysAlong, (k / kRaysAlong + random.uniform()) / kRaysAlong});
    const double up = std::sqrt(std::max(0.0, 1 - disk.u * disk.u - disk.v * disk.v));
    // Places and directions in one order would be correlated: 29 is prime to 64.
    const Vec3 x = patch.at(r2_point(static_cast<std::uint64_t>(k * 29 % kRays), shift)) + lift;
    result.hits[static_cast<std::size_t>(k)] = visibility.first_hit(x, disk.u * t + disk.v * b + up * n);
  }
  return result;
}

/// From `count` places that are spread evenly over the weight of the patches, so that all count the same.
std::vector<Glance> glances(const Visibility& visibility, const Eigen::ArrayXd& weights, int count,
                            std::uint64_t seed) {
  std::vector<double> up_to(at(static_cast<Index>(weights.size())));
  std::partial_sum(weights.begin(), weights.end(), up_to.begin());
  std::vector<Glance> result;
  if (up_to.empty() || !(up_to.back() > 0)) return result;
  result.resize(static_cast<std::size_t>(count));
  tbb::parallel_for(0, count, [&](int k) {
    const double place = (k + 0.5) / count * up_to.back();
    const auto found = std::upper_bound(up_to.begin(), up_to.end() - 1, place);
    result[static_cast<std::size_t>(k)] = glance(visibility, static_cast<Index>(found - up_to.begin()), 1,
                                                 RandomStream(seed, static_cast<std::uint64_t>(k)));
  });
  return result;
}

bool emits(const Material& material) {
  return (material.emission > 0).any();
}

/// Shares of the directions that meet backs of materials that do not emit.
std::vector<double> shares_of_backs(const std::vector<Glance>& all, const PatchMesh& mesh, bool even_blind) {
  std::vector<double> shares(mesh.materials().size(), 0);
  double directions = 0;
  for (const Glance& from : all) {
    if (!even_blind && from.fronts() == 0) continue;
    directions += kRays;
    for (const Visibility::Hit& hit : from.hits)
      if (hit.patch != Visibility::kNothing && !hit.front && hit.patch != from.from &&
          !emits(mesh.material_of(hit.patch)))
        shares[at(mesh.material(hit.patch))] += 1;
  }
  for (double& share : shares) share /= std::max(directions, 1.0);
  return shares;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Σ (x − c)·n A over Σ |(x − c)·n| A, with c the middle of the box round all: 1 where every front looks away from it.
double outwardness(const PatchMesh& mesh) {
  const Vec3 centre = (mesh.lower() + mesh.upper()) / 2;
  double signed_sum = 0, total = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const double volume = (mesh.centroid(i) - centre).dot(mesh.normal(i)) * mesh.area(i);
    signed_sum += volume;
    total += std::abs(volume);
  }
  return total > 1e-6 * mesh.diagonal() * mesh.areas().sum() ? signed_sum / total : 0;
}

std::string percent(double share) {
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

/// "'leaf' 5 %, 'wall' 2 %", the largest first.
std::string name_shares(const std::vector<double>& shares, const PatchMesh& mesh) {
  constexpr std::size_t kNamed = 5;
  constexpr double kNoise = 0.001;
  std::vector<std::size_t> order(shares.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
  std::string text;
  for (std::size_t k = 0; k < std::min(kNamed, order.size()) && shares[order[k]] > kNoise; ++k)
    text += fmt::format("{}'{}' {}", k == 0 ? "" : ", ", mesh.materials()[order[k]].name,
                        percent(shares[order[k]]));
  return text;
}

}  // namespace

SeenSides seen_sides(const Visibility& visibility, std::uint64_t seed) {
  constexpr int kPlaces = 2000, kLampPlaces = 200;
  constexpr double kNearlyAll = 0.9;
  const PatchMesh& mesh = visibility.mesh();
  SeenSides seen;

  const std::vector<Glance> all = glances(visibility, mesh.areas(), kPlaces, seed);
  const auto blind =
      std::count_if(all.begin(), all.end(), [](const Glance& from) { return from.fronts() == 0; });
  seen.blind = static_cast<double>(blind) / static_cast<double>(all.size());
  seen.backs_of = shares_of_backs(all, mesh, false);
  seen.backs = sum(seen.backs_of);

  const Eigen::ArrayXd power = mesh.emission().rowwise().sum() * mesh.areas();
  const std::vector<Glance> lamps = glances(visibility, power, kLampPlaces, seed + 1);
  seen.lamp_backs_of = shares_of_backs(lamps, mesh, true);
  seen.lamp_backs = sum(seen.lamp_backs_of);

  // Lamps that look at backs stand inside: they would look the wrong way if all were turned over.
  seen.look_outwards = seen.blind > kNearlyAll && seen.lamp_backs < 0.5 && outwardness(mesh) > 0.5;
  return seen;
}

std::vector<std::string> side_warnings(const SeenSides& seen, const PatchMesh& mesh) {
  constexpr double kWorthAWord = 0.01;
  if (seen.look_outwards)
    return {fmt::format(
        "the fronts look outwards: {:.0f} % of the area sees no other front; flip = true in a scene file "
        "turns all faces over",
        100 * seen.blind)};
  const auto told = [&](double share, std::string_view of) {
    return share > kWorthAWord ? fmt::format("{} of {}", percent(share), of) : std::string();
  };
  std::string what = told(seen.lamp_backs, "what the lamps emit");
  const std::string rest = told(seen.backs, "what leaves the patches");
  if (what.empty() && rest.empty()) return {};
  what += fmt::format("{}{}", what.empty() || rest.empty() ? "" : " and ", rest);

  std::vector<double> shares = seen.backs_of;
  for (std::size_t m = 0; m < shares.size(); ++m) shares[m] = std::max(shares[m], seen.lamp_backs_of[m]);
  const auto most = static_cast<std::size_t>(std::max_element(shares.begin(), shares.end()) - shares.begin());
  const bool decided = mesh.materials()[most].sides == Sides::automatic;
  return {
      fmt::format("{} ends on backs, which are black: {}; where they should not be, sides = {} in "
                  "[materials.NAME] of a scene file gives them a second side",
                  what, name_shares(shares, mesh), decided ? "\"both\"" : "\"both\" or \"auto\"")};
}

namespace {

/// What the backs of one part of the surface see, weighted by area.
struct SeenFromBehind {
  double directions = 0, fronts = 0;
  std::map<Index, double> backs_of;  ///< by part that may get backs
};

/// `open_part`: per face the part, −1 where it may not get a back.
std::vector<SeenFromBehind> look_from_behind(const Scene& scene, const std::vector<Index>& open_part,
                                             Index parts, std::uint64_t seed) {
  const PatchMesh mesh = make_patches(scene, PatchSize{std::numeric_limits<double>::infinity()}).mesh;
  const Visibility visibility(mesh);
  const auto part_of = [&](Index patch) { return open_part[at(mesh.surface(patch))]; };

  // Per direction the part of the back that it meets, or what else it meets.
  constexpr Index kBlack = -1, kFront = -2;
  std::vector<std::array<Index, kRays>> met(at(mesh.patch_count()));
  tbb::parallel_for(Index{0}, mesh.patch_count(), [&](Index i) {
    if (part_of(i) < 0) return;
    const Glance from = glance(visibility, i, -1, RandomStream(seed, static_cast<std::uint64_t>(i)));
    std::transform(from.hits.begin(), from.hits.end(), met[at(i)].begin(), [&](const Visibility::Hit& hit) {
      if (hit.patch == Visibility::kNothing || hit.patch == i) return kBlack;
      return hit.front ? kFront : part_of(hit.patch);
    });
  });
  std::vector<SeenFromBehind> seen(at(parts));
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (part_of(i) < 0) continue;
    SeenFromBehind& part = seen[at(part_of(i))];
    part.directions += mesh.area(i);
    for (const Index what : met[at(i)])
      if (what != kBlack) (what == kFront ? part.fronts : part.backs_of[what]) += mesh.area(i) / kRays;
  }
  return seen;
}

/// Parts whose backs get light: those that see fronts, then those that see such backs, and so on.
std::vector<std::uint8_t> lit_from_behind(std::vector<SeenFromBehind> seen) {
  constexpr double kMet = 0.01;
  std::vector<std::uint8_t> lit(seen.size(), 0);
  for (bool found = true; found;) {
    found = false;
    for (std::size_t p = 0; p < seen.size(); ++p) {
      if (lit[p] != 0) continue;
      double share = seen[p].fronts;
      for (const auto& [other, backs] : seen[p].backs_of) share += lit[at(other)] != 0 ? backs : 0;
      if (!(share > kMet * seen[p].directions)) continue;
      lit[p] = 1;
      found = true;
    }
  }
  return lit;
}

}  // namespace

DecidedSides decide_sides(const Scene& scene, std::uint64_t seed) {
  DecidedSides decided{scene};
  const auto automatic = [&](Index f) {
    return scene.materials()[at(scene.material(f))].sides == Sides::automatic;
  };
  const SurfaceParts surface = surface_parts(scene);
  const auto parts = static_cast<Index>(surface.closed.size());
  std::vector<Index> open_part(at(scene.face_count()), -1);  // of faces that may get backs
  std::vector<std::uint8_t> asked(surface.closed.size(), 0);
  for (Index f = 0; f < scene.face_count(); ++f) {
    const Index part = surface.part[at(f)];
    if (part < 0 || !automatic(f)) continue;
    asked[at(part)] = 1;
    if (surface.closed[at(part)] == 0) open_part[at(f)] = part;
  }
  for (Index p = 0; p < parts; ++p) decided.solids += asked[at(p)] != 0 && surface.closed[at(p)] != 0 ? 1 : 0;
  if (std::all_of(open_part.begin(), open_part.end(), [](Index part) { return part < 0; })) return decided;

  const std::vector<std::uint8_t> lit = lit_from_behind(look_from_behind(scene, open_part, parts, seed));
  std::vector<std::uint8_t> two_sided(open_part.size());
  for (Index f = 0; f < scene.face_count(); ++f) {
    const bool gets_back = open_part[at(f)] >= 0 && lit[at(open_part[at(f)])] != 0;
    two_sided[at(f)] = scene.two_sided(f) || gets_back ? 1 : 0;
    if (!gets_back) continue;
    ++decided.faces;
    decided.area += scene.area_vector(f).norm();
  }
  for (Index p = 0; p < parts; ++p)
    if (asked[at(p)] != 0 && surface.closed[at(p)] == 0)
      ++(lit[at(p)] != 0 ? decided.sheets : decided.unseen_sheets);
  decided.scene = scene.with_two_sided(std::move(two_sided));
  return decided;
}

}  // namespace radiosity
