// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/coarsen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "facet_axes.hpp"
#include "polygon.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
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
    std::map<std::array<Index, 4>, std::vector<Index>> cells;
    for (const Index i : facet.patches) {
      const Eigen::Array2d cell =
          ((axes.flat(mesh_.centroid(i)) - axes.box.min()).array() / axes.box.sizes().array() * count +
           kRounding)
              .floor();
      cells[{mesh_.material(i), apart_[mesh_.cluster(i)], static_cast<Index>(cell.x()),
             static_cast<Index>(cell.y())}]
          .push_back(i);
    }
    for (const auto& [key, patches] : cells) number_connected(patches);
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
  // Those of a cell that a wall on the facet divides are in two rooms: a group each, as patches end at what touches their face.
  void number_connected(const std::vector<Index>& patches) {
    DisjointSets sets(patches.size());
    std::map<std::pair<Index, Index>, Index> with_edge;  // the first of them
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const auto corners = mesh_.corners(patches[k]);
      for (std::size_t c = 0; c < corners.size(); ++c) {
        const std::pair<Index, Index> edge = std::minmax(corners[c], corners[(c + 1) % corners.size()]);
        const auto [first, is_new] = with_edge.try_emplace(edge, static_cast<Index>(k));
        if (!is_new && !stands_on(edge, mesh_.normal(patches[k])))
          sets.unite(first->second, static_cast<Index>(k));
      }
    }
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const auto root = static_cast<std::size_t>(sets.root(static_cast<Index>(k)));  // at most k
      group_[mesh_.cluster(patches[k])] = root == k ? groups_++ : group_[mesh_.cluster(patches[root])];
    }
  }

  // Whether a patch that faces another way has the edge, too.
  bool stands_on(const std::pair<Index, Index>& edge, const Vec3& normal) const {
    constexpr double kAlike = 0.9;
    return std::ranges::any_of(mesh_.vertex_patches(edge.first), [&](Index i) {
      return std::abs(mesh_.normal(i).dot(normal)) < kAlike &&
             std::ranges::find(mesh_.corners(i), edge.second) != mesh_.corners(i).end();
    });
  }

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
