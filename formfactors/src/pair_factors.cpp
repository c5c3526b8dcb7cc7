// SPDX-License-Identifier: GPL-3.0-or-later
#include "pair_factors.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

namespace {

// Calls f(x, weight) for points of a convex polygon: a rule on a quad, or on each triangle of a fan. Weights are areas.
template <class F>
void for_each_point(const Polygon& polygon, const PointRules::Rule& rule, F&& f) {
  const auto& c = polygon.corners;
  if (c.size() == 4) {
    const polygon::BilinearQuad quad(c);
    for (const auto [u, v] : rule.square) f(quad.at(u, v), polygon.normal.dot(quad.area_vector(u, v)));
    return;
  }
  for (std::size_t k = 1; k + 1 < c.size(); ++k) {
    const Vec3 e1 = c[k] - c[0];
    const Vec3 e2 = c[k + 1] - c[0];
    const double area = polygon.normal.dot(e1.cross(e2));
    for (const auto [u, v] : rule.triangle) f(c[0] + u * e1 + v * e2, area);
  }
}

thread_local Occluders::Scratch scratch;

Vec3 centre_of(const PatchMesh& mesh) {
  return (mesh.lower() + mesh.upper()) / 2;
}

// Kept near the origin: differences of large coordinates are taken once, here.
std::vector<Polygon> centred_polygons(const PatchMesh& mesh) {
  const Vec3 centre = centre_of(mesh);
  std::vector<Polygon> polygons;
  polygons.reserve(mesh.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    std::vector<Vec3> corners;
    for (const Index v : mesh.corners(i)) corners.push_back(mesh.vertex(v) - centre);
    polygons.emplace_back(std::move(corners), mesh.normal(i));
  }
  return polygons;
}

}  // namespace

PairFactors::PairFactors(const Visibility& visibility, Index samples, std::uint64_t seed, double tolerance,
                         std::span<const Index> rows)
    : visibility_(visibility),
      samples_(samples),
      packets_((samples + 15) / 16),
      seed_(seed),
      tolerance_(tolerance),
      polygons_(centred_polygons(visibility.mesh())),
      groups_(patch_groups(visibility.mesh(), visibility.facets(), centre_of(visibility.mesh()))),
      columns_(polygons_, groups_, tolerance) {
  const PatchMesh& mesh = visibility.mesh();
  for (const Polygon& p : polygons_)
    convex_.push_back(polygon::is_convex(p.corners, p.normal, -tolerance::kGrazed));
  group_of_.resize(polygons_.size());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    for (const Index i : groups_[g].patches) group_of_[i] = static_cast<std::uint32_t>(g);
    any_covered_.push_back(std::any_of(groups_[g].patches.begin(), groups_[g].patches.end(),
                                       [&](Index i) { return visibility.covered(i); }));
  }
  if (visibility.convex()) return;
  occluders_.emplace(mesh, visibility.facets(), groups_, rows, centre_of(mesh));
  if (!occluders_->usable()) occluders_.reset();
  if (occluders_) rules_.emplace(static_cast<std::size_t>(kMostOfSamples * samples_));
}

