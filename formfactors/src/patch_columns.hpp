// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include "pair_kernels.hpp"
#include "patch_groups.hpp"
#include "polygon_factor.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

/// Unoccluded A_i F_ij of one patch and all patches of a group, eight at a time. Three quadratures of the kernel
/// K = cosθ cosθ' / (π r²), the cheapest of them whose relative error is the tolerance (tolerance::kMoments and others):
/// - far: K between the centroids and its second derivatives along the principal axes of both patches, with their second moments
/// - between parallelograms: the 2 × 2 Gauss points of each, and fourth derivatives along their edges for the error of that rule
/// - nearer: Polygon::rule of both
/// The value is that of the pair alone, whatever its neighbours, and the same from either side but for rounding.
class PatchColumns {
 public:
  /// The d of the last of them for triangles and any other polygon.
  static double least_distance(double error) { return std::pow(tolerance::kProductOdd / error, 1.0 / 6); }

  PatchColumns(const std::vector<Polygon>& polygons, const std::vector<PatchGroup>& groups, double error);

  /// Into `areas`, in the order of the group's patches: m², at least 0, or kNearPair. Means nothing where one of the patches is not whole in
  /// front of the other.
  void mutual_areas(Index i, std::size_t group, std::vector<double>& areas) const;

 private:
  struct Place {
    std::size_t block, lane;
  };
  std::vector<double> data_;
  std::vector<ColumnBlock> blocks_;
  std::vector<std::size_t> first_block_;  // of groups, and the end
  std::vector<Place> place_;              // of patches
};

}  // namespace radiosity
