// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/restrict_to.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {
namespace {

using Triangle = std::array<Vec3, 3>;

Triangle triangle(const PatchMesh& mesh, const std::array<Index, 3>& corners) {
  return {mesh.vertex(corners[0]), mesh.vertex(corners[1]), mesh.vertex(corners[2])};
}

Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b - a).cross(c - a) / 2;
}

/// The part of the triangle that is inside of another one, seen along n.
std::vector<Vec3> clip(const Triangle& triangle, const Triangle& by, const Vec3& n) {
  std::vector<Vec3> part(triangle.begin(), triangle.end());
  for (std::size_t k = 0; k < 3; ++k) part = polygon::clip(part, n.cross(by[(k + 1) % 3] - by[k]), by[k]);
  return part;
}

Eigen::AlignedBox3d box_of(const PatchMesh& mesh, Index patch) {
  Eigen::AlignedBox3d box;
  for (const Index v : mesh.corners(patch)) box.extend(mesh.vertex(v));
  return box;
}

}  // namespace

BandArray restrict_to(const PatchMesh& coarse, const PatchMesh& fine, const BandArray& values) {
  if (values.rows() != fine.patch_count())
    throw InputError(fmt::format("restriction: {} values for {} patches", values.rows(), fine.patch_count()));
  std::vector<std::vector<Index>> inside(coarse.patch_count());
  {
    std::vector<Eigen::AlignedBox3d> large, small;
    const double rounding = tolerance::kContact * coarse.diagonal();
    for (Index i = 0; i < coarse.patch_count(); ++i) {
      Eigen::AlignedBox3d& box = large.emplace_back(box_of(coarse, i));
      box.min().array() -= rounding;
      box.max().array() += rounding;
    }
    for (Index i = 0; i < fine.patch_count(); ++i) small.push_back(box_of(fine, i));
    for_each_pair_that_meets(large, small, [&](std::size_t a, std::size_t b) {
      const auto i = static_cast<Index>(a), j = static_cast<Index>(b);
      // The two sides of a face have one number.
      if (coarse.surface(i) == fine.surface(j) && coarse.normal(i).dot(fine.normal(j)) > 0)
        inside[a].push_back(j);
    });
  }
  const BandArray at_vertices = vertex_means(fine, values);
  BandArray shift = values;
  for (Index j = 0; j < fine.patch_count(); ++j)
    for (const auto& t : fine.triangles(j)) {
      const Triangle x = triangle(fine, t);
      const double area = fine.normal(j).dot(area_vector(x[0], x[1], x[2]));
      for (const Index v : t) shift.row(j) -= area / (3 * fine.area(j)) * at_vertices.row(v);
    }

  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  BandArray means(coarse.patch_count(), values.cols());
  for (Index i = 0; i < coarse.patch_count(); ++i) {
    const Vec3& n = coarse.normal(i);
    auto& candidates = inside[i];
    std::sort(candidates.begin(), candidates.end());
    double covered = 0;
    means.row(i).setZero();
    for (const Index j : candidates)
      for (const auto& t : fine.triangles(j)) {
        const Triangle x = triangle(fine, t);
        const double whole = n.dot(area_vector(x[0], x[1], x[2]));
        for (const auto& own : coarse.triangles(i)) {
          const std::vector<Vec3> part = clip(x, triangle(coarse, own), n);
          for (std::size_t k = 1; k + 1 < part.size(); ++k) {
            const double area = n.dot(area_vector(part[0], part[k], part[k + 1]));
            const Vec3 centre = (part[0] + part[k] + part[k + 1]) / 3;
            covered += area;
            means.row(i) += area * shift.row(j);
            for (std::size_t c = 0; c < 3; ++c)
              means.row(i) += area * n.dot(area_vector(centre, x[(c + 1) % 3], x[(c + 2) % 3])) / whole *
                              at_vertices.row(t[c]);
          }
        }
      }
    means.row(i) /= covered > 0 ? covered : kNan;
  }
  return means;
}

}  // namespace radiosity
