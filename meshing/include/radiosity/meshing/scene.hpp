// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "radiosity/meshing/material.hpp"
#include "radiosity/meshing/symmetry.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Polygons with materials, in metres, as they came from the file. Immutable and validated: finite
/// coordinates, indices in range, at least three corners a face, valid materials with the same bands and
/// different names. Corners run counter-clockwise seen from the front. A face with holes is one loop that
/// walks each bridge to a hole twice, once each way (a "keyhole" polygon), as OBJ files write them.
class Scene {
 public:
  struct Arrays {
    std::vector<Vec3> vertices;        ///< m
    std::vector<Index> corners;        ///< vertex numbers of all faces, one face after the other
    std::vector<Index> face_start{0};  ///< face f has corners [face_start[f], face_start[f+1])
    std::vector<Index> face_material;  ///< one per face
    std::vector<Material> materials;
    std::vector<std::uint8_t> two_sided = {};  ///< one per face, where that is not left to the materials
    Symmetry symmetry = {};                    ///< of which the faces are one cell

    void add_face(std::span<const Index> face_corners, Index material);
  };

  /// Throws InputError naming the face, vertex, material or plane that breaks a rule; see settle(Symmetry&, …).
  explicit Scene(Arrays arrays);

  Index face_count() const { return static_cast<Index>(arrays_.face_material.size()); }
  Index vertex_count() const { return static_cast<Index>(arrays_.vertices.size()); }
  Index bands() const;

  const std::vector<Vec3>& vertices() const { return arrays_.vertices; }
  std::span<const Index> corners(Index face) const;
  Index material(Index face) const { return arrays_.face_material[face]; }
  const std::vector<Material>& materials() const { return arrays_.materials; }
  bool two_sided(Index face) const {
    return arrays_.two_sided.empty() ? materials()[material(face)].sides == Sides::both
                                     : arrays_.two_sided[face] != 0;
  }

  /// In force: of a period, with its steps.
  const Symmetry& symmetry() const { return arrays_.symmetry; }

  /// Half of the Newell vector Σ v_k × v_{k+1}: its length is the face's area, its direction the front
  /// normal.
  Vec3 area_vector(Index face) const;

  /// Radiating area of a material in m²: the sum over its faces, without their images, twice that of faces with two sides.
  double material_area(Index material) const;

  /// Corners of the axis-parallel bounding box.
  const Vec3& lower() const { return lower_; }
  const Vec3& upper() const { return upper_; }

  /// The same geometry with other materials (as many, in the same order).
  Scene with_materials(std::vector<Material> materials) const;

  /// The same scene, but which faces have two sides is given for each. Throws InputError on another number of them.
  Scene with_two_sided(std::vector<std::uint8_t> two_sided) const;

 private:
  Arrays arrays_;
  Vec3 lower_, upper_;
};

/// Lamps of a scene switched off (0), dimmed or brightened: a factor on the emission of each material.
struct LightingSetup {
  std::string name;
  std::vector<double> factors;
};

/// The material of a face emits.
bool emits(const Scene& scene);

/// The bands of the scene, followed by as many for each set-up: geometry and reflectances are the same, so all of them share F and
/// each pass over it. Throws InputError on a number of factors that is not that of the materials, or a factor that is negative or not
/// finite.
Scene with_setups(const Scene& scene, std::span<const LightingSetup> setups);

/// `count` bands of every material from `first` on.
std::vector<Material> select_bands(std::span<const Material> materials, Index first, Index count);

/// The same scene with one band where all bands of every material are equal: grey light is solved once.
Scene merge_equal_bands(const Scene& scene);

}  // namespace radiosity
