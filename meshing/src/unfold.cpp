// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/facets.hpp"
#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {

PatchMesh PatchMesh::with_images() const {
  return whole(true);
}

PatchMesh PatchMesh::unfolded() const {
  return whole(false);
}

BandArray PatchMesh::unfolded(const BandArray& of_cell) const {
  return of_cell.replicate(static_cast<Eigen::Index>(images(symmetry()).size()) + 1, 1);
}

PatchMesh PatchMesh::whole(bool tied) const {
  const std::vector<SymmetryImage> all = images(symmetry());
  if (all.empty()) return *this;
  // Of quads; a patch of the whole takes 3 kB with all that visibility makes of it.
  constexpr double kMostCorners = 4 * 4e6;
  const double corners = static_cast<double>(arrays_.corners.size()) * static_cast<double>(all.size() + 1);
  if (corners > kMostCorners)
    throw InputError(fmt::format(
        "symmetry: {} images and the {} patches themselves have {:.2g} corners; at most {:.2g}, some "
        "12 GB of memory, are possible; larger patches, or fewer steps of the period, make fewer",
        all.size(), patch_count(), corners, kMostCorners));
  const double touch = tolerance::kContact * diagonal();
  Arrays arrays = arrays_;
  arrays.symmetry = {};
  if (!tied) arrays.patch_cluster.clear();
  arrays.images = tied ? static_cast<Index>(all.size()) : 0;
  const auto cell_facets = carried_or_found_facets(*this);
  auto facets = std::make_shared<std::vector<Facet>>(*cell_facets);
  const Index n = patch_count(), vertices = vertex_count();
  for (std::size_t k = 0; k < all.size(); ++k) {
    const SymmetryImage& image = all[k];
    const Index before = static_cast<Index>(k + 1) * n,
                vertices_before = static_cast<Index>(k + 1) * vertices;
    for (const Vec3& x : arrays_.vertices) arrays.vertices.push_back(image.of_point(x, touch));
    for (Index i = 0; i < n; ++i) {
      // Turned round, a loop keeps its first corner.
      const auto loop = this->corners(i);
      const auto count = static_cast<Index>(loop.size());
      for (Index c = 0; c < count; ++c)
        arrays.corners.push_back(vertices_before + loop[image.turned() ? (count - c) % count : c]);
      arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
      arrays.patch_surface.push_back(surface(i));
      arrays.patch_material.push_back(material(i));
    }
    for (const Facet& original : *cell_facets) {
      Facet& facet = facets->emplace_back(original);
      for (Index& i : facet.patches) i += before;
      for (Facet::Piece& piece : facet.pieces) {
        for (Vec3& c : piece.corners) c = image.of_point(c, touch);
        if (image.turned()) std::reverse(piece.corners.begin(), piece.corners.end());
        piece.normal = image.of_direction(piece.normal);
      }
      if (facet.back != Facet::kNoBack) facet.back += (k + 1) * cell_facets->size();
    }
  }
  arrays.facets = std::move(facets);
  return PatchMesh(std::move(arrays));
}

}  // namespace radiosity
