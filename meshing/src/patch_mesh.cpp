// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/patch_mesh.hpp"

#include <fmt/format.h>

#include <OpenMesh/Core/Mesh/PolyConnectivity.hh>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>

#include "polygon.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "validate_materials.hpp"

namespace radiosity {
namespace {

using HalfEdges = OpenMesh::PolyConnectivity;

/// The half-edge structure of the patches. Where they form no surface (more than two patches at an edge, or
/// fans that meet in a vertex only) patches get half-edge vertices of their own, and `origin` tells for which
/// vertex of the mesh they stand.
struct Topology {
  HalfEdges half_edges;
  std::vector<Index> origin;
  std::vector<std::uint8_t> split;  ///< per vertex of the mesh
  std::multimap<Index, Index> copies;

  explicit Topology(const PatchMesh::Arrays& arrays) : split(arrays.vertices.size(), 0) {
    half_edges.reserve(arrays.vertices.size(), arrays.corners.size() * 3 / 4, arrays.patch_material.size());
    for (std::size_t v = 0; v < arrays.vertices.size(); ++v) add_vertex(static_cast<Index>(v));
    std::vector<HalfEdges::VertexHandle> loop;
    for (std::size_t p = 0; p + 1 < arrays.patch_start.size(); ++p) {
      const auto first = at(arrays.patch_start[p]), n = at(arrays.patch_start[p + 1]) - first;
      const std::span corners = std::span(arrays.corners).subspan(first, n);
      loop.clear();
      for (std::size_t k = 0; k < n; ++k) {
        const bool repeated = std::find(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(k),
                                        corners[k]) != corners.begin() + static_cast<std::ptrdiff_t>(k);
        loop.push_back(repeated ? replace(corners[k]) : open_vertex(corners[k]));
      }
      for (std::size_t k = 0; k < n; ++k) {
        const std::size_t next = (k + 1) % n;
        const auto edge = half_edges.find_halfedge(loop[k], loop[next]);
        if (!edge.is_valid() || half_edges.is_boundary(edge)) continue;
        loop[k] = replace(corners[k]);
        loop[next] = replace(corners[next]);
      }
      if (!can_be_linked(loop))
        for (std::size_t k = 0; k < n; ++k) loop[k] = replace(corners[k]);
      half_edges.add_face(loop);
    }
  }

 private:
  // Where the face closes the gap between two edges of one fan, no other fan may stand in that gap. add_face would find out, too,
  // but says so on std::cerr.
  bool can_be_linked(const std::vector<HalfEdges::VertexHandle>& loop) const {
    const std::size_t n = loop.size();
    for (std::size_t k = 0; k < n; ++k) {
      const auto in = half_edges.find_halfedge(loop[k], loop[(k + 1) % n]);
      const auto out = half_edges.find_halfedge(loop[(k + 1) % n], loop[(k + 2) % n]);
      if (!in.is_valid() || !out.is_valid() || half_edges.next_halfedge_handle(in) == out) continue;
      HalfEdges::HalfedgeHandle gap = half_edges.opposite_halfedge_handle(out);
      do gap = half_edges.opposite_halfedge_handle(half_edges.next_halfedge_handle(gap));
      while (!half_edges.is_boundary(gap));
      if (gap == in) return false;
    }
    return true;
  }
  HalfEdges::VertexHandle add_vertex(Index stands_for) {
    origin.push_back(stands_for);
    return half_edges.add_vertex();
  }
  HalfEdges::VertexHandle replace(Index vertex) {
    split[vertex] = 1;
    copies.emplace(vertex, static_cast<Index>(origin.size()));
    return add_vertex(vertex);
  }
  /// The vertex or a copy of it whose patches do not close a ring yet.
  HalfEdges::VertexHandle open_vertex(Index vertex) {
    if (const HalfEdges::VertexHandle v(vertex); half_edges.is_boundary(v)) return v;
    const auto [first, last] = copies.equal_range(vertex);
    for (auto copy = first; copy != last; ++copy)
      if (const HalfEdges::VertexHandle v(copy->second); half_edges.is_boundary(v)) return v;
    return replace(vertex);
  }
};

}  // namespace

PatchMesh::PatchMesh(Arrays arrays) : arrays_(std::move(arrays)) {
  const auto& [vertices, corners, patch_start, patch_surface, patch_material, materials, facets,
               patch_cluster, symmetry, images] = arrays_;
  constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<Index>::max());
  validate(std::span<const Material>(materials));
  const std::size_t patches = patch_material.size();
  if (corners.size() > kMost || vertices.size() > kMost)
    throw InputError(
        fmt::format("the patches have {} vertices and {} corners; at most {} of each are possible",
                    vertices.size(), corners.size(), kMost));
  if (patch_start.size() != patches + 1 || patch_surface.size() != patches || patch_start.front() != 0 ||
      at(patch_start.back()) != corners.size())
    throw InputError(
        fmt::format("{} patches with {} corners need as many surface numbers (not {}), and starts 0 to {} "
                    "(not {} entries)",
                    patches, corners.size(), patch_surface.size(), corners.size(), patch_start.size()));
  if (images < 0 || patches % (at(images) + 1) != 0)
    throw InputError(fmt::format("{} patches are not {} images of each of some", patches, images));
  originals_ = static_cast<Index>(patches) / (images + 1);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (!vertices[v].allFinite())
      throw InputError(fmt::format("vertex {}: its coordinates ({}, {}, {}) are not finite", v,
                                   vertices[v].x(), vertices[v].y(), vertices[v].z()));

