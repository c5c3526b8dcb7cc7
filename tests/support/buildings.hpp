// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "radiosity/meshing/material.hpp"
#include "radiosity/meshing/types.hpp"

/// Buildings as polygons, and what modelling programs do to them.
namespace radiosity::test {

/// What is wrong with a building's polygons. None of it changes the light by more than a few parts in a thousand.
struct Flaws {
  double angle = 0;                  ///< radians that the building is turned about the vertical, then
  std::optional<int> decimals = {};  ///< rounded
  bool gaps = false;         ///< furniture stands 10⁻⁶, 10⁻⁵, 10⁻⁴ or 10⁻³ m over the floor
  bool sunk = false;         ///< or in it; where both are set, every other piece
  bool duplicates = false;   ///< faces given twice, lamps too
  bool flips = false;        ///< faces of connected surfaces turned round, less than half the area of each
  bool t_junctions = false;  ///< walls split round their openings, their neighbours not
  bool non_planar = false;   ///< corners of floors, walls and furniture 1 … 3 mm off
  bool sheets =
      false;  ///< screens are one face, which the scene file gives sides = "auto", not boxes of 4 mm
};

struct BuildingSettings {
  int along = 2, across = 1;  ///< rooms
  std::uint64_t seed = 1;     ///< of sizes and places
  bool glazed = true;         ///< windows are panes that emit; otherwise open
  bool one_material = false;  ///< all is "default", ρ = ½, E = 1 W/m², as where formats know no materials
  bool triangles = false;     ///< convex faces cut into fans, as formats have it that know nothing else
};

/// Rooms of about 4 × 3.5 × 2.6 m on a grid, z up, within walls of 0.19 m. Doors join neighbours, the outer walls across have
/// windows. A table, a cupboard at the wall, two boxes one on the other and a screen in each room; a lamp flush with the
/// ceiling or under it. Without flaws the rooms are one closed surface whose edges belong to two faces each, every piece of
/// furniture is a closed box, and all contact is exact. Each room has materials of its own: walls0, floor0, …, walls1, …
struct Building {
  struct Face {
    std::vector<Vec3>
        corners;  ///< counter-clockwise from the front; holes by a bridge that is walked both ways
    std::size_t material;
  };
  std::vector<Material> materials;
  std::vector<Face> faces;
};
Building building(const BuildingSettings& settings = {}, const Flaws& flaws = {});

/// Writes it as FILE with what belongs to it beside it, by the extension: .obj (with .mtl), .ply, .stl, .gltf or .dae; the last
/// three take triangles.
void write_building(const Building& building, const std::filesystem::path& file);

}  // namespace radiosity::test
