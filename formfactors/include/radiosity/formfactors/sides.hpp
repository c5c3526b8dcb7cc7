// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/scene.hpp"

namespace radiosity {

/// What light meets first: fronts, or backs, which are black. Told by cosine-distributed rays [Malley1988] from about 2,000 places on
/// the patches and 200 on the lamps, the same for every method; shares below a thousandth are noise.
struct SeenSides {
  /// Share of what leaves the patches that ends on backs, and on those of each material. Patches that see no front do not count: a
  /// floor under a cupboard only sees what nobody else does. Neither do backs of materials that emit: a lamp's back may be dark.
  double backs = 0;
  std::vector<double> backs_of;
  /// The same of what the lamps emit, whatever they see.
  double lamp_backs = 0;
  std::vector<double> lamp_backs_of;
  double isolated = 0;  ///< share of the area that sees no front
  bool look_outwards =
      false;  ///< nearly nothing sees a front, because the fronts look away from the middle, lamps included
};

SeenSides seen_sides(const Visibility& visibility, std::uint64_t seed = 1);

/// Sentences about them for the user, each with its cure in words of the scene file; often none.
std::vector<std::string> side_warnings(const SeenSides& seen, const PatchMesh& mesh);

/// A material leaves its sides to decide_sides.
bool has_open_sides(const Scene& scene);

/// Faces of materials with Sides::automatic: which get a back of their own.
struct DecidedSides {
  Scene scene;              ///< which says it for each face
  Index sheets = 0;         ///< open parts of the surface that get backs
  Index faces = 0;          ///< of those sheets
  double area = 0;          ///< m², of one side of them
  Index unseen_sheets = 0;  ///< open parts that nothing sees from behind
  Index solids = 0;         ///< closed parts, which keep one side
};

/// An open part of the surface (see surface_parts) gets backs where more than 1 % of the directions from behind it meet fronts that emit
/// or see other fronts, or backs that are given to other parts. Closed parts keep one side: behind their fronts is matter, or the
/// outside of the room.
DecidedSides decide_sides(const Scene& scene, std::uint64_t seed = 1);

}  // namespace radiosity
