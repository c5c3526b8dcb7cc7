// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "radiosity/meshing/make_patches.hpp"

namespace radiosity {

Material grey(const std::string& name = "grey", Sides sides = Sides::front);

/// Collects polygons; every face has vertices of its own, as from a file that does not share them.
struct Shape {
  std::vector<std::vector<Vec3>> faces;
  std::vector<Index> materials;

  Shape& face(std::vector<Vec3> corners, Index material = 0);
  /// The surface of an axis-parallel box, fronts outward (or inward), faces in the order −x +x −y +y −z +z.
  Shape& box(const Vec3& lower, const Vec3& upper, bool inward = false, bool bottom = true);
  Shape& append(const Shape& other);
  Shape reversed() const;
  template <class Map>
  Shape mapped(const Map& map) const {
    Shape result = *this;
    for (auto& corners : result.faces)
      for (Vec3& x : corners) x = map(x);
    return result;
  }
  Scene scene(std::vector<Material> wanted = {grey()}) const;
};

/// A rectangle in the plane z = 0, front up.
std::vector<Vec3> rectangle(double x0, double y0, double x1, double y1, double z = 0);

/// [0, 3]² with the hole [1, 2]², front up: a keyhole polygon, which walks its bridge from (0, 0) to (1, 1) both ways.
std::vector<Vec3> wall_round_a_window();

/// A sphere of triangles: the icosahedron, each triangle split into 4 `rounds` times. Front outward.
Scene icosphere(int rounds, double radius = 1);

double total_area(const PatchMesh& mesh);
double smallest_angle_deg(const PatchMesh& mesh);
double longest_edge(const PatchMesh& mesh);

/// Vertices, by position, that lie strictly inside an edge of a patch.
int t_vertices(const PatchMesh& mesh);

/// Directed edges, by position, that are not matched by one edge in the opposite direction.
int unmatched_edges(const PatchMesh& mesh);

}  // namespace radiosity
