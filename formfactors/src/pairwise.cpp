// SPDX-License-Identifier: GPL-3.0-or-later
#include "pairwise.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "methods.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr double kFewAnswers = 32;  // rays or cells: errors of 1/√32 = 18 %

constexpr double kMostPairs = 5e7;
constexpr double kMostByRays =
    2e6;  // of patches that are no lamps, where shadow rays tell what is seen; of many lamps

std::size_t most_of_a_kind(const PatchMesh& mesh) {
  return static_cast<std::size_t>(std::max(32, mesh.cluster_count() / 20));
}
bool too_many_pairs(const PatchMesh& mesh, std::span<const Index> members, double most_pairs) {
  return members.size() > 32 &&
         static_cast<double>(members.size()) * static_cast<double>(mesh.patch_count()) > most_pairs;
}
bool too_many(const PatchMesh& mesh, std::span<const Index> clusters, double most_pairs) {
  return clusters.size() > most_of_a_kind(mesh) ||
         too_many_pairs(mesh, members_of(mesh, clusters), most_pairs);
}
// Of lamps those pairs count that are not known to be hidden from each other. Where a large share of the patches shines directions find
// it, and pairs pay only while they are few.
bool too_many_lamps(const Visibility& visibility, std::span<const Index> lamps) {
  const PatchMesh& mesh = visibility.mesh();
  const std::vector<Index> members = members_of(mesh, lamps);
  constexpr Index kSomeOf = 4;
  const std::size_t most = too_many_pairs(mesh, members, kMostByRays)
                               ? most_of_a_kind(mesh)
                               : static_cast<std::size_t>(std::max(32, mesh.cluster_count() / kSomeOf));
  if (lamps.size() > most) return true;
  return too_many_pairs(mesh, members, kMostPairs) &&
         PairFactors(visibility, pairwise_samples(visibility), 1, kFactorTolerance, members)
                 .near_pairs(members) > kMostPairs;
}
bool by_rays(const Visibility& visibility) {
  std::size_t polygons = 0;
  for (const Facet& facet : visibility.facets()) polygons += facet.pieces.size();
  return polygons > Occluders::kMost;
}
// For patches that are no lamps.
double most_pairs(const Visibility& visibility) {
  return by_rays(visibility) ? kMostByRays : kMostPairs;
}

std::vector<Index> lamps_of(const PatchMesh& mesh) {
  std::vector<Index> lamps;
  for (Index c = 0; c < mesh.cluster_count(); ++c)
    if ((mesh.material_of(mesh.members(c)[0]).emission > 0).any()) lamps.push_back(c);
  return lamps;
}

// Of corners over a plane.
struct Heights {
  double low, high;
};
Heights heights(const std::vector<Vec3>& corners, const Vec3& normal, double offset) {
  Heights h{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Vec3& c : corners) {
    const double height = normal.dot(c) - offset;
    h.low = std::min(h.low, height);
    h.high = std::max(h.high, height);
  }
  return h;
}

// Groups whose normals oppose and whose boxes are not further apart than `near` along any axis.
std::vector<std::pair<std::size_t, std::size_t>> opposed_neighbours(const std::vector<PatchGroup>& groups,
                                                                    double near) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const PatchGroup& group : groups) {
    Eigen::AlignedBox3d box;
    for (const Vec3& c : group.corners) box.extend(c);
    box.min().array() -= near / 2;
    box.max().array() += near / 2;
    boxes.push_back(box);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for_each_pair_that_meets(boxes, [&](std::size_t a, std::size_t b) {
    if (groups[a].normal.dot(groups[b].normal) < 0) pairs.emplace_back(a, b);
  });
  return pairs;
}

