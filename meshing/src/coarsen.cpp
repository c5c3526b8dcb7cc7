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
      : mesh_(mesh), factor_(factor), apart_(apart), group_(mesh.cluster_count()) {}

  // By the cells of a grid in the plane of the facet. Its patches are by themselves.
  void join(const Facet& facet) {
    const FacetAxes axes(mesh_, facet);
    // Rectangles are the cells of their grid, unless the first is a sliver; others have cells of their mean area.
    const double mean = axes.area / static_cast<double>(facet.patches.size());
    const bool grid = axes.cell && axes.cell->prod() >= 0.5 * mean;
    const Eigen::Vector2d fine = grid ? *axes.cell : Eigen::Vector2d::Constant(std::sqrt(mean));
    constexpr double kRounding = 1e-6;
    const Eigen::Array2d count =
        (axes.box.sizes().array() / (factor_ * fine.array()) - kRounding).ceil().max(1).min(double{1 << 20});
    std::map<std::array<Index, 4>, Index> number;
    for (const Index i : facet.patches) {
      const Eigen::Array2d cell =
          ((axes.flat(mesh_.centroid(i)) - axes.box.min()).array() / axes.box.sizes().array() * count +
           kRounding)
              .floor();
      const auto [found, is_new] =
          number.try_emplace({mesh_.material(i), apart_[mesh_.cluster(i)], static_cast<Index>(cell.x()),
                              static_cast<Index>(cell.y())},
                             groups_);
      groups_ += is_new ? 1 : 0;
      group_[mesh_.cluster(i)] = found->second;
    }
  }

  // Clusters, and facets of one patch: those that face the same side of a cube, halved along their longest extent until few are left.
  void join(const std::vector<Index>& clusters) {
    std::map<std::array<Index, 3>, std::vector<Index>> alike;
    centroids_.resize(group_.size());
    for (const Index c : clusters) {
      Vec3 n = Vec3::Zero(), x = n;
      const Vec3& origin = mesh_.centroid(mesh_.members(c)[0]);
      for (const Index i : mesh_.members(c)) {
        n += mesh_.area(i) * mesh_.normal(i);
        x += mesh_.area(i) * (mesh_.centroid(i) - origin);
      }
      centroids_[c] = x / mesh_.cluster_areas()[c] + origin;
      Eigen::Index axis = 0;
      n.cwiseAbs().maxCoeff(&axis);
      alike[{mesh_.material(mesh_.members(c)[0]), apart_[c],
             static_cast<Index>(2 * axis + (n[axis] < 0 ? 1 : 0))}]
          .push_back(c);
    }
    for (auto& [key, same] : alike) halve(same);
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
  void halve(std::span<Index> clusters) {
    Eigen::AlignedBox3d box;
    double largest = 0;
    for (const Index c : clusters) {
      box.extend(centroids_[c]);
      largest = std::max(largest, mesh_.cluster_areas()[c]);
    }
    const bool few = static_cast<double>(clusters.size()) <= 1.5 * factor_ * factor_;
    const bool near = box.diagonal().norm() <= 3 * factor_ * std::sqrt(largest);
    if (clusters.size() == 1 || (few && near)) {
      for (const Index c : clusters) group_[c] = groups_;
      ++groups_;
      return;
    }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto middle = clusters.begin() + static_cast<std::ptrdiff_t>(clusters.size() / 2);
    std::nth_element(clusters.begin(), middle, clusters.end(), [&](Index a, Index b) {
      return std::pair(centroids_[a][axis], a) < std::pair(centroids_[b][axis], b);
    });
    halve({clusters.begin(), middle});
    halve({middle, clusters.end()});
  }

  const PatchMesh& mesh_;
  double factor_;
  std::span<const std::uint8_t> apart_;
  std::vector<Index> group_;     // of clusters
  std::vector<Vec3> centroids_;  // of those that are joined by place
  Index groups_ = 0;
};

}  // namespace

Coarsening coarsen(const PatchMesh& mesh, std::span<const Facet> facets, double factor,
                   std::span<const std::uint8_t> apart) {
  if (!(factor >= 1)) throw InputError(fmt::format("coarser patches: a factor of {} is below 1", factor));
  if (apart.size() != at(mesh.cluster_count()))
    throw InputError(
        fmt::format("coarser patches: {} classes for {} patches", apart.size(), mesh.cluster_count()));
  Joiner joiner(mesh, factor, apart);
  std::vector<Index> others;
  for (Index c = 0; c < mesh.cluster_count(); ++c)
    if (mesh.members(c).size() > 1) others.push_back(c);
  for (const Facet& facet : facets) {
    Facet part = facet;
    std::erase_if(part.patches, [&](Index i) { return mesh.members(mesh.cluster(i)).size() > 1; });
    if (part.patches.size() == 1)
      others.push_back(mesh.cluster(part.patches[0]));
    else if (!part.patches.empty())
      joiner.join(part);
  }
  joiner.join(others);
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
