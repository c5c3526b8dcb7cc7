// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

/// What the vectorised parts of factors computed pair by pair work on: plain arrays and nothing else, as in item_buffer.hpp, for
/// the same reason.
namespace radiosity {

/// Numbers handled at a time; arrays are padded to a multiple of it.
inline constexpr std::size_t kLanes = 8;

/// Of a block of patches, kLanes numbers each. After them four Gauss points, then the points of Polygon::rule: x, y, z, weight.
enum Column : std::size_t {
  kCentroid = 0,
  kNormal = 3,
  kArea = 6,
  kAxisU = 7,  // principal axes, with the roots of the second moments as lengths, and the moments
  kAxisV = 10,
  kMomentU = 13,
  kMomentV,
  kFarReach,  // radius of the patch times the least d of a rule
  kMiddleReach,
  kLeastReach,
  kColumns
};
inline constexpr std::size_t kGaussPoints = 4;

struct ColumnBlock {
  std::size_t start, points;  ///< in the columns; the most of Polygon::rule
};

/// Of pairs that no quadrature is good for: contours tell (mutual_area).
inline constexpr double kNearPair = -1;

/// Points x, y, z and weight in columns of `stride` numbers, `size` of which have a weight.
struct RuleColumns {
  std::size_t size, stride;
  const double* columns;
  const double* normal;  ///< of their polygon
};

/// A parallelogram with its middle at `origin`, sides u and v, and the vectors that give coordinates along these; or its half
/// below the diagonal.
struct ShadowFrame {
  const double *origin, *u, *v, *normal, *dual_u, *dual_v;
  double area;
};
/// A polygon in coordinates of such a frame and heights over it. Points x with plane·(x, −1) ≤ 0 do not see its shadow; those of
/// one group do not overlap.
struct ShadowCorners {
  const double *u, *v, *h;
  std::size_t count;
  const double* plane;
  std::size_t group;
};
inline constexpr std::size_t kMostShadows = 8, kMostShadowCorners = 16;

/// PatchColumns::mutual_areas of a patch, `p` with kLanes between its columns, and all of some blocks.
using MutualAreas = void(const double* p, std::size_t points_p, const double* data, const ColumnBlock* block,
                         const ColumnBlock* end, double* areas);

/// ShadowShare::add_to of kLanes points.
using Shadows = void(const double* const* points, const double* normal, const ShadowFrame& q,
                     const ShadowCorners* shadows, std::size_t count, double* const* answers);

/// The code for one level of processors. All of them give the same bits.
struct PairKernels {
  std::string_view level;

  MutualAreas* mutual_areas;

  /// ∫ ∫_f ln|x − y| |dy| |dx| over the part of length h about `middle` of an edge, by 8 points x; the inner integral, over an edge of
  /// this length from `start`, is closed:
  ///   w ln √(w² + d²) + p ln √(p² + d²) − l + d · (the angle under which x sees f),
  /// where p and w = l − p are the parts of f before and after the foot of x, and d is the distance from its line.
  double (*edge_pair)(const double* middle, const double* direction, double h, const double* start,
                      const double* line, double length);

  /// Σ sign G, G = (w² − d²) ln(w² + d²) / 4 − 3 w² / 4 + w d arctan(w / d), of a multiple of kLanes pairs of parallel edges.
  double (*parallel_sum)(const double* w, const double* d, const double* sign, std::size_t count);

  /// Kernel cosθ cosθ' / (π r²) summed over two rules, up to its sign. Points behind the other plane do not occur here.
  double (*quadrature)(const RuleColumns& p, const RuleColumns& q);

  Shadows *shadows_on_parallelogram, *shadows_on_triangle;
};

/// Those that this processor can run, the fastest last.
std::span<const PairKernels> pair_kernels();
/// The fastest.
const PairKernels& pair_kernel();

#ifdef RADIOSITY_KERNEL
namespace RADIOSITY_KERNEL {
MutualAreas mutual_areas;
Shadows shadows_on_parallelogram, shadows_on_triangle;
extern const PairKernels pair_kernels;
}  // namespace RADIOSITY_KERNEL
#endif

}  // namespace radiosity