PairFactors::Weights PairFactors::sight_lines(Index i, Index j, Index first, Index last) const {
  const PatchMesh& mesh = visibility_.mesh();
  RandomStream random(seed_, (static_cast<std::uint64_t>(i) << 32) | static_cast<std::uint64_t>(j));
  const std::array<double, 4> shift{random.uniform(), random.uniform(), random.uniform(), random.uniform()};
  const PatchSampler patch_i(mesh, i);
  const PatchSampler patch_j(mesh, j);
  Weights weights;
  for (Index packet = first; packet < last; ++packet) {
    Visibility::SightLines lines;
    lines.from = i;
    lines.to = j;
    std::array<double, 16> kernel{};
    for (std::uint64_t k = 0; k < 16; ++k) {
      const auto [on_i, on_j] = r4_points(static_cast<std::uint64_t>(packet) * 16 + k, shift);
      const Vec3 x = patch_i.at(on_i);
      const Vec3 y = patch_j.at(on_j);
      const Vec3 r = y - x;
      const double cos_i = mesh.normal(i).dot(r);
      const double cos_j = -mesh.normal(j).dot(r);
      if (cos_i <= 0 || cos_j <= 0) continue;
      const auto lane = static_cast<std::size_t>(lines.count++);
      kernel[lane] = cos_i * cos_j / (r.squaredNorm() * r.squaredNorm());
      const Eigen::Vector3f a = visibility_.scaled(x).cast<float>();
      const Eigen::Vector3f b = visibility_.scaled(y).cast<float>();
      lines.x[lane] = a.x();
      lines.y[lane] = a.y();
      lines.z[lane] = a.z();
      lines.tx[lane] = b.x();
      lines.ty[lane] = b.y();
      lines.tz[lane] = b.z();
    }
    if (lines.count == 0) continue;
    visibility_.blocked(lines);
    rays_.fetch_add(static_cast<std::uint64_t>(lines.count), std::memory_order_relaxed);
    for (int k = 0; k < lines.count; ++k) {
      const auto lane = static_cast<std::size_t>(k);
      weights.all += kernel[lane];
      if (!lines.blocked[lane]) weights.seen += kernel[lane];
    }
  }
  return weights;
}

double PairFactors::visible_by_rays(Index i, Index j) const {
  Weights weights = sight_lines(i, j, 0, packets_);
  if (weights.seen > 0 && weights.seen < weights.all) {
    const Weights more = sight_lines(i, j, packets_, 4 * packets_);
    weights.seen += more.seen;
    weights.all += more.all;
  }
  return weights.all > 0 ? weights.seen / weights.all : 0;
}

std::uint64_t PairCounts::*PairFactors::approach(Index i, std::size_t group) const {
  const Polygon& p = polygons_[i];
  const PatchGroup& g = groups_[group];
  const double height = p.normal.dot(p.centroid);
  const PatchGroup& own = groups_[group_of_[i]];
  const bool behind = g.facet == own.facet || g.facet == visibility_.facets()[own.facet].back ||
                      std::none_of(g.corners.begin(), g.corners.end(),
                                   [&](const Vec3& c) { return p.normal.dot(c) > height; }) ||
                      std::none_of(p.corners.begin(), p.corners.end(),
                                   [&](const Vec3& c) { return g.normal.dot(c) > g.offset; });
  if (behind || visibility_.covered(i)) return &PairCounts::behind;
  if (occluders_ && occluders_->approach(i, p.corners, group, scratch) == Occluders::View::hidden)
    return &PairCounts::hidden;
  return nullptr;
}

void PairFactors::cluster_row(Index cluster, bool upper, std::vector<double>& row) const {
  const PatchMesh& mesh = visibility_.mesh();
  row.assign(mesh.cluster_count(), 0);
  if (!mesh.clustered()) {
    for_each_in_row(cluster, upper, [&](Index j, double mutual) {
      if (const Index to = mesh.original(j); !upper || to >= cluster) row[to] += mutual;
    });
    return;
  }
  for (const Index i : mesh.members(cluster))
    for_each_in_row(i, false, [&](Index j, double mutual) {
      if (const Index to = mesh.cluster(j); !upper || to >= cluster) row[to] += mutual;
    });
}

double PairFactors::near_pairs(std::span<const Index> patches) const {
  constexpr std::size_t kAsked = 64;
  if (patches.empty()) return 0;
  std::vector<double> near(std::min(kAsked, patches.size()), 0);
  tbb::parallel_for(std::size_t{0}, near.size(), [&](std::size_t k) {
    // Lamps are alike, and what faces up must not be asked alone.
    const Index chosen = one_of_stretch(static_cast<Index>(k), static_cast<Index>(near.size()),
                                        static_cast<Index>(patches.size()));
    for (std::size_t group = 0; group < groups_.size(); ++group)
      if (approach(patches[chosen], group) == nullptr)
        near[k] += static_cast<double>(groups_[group].patches.size());
  });
  return std::accumulate(near.begin(), near.end(), 0.0) / static_cast<double>(near.size()) *
         static_cast<double>(patches.size());
}

