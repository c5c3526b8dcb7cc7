// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "radiosity/meshing/facet.hpp"
#include "radiosity/meshing/material.hpp"
#include "radiosity/meshing/symmetry.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// The patches: planar polygons (nearly always triangles and quads) with material, immutable. Areas, normals
/// and centroids are computed once. Two patches share a vertex only where the surface is smooth between them:
/// at creases, at changes of material, at contact lines and at open borders every side has vertices of its
/// own, at the same bits of the same position. So a vertex carries one radiosity, and no radiosity bleeds
/// round a corner.
///
/// Patches that are smaller than unknowns need be are joined to clusters, which share one radiosity in the exchange of light: a
/// cluster has the area, and the points, of all its members, each with its own normal, so it may see itself, F_ii > 0. Every patch
/// is in one cluster, mostly by itself; clusters are numbered by their first members.
///
/// Where the patches are one cell of a symmetric scene they stand for the whole of it: see with_images().
class PatchMesh {
 public:
  struct Arrays {
    std::vector<Vec3> vertices;  ///< m
    std::vector<Index> corners;  ///< vertex numbers of all patches, counter-clockwise seen from the front
    std::vector<Index> patch_start{0};  ///< patch i has corners [patch_start[i], patch_start[i+1])
    std::vector<Index> patch_surface;   ///< the face of the file that patch i is a piece of
    std::vector<Index> patch_material;  ///< index into materials
    std::vector<Material> materials;
    std::shared_ptr<const std::vector<Facet>> facets = {};  ///< null where they are not known
    /// Per patch: any number that those of its cluster share, all of one material; empty: each patch is by itself.
    std::vector<Index> patch_cluster = {};
    Symmetry symmetry = {};  ///< of which the patches are one cell
    /// So many times as many patches follow on those of the cell, in the same order each time: patch k n + i of n is an image of patch
    /// i. `patch_cluster` is that of the cell.
    Index images = 0;
  };

  /// Throws InputError on an index out of range, a patch with fewer than three corners, no area or
  /// coordinates that are not finite, invalid materials, facets that do not have each patch once, or clusters of several materials. A
  /// power is divided by the area of its patches, without images; InputError where there are none.
  explicit PatchMesh(Arrays arrays);

  /// The faces that the patches are pieces of, as they were before they were cut; null where that is not known: see facets().
  const std::shared_ptr<const std::vector<Facet>>& facets() const { return arrays_.facets; }

  /// The same patches with other materials, as many, in the same order. Throws InputError on others.
  PatchMesh with_materials(std::vector<Material> materials) const;

  /// The same patches in other clusters, as Arrays::patch_cluster. Throws InputError on clusters of several materials.
  PatchMesh with_clusters(std::vector<Index> patch_cluster) const;

  const Symmetry& symmetry() const { return arrays_.symmetry; }

  /// The whole scene: these patches, and behind them all their images, which belong to the clusters of their originals: what is
  /// visible is asked of all of them, unknown are those of the cell.
  PatchMesh with_images() const;
  /// The whole scene as any other: images are patches like all others, and none are clusters.
  PatchMesh unfolded() const;
  /// Values of the whole, a row per patch or per vertex, of those of the cell.
  BandArray unfolded(const BandArray& of_cell) const;

  Index image_count() const { return arrays_.images; }  ///< of each patch
  Index original_count() const { return originals_; }   ///< patches that are no images
  Index original(Index patch) const { return patch < originals_ ? patch : patch % originals_; }