  if (facets) {
    std::vector<std::uint8_t> seen(patches, 0);
    for (const Facet& facet : *facets)
      for (const Index p : facet.patches) {
        if (p < 0 || at(p) >= patches || seen[p] != 0)
          throw InputError(
              fmt::format("facets: patch {} is in several, or not one of the {} patches", p, patches));
        seen[p] = 1;
      }
    if (const auto missing = std::find(seen.begin(), seen.end(), 0); missing != seen.end())
      throw InputError(fmt::format("facets: patch {} is in none", missing - seen.begin()));
  }

  areas_.resize(static_cast<Eigen::Index>(patches));
  normals_.reserve(patches);
  centroids_.reserve(patches);
  triangle_start_.reserve(patches + 1);
  triangle_start_.push_back(0);
  lower_ = Vec3::Constant(std::numeric_limits<double>::infinity());
  upper_ = -lower_;
  for (std::size_t p = 0; p < patches; ++p) {
    if (at(patch_start[p + 1]) > corners.size())
      throw InputError(fmt::format("patch {}: patch_start ends it at corner {}, of {}", p, patch_start[p + 1],
                                   corners.size()));
    if (patch_start[p + 1] - patch_start[p] < 3)
      throw InputError(fmt::format("patch {}: it has {} corners; at least 3 are needed", p,
                                   patch_start[p + 1] - patch_start[p]));
    if (patch_material[p] < 0 || at(patch_material[p]) >= materials.size())
      throw InputError(fmt::format("patch {}: material {} is not one of the {} materials", p,
                                   patch_material[p], materials.size()));
    const std::span<const Index> loop = this->corners(static_cast<Index>(p));
    for (const Index v : loop) {
      if (v < 0 || at(v) >= vertices.size())
        throw InputError(
            fmt::format("patch {}: vertex {} is not one of the {} vertices", p, v, vertices.size()));
      lower_ = lower_.cwiseMin(vertices[v]);
      upper_ = upper_.cwiseMax(vertices[v]);
    }
    const Vec3 area_vector = polygon::area_vector(vertices, loop);
    const double area = area_vector.norm();
    if (!(area > 0 && std::isfinite(area)))
      throw InputError(fmt::format("patch {} (of face {}): its area is {} m²; it must be more than 0", p,
                                   patch_surface[p], area));
    areas_[static_cast<Eigen::Index>(p)] = area;
    normals_.push_back(area_vector / area);

    // x_c = v_0 + Σ A_k (d_k + d_{k+1})/3 / Σ A_k, with d_k = v_k − v_0 and the signed areas A_k.
    const Vec3& first = vertices[loop[0]];
    Vec3 moment = Vec3::Zero();
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      const Vec3 a = vertices[loop[k]] - first, b = vertices[loop[k + 1]] - first;
      moment += a.cross(b).dot(normals_.back()) / 2 * (a + b) / 3;
    }
    centroids_.push_back(first + moment / area);

