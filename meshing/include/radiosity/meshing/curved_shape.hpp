// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "radiosity/meshing/scene.hpp"

namespace radiosity {

struct Sphere {  ///< fronts outside
  Vec3 centre;
  double radius;  ///< m
};
struct Cylinder {  ///< fronts outside; open at both ends, or closed by disks
  Vec3 base, top;  ///< ends of the axis
  double radius;   ///< m
  bool caps = false;
};
struct Disk {  ///< front where the normal points
  Vec3 centre, normal;
  double radius;  ///< m
};
/// Bicubic patches S(u, v) = Σ_i Σ_j B_i(u) B_j(v) P_ij, B the Bernstein polynomials of degree 3, each with its points P_00, P_01, P_02,
/// P_03, P_10, …; fronts where S_u × S_v points. Patches whose edges have the same points, in either order, have no gap between them.
struct BezierSurface {
  std::vector<std::array<Vec3, 16>> patches;
};

/// A surface that is not planar, by its formula. Lengths in m.
struct CurvedShape {
  std::string name = {};  ///< for messages
  std::variant<Sphere, Cylinder, Disk, BezierSurface> surface;
  bool flip = false;  ///< fronts are on the other side
};

/// A length to choose a chord error by: the radius, or half the diagonal of the box about the control points, m.
double size(const CurvedShape& shape);

/// A ball that holds the shape.
struct Ball {
  Vec3 centre;
  double radius;  ///< m
};
Ball enclosing_ball(const CurvedShape& shape);

/// Adds facets whose vertices lie on the surface and from which no point of it is further than `chord_error`, in m:
///   sphere: an icosahedron, each face divided into ν² triangles that are pushed out, the least ν or nearly so;
///   cylinder, disk: the regular n-gon with r (1 − cos(π/n)) ≤ chord_error;
///   Bézier: n × n quads of two triangles each, the least n with (M_uu + 2 M_uv + M_vv) / (8 n²) ≤ chord_error
///   [Filip1986], M the largest second derivatives as the control points bound them.
/// Spheres have ν ≥ 2 and polygons n ≥ 16, so that neighbours meet at less than 30° and count as one smooth surface. Edges are shared by vertex numbers.
/// Throws InputError naming the shape on a radius, an axis or a chord error that is not positive, on numbers that are not finite, and
/// where it would take more than tolerance::kMostPiecesOfFace facets.
void tessellate(const CurvedShape& shape, double chord_error, Index material, Scene::Arrays& arrays);

}  // namespace radiosity