// Area of what patch i and patch j have in common, seen along the normal of i, m².
double common_area(const PatchMesh& mesh, Index i, Index j) {
  const Vec3& n = mesh.normal(i);
  double area = 0;
  for (const auto& a : mesh.triangles(i))
    for (const auto& b : mesh.triangles(j)) {
      std::vector<Vec3> part{mesh.vertex(b[0]), mesh.vertex(b[1]), mesh.vertex(b[2])};
      for (std::size_t k = 0; k < 3 && !part.empty(); ++k) {
        const Vec3& corner = mesh.vertex(a[k]);
        part = polygon::clip(part, n.cross(mesh.vertex(a[(k + 1) % 3]) - corner), corner);
      }
      for (std::size_t k = 1; k + 1 < part.size(); ++k)
        area += std::abs(n.dot((part[k] - part[0]).cross(part[k + 1] - part[0]))) / 2;
    }
  return area;
}

// Of patches i and j that face each other, one of them nowhere higher over the other's plane than kNearPlane · diagonal: how much of
// each the other ones take, as a share, at most 1. (Where the normals do not oppose, such pairs exchange next to nothing.)
Eigen::ArrayXd near_shares(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  const Vec3 centre = (mesh.lower() + mesh.upper()) / 2;
  const double near = tolerance::kNearPlane * mesh.diagonal();
  const double rounding = tolerance::kOnPlane * mesh.diagonal();
  const std::vector<PatchGroup> groups = patch_groups(mesh, visibility.facets(), centre);
  const auto corners_of = [&](Index i) {
    std::vector<Vec3> corners;
    for (const Index v : mesh.corners(i)) corners.push_back(mesh.vertex(v) - centre);
    return corners;
  };
  const auto box_of = [&](Index i) {
    Eigen::AlignedBox3d box;
    for (const Index v : mesh.corners(i)) box.extend(mesh.vertex(v) - centre);
    return box;
  };
  // Patches of `over` that are low over the plane of `under`, with those of `under` that they touch.
  struct Common {
    Index patch, other;
    double area;  // m²
  };
  using Touched = std::vector<Common>;
  const auto mark = [&](const PatchGroup& over, const PatchGroup& under, Touched& touched) {
    for (const Index j : over.patches) {
      const Heights h = heights(corners_of(j), under.normal, under.offset);
      if (h.high <= rounding || h.high > near || visibility.covered(j)) continue;
      Eigen::AlignedBox3d box = box_of(j);
      box.min().array() -= near;
      box.max().array() += near;
      for (const Index i : under.patches) {
        if (visibility.covered(i) || !box.intersects(box_of(i))) continue;
        if (heights(corners_of(i), over.normal, over.offset).high <= rounding) continue;
        const double area = common_area(mesh, i, j);
        touched.push_back({i, j, area});
        touched.push_back({j, i, area});
      }
    }
  };
  const auto compare = [&](const PatchGroup& a, const PatchGroup& b, Touched& touched) {
    const Heights of_b = heights(b.corners, a.normal, a.offset);
    const Heights of_a = heights(a.corners, b.normal, b.offset);
    if (of_a.high <= rounding || of_b.high <= rounding) return;
    if (of_b.low <= near) mark(b, a, touched);
    if (of_a.low <= near) mark(a, b, touched);
    // Each pair once, whichever of the two was found to be low over the other.
    const auto pair = [](const Common& c) { return std::pair(c.patch, c.other); };
    std::ranges::sort(touched, {}, pair);
    const auto repeated = std::ranges::unique(touched, {}, pair);
    touched.erase(repeated.begin(), repeated.end());
  };
  const std::vector<std::pair<std::size_t, std::size_t>> pairs = opposed_neighbours(groups, near);
  std::vector<Touched> touched(pairs.size());
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t k) {
    compare(groups[pairs[k].first], groups[pairs[k].second], touched[k]);
  });
  Eigen::ArrayXd area = Eigen::ArrayXd::Zero(mesh.patch_count());
  for (const Touched& list : touched)
    for (const Common& common : list) area[common.patch] += common.area;
  return (area / mesh.areas()).min(1.0);
}

// A sliver that lies on a wall does not make it a near one.
constexpr double kNearShare = 0.01;

