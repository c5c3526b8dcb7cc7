// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_columns.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>

#include "pair_kernels.hpp"

namespace radiosity {
namespace {

// Principal axes of a polygon that is no parallelogram: ∫ (x − c)(x − c)ᵀ dA / A, summed over the triangles of a fan.
std::array<Vec3, 2> principal_axes(const Polygon& p) {
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (std::size_t k = 1; k + 1 < p.corners.size(); ++k) {
    const std::array<Vec3, 3> v{p.corners[0] - p.centroid, p.corners[k] - p.centroid,
                                p.corners[k + 1] - p.centroid};
    const double area = p.normal.dot((v[1] - v[0]).cross(v[2] - v[0])) / 2;
    const Vec3 sum = v[0] + v[1] + v[2];
    moments +=
        area / (12 * p.area) *
        (v[0] * v[0].transpose() + v[1] * v[1].transpose() + v[2] * v[2].transpose() + sum * sum.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  const auto axis = [&](int k) -> Vec3 {
    return std::sqrt(std::max(0.0, axes.eigenvalues()[k])) * axes.eigenvectors().col(k);
  };
  return {axis(1), axis(2)};
}

}  // namespace

PatchColumns::PatchColumns(const std::vector<Polygon>& polygons, const std::vector<PatchGroup>& groups,
                           double error) {
  const double far = std::pow(tolerance::kMoments / error, 1.0 / 4);
  const double far_odd = std::max(far, std::cbrt(tolerance::kMomentsOdd / error));
  const double middle = std::pow(tolerance::kGauss / error, 1.0 / 6);
  const double least = std::pow(tolerance::kProduct / error, 1.0 / 6), least_odd = least_distance(error);
  place_.resize(polygons.size());
  std::size_t size = 0;
  for (const PatchGroup& group : groups) {
    first_block_.push_back(blocks_.size());
    for (std::size_t first = 0; first < group.patches.size(); first += kLanes) {
      std::size_t points = 0;
      for (std::size_t k = first; k < std::min(first + kLanes, group.patches.size()); ++k) {
        points = std::max(points, polygons[group.patches[k]].rule.size);
        place_[group.patches[k]] = {blocks_.size(), k - first};
      }
      blocks_.push_back({size, points});
      size += (kColumns + 4 * (kGaussPoints + points)) * kLanes;
    }
  }
  first_block_.push_back(blocks_.size());
  data_.resize(size);
  tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    const std::vector<Index>& patches = groups[g].patches;
    for (std::size_t block = first_block_[g]; block < first_block_[g + 1]; ++block) {
      const std::size_t first = (block - first_block_[g]) * kLanes, points = blocks_[block].points;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const Polygon& p =
            polygons[patches[std::min(first + lane, patches.size() - 1)]];  // the last one again and again
        double* const column = data_.data() + blocks_[block].start + lane;
        const auto set = [&](std::size_t c, double value) { column[c * kLanes] = value; };
        const auto set_vector = [&](std::size_t c, const Vec3& v) {
          for (Eigen::Index k = 0; k < 3; ++k) set(c + static_cast<std::size_t>(k), v[k]);
        };
        const auto [u, v] = p.parallelogram
                                ? std::array<Vec3, 2>{(p.corners[1] - p.corners[0]) / std::sqrt(12.0),
                                                      (p.corners[3] - p.corners[0]) / std::sqrt(12.0)}
                                : principal_axes(p);
        set_vector(kCentroid, p.centroid);
        set_vector(kNormal, p.normal);
        set(kArea, p.area);
        set_vector(kAxisU, u);
        set_vector(kAxisV, v);
        set(kMomentU, u.squaredNorm());
        set(kMomentV, v.squaredNorm());
        set(kFarReach, p.radius * (p.parallelogram ? far : far_odd));
        set(kMiddleReach, p.parallelogram ? p.radius * middle : std::numeric_limits<double>::infinity());
        set(kLeastReach, p.radius * (p.parallelogram ? least : least_odd));
        std::size_t at = kColumns;
        for (const double a : {-1.0, 1.0})
          for (const double b : {-1.0, 1.0}) {
            set_vector(at, p.centroid + a * u + b * v);
            set(at + 3, p.area / 4);
            at += 4;
          }
        for (std::size_t k = 0; k < points; ++k, at += 4)
          for (std::size_t c = 0; c < 4; ++c)
            set(at + c, c == 3 && k >= p.rule.size
                            ? 0
                            : p.rule.columns[c * p.rule.stride + std::min(k, p.rule.size - 1)]);
      }
    }
  });
}

void PatchColumns::mutual_areas(Index i, std::size_t group, std::vector<double>& areas) const {
  const auto [block, lane] = place_[i];
  const ColumnBlock& of_p = blocks_[block];
  areas.resize((first_block_[group + 1] - first_block_[group]) * kLanes);
  pair_kernel().mutual_areas(data_.data() + of_p.start + lane, of_p.points, data_.data(),
                             blocks_.data() + first_block_[group], blocks_.data() + first_block_[group + 1],
                             areas.data());
}

}  // namespace radiosity
