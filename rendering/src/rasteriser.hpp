// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

/// What scan conversion draws: convex polygons, the patches or pieces of them, counter-clockwise seen from the front.
struct Polygons {
  struct Corner {
    Index vertex;
    Index from, to;  ///< the edge to the next corner is part of the line from `from` to `to`
  };
  struct Plane {
    Vec3 normal;  ///< unit, of the front
    Vec3 on;      ///< m
  };
  std::vector<Vec3> vertices;  ///< m
  std::vector<Corner> corners;
  std::vector<Index> start{0};  ///< polygon i has corners [start[i], start[i+1])
  std::vector<Index> patch;     ///< that polygon i is a piece of
  std::vector<Plane> planes;
  std::vector<Index> plane;  ///< of polygon i

  Index count() const { return static_cast<Index>(patch.size()); }
  std::span<const Corner> polygon(Index i) const {
    return std::span(corners).subspan(start[i], start[i + 1] - start[i]);
  }
  /// Its number.
  Index add(std::span<const Corner> polygon, Index of_patch, Index in_plane) {
    corners.insert(corners.end(), polygon.begin(), polygon.end());
    start.push_back(static_cast<Index>(corners.size()));
    patch.push_back(of_patch);
    plane.push_back(in_plane);
    return count() - 1;
  }
};

/// The triangles of the patches; vertices as the mesh has them. Those of a patch lie in its plane, unless it is not planar: faces that
/// were kept as the file has them may not be.
Polygons triangles_of(const PatchMesh& mesh);

/// A sample that shows the front of a patch.
struct Fragment {
  Index patch;
  Vec3 x;                 ///< m, on the patch
  Eigen::ArrayXd values;  ///< of the vertices, interpolated linearly over the polygon in space
};

/// Calls `shade(point, fragment)` for each point of the grid that shows a front; backs hide what is behind them and show nothing.
/// `values` has a row for each vertex. Without an order, what is nearest is seen (z-buffer [Catmull1974]); with one, what is drawn
/// last. `shade` is called on many threads, once for a point; what it is told does not depend on their number.
///
/// Polygons whose vertices are all beyond one plane of the view volume are rejected, those with all vertices inside are accepted, others
/// are clipped [SutherlandHodgman1974] in homogeneous coordinates [BlinnNewell1978]: x, y = (p − eye)·right, up in half images,
/// w = (p − eye)·forward, z = a constant, so that z/w, linear on the screen, grows with nearness and the far plane, z ≥ 0, is at
/// infinity. New vertices have values, too. Which side is seen is told by the polygon's plane.
///
/// A sample is inside an edge that goes from a to b when (a × b)·(x, y, 1) > 0, in (x, y, w) of the ends of the edge's line as it was
/// before anything was cut, always taken in the order of their positions: both neighbours at an edge see the same bits, and the sample
/// belongs to exactly one of them, also where polygons were clipped or split. On the line itself it goes where a sample moved by
/// (ε, ε²) would. Then scan lines are filled from the first to the last sample that is inside all edges.
void rasterise(const Polygons& polygons, const BandArray& values,
               std::optional<std::span<const Index>> back_to_front, const Pinhole& eye,
               const SampleGrid& grid,
               const std::function<void(Eigen::Index point, const Fragment& fragment)>& shade);

}  // namespace radiosity