// Of clusters with at least one near patch: how much of them is near another patch, as a share of their area.
std::vector<std::pair<Index, double>> near_clusters(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  const Eigen::ArrayXd near = near_shares(visibility);
  std::vector<std::pair<Index, double>> out;
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    bool any = false;
    double area = 0;
    for (const Index i : mesh.members(c)) {
      any |= near[i] > kNearShare;
      area += near[i] * mesh.area(i);
    }
    if (any) out.emplace_back(c, area / mesh.cluster_areas()[c]);
  }
  return out;
}

std::vector<Index> numbers(const std::vector<std::pair<Index, double>>& clusters) {
  std::vector<Index> out;
  for (const auto& [c, share] : clusters) out.push_back(c);
  return out;
}

// Lamps, clusters of one material together, that are too small for the directions to tell. By reciprocity the area mean over i of
// Σ_{j in L} F_ij is at most A_L / ΣA, and that of what one cluster of L sends to one of mean area 1/n; with 1/direction_share
// directions from every one and m clusters in L, what a typical one receives from L rests on some
//   (A_L / ΣA + m / n) / direction_share
// of them.
struct FaintLamps {
  std::size_t materials = 0, faint = 0;
};
FaintLamps faint_lamps(const PatchMesh& mesh, const std::vector<Index>& lamps, double direction_share) {
  const double total = mesh.cluster_areas().sum();
  std::map<Index, double> share;  // of materials that emit
  for (const Index c : lamps)
    share[mesh.material(mesh.members(c)[0])] += mesh.cluster_areas()[c] / total + 1.0 / mesh.cluster_count();
  FaintLamps out{share.size(), 0};
  for (const auto& [material, s] : share) out.faint += s < kFewAnswers * direction_share ? 1 : 0;
  return out;
}

std::vector<Index> united(const std::vector<Index>& a, const std::vector<Index>& b) {
  std::vector<Index> out;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
  return out;
}

}  // namespace

std::vector<Index> members_of(const PatchMesh& mesh, std::span<const Index> clusters) {
  std::vector<Index> out;
  for (const Index c : clusters) out.insert(out.end(), mesh.members(c).begin(), mesh.members(c).end());
  return out;
}

Index pairwise_samples(const Visibility& visibility) {
  // Sixteen rays miss so many half-shadows that an office is off by 0.8 %; with 32 by 0.4 %, with 64 by a quarter of a percent.
  constexpr Index kPoints = 9, kRays = 32;
  return by_rays(visibility) ? kRays : kPoints;
}

bool hardly_answered(const FormFactorMethod& method, double row_sum) {
  const std::optional<double> share = method.direction_share();
  return share && row_sum < kFewAnswers * *share;
}

std::vector<Index> pairwise_in_advance(const Visibility& visibility) {
  std::vector<Index> lamps = lamps_of(visibility.mesh());
  std::vector<Index> near = numbers(near_clusters(visibility));
  if (too_many_lamps(visibility, lamps)) lamps.clear();
  if (too_many(visibility.mesh(), near, most_pairs(visibility))) near.clear();
  return united(lamps, near);
}

