// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/box_pairs.hpp"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <vector>

namespace radiosity {
namespace {

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;

std::vector<Box> numbered(std::span<const Eigen::AlignedBox3d> boxes) {
  std::vector<Box> out;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Eigen::Vector3d low = boxes[i].min(),
                    high = boxes[i].max();  // CGAL takes them by pointers to what is not const
    out.emplace_back(low.data(), high.data(), i);
  }
  return out;
}

}  // namespace

void for_each_pair_that_meets(std::span<const Eigen::AlignedBox3d> boxes,
                              const std::function<void(std::size_t, std::size_t)>& f) {
  std::vector<Box> all = numbered(boxes);
  CGAL::box_self_intersection_d(all.begin(), all.end(),
                                [&](const Box& a, const Box& b) { f(a.info(), b.info()); });
}

void for_each_pair_that_meets(std::span<const Eigen::AlignedBox3d> a, std::span<const Eigen::AlignedBox3d> b,
                              const std::function<void(std::size_t, std::size_t)>& f) {
  std::vector<Box> first = numbered(a), second = numbered(b);
  CGAL::box_intersection_d(first.begin(), first.end(), second.begin(), second.end(),
                           [&](const Box& i, const Box& j) { f(i.info(), j.info()); });
}

}  // namespace radiosity