  /// Whether any cluster has several members; images are none.
  bool clustered() const { return !arrays_.patch_cluster.empty(); }
  Index cluster_count() const {
    return clustered() ? static_cast<Index>(cluster_areas_.size()) : original_count();
  }
  Index cluster(Index patch) const {
    return clustered() ? arrays_.patch_cluster[original(patch)] : original(patch);
  }
  /// Patches that are no images, ascending.
  std::span<const Index> members(Index cluster) const {
    return clustered() ? piece(members_.items, members_.start, cluster)
                       : std::span(members_.items).subspan(static_cast<std::size_t>(cluster), 1);
  }
  /// Of all members, m².
  const Eigen::ArrayXd& cluster_areas() const { return cluster_areas_.size() > 0 ? cluster_areas_ : areas_; }
  /// Of values that members share, a row per patch: a row per cluster; and back, to the patches that are no images.
  BandArray per_cluster(const BandArray& per_patch) const;
  BandArray per_patch(const BandArray& per_cluster) const;

  Index patch_count() const { return static_cast<Index>(arrays_.patch_material.size()); }
  Index vertex_count() const { return static_cast<Index>(arrays_.vertices.size()); }
  Index bands() const;

  const std::vector<Vec3>& vertices() const { return arrays_.vertices; }
  const Vec3& vertex(Index v) const { return arrays_.vertices[v]; }
  std::span<const Index> corners(Index patch) const {
    return piece(arrays_.corners, arrays_.patch_start, patch);
  }
  Index surface(Index patch) const { return arrays_.patch_surface[patch]; }
  Index material(Index patch) const { return arrays_.patch_material[patch]; }
  const std::vector<Material>& materials() const { return arrays_.materials; }
  const Material& material_of(Index patch) const { return arrays_.materials[material(patch)]; }

  double area(Index patch) const { return areas_[patch]; }           ///< A_i, m²
  const Eigen::ArrayXd& areas() const { return areas_; }             ///< A, m²
  const Vec3& normal(Index patch) const { return normals_[patch]; }  ///< unit, front
  const Vec3& centroid(Index patch) const { return centroids_[patch]; }
  double longest_edge(Index patch) const;  ///< m

  /// Triangles that cover the patch: vertex numbers, counter-clockwise seen from the front. Triangle t of the
  /// mesh belongs to patch triangle_patch(t); a patch's triangles are consecutive.
  std::span<const std::array<Index, 3>> triangles() const { return triangles_; }
  std::span<const std::array<Index, 3>> triangles(Index patch) const {
    return piece(triangles_, triangle_start_, patch);
  }
  Index triangle_patch(Index triangle) const { return triangle_patch_[triangle]; }

  /// Patches round a vertex, and vertices joined to it by an edge; on_border where the patches do not close a
  /// ring, with their mirror images where they meet those smoothly.
  std::span<const Index> vertex_patches(Index v) const {
    return piece(vertex_patches_.items, vertex_patches_.start, v);
  }
  std::span<const Index> vertex_neighbours(Index v) const {
    return piece(vertex_neighbours_.items, vertex_neighbours_.start, v);
  }
  bool on_border(Index v) const { return on_border_[v] != 0; }

  /// Corners of the axis-parallel bounding box, and its diagonal in m.
  const Vec3& lower() const { return lower_; }
  const Vec3& upper() const { return upper_; }
  double diagonal() const { return (upper_ - lower_).norm(); }

  /// ρ, 1 − ρ and E of every patch (rows) and band (columns).
  BandArray reflectance() const;
  BandArray absorptance() const;
  BandArray emission() const;

 private:
  struct Rows {
    std::vector<Index> start, items;
  };
  template <class T>
  static std::span<const T> piece(const std::vector<T>& items, const std::vector<Index>& start, Index i) {
    return std::span(items).subspan(start[i], start[i + 1] - start[i]);
  }

  PatchMesh whole(bool tied) const;
  void spread_powers();
  void number_clusters();

  Arrays arrays_;
  Index originals_ = 0;
  Eigen::ArrayXd areas_, cluster_areas_;  // cluster_areas_: empty where they are areas_
  Rows members_;
  std::vector<Vec3> normals_, centroids_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Index> triangle_start_, triangle_patch_;
  Rows vertex_patches_, vertex_neighbours_;
  std::vector<std::uint8_t> on_border_;
  Vec3 lower_ = Vec3::Zero(), upper_ = Vec3::Zero();
};

}  // namespace radiosity