PairwisePatches pairwise_patches(const FormFactorMethod& method, const Visibility& visibility,
                                 std::span<const double> row_sums) {
  const PatchMesh& mesh = visibility.mesh();
  const std::size_t most = most_of_a_kind(mesh);
  const double pairs =
      0.5 * static_cast<double>(mesh.patch_count()) * static_cast<double>(mesh.patch_count() - 1);
  const std::string analytic = fmt::format("method analytic (all {:.2g} pairs)", pairs);
  PairwisePatches out;
  std::vector<Index> lamps = lamps_of(mesh);
  if (too_many_lamps(visibility, lamps)) {
    const FaintLamps found = faint_lamps(mesh, lamps, method.direction_share().value_or(0));
    if (found.faint > 0)
      out.warnings.push_back(fmt::format(
          "the surfaces that emit, of {} of {} materials, are so small that what single patches "
          "receive from them is noise (18 % and more), and their patches are too many to be "
          "computed pair by pair ({} of {}, at most {}); more samples, fewer patches on lamps or {} "
          "tell them",
          found.faint, found.materials, lamps.size(), mesh.cluster_count(), most, analytic));
    lamps.clear();
  }
  out.lamps = static_cast<Index>(lamps.size());

  auto near_shares = near_clusters(visibility);
  std::vector<Index> near = numbers(near_shares);
  if (too_many(mesh, near, most_pairs(visibility))) {
    // What lies against another patch with nearly all of its area sees nothing to speak of but that.
    constexpr double kHidden = 0.9;
    double exchanged = 0, wrong = 0, hidden = 0;
    for (Index c = 0; c < mesh.cluster_count(); ++c) exchanged += mesh.cluster_areas()[c] * row_sums[c];
    for (const auto& [c, share] : near_shares) {
      if (method.leaves_out_faced()) {
        hidden += share * mesh.cluster_areas()[c];
      } else if (share >= kHidden) {
        out.hidden.push_back(c);
        hidden += mesh.cluster_areas()[c];
      } else {
        out.unreliable.emplace_back(c, share);
        wrong += share * mesh.cluster_areas()[c] * row_sums[c];
      }
    }
    constexpr double kLittleExchange = 0.01, kLittleArea = 0.1;
    if (wrong > kLittleExchange * exchanged || hidden > kLittleArea * mesh.cluster_areas().sum())
      out.warnings.push_back(fmt::format(
          "{} patches lie nearer than {:.2g} m in front of others, {:.2g} % of all area, too many to be "
          "computed pair by pair: {}; {} "
          "tells them",
          near.size(), tolerance::kNearPlane * mesh.diagonal(), 100 * hidden / mesh.cluster_areas().sum(),
          method.leaves_out_faced() ? "what is in such gaps counts as seeing nothing"
                                    : fmt::format("{} of them with nearly all of their area count as seeing "
                                                  "nothing, and the factors of the others are "
                                                  "wrong, as cells start on the wrong side",
                                                  out.hidden.size()),
          analytic));
    near.clear();
  }

  std::vector<Index> unanswered;
  for (Index c = 0; c < mesh.cluster_count(); ++c)
    if (hardly_answered(method, row_sums[c]) && !all_covered(visibility, c)) unanswered.push_back(c);
  const std::vector<Index> rows = members_of(mesh, united(united(lamps, near), unanswered));
  if (!rows.empty())
    out.factors =
        std::make_unique<PairFactors>(visibility, pairwise_samples(visibility), 1, kFactorTolerance, rows);
  std::erase_if(unanswered, [&](Index c) {
    const auto members = mesh.members(c);
    return !(row_sums[c] > 0) &&
           std::none_of(members.begin(), members.end(), [&](Index i) { return out.factors->may_see_any(i); });
  });
  // Of many the noise is in the error that is estimated. Those that no direction finds anything from are what lies outside of an
  // open scene; they are counted as isolated.
  if (too_many(mesh, unanswered, most_pairs(visibility)))
    std::erase_if(unanswered, [&](Index i) { return row_sums[i] == 0; });
  if (too_many(mesh, unanswered, most_pairs(visibility))) unanswered.clear();
  out.misjudged = united(near, unanswered);
  out.patches = united(lamps, out.misjudged);
  if (out.patches.empty())
    out.factors.reset();
  else
    out.pairs = out.factors->near_pairs(members_of(mesh, out.patches));
  return out;
}

std::vector<Index> clusters_apart(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  std::vector<Index> out;
  if (!mesh.clustered()) return out;
  const Eigen::ArrayXd near = near_shares(visibility);
  for (Index i = 0; i < mesh.original_count(); ++i)
    out.push_back(4 * mesh.cluster(i) + (visibility.covered(i) ? 2 : 0) + (near[i] > kNearShare ? 1 : 0));
  return out;
}

}  // namespace radiosity
