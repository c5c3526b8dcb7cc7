// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// A planar polygon, or several near each other that face about the same way.
struct Joinable {
  Index kind;  ///< those of different kinds are never joined; below 0: with none
  Vec3 centroid, normal;
  double area;  ///< m²
  Eigen::AlignedBox3d box;
};

/// Joins what is near and faces about the same way: sets of one kind are divided until the members of each fit into a cube of this
/// size and, where they have more than a sixteenth of its square in area, differ in no component of their normals by more than 0.75
/// and lie within a quarter of the size along their mean normal, so that what hides the other is not joined with it. Returns a
/// number for each, from 0, in the order of their first members.
std::vector<Index> join_near(std::span<const Joinable> items, double size);

}  // namespace radiosity