bool PairFactors::may_see_any(Index i) const {
  for (std::size_t group = 0; group < groups_.size(); ++group)
    if (approach(i, group) == nullptr) return true;
  return false;
}

bool PairFactors::sees_all_of(Index i, std::size_t group) const {
  const Polygon& p = polygons_[i];
  const PatchGroup& g = groups_[group];
  if (any_covered_[group] ||
      !(visibility_.convex() || (occluders_ && occluders_->complete() && scratch.near.empty())))
    return false;
  const double slack = tolerance::kOnPlane * p.radius;
  return std::all_of(g.corners.begin(), g.corners.end(),
                     [&](const Vec3& c) { return p.normal.dot(c - p.centroid) >= -slack; }) &&
         std::all_of(p.corners.begin(), p.corners.end(),
                     [&](const Vec3& c) { return g.normal.dot(c) - g.offset >= -slack; });
}

double PairFactors::near_area(Index i, Index j) const {
  constexpr double kContour = std::numeric_limits<double>::infinity();
  return radiosity::mutual_area(polygons_[std::min(i, j)], polygons_[std::max(i, j)], kContour);
}

double PairFactors::mutual_area(Index i, Index j, double area, Work& work, PairCounts& counts) const {
  // Of patches of one size the first, whatever rounding says.
  if (j < i) std::swap(i, j);
  if (polygons_[j].area < polygons_[i].area * (1 - tolerance::kSameArea)) std::swap(i, j);
  const Polygon& p = polygons_[i];
  const Polygon& q = polygons_[j];
  const Vec3 r = q.centroid - p.centroid;
  bool p_visible = p.normal.dot(r) >= -q.radius && q.normal.dot(r) <= p.radius && !visibility_.covered(i) &&
                   !visibility_.covered(j);
  bool q_visible = p_visible;
  std::optional<Polygon> p_front, q_front;
  if (p_visible) {
    p_front = front_part(p, q, p_visible);
    q_front = front_part(q, p, q_visible);
  }
  if (!p_visible || !q_visible) {
    ++counts.behind;
    return 0;
  }
  const Polygon& p_seen = p_front ? *p_front : p;
  const Polygon& q_seen = q_front ? *q_front : q;
  const auto unoccluded = [&] {
    if (p_front || q_front)
      return radiosity::mutual_area(p_seen, q_seen, PatchColumns::least_distance(tolerance_));
    return area != kNearPair ? area : near_area(i, j);
  };
  Occluders::View view = Occluders::View::crowded;
  if (visibility_.convex()) {
    view = Occluders::View::free;
  } else if (occluders_ && occluders_->complete() && convex_[i] && convex_[j]) {
    view = occluders_->classify(i, p_seen.corners, j, q_seen.corners, scratch);
  }
  switch (view) {
    case Occluders::View::hidden:
      ++counts.hidden;
      return 0;
    case Occluders::View::free:
      ++counts.free;
      return unoccluded();
    case Occluders::View::partial: {
      ++counts.partial;
      const double whole = unoccluded();
      return visible_by_shadows(i, p_seen, q_seen, whole, work) * whole;
    }
    case Occluders::View::crowded:
      break;
  }
  ++counts.by_rays;
  const double fraction = visible_by_rays(i, j);
  return fraction > 0 ? fraction * unoccluded() : 0;
}

void PairFactors::add(const PairCounts& counts) const {
  const std::lock_guard lock(counting_);
  counts_ += counts;
}

PairCounts PairFactors::counts() const {
  const std::lock_guard lock(counting_);
  return counts_;
}

