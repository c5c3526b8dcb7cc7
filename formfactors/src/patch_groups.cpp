// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_groups.hpp"

#include <algorithm>

namespace radiosity {
namespace {

constexpr std::ptrdiff_t kMostPatches = 32;

struct Grouper {
  const PatchMesh& mesh;
  const Vec3& origin;
  std::vector<PatchGroup>& groups;
  Vec3 normal, u, v;
  std::size_t facet;

  void add(std::vector<Index>::iterator first, std::vector<Index>::iterator last) {
    Eigen::AlignedBox2d box;
    for (auto i = first; i != last; ++i) {
      for (const Index c : mesh.corners(*i)) {
        const Vec3 x = mesh.vertex(c) - origin;
        box.extend(Eigen::Vector2d(u.dot(x), v.dot(x)));
      }
    }
    if (last - first > kMostPatches) {
      const Vec3& axis = box.sizes().x() >= box.sizes().y() ? u : v;
      const auto before = [&](Index a, Index b) {
        const double ca = axis.dot(mesh.centroid(a) - origin);
        const double cb = axis.dot(mesh.centroid(b) - origin);
        return ca != cb ? ca < cb : a < b;
      };
      const auto middle = first + (last - first) / 2;
      std::nth_element(first, middle, last, before);
      add(first, middle);
      add(middle, last);
      return;
    }
    PatchGroup group{{first, last}, {}, normal, normal.dot(mesh.centroid(*first) - origin), facet};
    std::sort(group.patches.begin(), group.patches.end());
    if (group.patches.size() == 1) {
      for (const Index c : mesh.corners(*first)) group.corners.push_back(mesh.vertex(c) - origin);
    } else {
      for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                                Eigen::AlignedBox2d::TopRight, Eigen::AlignedBox2d::TopLeft}) {
        const Eigen::Vector2d p = box.corner(corner);
        group.corners.push_back(p.x() * u + p.y() * v + group.offset * normal);
      }
    }
    groups.push_back(std::move(group));
  }
};

}  // namespace

std::vector<PatchGroup> patch_groups(const PatchMesh& mesh, const std::vector<Facet>& facets,
                                     const Vec3& origin) {
  std::vector<PatchGroup> groups;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const Facet& facet = facets[f];
    const Vec3& normal = facet.patches.size() == 1 ? mesh.normal(facet.patches[0]) : facet.pieces[0].normal;
    // Along an edge of the facet, where walls end.
    const Vec3 u = (facet.pieces[0].corners[1] - facet.pieces[0].corners[0]).normalized();
    const Vec3 v = normal.cross(u).normalized();
    std::vector<Index> patches = facet.patches;
    Grouper{mesh, origin, groups, normal, v.cross(normal), v, f}.add(patches.begin(), patches.end());
  }
  return groups;
}

}  // namespace radiosity
