// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

/// The numeric thresholds that more than one place knows, or that decide what a user sees, with their formula and reason; those of
/// a single function stand in it. Lengths are relative to a length of the scene, never absolute, so that millimetres and
/// kilometres give the same answer.
namespace radiosity::tolerance {

/// A face is degenerate when its height (2·area / longest edge) is below the rounding of its coordinates,
/// kDegenerateHeight · max|x|: nothing but rounding could then tell its normal.
inline constexpr double kDegenerateHeight = 8 * std::numeric_limits<double>::epsilon();

/// A polygon is planar when no corner is further than kPlanarity · (its diameter) from its mean plane. Single
/// precision files (relative rounding 6e-8) stay planar; a wall modelled 1 mm askew over 5 m does not.
inline constexpr double kPlanarity = 1e-6;

/// Patches that share an edge lie in one plane when no corner of one is further than kCoplanar · (scene diagonal), and the
/// rounding of its coordinates, from the plane of the other: a cylinder of 10⁵ segments stays round.
inline constexpr double kCoplanar = 1e-9;

/// A boundary goes straight on where the sine of its turn is below this, besides the rounding of its coordinates.
inline constexpr double kStraight = 1e-9;

/// A line of one face touches another face when it is closer than kContact · (scene diagonal): 0.02 mm in a
/// 20 m building. Contact only adds cut lines; it never moves a vertex.
inline constexpr double kContact = 1e-6;

/// Modellers round to kModelled · (scene diagonal) at the coarsest: 4 mm in a 20 m building. A vertex that near to an edge may be meant
/// to lie on it, and between faces that look at each other across such a gap no light to speak of gets but at the rim.
inline constexpr double kModelled = 200 * kContact;

/// A sensor on a surface stands kBesideSurface · (scene diagonal), and the rounding of the coordinates, in front of it: far above the
/// rounding of double precision, far below what irradiance could tell. Its rays, in single precision, start at kContact.
inline constexpr double kBesideSurface = 1e-9;

/// An edge of n · size takes n pieces, not n + 1, although rounding may make it longer by this share (and by the
/// rounding of its coordinates, kDegenerateHeight · max|x|).
inline constexpr double kWholePieces = 1e-5;

/// A face is divided into at most so many patches: what a triangulation takes seconds and some hundred megabytes for, and far
/// beyond what form factors between them could be computed for.
inline constexpr double kMostPiecesOfFace = 4e6;

/// Cosine of 30°: two faces that meet at a smaller angle between their normals form one smooth surface, over
/// which vertex radiosities are interpolated. Tessellated curves stay below, building corners above.
inline constexpr double kSmoothCosine = 0.8660254037844387;

/// A ray passes through what lies in the plane it starts from: everything within kSamePlane of that plane, in units of
/// the scaled scene (diagonal 1). Eight roundings of single precision at that size.
inline constexpr float kSamePlane = 5e-7F;

/// Two surfaces in contact lie face to face when the cosine between their normals is below this: tilts of up to 8° between a thing
/// and what it stands on.
inline constexpr float kOpposed = -0.99F;

/// What is nowhere further than kNearPlane · (scene diagonal) in front of a patch's plane is too near for rays and item
/// buffers, which work in single precision and pass through what lies within kSamePlane.
inline constexpr double kNearPlane = 4 * static_cast<double>(kSamePlane);

/// In a patch locator, a corner lies on the line that divides a cell when it is nearer than kOnLine cells: what single precision
/// leaves of positions up to 1000 cells.
inline constexpr double kOnLine = 1e-4;

/// A scene is convex when no vertex lies deeper than kConvex · (scene diagonal) behind any patch.
inline constexpr double kConvex = 1e-9;

/// In an item buffer, the back of a wall without thickness must lose against the front in the same place although both depths
/// are rounded: at grazing angles single precision leaves some 1e-5 of the depth.
inline constexpr float kDepthTie = 1e-4F;
/// Facets in an item buffer reach beyond their edges by so much, relative to the cube's half-width: some roundings, so that no cell
/// falls between an edge and those of several neighbours along it.
inline constexpr float kEdgeSlack = 1e-6F;

/// A scene is closed when at most this share of all sampled directions leaves it or meets the back of a patch: cracks
/// between faces that do not share vertices, and rounding at edges.
inline constexpr double kClosedScene = 1e-5;

/// Two edges are parallel when the sine of their angle is below this, and perpendicular when the cosine is: then ∮∮ ln r
/// has a closed form, whose error from the remaining angle is of the order of that sine. Far from the origin, rounding of
/// the coordinates turns edges by that much.
inline constexpr double kParallel = 1e-8;

/// A polygon that hides no more of a patch than kGrazed · (its extent), at its edge or at grazing angles, hides nothing of it: walls
/// that meet at an edge, and walls in one plane, but for the rounding of their corners. A hundredth of what else form factors err by.
inline constexpr double kGrazed = 2e-5;

/// A corner lies on another polygon's plane when its height is below kOnPlane · (distance + sizes): some hundred roundings.
inline constexpr double kOnPlane = 1e-13;

/// Patches are of one size when their areas differ by less than this share: rounding must not choose between them.
inline constexpr double kSameArea = 1e-9;

/// A winding number is whole when it is this near to an integer: of closed surfaces it is one but for rounding, and a lamp of one face
/// adds the share of the sphere that it takes, a few per cent of most places in a room.
inline constexpr double kWholeWinding = 0.1;

/// Surfaces are closed but for such lamps and screens when winding numbers are whole before this share of their area.
inline constexpr double kMostlyClosed = 0.9;

/// Relative errors of quadratures of the kernel cosθ cosθ' / (π r²) over two patches whose distance is d · (sum of their radii),
/// root mean square over all positions in front of each other; single ones, at grazing angles, are up to ten times that:
///   kMoments d⁻⁴   (kMomentsOdd d⁻³ where one is no parallelogram)   second moments about the centroids
///   kGauss d⁻⁶     the 2 × 2 Gauss points of parallelograms with fourth moments
///   kProduct d⁻⁶   (kProductOdd) quadrature of degree 5, squares (and triangles)
/// The contour form, exact but for rounding, costs some ten times as much as the last.
inline constexpr double kMoments = 0.25, kMomentsOdd = 0.1, kGauss = 0.05, kProduct = 0.0045,
                        kProductOdd = 0.026;

/// Beyond kShadowShare radii of a patch from another one the kernel over it is biquadratic but for some 0.4 / kShadowShare³, which
/// alternates in sign: less than what the points in partial shadow err by.
inline constexpr double kShadowShare = 4;

/// A row of sampled form factors whose sum would need a factor beyond this (or below its inverse) does not agree with the rows
/// of the patches that it sees: sampling errors of row sums are some per cent.
inline constexpr double kMostScaling = 1.5;

/// Nothing escapes when the area-weighted mean of 1 − Σ_j F_ij is below this: rounding of single precision row sums.
inline constexpr double kNoEscape = 1e-6;

/// What is left of 1 minus the sum of a row's parts is rounding below this.
inline constexpr double kNotLost = 1e-9;

/// A form factor that is a difference of sums over some thousand edges is rounding below this.
inline constexpr double kFactorRounding = 1e-12;

/// Shares of light that add up to 1 as decimals may do so as doubles only up to this.
inline constexpr double kShares = 1e-12;

/// A ray that leaves one side of a curved surface at a point rounded to single precision may start behind its next facet: what it meets
/// from the wrong side nearer than kLeaving, in units of the scaled scene, is the surface that it leaves.
inline constexpr float kLeaving = 8 * kSamePlane;

/// Where a ray nearly lies in a plane, within kGrazingCosine of it, the place where it meets the plane is no better known than what
/// single precision told of its length.
inline constexpr double kGrazingCosine = 1e-4;

/// What ends within kAtEmitter · (scene diagonal) of a point of a lamp has reached it: rounding of single precision, twice.
inline constexpr double kAtEmitter = 2 * static_cast<double>(kSamePlane);

/// A mirrored ray stands for all of a lobe cosⁿ from this n on: half of the lobe is then within 7° of the mirror's direction. Of
/// duller surfaces ray tracing shows the highlights of lights alone.
inline constexpr double kMirrorLike = 100;

/// A mirrored or refracted ray that would add less than this share of what it shows to a pixel is not followed: a tenth of a step of
/// eight bits where it shows white, and light within glass that is mirrored on and on.
inline constexpr double kLeastShare = 4e-4;

/// Ray tracing asks for the shadow of lights together that could not add more than this share to what a point shows: half a step of eight bits
/// where it shows white.
inline constexpr double kDimLights = 0.005;

/// A path that is not absorbed after so many surfaces never will be: the chance is below 10⁻³⁰⁰ where each absorbs 5 %.
inline constexpr int kLongestPath = 1 << 14;

/// Conjugate gradients take patches that reflect less than this for black. What they reflect is lost beside any rounding, and A/ρ would
/// overflow.
inline constexpr double kBlack = 1e-200;

/// What conjugate gradients take from the residual step by step drifts away from that of B by rounding, a little with each step. After
/// so many it is computed again before it is believed.
inline constexpr int kStepsWithoutDrift = 50;

}  // namespace radiosity::tolerance
