// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/coarsen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "facet_axes.hpp"
#include "polygon.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

class Joiner {
 public:
  Joiner(const PatchMesh& mesh, double factor, std::span<const std::uint8_t> apart)
      : mesh_(mesh), factor_(factor), apart_(apart), group_(mesh.patch_count()) {}

  // By the cells of a grid in the plane of the facet.
  void join(const Facet& facet) {
    const FacetAxes axes(mesh_, facet);
    // Rectangles are the cells of their grid; others have cells of their mean area.
    const Eigen::Vector2d fine = axes.cell.value_or(
        Eigen::Vector2d::Constant(std::sqrt(axes.area / static_cast<double>(facet.patches.size()))));
    constexpr double kRounding = 1e-6;
    const Eigen::Array2d count =
        (axes.box.sizes().array() / (factor_ * fine.array()) - kRounding).ceil().max(1).min(double{1 << 20});
    std::map<std::array<Index, 4>, Index> number;
    for (const Index i : facet.patches) {
      const Eigen::Array2d cell =
          ((axes.flat(mesh_.centroid(i)) - axes.box.min()).array() / axes.box.sizes().array() * count +
           kRounding)
              .floor();
      const auto [found, is_new] = number.try_emplace(
          {mesh_.material(i), apart_[i], static_cast<Index>(cell.x()), static_cast<Index>(cell.y())},
          groups_);
      groups_ += is_new ? 1 : 0;
      group_[i] = found->second;
    }
  }

  // Facets of one patch: those that face the same side of a cube, halved along their longest extent until few are left.
  void join(const std::vector<Index>& single) {
    std::map<std::array<Index, 3>, std::vector<Index>> alike;
    for (const Index i : single) {
      Eigen::Index axis = 0;
      const Vec3& n = mesh_.normal(i);
      n.cwiseAbs().maxCoeff(&axis);
      alike[{mesh_.material(i), apart_[i], static_cast<Index>(2 * axis + (n[axis] < 0 ? 1 : 0))}].push_back(
          i);
    }
    for (auto& [key, patches] : alike) halve(patches);
  }

  Coarsening result() const {
    Coarsening out;
    std::vector<Index> number(groups_, -1);
    for (const Index g : group_) {
      if (number[g] < 0) number[g] = out.count++;
      out.parent.push_back(number[g]);
    }
    return out;
  }

 private:
  void halve(std::span<Index> patches) {
    Eigen::AlignedBox3d box;
    double largest = 0;
    for (const Index i : patches) {
      box.extend(mesh_.centroid(i));
      largest = std::max(largest, mesh_.area(i));
    }
    const bool few = static_cast<double>(patches.size()) <= 1.5 * factor_ * factor_;
    const bool near = box.diagonal().norm() <= 3 * factor_ * std::sqrt(largest);
    if (patches.size() == 1 || (few && near)) {
      for (const Index i : patches) group_[i] = groups_;
      ++groups_;
      return;
    }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto middle = patches.begin() + static_cast<std::ptrdiff_t>(patches.size() / 2);
    std::nth_element(patches.begin(), middle, patches.end(), [&](Index a, Index b) {
      return std::pair(mesh_.centroid(a)[axis], a) < std::pair(mesh_.centroid(b)[axis], b);
    });
    halve({patches.begin(), middle});
    halve({middle, patches.end()});
  }

  const PatchMesh& mesh_;
  double factor_;
  std::span<const std::uint8_t> apart_;
  std::vector<Index> group_;
  Index groups_ = 0;
};

}  // namespace

Coarsening coarsen(const PatchMesh& mesh, std::span<const Facet> facets, double factor,
                   std::span<const std::uint8_t> apart) {
  if (!(factor >= 1)) throw InputError(fmt::format("coarser patches: a factor of {} is below 1", factor));
  if (apart.size() != at(mesh.patch_count()))
    throw InputError(
        fmt::format("coarser patches: {} classes for {} patches", apart.size(), mesh.patch_count()));
  Joiner joiner(mesh, factor, apart);
  std::vector<Index> single;
  for (const Facet& facet : facets) {
    if (facet.patches.size() == 1)
      single.push_back(facet.patches[0]);
    else
      joiner.join(facet);
  }
  joiner.join(single);
  return joiner.result();
}

BandArray restrict_to(const Coarsening& coarsening, const Eigen::ArrayXd& areas, const BandArray& values) {
  const auto n = static_cast<Index>(coarsening.parent.size());
  if (areas.size() != n || values.rows() != n)
    throw InputError(fmt::format("coarser patches: {} areas and {} values for {} patches", areas.size(),
                                 values.rows(), n));
  BandArray sums = BandArray::Zero(coarsening.count, values.cols());
  Eigen::ArrayXd area = Eigen::ArrayXd::Zero(coarsening.count);
  for (Index i = 0; i < n; ++i) {
    const Index p = coarsening.parent[i];
    sums.row(p) += areas[i] * values.row(i);
    area[p] += areas[i];
  }
  sums.colwise() /= area;
  return sums;
}

}  // namespace radiosity