    for (const auto& [a, b, c] : polygon::triangles(vertices, loop)) {
      triangles_.push_back({loop[a], loop[b], loop[c]});
      triangle_patch_.push_back(static_cast<Index>(p));
    }
    triangle_start_.push_back(static_cast<Index>(triangles_.size()));
  }
  if (patches == 0) lower_ = upper_ = Vec3::Zero();
  number_clusters();

  vertex_patches_.start.assign(vertices.size() + 1, 0);
  for (const Index v : corners) ++vertex_patches_.start[v + 1];
  for (std::size_t v = 0; v < vertices.size(); ++v) vertex_patches_.start[v + 1] += vertex_patches_.start[v];
  // A patch that passes a vertex twice is listed once; the gap closes below.
  std::vector<Index> used(vertices.size(), 0), last(vertices.size(), -1);
  vertex_patches_.items.resize(corners.size());
  for (std::size_t p = 0; p < patches; ++p)
    for (const Index v : this->corners(static_cast<Index>(p))) {
      if (last[v] == static_cast<Index>(p)) continue;
      last[v] = static_cast<Index>(p);
      vertex_patches_.items[vertex_patches_.start[v] + used[v]++] = static_cast<Index>(p);
    }
  std::size_t filled = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const auto from = at(vertex_patches_.start[v]);
    vertex_patches_.start[v] = static_cast<Index>(filled);
    for (std::size_t k = 0; k < at(used[v]); ++k)
      vertex_patches_.items[filled++] = vertex_patches_.items[from + k];
  }
  vertex_patches_.start[vertices.size()] = static_cast<Index>(filled);
  vertex_patches_.items.resize(filled);

  const Topology topology(arrays_);
  const HalfEdges& mesh = topology.half_edges;
  on_border_ = topology.split;
  const double touch = tolerance::kContact * diagonal();
  // The border of a patch in a mirror plane, where it meets its image smoothly.
  const auto mirrored_smoothly = [&](HalfEdges::HalfedgeHandle border) {
    const Index patch = mesh.face_handle(mesh.opposite_halfedge_handle(border)).idx();
    const Vec3& a = vertices[topology.origin[mesh.from_vertex_handle(border).idx()]];
    const Vec3& b = vertices[topology.origin[mesh.to_vertex_handle(border).idx()]];
    return std::ranges::any_of(symmetry.planes, [&](const MirrorPlane& plane) {
      const double across = normals_[patch][plane.axis];
      return std::abs(a[plane.axis] - plane.offset) <= touch &&
             std::abs(b[plane.axis] - plane.offset) <= touch &&
             1 - 2 * across * across >= tolerance::kSmoothCosine;
    });
  };
  std::vector<std::array<Index, 2>> pairs;
  pairs.reserve(2 * mesh.n_edges());
  for (const auto h : mesh.halfedges())
    pairs.push_back(
        {topology.origin[mesh.from_vertex_handle(h).idx()], topology.origin[mesh.to_vertex_handle(h).idx()]});
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  vertex_neighbours_.start.assign(vertices.size() + 1, 0);
  vertex_neighbours_.items.reserve(pairs.size());
  for (const auto& [v, neighbour] : pairs) {
    ++vertex_neighbours_.start[v + 1];
    vertex_neighbours_.items.push_back(neighbour);
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    vertex_neighbours_.start[v + 1] += vertex_neighbours_.start[v];
    if (mesh.is_isolated(HalfEdges::VertexHandle(static_cast<int>(v)))) on_border_[v] = 1;
  }
  for (const auto h : mesh.halfedges())
    if (mesh.is_boundary(h) && !mirrored_smoothly(h))
      for (const auto end : {mesh.from_vertex_handle(h), mesh.to_vertex_handle(h)})
        if (topology.origin[end.idx()] == end.idx()) on_border_[end.idx()] = 1;
  spread_powers();
}

double PatchMesh::longest_edge(Index patch) const {
  return polygon::longest_edge(arrays_.vertices, corners(patch));
}

PatchMesh PatchMesh::with_materials(std::vector<Material> materials) const {
  if (materials.size() != arrays_.materials.size())
    throw InputError(fmt::format("{} materials were given for a mesh that has {}", materials.size(),
                                 arrays_.materials.size()));
  validate(materials);
  PatchMesh mesh = *this;
  mesh.arrays_.materials = std::move(materials);
  mesh.spread_powers();
  return mesh;
}

