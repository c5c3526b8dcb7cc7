// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "methods.hpp"
#include "polygon_factor.hpp"
#include "sampling.hpp"

namespace radiosity {
namespace {

/// F_ij = (exact unoccluded factor) × (visible fraction). The fraction is measured on K stratified pairs of points, each
/// weighted by its kernel k = cosθ cosθ' / r²:   Σ V k / Σ k. Convex scenes cast no ray and are exact.
/// Pairs are always computed in the same order of their numbers, so A_i F_ij = A_j F_ji.
class Analytic final : public FormFactorMethod {
 public:
  Analytic(const Visibility& visibility, const FormFactorOptions& options)
      : visibility_(visibility), seed_(options.seed), packets_((options.samples + 15) / 16) {
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

  void rows(Index first, Index last, bool upper, const Sink& sink) const override;
  bool reciprocal() const override { return true; }
  bool exact() const override { return visibility_.convex(); }
  Index setting() const override { return 16 * packets_; }
  Index max_entries_per_row() const override { return visibility_.mesh().patch_count(); }

 private:
  double visible_fraction(Index i, Index j) const;

  const Visibility& visibility_;
  std::uint64_t seed_;
  Index packets_;
  std::vector<Polygon> polygons_;
};

double Analytic::visible_fraction(Index i, Index j) const {
  const PatchMesh& mesh = visibility_.mesh();
  RandomStream random(seed_, (static_cast<std::uint64_t>(i) << 32) | static_cast<std::uint64_t>(j));
  const Sample2 shift_i{random.uniform(), random.uniform()};
  const Sample2 shift_j{random.uniform(), random.uniform()};
  double sum = 0;
  double seen = 0;
  std::uint64_t point = 0;
  for (Index packet = 0; packet < packets_; ++packet) {
    Visibility::SightLines lines;
    lines.from = i;
    lines.to = j;
    std::array<double, 16> kernel{};
    for (int k = 0; k < 16; ++k, ++point) {
      const Vec3 x = point_on_patch(mesh, i, r2_point(point, shift_i));
      // Point k of i goes with point 5k mod 16 of j: both sets stay evenly spread, and their pairs are mixed.
      const Vec3 y = point_on_patch(mesh, j, r2_point((point & ~15ULL) | (point * 5 & 15), shift_j));
      const Vec3 r = y - x;
      const double k_ij = mesh.normal(i).dot(r) * -mesh.normal(j).dot(r);
      if (mesh.normal(i).dot(r) <= 0 || k_ij <= 0) continue;
      const auto lane = static_cast<std::size_t>(lines.count++);
      kernel[lane] = k_ij / (r.squaredNorm() * r.squaredNorm());
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
    count_rays(static_cast<std::uint64_t>(lines.count));
    for (int k = 0; k < lines.count; ++k) {
      const auto lane = static_cast<std::size_t>(k);
      sum += kernel[lane];
      if (!lines.blocked[lane]) seen += kernel[lane];
    }
  }
  return sum > 0 ? seen / sum : 0;
}

void Analytic::rows(Index first, Index last, bool upper, const Sink& sink) const {
  const auto n = static_cast<Index>(polygons_.size());
  const bool occlusion = !visibility_.convex();
  std::vector<Index> columns;
  std::vector<double> values;
  for (Index i = first; i < last; ++i) {
    columns.clear();
    values.clear();
    const Polygon& p = polygons_[static_cast<std::size_t>(i)];
    for (Index j = upper ? i + 1 : 0; j < n; ++j) {
      if (j == i) continue;
      const Polygon& q = polygons_[static_cast<std::size_t>(j)];
      const Vec3 r = q.centroid - p.centroid;
      if (p.normal.dot(r) < -q.radius || q.normal.dot(r) > p.radius) continue;  // behind one another
      double mutual = j > i ? mutual_area(p, q) : mutual_area(q, p);
      if (mutual <= 0) continue;
      if (occlusion) mutual *= visible_fraction(std::min(i, j), std::max(i, j));
      if (mutual <= 0) continue;
      columns.push_back(j);
      values.push_back(mutual / p.area);
    }
    sink(i, columns, values, -1);
  }
}

}  // namespace

std::unique_ptr<FormFactorMethod> make_analytic(const Visibility& visibility,
                                                const FormFactorOptions& options) {
  return std::make_unique<Analytic>(visibility, options);
}

}  // namespace radiosity