double PairFactors::visible_by_shadows(Index i, const Polygon& from, const Polygon& to, double mutual,
                                       Work& work) const {
  constexpr std::size_t kFew = 256;
  const double share = mutual / from.area * static_cast<double>(std::max(kFew, polygons_.size()));
  const double points = samples_ * std::min(std::cbrt(share * share), kMostOfSamples);
  if (const std::optional<double> visible =
          visible_by_areas(i, from, to, rules_->nearest_of_vectors(points), work))
    return *visible;
  double seen = 0;
  double all = 0;
  for_each_point(from, rules_->nearest(points), [&](const Vec3& x, double weight) {
    const double factor = point_factor(x, from.normal, to.corners);
    all += weight * factor;
    seen += weight * occluders_->visible_point_factor(x, from.normal, to.corners, factor, scratch);
  });
  return all > 0 ? std::clamp(seen / all, 0.0, 1.0) : 0;
}

ShadowShare::Points& PairFactors::points_on(Index i, const Polygon& from, const PointRules::Rule& rule,
                                            Work& work) const {
  const bool kept = i == work.row && &from == &polygons_[i];
  work.points.resize(rules_->count());
  ShadowShare::Points& at = kept ? work.points[rules_->number(rule)] : work.others;
  if (!kept) at.clear();
  if (at.columns[0].empty())
    for_each_point(from, rule, [&](const Vec3& x, double weight) { at.add(x, weight); });
  at.fill();
  return at;
}

std::optional<double> PairFactors::visible_by_areas(Index i, const Polygon& from, const Polygon& to,
                                                    const PointRules::Rule& rule, Work& work) const {
  Occluders::Scratch& asked = scratch;
  const std::vector<int>& candidates = asked.candidates;
  if (candidates.size() > ShadowShare::kMost ||
      (to.centroid - from.centroid).norm() < tolerance::kShadowShare * to.radius + from.radius)
    return std::nullopt;
  std::array<std::span<const Vec3>, ShadowShare::kMost> parts;
  std::array<std::vector<Vec3>, ShadowShare::kMost> cut;
  std::size_t corners = 0;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    parts[k] = occluders_->corners(candidates[k]);
    for (const Polygon* side : {&to, &from})
      if (std::any_of(parts[k].begin(), parts[k].end(),
                      [&](const Vec3& c) { return side->normal.dot(c - side->centroid) < 0; })) {
        cut[k] = polygon::clip(parts[k], side->normal, side->centroid);
        parts[k] = cut[k];
      }
    asked.part.assign(parts[k].begin(), parts[k].end());
    if (parts[k].size() >= 3) Occluders::clip_to_shaft(asked.part, asked);
    if (asked.part.size() < 3) parts[k] = {};
    corners += parts[k].size();
    if (corners > ShadowShare::kMostCorners) return std::nullopt;
  }
  if (corners == 0) return 1.0;
  ShadowShare::Points& at = points_on(i, from, rule, work);
  const auto add = [&](std::span<const Vec3> piece) {
    ShadowShare shadows(piece, to.normal);
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      if (parts[k].empty()) continue;
      const auto [group, fronts_only] = occluders_->shadow_group(i, candidates[k]);
      shadows.add(parts[k], group, fronts_only ? &occluders_->normal(candidates[k]) : nullptr);
    }
    shadows.add_to(at, from.normal);
  };
  if (to.parallelogram) {
    add(to.corners);
  } else {
    for (std::size_t k = 1; k + 1 < to.corners.size(); ++k)
      add(std::array{to.corners[0], to.corners[k], to.corners[k + 1]});
  }
  double all = 0, seen = 0;
  for (std::size_t k = 0; k < at.all.size(); ++k) {
    const double weight = at.columns[3][k];
    all += weight * at.all[k];
    if (at.unsure[k] == 0 || weight == 0) {
      seen += weight * at.seen[k];
    } else {
      const Vec3 x(at.columns[0][k], at.columns[1][k], at.columns[2][k]);
      const double factor = point_factor(x, from.normal, to.corners);
      if (factor > 0)
        seen += weight * at.all[k] / factor *
                occluders_->visible_point_factor(x, from.normal, to.corners, factor, scratch);
    }
  }
  return seen > tolerance::kFactorRounding * all ? std::min(seen / all, 1.0) : 0;
}

}  // namespace radiosity