PatchMesh PatchMesh::with_clusters(std::vector<Index> patch_cluster) const {
  PatchMesh mesh = *this;
  mesh.arrays_.patch_cluster = std::move(patch_cluster);
  mesh.number_clusters();
  return mesh;
}

void PatchMesh::number_clusters() {
  std::vector<Index>& cluster = arrays_.patch_cluster;
  const auto patches = at(original_count());
  if (!cluster.empty() && cluster.size() != patches)
    throw InputError(fmt::format("{} numbers of clusters for {} patches", cluster.size(), patches));
  std::unordered_map<Index, Index> number;
  std::vector<Index> first;
  for (std::size_t p = 0; p < cluster.size(); ++p) {
    const auto [found, is_new] = number.try_emplace(cluster[p], static_cast<Index>(first.size()));
    if (is_new) first.push_back(static_cast<Index>(p));
    const Index known = first[at(found->second)];
    if (material(known) != material(static_cast<Index>(p)))
      throw InputError(
          fmt::format("patches {} and {} are in one cluster, but of different materials", known, p));
    cluster[p] = found->second;
  }
  members_ = {};
  members_.items.resize(patches);
  std::iota(members_.items.begin(), members_.items.end(), 0);
  cluster_areas_.resize(0);
  if (first.size() == patches) cluster.clear();
  if (cluster.empty()) {
    if (arrays_.images > 0) cluster_areas_ = areas_.head(static_cast<Eigen::Index>(patches));
    return;
  }
  std::stable_sort(members_.items.begin(), members_.items.end(),
                   [&](Index a, Index b) { return cluster[at(a)] < cluster[at(b)]; });
  members_.start.assign(first.size() + 1, 0);
  cluster_areas_ = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(first.size()));
  for (std::size_t p = 0; p < patches; ++p) {
    ++members_.start[at(cluster[p]) + 1];
    cluster_areas_[cluster[p]] += areas_[static_cast<Eigen::Index>(p)];
  }
  std::partial_sum(members_.start.begin(), members_.start.end(), members_.start.begin());
}

BandArray PatchMesh::per_cluster(const BandArray& per_patch) const {
  if (!clustered()) return per_patch.topRows(original_count());
  BandArray out(cluster_count(), per_patch.cols());
  for (Index c = 0; c < cluster_count(); ++c) out.row(c) = per_patch.row(members(c)[0]);
  return out;
}

BandArray PatchMesh::per_patch(const BandArray& per_cluster) const {
  if (!clustered()) return per_cluster;
  return per_cluster(arrays_.patch_cluster, Eigen::all);
}

/// E = Φ / A
void PatchMesh::spread_powers() {
  std::vector<double> area(arrays_.materials.size());
  for (Index p = 0; p < original_count(); ++p) area[material(p)] += areas_[p];
  for (std::size_t m = 0; m < area.size(); ++m) {
    Material& lamp = arrays_.materials[m];
    if (!lamp.emits_power) continue;
    lamp.emits_power = false;
    if ((lamp.emission == 0).all()) continue;
    if (!(area[m] > 0))
      throw InputError(fmt::format("material '{}': {} W have no patch to leave from", lamp.name,
                                   lamp.emission.maxCoeff()));
    lamp.emission /= area[m];
  }
}

Index PatchMesh::bands() const {
  return static_cast<Index>(arrays_.materials.front().reflectance.size());
}

BandArray PatchMesh::reflectance() const {
  BandArray rho(patch_count(), bands());
  for (Index p = 0; p < patch_count(); ++p) rho.row(p) = material_of(p).reflectance;
  return rho;
}

BandArray PatchMesh::absorptance() const {
  BandArray alpha(patch_count(), bands());
  for (Index p = 0; p < patch_count(); ++p) alpha.row(p) = radiosity::absorptance(material_of(p));
  return alpha;
}

BandArray PatchMesh::emission() const {
  BandArray emission(patch_count(), bands());
  for (Index p = 0; p < patch_count(); ++p) emission.row(p) = material_of(p).emission;
  return emission;
}

}  // namespace radiosity
