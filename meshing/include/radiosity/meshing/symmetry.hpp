// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// The plane x_axis = offset, in m.
struct MirrorPlane {
  int axis = 0;  ///< 0 x, 1 y, 2 z
  double offset = 0;
};

/// What makes the whole of a scene that is one cell of it: its images in planes, which are perpendicular to each other, and all of that
/// again at every step of a period. Radiosities of a patch and its images are equal, so that only those of the cell are unknown.
struct Symmetry {
  std::vector<MirrorPlane> planes = {};
  Vec3 period = Vec3::Zero();  ///< m; 0: none
  /// Steps of the period either way that are seen, K; what is farther off is as if it were not there. 0: as many as it takes, see
  /// steps_of_period.
  Index steps = 0;

  bool periodic() const { return !period.isZero(0); }
  bool none() const { return planes.empty() && !periodic(); }
};

/// One image of the cell: mirrored in some planes, then moved.
struct SymmetryImage {
  std::vector<MirrorPlane> planes = {};
  Vec3 shift = Vec3::Zero();  ///< m

  bool turned() const { return planes.size() % 2 != 0; }  ///< what runs counter-clockwise runs clockwise
  /// A point that is no farther than `touch` from a plane lies in it and is its own image, to the bit: no crack opens there.
  Vec3 of_point(Vec3 x, double touch) const;
  Vec3 of_direction(Vec3 d) const;
};

/// All but the cell itself: 2^planes (2 K + 1) − 1.
std::vector<SymmetryImage> images(const Symmetry& symmetry);

/// Both ends of an edge of the surface lie where the next image begins: the surface goes on there.
bool goes_on(const Symmetry& symmetry, const Vec3& a, const Vec3& b, const Vec3& lower, const Vec3& upper,
             double touch);

/// K such that no more of what leaves a wall goes beyond the last step, by either end, than kBeyond:
///   2 A d / (π s³) ≤ kBeyond,   s = K |period|
/// with the cross-section of the whole that lies in the box round the cell, of area A and diagonal d: s away, both cosines of a wall
/// along the period fall with d / s.
Index steps_of_period(const Symmetry& symmetry, const Vec3& lower, const Vec3& upper);
inline constexpr double kBeyond = 1e-3;

/// Fills in the steps. Throws InputError, naming plane or face, coordinate and rule: numbers that are not finite, planes that are
/// parallel, a period that is neither along nor across a plane, faces that cross a plane, lie in it or on both of its sides, and a cell
/// that is longer than its period. `touch`: what counts as in a plane, m.
void settle(Symmetry& symmetry, const std::vector<Vec3>& vertices, std::span<const Index> corners,
            std::span<const Index> face_start, double touch);

/// "x = 0", in m; and back. Throws InputError where a text is not a letter of x, y, z, an equals sign and a finite number.
std::string text_of(const MirrorPlane& plane);
MirrorPlane plane_of(const std::string& text);

/// "mirrored in x = 0, z = 2.5; period 0 0 6 m, 10 steps either way: 83 images"
std::string text_of(const Symmetry& symmetry);

}  // namespace radiosity
