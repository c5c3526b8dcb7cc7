// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <span>

namespace radiosity {

/// Calls f(i, j), in no certain order, once for each pair of boxes that overlap or touch [Zomorodian2000]: O(n log³ n + pairs).
/// None is empty.
void for_each_pair_that_meets(std::span<const Eigen::AlignedBox3d> boxes,
                              const std::function<void(std::size_t, std::size_t)>& f);

/// The same for pairs of one box of `a`, i, and one of `b`, j.
void for_each_pair_that_meets(std::span<const Eigen::AlignedBox3d> a, std::span<const Eigen::AlignedBox3d> b,
                              const std::function<void(std::size_t, std::size_t)>& f);

}  // namespace radiosity
