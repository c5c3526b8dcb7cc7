// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_columns.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "vectors.hpp"

namespace radiosity {
namespace {

// Of a block of patches, kLanes numbers each. After them the Gauss points, then the points of Polygon::rule: x, y, z, weight.
enum Column : std::size_t {
  kCentroid = 0,
  kNormal = 3,
  kArea = 6,
  kAxisU = 7,  // principal axes, with the roots of the second moments as lengths, and the moments
  kAxisV = 10,
  kMomentU = 13,
  kMomentV,
  kFar,  // radius of the patch times the least d of a rule
  kMiddle,
  kLeast,
  kColumns
};
constexpr std::size_t kGaussPoints = 4;

// Σ_k K_k t^k of K(t) along an axis, times s₀², of K = N(t) / s(t)², N = n₀ + n₁ t, s = s₀ (1 + a t + b t²).
RADIOSITY_INLINE Lanes second(const Lanes& n0, const Lanes& n1, const Lanes& a, const Lanes& b) {
  return n0 * (3 * a * a - 2 * b) - 2 * n1 * a;
}
RADIOSITY_INLINE Lanes fourth(const Lanes& n0, const Lanes& n1, const Lanes& a, const Lanes& b) {
  const Lanes a2 = a * a;
  return n0 * (3 * b * b + a2 * (5 * a2 - 12 * b)) + n1 * a * (6 * b - 4 * a2);
}

// One patch, `p` with kLanes between its columns, and those of a block.
struct Pairs {
  const double* p;
  const double* q;

  RADIOSITY_INLINE double of_p(std::size_t column) const { return p[column * kLanes]; }
  RADIOSITY_INLINE Lanes of_q(std::size_t column) const { return load(q + column * kLanes); }
  // Of vectors at these columns.
  template <class A, class B>
  static RADIOSITY_INLINE Lanes dot(const A& a, const B& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  struct OfP {
    double c[3];
    RADIOSITY_INLINE double operator[](std::size_t k) const { return c[k]; }
  };
  struct OfQ {
    Lanes c[3];
    RADIOSITY_INLINE const Lanes& operator[](std::size_t k) const { return c[k]; }
  };
  RADIOSITY_INLINE OfP vector_of_p(std::size_t column) const {
    return {{of_p(column), of_p(column + 1), of_p(column + 2)}};
  }
  RADIOSITY_INLINE OfQ vector_of_q(std::size_t column) const {
    return {{of_q(column), of_q(column + 1), of_q(column + 2)}};
  }

  // Σ w_a w_b K of points that start at `first`, π left out.
  RADIOSITY_INLINE Lanes product(std::size_t first_p, std::size_t count_p, std::size_t first_q,
                                 std::size_t count_q) const {
    const OfP np = vector_of_p(kNormal), cp = vector_of_p(kCentroid);
    const OfQ nq = vector_of_q(kNormal), cq = vector_of_q(kCentroid);
    Lanes sum{};
    for (std::size_t b = first_q; b < first_q + 4 * count_q; b += 4) {
      const OfQ y = vector_of_q(b);
      // The height of a point over the other plane is that of all sight lines that end there.
      const Lanes weight =
          of_q(b + 3) * (np[0] * (y[0] - cp[0]) + np[1] * (y[1] - cp[1]) + np[2] * (y[2] - cp[2]));
      Lanes inner{};
      for (std::size_t a = first_p; a < first_p + 4 * count_p; a += 4) {
        const OfP x = vector_of_p(a);
        const Lanes height = nq[0] * (x[0] - cq[0]) + nq[1] * (x[1] - cq[1]) + nq[2] * (x[2] - cq[2]);
        const Lanes r0 = y[0] - x[0], r1 = y[1] - x[1], r2 = y[2] - x[2];
        const Lanes s = r0 * r0 + r1 * r1 + r2 * r2;
        inner += of_p(a + 3) * height / (s * s);
      }
      sum += weight * inner;
    }
    return sum;
  }

  RADIOSITY_INLINE Lanes mutual_areas(std::size_t points_p, std::size_t points_q) const {
    const OfP np = vector_of_p(kNormal), cp = vector_of_p(kCentroid);
    const OfQ nq = vector_of_q(kNormal), cq = vector_of_q(kCentroid);
    const OfQ r{{cq[0] - cp[0], cq[1] - cp[1], cq[2] - cp[2]}};
    const Lanes s = dot(r, r);
    const auto beyond = [&](std::size_t column) RADIOSITY_INLINED {
      const Lanes reach = of_p(column) + of_q(column);
      return greater(s, reach * reach);
    };
    const LaneBits far = beyond(kFar), middle = beyond(kMiddle) & ~far,
                   least = beyond(kLeast) & ~far & ~middle;
    Lanes area = Lanes{} + PatchColumns::kNear;

    if (any(far | middle)) {
      const Lanes inverse = 1 / s;
      const Lanes a0 = dot(np, r), b0 = -dot(nq, r), n0 = a0 * b0;
      Lanes second_sum = n0, fourth_sum{};
      for (std::size_t k = 0; k < 2; ++k) {
        const OfP u = vector_of_p(kAxisU + 3 * k);
        const OfQ v = vector_of_q(kAxisU + 3 * k);
        const Lanes n_u = a0 * dot(nq, u), a_u = -2 * inverse * dot(u, r), b_u = inverse * of_p(kMomentU + k);
        const Lanes n_v = b0 * dot(np, v), a_v = 2 * inverse * dot(v, r), b_v = inverse * of_q(kMomentU + k);
        second_sum += second(n0, n_u, a_u, b_u) + second(n0, n_v, a_v, b_v);
        fourth_sum += fourth(n0, n_u, a_u, b_u) + fourth(n0, n_v, a_v, b_v);
      }
      const Lanes weight = of_p(kArea) * of_q(kArea) * (inverse * inverse);
      area = select(far, weight * second_sum, area);
      if (any(middle)) {
        const Lanes gauss = product(kColumns, kGaussPoints, kColumns, kGaussPoints);
        // Over an edge t has the fourth moment 9/5 in units of its second one squared; over the two points it is 1.
        area = select(middle, gauss + 0.8 * weight * fourth_sum, area);
      }
    }
    if (any(least)) {
      constexpr std::size_t kFirst = kColumns + 4 * kGaussPoints;
      area = select(least, product(kFirst, points_p, kFirst, points_q), area);
    }
    const Lanes scaled = area * std::numbers::inv_pi;
    return select(far | middle | least, select(greater(scaled, Lanes{}), scaled, Lanes{}), area);
  }
};

RADIOSITY_CLONES void mutual_areas_of(const double* p, std::size_t points_p, const double* data,
                                      const PatchColumns::Block* block, const PatchColumns::Block* end,
                                      double* areas) {
  for (; block != end; ++block, areas += kLanes)
    store(Pairs{p, data + block->start}.mutual_areas(points_p, block->points), areas);
}

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
        set(kFar, p.radius * (p.parallelogram ? far : far_odd));
        set(kMiddle, p.parallelogram ? p.radius * middle : std::numeric_limits<double>::infinity());
        set(kLeast, p.radius * (p.parallelogram ? least : least_odd));
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
  const Block& of_p = blocks_[block];
  areas.resize((first_block_[group + 1] - first_block_[group]) * kLanes);
  mutual_areas_of(data_.data() + of_p.start + lane, of_p.points, data_.data(),
                  blocks_.data() + first_block_[group], blocks_.data() + first_block_[group + 1],
                  areas.data());
}

}  // namespace radiosity
