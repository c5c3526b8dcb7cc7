// SPDX-License-Identifier: GPL-3.0-or-later
#include "shadow_share.hpp"

#include <algorithm>

#include "pair_kernels.hpp"

namespace radiosity {

ShadowShare::ShadowShare(std::span<const Vec3> corners, const Vec3& normal)
    : triangle_(corners.size() == 3), normal_(normal) {
  // The longest side of a triangle is the diagonal.
  std::size_t first = 0;
  const auto diagonal = [&](std::size_t k) { return (corners[(k + 2) % 3] - corners[k]).squaredNorm(); };
  for (std::size_t k = 1; triangle_ && k < 3; ++k)
    if (diagonal(k) > diagonal(first)) first = k;
  const auto corner = [&](std::size_t k) -> const Vec3& { return corners[(first + k) % corners.size()]; };
  origin_ = (corner(0) + corner(2)) / 2;
  u_ = corner(1) - corner(0);
  v_ = corner(2) - corner(1);
  dual_u_ = v_.cross(normal_) / u_.dot(v_.cross(normal_));
  dual_v_ = normal_.cross(u_) / v_.dot(normal_.cross(u_));
}

void ShadowShare::add(std::span<const Vec3> polygon, std::size_t group, const Vec3* normal) {
  const std::size_t first = corners_;
  for (const Vec3& corner : polygon) {
    const Vec3 r = corner - origin_;
    u_of_[corners_] = dual_u_.dot(r);
    v_of_[corners_] = dual_v_.dot(r);
    h_of_[corners_++] = normal_.dot(r);
  }
  planes_[count_] = {0, 0, 0, -1};
  if (normal) planes_[count_] = {normal->x(), normal->y(), normal->z(), normal->dot(polygon[0] - origin_)};
  shadows_[count_] = {&u_of_[first],  &v_of_[first],          &h_of_[first],
                      polygon.size(), planes_[count_].data(), group};
  ++count_;
}

void ShadowShare::Points::fill() {
  while (columns[0].size() % kLanes != 0) {
    for (std::size_t k = 0; k < 3; ++k) columns[k].push_back(columns[k].back());
    columns[3].push_back(0);
  }
  for (auto* answers : {&all, &seen, &unsure}) answers->assign(columns[0].size(), 0);
}

void ShadowShare::add_to(Points& points, const Vec3& normal) const {
  const ShadowFrame frame{origin_.data(), u_.data(),      v_.data(),          normal_.data(),
                          dual_u_.data(), dual_v_.data(), u_.cross(v_).norm()};
  const PairKernels& kernel = pair_kernel();
  const auto add = triangle_ ? kernel.shadows_on_triangle : kernel.shadows_on_parallelogram;
  const auto& columns = points.columns;
  for (std::size_t k = 0; k < columns[0].size(); k += kLanes) {
    const double* const at[3] = {&columns[0][k], &columns[1][k], &columns[2][k]};
    double* const answers[3] = {&points.all[k], &points.seen[k], &points.unsure[k]};
    add(at, normal.data(), frame, shadows_.data(), count_, answers);
  }
}

}  // namespace radiosity
