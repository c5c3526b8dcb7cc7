// SPDX-License-Identifier: GPL-3.0-or-later
#include "pairwise.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <map>
#include <utility>

#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr double kFewAnswers = 32;  // rays or cells: errors of 1/√32 = 18 %

std::size_t most_of_a_kind(Index patches) {
  constexpr std::size_t kMostPairs = 50'000'000;
  const auto n = static_cast<std::size_t>(std::max<Index>(patches, 1));
  return std::max<std::size_t>(32, std::min(n / 20, kMostPairs / n));
}

std::vector<Index> lamps_of(const PatchMesh& mesh) {
  std::vector<Index> lamps;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if ((mesh.material_of(i).emission > 0).any()) lamps.push_back(i);
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

// Patches i and j that face each other, one of them nowhere higher over the other's plane than kNearPlane · diagonal, and not
// beside it either. (Where the normals do not oppose, such pairs exchange next to nothing.)
std::vector<Index> near_patches(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  const Vec3 centre = (mesh.lower() + mesh.upper()) / 2;
  const double near = tolerance::kNearPlane * mesh.diagonal();
  const double rounding = tolerance::kOnPlane * mesh.diagonal();
  const std::vector<PatchGroup> groups = patch_groups(mesh, visibility.facets(), centre);
  std::vector<std::uint8_t> found(mesh.patch_count(), 0);
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
  const auto mark = [&](const PatchGroup& over, const PatchGroup& under) {
    for (const Index j : over.patches) {
      const Heights h = heights(corners_of(j), under.normal, under.offset);
      if (h.high <= rounding || h.high > near || visibility.covered(j)) continue;
      Eigen::AlignedBox3d box = box_of(j);
      box.min().array() -= near;
      box.max().array() += near;
      for (const Index i : under.patches) {
        if (visibility.covered(i) || !box.intersects(box_of(i))) continue;
        if (heights(corners_of(i), over.normal, over.offset).high <= rounding) continue;
        for (const Index k : {i, j}) std::atomic_ref(found[k]).store(1, std::memory_order_relaxed);
      }
    }
  };
  const auto compare = [&](const PatchGroup& a, const PatchGroup& b) {
    const Heights of_b = heights(b.corners, a.normal, a.offset);
    const Heights of_a = heights(a.corners, b.normal, b.offset);
    if (of_a.high <= rounding || of_b.high <= rounding) return;
    if (of_b.low <= near) mark(b, a);
    if (of_a.low <= near) mark(a, b);
  };
  const std::vector<std::pair<std::size_t, std::size_t>> pairs = opposed_neighbours(groups, near);
  tbb::parallel_for(std::size_t{0}, pairs.size(),
                    [&](std::size_t k) { compare(groups[pairs[k].first], groups[pairs[k].second]); });
  std::vector<Index> out;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (found[i] != 0) out.push_back(i);
  return out;
}

// Lamps, patches of one surface together, that are too small for the directions to tell. By reciprocity the area mean over i of
// Σ_{j in L} F_ij is at most A_L / ΣA, and that of what one patch of L sends to a patch of mean area 1/n; with 1/direction_share directions from
// every patch and m patches in L, what a typical patch receives from L rests on some
//   (A_L / ΣA + m / n) / direction_share
// of them.
struct FaintLamps {
  std::size_t lamps = 0, faint = 0;
};
FaintLamps faint_lamps(const PatchMesh& mesh, const std::vector<Index>& lamps, double direction_share) {
  const double total = mesh.areas().sum();
  std::map<Index, double> share;  // of surfaces that emit
  for (const Index i : lamps) share[mesh.surface(i)] += mesh.area(i) / total + 1.0 / mesh.patch_count();
  FaintLamps out{share.size(), 0};
  for (const auto& [surface, s] : share) out.faint += s < kFewAnswers * direction_share ? 1 : 0;
  return out;
}

std::vector<Index> united(const std::vector<Index>& a, const std::vector<Index>& b) {
  std::vector<Index> out;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
  return out;
}

}  // namespace

bool hardly_answered(const FormFactorMethod& method, double row_sum) {
  const std::optional<double> share = method.direction_share();
  return share && row_sum < kFewAnswers * *share;
}

std::vector<Index> pairwise_in_advance(const Visibility& visibility) {
  const std::size_t most = most_of_a_kind(visibility.mesh().patch_count());
  std::vector<Index> lamps = lamps_of(visibility.mesh());
  std::vector<Index> near = near_patches(visibility);
  if (lamps.size() > most) lamps.clear();
  if (near.size() > most) near.clear();
  return united(lamps, near);
}

PairwisePatches pairwise_patches(const FormFactorMethod& method, const Visibility& visibility,
                                 std::span<const double> row_sums) {
  const PatchMesh& mesh = visibility.mesh();
  const std::size_t most = most_of_a_kind(mesh.patch_count());
  const double pairs =
      0.5 * static_cast<double>(mesh.patch_count()) * static_cast<double>(mesh.patch_count() - 1);
  const std::string analytic = fmt::format("method analytic (all {:.2g} pairs)", pairs);
  PairwisePatches out;
  const auto make_factors = [&] {
    if (!out.factors) out.factors = std::make_unique<PairFactors>(visibility, kPairwiseSamples, 1);
  };

  std::vector<Index> lamps = lamps_of(mesh);
  if (lamps.size() > most) {
    const FaintLamps found = faint_lamps(mesh, lamps, method.direction_share().value_or(0));
    if (found.faint > 0)
      out.warnings.push_back(
          fmt::format("{} of {} surfaces that emit are so small that what single patches receive from them "
                      "is noise (18 % and "
                      "more), and their patches are too many to be computed pair by pair ({} of {}, at most "
                      "{}); more samples, "
                      "fewer patches on lamps or {} tell them",
                      found.faint, found.lamps, lamps.size(), mesh.patch_count(), most, analytic));
    lamps.clear();
  }
  out.lamps = static_cast<Index>(lamps.size());

  std::vector<Index> near = near_patches(visibility);
  if (near.size() > most) {
    out.warnings.push_back(
        fmt::format("{} patches lie nearer than {:.2g} m in front of others, where rays and cells start on "
                    "the wrong side; their "
                    "factors are wrong, and they are too many to be computed pair by pair; {} tells them",
                    near.size(), tolerance::kNearPlane * mesh.diagonal(), analytic));
    out.unreliable = static_cast<Index>(near.size());
    near.clear();
  }

  std::vector<Index> unanswered;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const double sum = row_sums[i];
    if (!hardly_answered(method, sum) || visibility.covered(i)) continue;
    make_factors();
    if (sum > 0 || out.factors->may_see_any(i)) unanswered.push_back(i);
  }
  // Many that no direction finds anything from are what lies outside of an open scene; they are counted as isolated.
  if (unanswered.size() > most) std::erase_if(unanswered, [&](Index i) { return row_sums[i] == 0; });
  if (unanswered.size() > most) {
    out.warnings.push_back(
        fmt::format("{} patches see so little that their factors are noise, and they are too many to be "
                    "computed pair by pair; "
                    "more samples or {} tell them",
                    unanswered.size(), analytic));
    unanswered.clear();
  }
  out.misjudged = united(near, unanswered);
  out.patches = united(lamps, out.misjudged);
  if (!out.patches.empty()) make_factors();
  return out;
}

}  // namespace radiosity
