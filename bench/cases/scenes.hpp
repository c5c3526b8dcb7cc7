// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <initializer_list>
#include <random>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/meshing/scene.hpp"

/// Small scenes with patches placed by hand, so that tests of form factors and solvers do not depend on
/// make_patches.
namespace radiosity::test {

/// One band.
Material grey(std::string name, double reflectance, double emission);

/// Uniform on [0, 1), the same on every platform (the distributions of <random> are not).
double uniform(std::mt19937_64& random);

enum class Facing { inward, outward };

/// Adds surfaces one after the other; all pieces of a surface have its number, all surfaces added after
/// `use_material` that material.
class MeshBuilder {
 public:
  MeshBuilder();  ///< material 0: ρ = 0.5, E = 1

  MeshBuilder& use_material(Material material);

  /// The parallelogram origin + s u + t v cut into nu × nv quads; front normal u × v. Patch b·nu + a of the
  /// surface is the piece a of u and b of v.
  MeshBuilder& grid(const Vec3& origin, const Vec3& u, const Vec3& v, Index nu, Index nv);

  /// One patch.
  MeshBuilder& polygon(const std::vector<Vec3>& corners);

  /// Six surfaces of n × n quads in the order x−, x+, y−, y+, z− (floor), z+ (ceiling).
  MeshBuilder& box(const Vec3& lower, const Vec3& upper, Index n, Facing facing);

  /// One smooth surface of 20·4^subdivisions triangles with corners on the sphere.
  MeshBuilder& sphere(const Vec3& centre, double radius, int subdivisions, Facing facing);

  PatchMesh build() const { return PatchMesh(arrays_); }

 private:
  void add_patch(std::initializer_list<Index> corners);
  void next_surface() { ++surface_; }

  PatchMesh::Arrays arrays_;
  Index material_ = 0, surface_ = 0;
};

/// [0, 1]³ seen from the inside, n × n patches a face: 6 n² patches, closed and convex.
PatchMesh cube_room(Index n);

/// The same with a box in mid-air, [0.3, 0.6] × [0.3, 0.65] × [0.4, 0.7], m × m patches a face, last.
PatchMesh room_with_floating_box(Index n, Index m);

/// Unit squares at distance `gap`, facing each other, n × n patches each.
PatchMesh opposed_squares(double gap, Index n = 1);

/// opposed_squares(1, n) with a square of side `side`, seen from both sides, midway on the axis (m × m
/// patches a side, last).
PatchMesh opposed_squares_with_screen(Index n, double side, Index m = 1);

/// Rectangles l × w (lying) and l × h with the edge l in common, at `angle` (π/2: a right angle).
PatchMesh rectangles_sharing_an_edge(double l, double w, double h, double angle);

/// Regular tetrahedron seen from the inside, one patch a face.
PatchMesh tetrahedron();

/// Spheres of radius 1 (seen from outside, material 0) and 2 (seen from inside, material 1) about the origin.
PatchMesh concentric_spheres(int inner_subdivisions, int outer_subdivisions, const Material& inner,
                             const Material& outer);

/// [0, 2] × [0, 1]², 6k × 3k × 3k patches, with a wall of no thickness at x = 1, seen from both sides, in which
/// a door y ∈ [1/3, 2/3], z ∈ [0, 2/3] is left open. Closed, not convex.
PatchMesh two_rooms(Index k);

/// cube_room(n) with `count` two-sided triangles in mid-air, at random.
PatchMesh room_with_triangle_soup(Index n, Index count, std::uint64_t seed);

/// Faces [0, 1]³ from the inside and, outward, a box [1/3, 2/3]² × [0, 1/2] that stands on the floor, bottom
/// included. Materials 0 (room) and 1 (box).
Scene box_on_floor();

/// Two rooms of 5.4 × 6 × 3 m and 4.4 × 6 × 3 m, joined by a door, closed: 16 pieces of furniture, a lamp under each ceiling
/// that shines from all its sides, 1 m² of it downwards.
Scene two_furnished_rooms();

/// An office floor of 24 × 12.2 × 3 m, closed: six rooms of 4 × 5 m on either side of a corridor, a door, a desk, a cupboard and
/// a lamp of 0.6 m² in each; the corridor has no lamp.
Scene office_floor();

/// `rooms` offices of 4 × 5 × 3 m on either side of a corridor without lamps, closed. Each has a door, a window, two desks and two
/// chairs on legs, a shelf of six boards, and four hanging luminaires of 0.36 m² that shine downwards.
Scene office_building(int rooms);

/// A cube of side 1, its ceiling the lamp, with a box [0.25, 0.75]³ in the middle.
Scene cube_with_box();

/// A Cornell box of side 0.55 m with a front wall, so that it is closed: red and green side walls, two turned blocks on the
/// floor, a lamp of 0.13 × 0.11 m flush with the ceiling; three bands. z is up.
Scene closed_cornell_box();

/// A unit cube whose ceiling emits 1 W/m², with the reflectances of floor, ceiling and walls.
Scene lit_cube(double floor, double ceiling, double walls);

/// What a mesh was made of, to make others of; without clusters and facets.
PatchMesh::Arrays arrays_of(const PatchMesh& mesh);

/// The faces of a mesh as a scene.
Scene scene_of(const PatchMesh& mesh);

/// A closed room of 4 × 3 × 2.5 m with one to four boxes in it, standing or in mid-air, turned, a lamp on the ceiling, and
/// reflectances between 0.1 and 0.9; all at random.
Scene random_room(std::uint64_t seed);

PatchMesh transformed(const PatchMesh& mesh, const Eigen::Affine3d& transform);

}  // namespace radiosity::test
