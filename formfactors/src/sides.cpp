// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/sides.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string_view>

#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/surface_parts.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr int kRaysAlong = 8;
constexpr int kRays = kRaysAlong * kRaysAlong;

/// Directions from all over one side of a patch (1 the front, −1 the back), and what they meet first: visit(k, hit) for k = 0, 1, …
/// until it gives false.
template <class Visit>
void look(const Visibility& visibility, Index from, int side, RandomStream random, const Visit& visit) {
  const PatchMesh& mesh = visibility.mesh();
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
    Visibility::Hit hit = visibility.first_hit(x, disk.u * t + disk.v * b + up * n);
    if (hit.patch == from) hit.patch = Visibility::kNothing;  // a patch that is not quite planar
    if (!visit(static_cast<std::size_t>(k), hit)) return;
  }
}

bool meets_front(const Visibility::Hit& hit) {
  return hit.patch != Visibility::kNothing && hit.front;
}
bool meets_back(const Visibility::Hit& hit) {
  return hit.patch != Visibility::kNothing && !hit.front;
}

/// What 64 directions from the front of a patch meet. Kept apart from the sums, so that threads do not change their bits.
struct Glance {
  Index from = 0;
  std::array<Visibility::Hit, kRays> hits;
  bool sees_nothing() const { return std::none_of(hits.begin(), hits.end(), meets_front); }
};

/// From `count` places that are spread evenly over the weight of the patches, so that all count the same.
std::vector<Glance> glances(const Visibility& visibility, const Eigen::ArrayXd& weights, int count,
                            std::uint64_t seed) {
  std::vector<double> up_to(static_cast<Index>(weights.size()));
  std::partial_sum(weights.begin(), weights.end(), up_to.begin());
  std::vector<Glance> result;
  if (up_to.empty() || !(up_to.back() > 0)) return result;
  result.resize(count);
  tbb::parallel_for(0, count, [&](int k) {
    const double place = (k + 0.5) / count * up_to.back();
    const auto found = std::upper_bound(up_to.begin(), up_to.end() - 1, place);
    Glance& glance = result[k];
    glance.from = static_cast<Index>(found - up_to.begin());
    look(visibility, glance.from, 1, RandomStream(seed, static_cast<std::uint64_t>(k)),
         [&](std::size_t ray, const Visibility::Hit& hit) {
           glance.hits[ray] = hit;
           return true;
         });
  });
  return result;
}

bool emits(const Material& material) {
  return (material.emission > 0).any();
}

