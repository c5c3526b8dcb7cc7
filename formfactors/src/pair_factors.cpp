// SPDX-License-Identifier: GPL-3.0-or-later
#include "pair_factors.hpp"

#include <utility>

#include "sampling.hpp"

namespace radiosity {

PairFactors::PairFactors(const Visibility& visibility, Index samples, std::uint64_t seed)
    : visibility_(visibility), packets_((samples + 15) / 16), seed_(seed) {
  const PatchMesh& mesh = visibility.mesh();
  // Kept near the origin: differences of large coordinates are taken once, here.
  const Vec3 centre = (mesh.lower() + mesh.upper()) / 2;
  polygons_.reserve(static_cast<std::size_t>(mesh.patch_count()));
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    std::vector<Vec3> corners;
    for (const Index v : mesh.corners(i)) corners.push_back(mesh.vertex(v) - centre);
    polygons_.emplace_back(std::move(corners), mesh.normal(i));
  }
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

double PairFactors::visible_fraction(Index i, Index j) const {
  Weights weights = sight_lines(i, j, 0, packets_);
  if (weights.seen > 0 && weights.seen < weights.all) {
    const Weights more = sight_lines(i, j, packets_, 4 * packets_);
    weights.seen += more.seen;
    weights.all += more.all;
  }
  return weights.all > 0 ? weights.seen / weights.all : 0;
}

double PairFactors::mutual_area(Index i, Index j) const {
  if (j < i) std::swap(i, j);
  const Polygon& p = polygons_[static_cast<std::size_t>(i)];
  const Polygon& q = polygons_[static_cast<std::size_t>(j)];
  const Vec3 r = q.centroid - p.centroid;
  if (p.normal.dot(r) < -q.radius || q.normal.dot(r) > p.radius) return 0;  // behind one another
  const double open = radiosity::mutual_area(p, q);
  if (open <= 0 || visibility_.convex()) return open;
  return open * visible_fraction(i, j);
}

}  // namespace radiosity
