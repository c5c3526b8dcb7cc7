// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/box_pairs.hpp"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <vector>

namespace radiosity {

void for_each_pair_that_meets(std::span<const Eigen::AlignedBox3d> boxes,
                              const std::function<void(std::size_t, std::size_t)>& f) {
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;
  std::vector<Box> numbered;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Eigen::Vector3d low = boxes[i].min(),
                    high = boxes[i].max();  // CGAL takes them by pointers to what is not const
    numbered.emplace_back(low.data(), high.data(), i);
  }
  CGAL::box_self_intersection_d(numbered.begin(), numbered.end(),
                                [&](const Box& a, const Box& b) { f(a.info(), b.info()); });
}

}  // namespace radiosity
