// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

/// What the vectorised part of the hemicube works on: plain arrays and nothing else. item_buffer.cpp is built several times, for
/// processors of several levels; an inline function or a template shared with other sources could be linked from there into all of them.
namespace radiosity::item_buffer {

/// Polygons are handled so many at a time, their arrays padded to a multiple of it.
inline constexpr std::size_t kLanes = 16;
/// Cells are stored in tiles of 4 × 4, one vector.
inline constexpr int kTile = 4;
/// What a cell holds that shows no front; that of facet f is 1 + f.
inline constexpr std::int32_t kLost = 0;
/// Of a tile that shows more than two items.
inline constexpr std::int32_t kMixed = -1;

/// Convex polygons, all of three or all of four corners, counter-clockwise about the front normal, in scaled coordinates (see
/// Visibility::scaled).
struct Polygons {
  std::size_t count;
  /// Of each kLanes of them, kLanes numbers each: of every corner x, y, z and what single precision left of these; of every edge, from
  /// corner k to k + 1, 1 or, where another polygon may have it the other way round, −1 on one of the two.
  const float* numbers;
  const std::int32_t *plane, *content;  // content is kLost where a lane holds no polygon
};
inline constexpr std::size_t kNumbersPerCorner = 7;

struct Items {
  Polygons facet_triangles, facet_quads;  // facets, in pieces: content is 1 + the number of their plane
  Polygons triangles, quads;   // patches of one facet in each kLanes of them, of facets that have several
  const std::int32_t* single;  // of planes: the content of the only patch of their facet, or kLost
  std::size_t planes;
  const double *nx, *ny, *nz, *offset;  // of planes: n·x = offset
};

/// The eye and the local frame: rows of the rotation from scaled to local coordinates, z along the patch's normal.
struct View {
  double eye[3];
  double frame[9];
  std::size_t own,
      back;  // planes that hide nothing from the eye: those of its facet and of that facet's other side
};

/// One of the five faces. Cell (column, row) has its centre at (u, v) = (−1 + (column + ½) h, v0 + (row + ½) h),
/// h = 2/resolution, in the direction u·right + v·up + forward.
struct Face {
  std::int32_t right, up, forward;  // local axes: 0 x, 1 y, 2 z, 3 −x, 4 −y
  int rows;
  float v0;
  int tile_columns, tile_rows;
  std::size_t first_cell;        // tiles in rows from the bottom, each row by row
  const float *tile_u, *tile_v;  // centres of the cells, 16 for each column and each row of tiles
};

/// Memory of one thread.
struct Buffers {
  float *pu, *pv, *pw;  // of planes: nearness of the cell (u, v, 1) of local axes
  std::int32_t* front;  // of planes: 1 front, −1 back, 0 edge on
  std::int32_t* item;   // of cells: kLost or 1 + plane
  float* nearness;      // of cells
  // Of tiles, and kLanes more: the items that their cells show. `second` is `first` where that is all, and kMixed where two are not.
  std::int32_t *first, *second;
  double* shares;  // of kLost and of planes, four each: what the cells say that is seen of them
  std::int32_t*
      content;  // of polygons of patches that are seen, with their factors; negative where cells told
  float* factor;
};

/// The code for one level of processors. All of them give the same bits.
struct Kernel {
  std::string_view level;

  /// sums[content] += weight · F from the eye to every patch. `share` is ΔF of cells, 0 beyond the borders of the faces, and their
  /// sums of tiles. Gives the share of what is lost; with it F adds up to 1.
  double (*add_factors)(const Items& items, const View& view, const Face* faces, int resolution,
                        std::size_t cells, const float* share, const double* tile_share, double weight,
                        const Buffers& buffers, double* sums);
};

/// Those that this processor can run, the fastest last.
std::span<const Kernel> kernels();

}  // namespace radiosity::item_buffer
