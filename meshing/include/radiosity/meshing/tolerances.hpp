// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

/// Every numeric threshold of the toolkit, with its formula and its reason. Lengths are relative to a length
/// of the scene, never absolute, so that millimetres and kilometres give the same answer.
namespace radiosity::tolerance {

/// A face is degenerate when its height (2·area / longest edge) is below the rounding of its coordinates,
/// kDegenerateHeight · max|x|: nothing but rounding could then tell its normal.
inline constexpr double kDegenerateHeight = 8 * std::numeric_limits<double>::epsilon();

/// A polygon is planar when no corner is further than kPlanarity · (its diameter) from its mean plane. Single
/// precision files (relative rounding 6e-8) stay planar; a wall modelled 1 mm askew over 5 m does not.
inline constexpr double kPlanarity = 1e-6;

/// A line of one face touches another face when it is closer than kContact · (scene diagonal): 0.02 mm in a
/// 20 m building. Contact only adds cut lines; it never moves a vertex.
inline constexpr double kContact = 1e-6;

/// Cosine of 30°: two faces that meet at a smaller angle between their normals form one smooth surface, over
/// which vertex radiosities are interpolated. Tessellated curves stay below, building corners above.
inline constexpr double kSmoothCosine = 0.8660254037844387;

}  // namespace radiosity::tolerance
