// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/surface_parts.hpp"

#include "radiosity/meshing/disjoint_sets.hpp"
#include "surface.hpp"

namespace radiosity {

SurfaceParts surface_parts(const Scene& scene) {
  Repairs repairs;
  std::vector<std::string> warnings;
  const Surface surface = repair(scene, repairs, warnings);

  const std::vector<EdgeSide> sides = edge_sides(surface);
  DisjointSets joined(surface.count());
  std::vector<Index> on_odd_edges;
  for (std::size_t k = 0, next; k < sides.size(); k = next) {
    for (next = k + 1; next < sides.size() && sides[next].key == sides[k].key;) ++next;
    if (next - k == 2) joined.unite(sides[k].polygon, sides[k + 1].polygon);
    if ((next - k) % 2 == 1)
      for (std::size_t s = k; s < next; ++s) on_odd_edges.push_back(sides[s].polygon);
  }

  SurfaceParts parts;
  parts.part.assign(scene.face_count(), -1);
  std::vector<Index> number(surface.count(), -1);  // per polygon that stands for its set
  for (Index p = 0; p < surface.count(); ++p) {
    Index& part = number[joined.root(p)];
    if (part < 0) {
      part = static_cast<Index>(parts.closed.size());
      parts.closed.push_back(1);
    }
    parts.part[surface.face[p]] = part;
  }
  for (const Index p : on_odd_edges) parts.closed[number[joined.root(p)]] = 0;
  return parts;
}

}  // namespace radiosity