/// Shares of the directions that meet backs of materials that do not emit.
std::vector<double> shares_of_backs(const std::vector<Glance>& all, const Visibility& visibility,
                                    bool even_isolated) {
  const PatchMesh& mesh = visibility.mesh();
  std::vector<double> shares(mesh.materials().size(), 0);
  double directions = 0;
  for (const Glance& glance : all) {
    if (visibility.covered(glance.from) || (!even_isolated && glance.sees_nothing())) continue;
    directions += kRays;
    for (const Visibility::Hit& hit : glance.hits)
      if (meets_back(hit) && !emits(mesh.material_of(hit.patch))) shares[mesh.material(hit.patch)] += 1;
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

constexpr double kWorthAWord = 0.01;

/// "'leaf' 5 %, 'wall' 2 %": the largest, and others that are worth a word.
std::string name_shares(const std::vector<double>& shares, const PatchMesh& mesh) {
  constexpr std::size_t kNamed = 5;
  std::vector<std::size_t> order(shares.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
  std::string text;
  for (std::size_t k = 0; k < std::min(kNamed, order.size()); ++k) {
    if (k > 0 && shares[order[k]] <= kWorthAWord) break;
    text += fmt::format("{}'{}' {}", k == 0 ? "" : ", ", mesh.materials()[order[k]].name,
                        percent(shares[order[k]]));
  }
  return text;
}

}  // namespace

SeenSides seen_sides(const Visibility& visibility, std::uint64_t seed) {
  constexpr int kPlaces = 500, kLampPlaces = 200;
  constexpr double kNearlyAll = 0.9;
  const PatchMesh& mesh = visibility.cell();
  SeenSides seen;

  const std::vector<Glance> all = glances(visibility, mesh.areas(), kPlaces, seed);
  const auto isolated =
      std::count_if(all.begin(), all.end(), [](const Glance& from) { return from.sees_nothing(); });
  seen.isolated = static_cast<double>(isolated) / static_cast<double>(all.size());
  seen.backs_of = shares_of_backs(all, visibility, false);
  seen.backs = sum(seen.backs_of);

  // Relative to the largest of both factors: a sum of powers might be more than a double holds.
  const BandArray emission = mesh.emission();
  const double most = emission.maxCoeff() > 0 ? emission.maxCoeff() : 1;
  const Eigen::ArrayXd power = (emission / most).rowwise().sum() * (mesh.areas() / mesh.areas().maxCoeff());
  const std::vector<Glance> lamps = glances(visibility, power, kLampPlaces, seed + 1);
  seen.lamp_backs_of = shares_of_backs(lamps, visibility, true);
  seen.lamp_backs = sum(seen.lamp_backs_of);

  // Lamps that look at backs stand inside: they would look the wrong way if all were turned over.
  seen.look_outwards =
      seen.isolated > kNearlyAll && seen.lamp_backs < 0.5 && outwardness(visibility.mesh()) > 0.5;
  return seen;
}

std::vector<std::string> side_warnings(const SeenSides& seen, const PatchMesh& mesh) {
  if (seen.look_outwards)
    return {fmt::format(
        "the fronts look outwards: {:.0f} % of the area sees no other front; flip = true in a scene file "
        "turns all faces over",
        100 * seen.isolated)};
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
      fmt::format("{} ends on backs, which are black: {}; sides = {} in [materials.NAME] of a scene file "
                  "makes them two-sided",
                  what, name_shares(shares, mesh), decided ? "\"both\"" : "\"both\" or \"auto\"")};
}

namespace {

/// What decides which open parts of the surface get backs.
class FromBehind {
 public:
  /// `open_part`: per face the part, −1 where it may not get a back.
  FromBehind(const Scene& scene, const std::vector<Index>& open_part, Index parts, std::uint64_t seed)
      : mesh_(make_patches(scene, PatchSize{std::numeric_limits<double>::infinity()}).mesh),
        visibility_(mesh_),
        lit_front_(mesh_.patch_count(), 0),
        lit_part_(parts, 0),
        backs_met_(lit_front_.size()),
        met_from_behind_(lit_front_.size()) {
    part_.reserve(lit_front_.size());
    for (Index i = 0; i < mesh_.patch_count(); ++i) part_.push_back(open_part[mesh_.surface(i)]);
    tbb::parallel_for(Index{0}, mesh_.patch_count(), [&](Index i) {
      look_from_front(i, RandomStream(seed, 2 * static_cast<std::uint64_t>(i)));
      if (part_[i] >= 0) look_from_back(i, RandomStream(seed, 2 * static_cast<std::uint64_t>(i) + 1));
    });
  }

  /// Per part whether light reaches its back: from fronts that emit or see other fronts, directly or by such backs. What lies
  /// in the dark, such as the inside of an open tube and the floor under it, lights nothing.
  const std::vector<std::uint8_t>& lit_parts() {
    while (spread()) {
    }
    return lit_part_;
  }

 private:
  Index part_of(const Visibility::Hit& hit) const { return part_[mesh_.original(hit.patch)]; }

  void look_from_front(Index i, RandomStream random) {
    std::vector<Index> backs;
    lit_front_[i] = emits(mesh_.material_of(i)) ? 1 : 0;
    if (lit_front_[i] != 0) return;
    look(visibility_, i, 1, random, [&](std::size_t, const Visibility::Hit& hit) {
      if (meets_back(hit) && part_of(hit) >= 0) backs.push_back(part_of(hit));
      lit_front_[i] = meets_front(hit) ? 1 : 0;
      return !meets_front(hit);
    });
    if (lit_front_[i] == 0) backs_met_[i] = std::move(backs);
  }

  void look_from_back(Index i, RandomStream random) {
    std::vector<Met>& met = met_from_behind_[i];
    look(visibility_, i, -1, random, [&](std::size_t, const Visibility::Hit& hit) {
      if (meets_front(hit)) met.push_back({mesh_.original(hit.patch), -1});
      if (meets_back(hit) && part_of(hit) >= 0) met.push_back({-1, part_of(hit)});
      return true;
    });
  }

  /// Whether light came any further.
  bool spread() {
    constexpr double kMet = 0.01;
    bool further = false;
    for (std::size_t i = 0; i < backs_met_.size(); ++i) {
      if (lit_front_[i] != 0) continue;
      lit_front_[i] = std::any_of(backs_met_[i].begin(), backs_met_[i].end(),
                                  [&](Index part) { return lit_part_[part] != 0; });
      further = further || lit_front_[i] != 0;
    }
    std::vector<double> directions(lit_part_.size(), 0), lit(lit_part_.size(), 0);
    for (Index i = 0; i < mesh_.patch_count(); ++i) {
      const Index part = part_[i];
      if (part < 0 || lit_part_[part] != 0) continue;
      const auto count =
          std::count_if(met_from_behind_[i].begin(), met_from_behind_[i].end(), [&](const Met& what) {
            return what.front >= 0 ? lit_front_[what.front] != 0 : lit_part_[what.part] != 0;
          });
      directions[part] += kRays * mesh_.area(i);
      lit[part] += static_cast<double>(count) * mesh_.area(i);
    }
    for (std::size_t p = 0; p < lit.size(); ++p) {
      if (!(lit[p] > kMet * directions[p])) continue;
      lit_part_[p] = 1;
      further = true;
    }
    return further;
  }

  struct Met {
    Index front;  ///< a patch, or −1:
    Index part;   ///< of the back of a patch
  };
  const PatchMesh mesh_;
  const Visibility visibility_;
  std::vector<Index> part_;  // per patch
  std::vector<std::uint8_t> lit_front_, lit_part_;
  std::vector<std::vector<Index>> backs_met_;  // parts, by fronts that are not lit
  std::vector<std::vector<Met>> met_from_behind_;
};

}  // namespace

bool has_open_sides(const Scene& scene) {
  return std::any_of(scene.materials().begin(), scene.materials().end(),
                     [](const Material& material) { return material.sides == Sides::automatic; });
}

DecidedSides decide_sides(const Scene& scene, std::uint64_t seed) {
  DecidedSides decided{scene};
  const auto automatic = [&](Index f) {
    return scene.materials()[scene.material(f)].sides == Sides::automatic;
  };
  const SurfaceParts surface = surface_parts(scene);
  const auto parts = static_cast<Index>(surface.closed.size());
  std::vector<Index> open_part(scene.face_count(), -1);  // of faces that may get backs
  std::vector<std::uint8_t> asked(surface.closed.size(), 0);
  for (Index f = 0; f < scene.face_count(); ++f) {
    const Index part = surface.part[f];
    if (part < 0 || !automatic(f)) continue;
    asked[part] = 1;
    if (surface.closed[part] == 0) open_part[f] = part;
  }
  for (Index p = 0; p < parts; ++p) decided.solids += asked[p] != 0 && surface.closed[p] != 0 ? 1 : 0;
  if (std::all_of(open_part.begin(), open_part.end(), [](Index part) { return part < 0; })) return decided;

  FromBehind from_behind(scene, open_part, parts, seed);
  const std::vector<std::uint8_t>& lit = from_behind.lit_parts();
  std::vector<std::uint8_t> two_sided(open_part.size());
  for (Index f = 0; f < scene.face_count(); ++f) {
    const bool gets_back = open_part[f] >= 0 && lit[open_part[f]] != 0;
    two_sided[f] = scene.two_sided(f) || gets_back ? 1 : 0;
    if (!gets_back) continue;
    ++decided.faces;
    decided.area += scene.area_vector(f).norm();
  }
  for (Index p = 0; p < parts; ++p)
    if (asked[p] != 0 && surface.closed[p] == 0) ++(lit[p] != 0 ? decided.sheets : decided.unseen_sheets);
  decided.scene = scene.with_two_sided(std::move(two_sided));
  return decided;
}

}  // namespace radiosity
