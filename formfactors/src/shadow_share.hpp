// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pair_kernels.hpp"
#include "polygon_factor.hpp"

namespace radiosity {

/// What points on one patch see of a parallelogram or triangle q past polygons, eight points at a time. In coordinates in which q
/// is the square [−½, ½]² or its half below the diagonal, K = cosθ cosθ' / r² is taken to be biquadratic, equal to it at the 3 × 3
/// Gauss points, and its integral over the union of the polygons' shadows is one round the union,
///   ∫∫ K du dv = −∮ P(u, v) du,   ∂P/∂v = K,
/// with u and v held to q; that is exact. Round the union go those pieces of the shadows' edges that are in no other shadow. What
/// the interpolation leaves of K oscillates: relative to K it is some 0.4 (radius of q / distance)³.
class ShadowShare {
 public:
  /// Three corners, or the four of a parallelogram, counter-clockwise about the normal.
  ShadowShare(std::span<const Vec3> corners, const Vec3& normal);

  static constexpr std::size_t kMost = kMostShadows, kMostCorners = kMostShadowCorners;
  /// One of at most kMost polygons of at most kMostCorners corners together. Those of one group do not overlap; where a normal is
  /// given only points in front of it see its shadow.
  void add(std::span<const Vec3> polygon, std::size_t group, const Vec3* normal);
  ShadowShare(const ShadowShare&) = delete;  // its shadows point into it

  struct Points {
    std::array<std::vector<double>, 4> columns;  ///< x, y, z, weight
    void clear() {
      for (auto& column : columns) column.clear();
    }
    void add(const Vec3& x, double weight) {
      for (std::size_t k = 0; k < 3; ++k) columns[k].push_back(x[static_cast<Eigen::Index>(k)]);
      columns[3].push_back(weight);
    }
    void fill();  ///< the last vector, without weight; the answers with 0
    /// ∫ K dA and ∫ V K dA, summed up; `unsure` is not 0 where a shadow may overlap more than four others, or is of
    /// what is right beside the point.
    std::vector<double> all, seen, unsure;
  };
  /// Of a patch with this normal.
  void add_to(Points& points, const Vec3& normal) const;

 private:
  bool triangle_;
  Vec3 origin_, u_, v_, normal_, dual_u_, dual_v_;
  std::array<double, kMostCorners> u_of_, v_of_, h_of_;  // of corners; h is the height over q
  std::array<std::array<double, 4>, kMost> planes_;      // normal and offset
  std::array<ShadowCorners, kMost> shadows_;
  std::size_t corners_ = 0, count_ = 0;
};

}  // namespace radiosity
