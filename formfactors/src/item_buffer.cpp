// SPDX-License-Identifier: GPL-3.0-or-later
#include "item_buffer.hpp"

#include "radiosity/meshing/tolerances.hpp"
#include "vectors.hpp"

namespace radiosity::item_buffer {
namespace {

inline Ints truncated(const Floats& a) {
  return Ints::each([](auto x) { return __builtin_convertvector(x, Ints::Part); }, a);
}
template <class T>
inline auto gather(const T* base, const std::int32_t* index) {
  alignas(64) T values[kLanes];
  for (std::size_t k = 0; k < kLanes; ++k) values[k] = base[index[k]];
  return load(values);
}
// Planes through the eye that bound the faces' pyramids: a bit is set where the vertex is on the negative side. kAbove is set
// where it is higher over the patch's plane than what counts as lying in it.
constexpr std::int32_t kAbove = 1 << 7, kBelow = 1 << 8;

// For each face: planes of which its pyramid is on the positive and on the negative side.
//   top: |x| ≤ z, |y| ≤ z;   +x: |y| ≤ x, 0 ≤ z ≤ x;   and so on round.
struct Pyramid {
  std::int32_t positive, negative;
};
constexpr Pyramid kPyramids[5] = {
    {0b0001111, 0},         {0b1110000, 0b0000001}, {0b1000000, 0b0110010},
    {0b1100000, 0b0010100}, {0b1010000, 0b0101000},
};

// The plane n·x = offset appears in the cell (u, v, 1) at depth w with 1/w = n·(u, v, 1) / (n·(plane − eye)), in local axes.
void planes_to_local(const Items& items, const View& view, const Buffers& out) {
  for (std::size_t p = 0; p < items.planes; ++p) {
    const double nx = items.nx[p], ny = items.ny[p], nz = items.nz[p];
    const double d = items.offset[p] - nx * view.eye[0] - ny * view.eye[1] - nz * view.eye[2];
    const bool edge_on =
        p == view.own || p == view.back || (d <= tolerance::kOnPlane && d >= -tolerance::kOnPlane);
    const bool front = d < 0;
    // A wall without thickness shows each side its own front: at equal depth the front wins.
    const double nearer = edge_on ? 0 : (front ? 1.0 : 1.0 - static_cast<double>(tolerance::kDepthTie)) / d;
    const double* m = view.frame;
    out.pu[p] = static_cast<float>(nearer * (m[0] * nx + m[1] * ny + m[2] * nz));
    out.pv[p] = static_cast<float>(nearer * (m[3] * nx + m[4] * ny + m[5] * nz));
    out.pw[p] = static_cast<float>(nearer * (m[6] * nx + m[7] * ny + m[8] * nz));
    out.front[p] = edge_on ? 0 : front ? 1 : -1;
  }
}

struct Triple {
  Floats x, y, z;
};

// All lanes brought together, a quarter of them at a time and then one by one.
template <class Four, class F, class V>
inline auto united(const V& v, F f) {
  Four q[4];
  __builtin_memcpy(q, v.part, sizeof q);
  const Four four = f(f(q[0], q[1]), f(q[2], q[3]));
  return f(f(four[0], four[1]), f(four[2], four[3]));
}
using FourFloats = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));
inline float sum_of(const Floats& x) {
  return united<FourFloats>(x, [](auto a, auto b) { return a + b; });
}
inline std::int32_t least_of(const Ints& x) {
  return united<FourInts>(x, [](auto a, auto b) { return a < b ? a : b; });
}
inline std::int32_t most_of(const Ints& x) {
  return united<FourInts>(x, [](auto a, auto b) { return a > b ? a : b; });
}

// Differences from the eye are taken before single precision rounds: what is near is seen sharply wherever the eye is.
struct Camera {
  explicit Camera(const View& view) {
    for (std::size_t k = 0; k < 3; ++k) {
      high[k] = static_cast<float>(view.eye[k]);
      low[k] = static_cast<float>(view.eye[k] - static_cast<double>(high[k]));
    }
    for (std::size_t k = 0; k < 9; ++k) m[k] = static_cast<float>(view.frame[k]);
  }
  Triple to_local(const float* corner) const {
    Floats d[3];
    for (std::size_t k = 0; k < 3; ++k)
      d[k] = (load(corner + k * kLanes) - high[k]) + (load(corner + (3 + k) * kLanes) - low[k]);
    const auto along = [&](std::size_t row) { return m[row] * d[0] + m[row + 1] * d[1] + m[row + 2] * d[2]; };
    return {along(0), along(3), along(6)};
  }
  float high[3], low[3], m[9];
};

Ints code_of(const Triple& p) {
  const auto& [x, y, z] = p;
  const auto bit = [](const Ints& mask, std::int32_t value) { return mask & value; };
  return bit(z < x, 1) | bit(z < -x, 2) | bit(z < y, 4) | bit(z < -y, 8) | bit(x < y, 16) | bit(x < -y, 32) |
         bit(z < 0.0F, 64) | bit(z > tolerance::kSamePlane, kAbove) | bit(z < -tolerance::kSamePlane, kBelow);
}

// Values of the local axes 0 x, 1 y, 2 z, 3 −x, 4 −y.
struct Axes {
  alignas(64) float value[5][kLanes];
};
void store_axes(Axes& out, const Triple& p) {
  store(out.value[0], p.x);
  store(out.value[1], p.y);
  store(out.value[2], p.z);
  store(out.value[3], -p.x);
  store(out.value[4], -p.y);
}

// Of kLanes polygons.
template <std::size_t kCorners>
struct Batch {
  Axes corner[kCorners], edge[kCorners];
  Axes nearness;  // of their planes
  std::int32_t shows[kLanes];
};

// Of u and v, times w > 0: those of the corners in front of the eye; where an edge passes w = 0 the polygon goes to infinity in its
// direction there.
struct Bounds {
  Floats u_low, u_high, v_low, v_high;
};

template <std::size_t kCorners>
Bounds bounds_of(const Batch<kCorners>& batch, const Face& face) {
  const std::int32_t right = face.right, up = face.up, forward = face.forward;
  const Floats infinite = 3e38F;
  Bounds out{infinite, -infinite, infinite, -infinite};
  for (std::size_t k = 0; k < kCorners; ++k) {
    const Axes &a = batch.corner[k], &b = batch.corner[(k + 1) % kCorners];
    const Floats aw = load(a.value[forward]), bw = load(b.value[forward]);
    const Ints a_front = aw > 1e-6F, b_front = bw > 1e-6F;
    const Floats per_w = 1.0F / aw;
    const Floats u = load(a.value[right]) * per_w, v = load(a.value[up]) * per_w;
    out.u_low = select(a_front, min(out.u_low, u), out.u_low);
    out.u_high = select(a_front, max(out.u_high, u), out.u_high);
    out.v_low = select(a_front, min(out.v_low, v), out.v_low);
    out.v_high = select(a_front, max(out.v_high, v), out.v_high);
    const Ints crosses = a_front ^ b_front;
    if (lane_bits(crosses) == 0) continue;
    const auto at_zero = [&](std::int32_t axis) {  // where w = 0, times the difference of w
      const Floats at = aw * load(b.value[axis]) - bw * load(a.value[axis]);
      return select(a_front, at, -at);
    };
    const Floats cross_u = at_zero(right), cross_v = at_zero(up);
    const Floats slack = 1e-5F * (abs(aw) + abs(bw));
    out.u_high = select(crosses & (cross_u > -slack), infinite, out.u_high);
    out.u_low = select(crosses & (cross_u < slack), -infinite, out.u_low);
    out.v_high = select(crosses & (cross_v > -slack), infinite, out.v_high);
    out.v_low = select(crosses & (cross_v < slack), -infinite, out.v_low);
  }
  return out;
}

// Of each polygon, along one side of a face.
struct Range {
  std::int32_t first[kLanes], last[kLanes];
  std::int32_t least, most;  // of all, where asked for
};

// Cells whose centres may be between `low` and `high`; a hundredth of a cell for rounding. Bits of the lanes that have any.
std::uint32_t cells_between(const Floats& low, const Floats& high, float origin, float per_cell, int count,
                            Range& out) {
  const float end = static_cast<float>(count - 1);
  const Floats from = (low - origin) * per_cell + 0.49F;
  const Ints first = truncated(min(max(from, 0.0F), end + 1));
  const Floats to = min((high - origin) * per_cell - 0.49F, end);
  const Ints last = select(to < 0.0F, -1, truncated(max(to, 0.0F)));
  store(out.first, first);
  store(out.last, last);
  return lane_bits(~(first > last));
}

// The tiles of all cells that reach between them.
Ints tiles_between(const Ints& lanes, const Floats& low, const Floats& high, float origin, float per_cell,
                   int count, Range& out) {
  const float end = static_cast<float>(count);
  const Floats from = (low - origin) * per_cell - 0.01F;
  const Floats to = (high - origin) * per_cell + 0.01F;
  const auto tile = [&](const Floats& x) { return truncated(min(max(x, 0.0F), end - 1) * (1.0F / kTile)); };
  const Ints first = tile(from), last = tile(to), reach = lanes & (to > 0.0F) & (from < end);
  store(out.first, first);
  store(out.last, last);
  out.least = least_of(select(reach, first, 1 << 20));
  out.most = most_of(select(reach, last, -1));
  return reach;
}

// Linear in u and v: a[0] u + a[1] v + a[2]; of edges ≥ 0 inside.
struct Linear {
  Floats a[3];
};
inline Linear linear(const Axes& axes, const Face& face, std::size_t lane) {
  return {{axes.value[face.right][lane], axes.value[face.up][lane], axes.value[face.forward][lane]}};
}

// Calls f(at, u, inside) for the tiles of a lane: where its cells are, and which of them have their centres in the polygon. row(v) comes
// before each row of tiles.
template <std::size_t kCorners, class Row, class F>
inline void for_each_tile(const Linear* edge, const Face& face, const Range& columns, const Range& rows,
                          std::size_t lane, Row&& row, F&& f) {
  const auto tile_columns = static_cast<std::size_t>(face.tile_columns);
  const auto tile_first = static_cast<std::size_t>(columns.first[lane] / kTile) * kLanes,
             tile_last = static_cast<std::size_t>(columns.last[lane] / kTile) * kLanes;
  const auto row_end = static_cast<std::size_t>(rows.last[lane] / kTile) * kLanes;
  for (std::size_t r = static_cast<std::size_t>(rows.first[lane] / kTile) * kLanes; r <= row_end;
       r += kLanes) {
    const Floats v = load(face.tile_v + r);
    Floats rest[kCorners];
    for (std::size_t k = 0; k < kCorners; ++k) rest[k] = edge[k].a[1] * v + edge[k].a[2];
    row(v);
    for (std::size_t tile = tile_first; tile <= tile_last; tile += kLanes) {
      const Floats u = load(face.tile_u + tile);
      Floats inside = edge[0].a[0] * u + rest[0];
      for (std::size_t k = 1; k < kCorners; ++k) inside = min(inside, edge[k].a[0] * u + rest[k]);
      f(face.first_cell + r * tile_columns + tile, u, inside >= 0.0F);
    }
  }
}

template <std::size_t kCorners>
void draw_face(const Batch<kCorners>& batch, const Ints& reaches, const Face& face, int resolution,
               const Buffers& buffers) {
  const float per_cell = static_cast<float>(resolution) / 2;
  const Bounds b = bounds_of(batch, face);
  Range columns, rows;
  std::uint32_t lanes = lane_bits(reaches) &
                        cells_between(b.u_low, b.u_high, -1, per_cell, resolution, columns) &
                        cells_between(b.v_low, b.v_high, face.v0, per_cell, face.rows, rows);
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
    Linear edge[kCorners];
    for (std::size_t k = 0; k < kCorners; ++k) {
      edge[k] = linear(batch.edge[k], face, lane);
      Floats* const a = edge[k].a;
      // Some roundings more: facets meet edge to edge, but one edge may be the neighbours of several.
      a[2] = a[2] + tolerance::kEdgeSlack * (abs(a[0]) + abs(a[1]) + abs(a[2]));
    }
    const Linear nearness = linear(batch.nearness, face, lane);
    const Ints shows = batch.shows[lane];
    Floats rest_near;
    for_each_tile<kCorners>(
        edge, face, columns, rows, lane,
        [&](const Floats& v) { rest_near = nearness.a[1] * v + nearness.a[2]; },
        [&](std::size_t at, const Floats& u, const Ints& inside) {
          const Floats near = nearness.a[0] * u + rest_near;
          const Floats before = load(buffers.nearness + at);
          const Ints wins = inside & (near > before);
          store(buffers.nearness + at, select(wins, near, before));
          store(buffers.item + at, select(wins, shows, load(buffers.item + at)));
        });
  }
}

// Calls f(first, batch, reaches, reached, above): the faces' pyramids that each polygon may reach into, and whether all of it is above
// the horizon. A homogeneous rasteriser [OlanoGreer1997]: the direction q = (u, v, 1) of a cell meets the polygon iff q·(a × b) ≥ 0 for
// each edge ab (counter-clockwise seen from the eye), which needs no clipping, whatever lies behind the eye. Two polygons that share an
// edge see it with the opposite sign, to the bit, so no cell falls between them. (This file is built without fused multiply-add, which a
// compiler may use for some lanes and not for others.)
template <std::size_t kCorners, bool kPatches, class F>
inline void for_each_batch(const Polygons& polygons, const View& view, const Buffers& buffers, F&& f) {
  const Camera camera(view);
  Batch<kCorners> batch;
  const float* numbers = polygons.numbers;
  for (std::size_t first = 0; first < polygons.count;
       first += kLanes, numbers += kNumbersPerCorner * kCorners * kLanes) {
    const std::int32_t* const plane = polygons.plane + first;
    if (kPatches && buffers.front[*plane] != 1) continue;
    const Ints facing = kPatches ? 1 : gather(buffers.front, plane);
    const Ints front = facing == 1;
    const Ints content = load(polygons.content + first);
    Triple corner[kCorners];
    Ints all = -1, any = 0;
    for (std::size_t k = 0; k < kCorners; ++k) {
      corner[k] = camera.to_local(numbers + 6 * k * kLanes);
      const Ints code = code_of(corner[k]);
      all = all & code;
      any = any | code;
    }
    // Not those with all corners on the wrong side of one plane of a face's pyramid, nor below the horizon, nor in the patch's own
    // plane.
    const Ints none = 0;
    const Ints skipped = ((any & kAbove) == none) | (facing == none) | (content == none);
    Ints reaches[5];
    int reached = 0;
    for (int k = 0; k < 5; ++k) {
      reaches[k] = ~skipped & (((all & kPyramids[k].positive) | (~any & kPyramids[k].negative)) == none);
      reached |= (lane_bits(reaches[k]) != 0 ? 1 : 0) << k;
    }
    if (reached == 0) continue;

    const Floats sign = select(front, Floats(-1.0F), 1.0F);
    for (std::size_t k = 0; k < kCorners; ++k) {
      store_axes(batch.corner[k], corner[k]);
      // a × b = a × (b − a), from the same one of the two for both polygons: they see the same bits, and the line passes the
      // corners within a rounding of their distance, not of that divided by the edge's length.
      const Triple &a = corner[k], &b = corner[(k + 1) % kCorners];
      const Floats direction = load(numbers + (6 * kCorners + k) * kLanes);
      const Ints turned = direction < 0.0F;
      const Triple from{select(turned, b.x, a.x), select(turned, b.y, a.y), select(turned, b.z, a.z)};
      const Triple along{select(turned, a.x, b.x) - from.x, select(turned, a.y, b.y) - from.y,
                         select(turned, a.z, b.z) - from.z};
      const Floats signs = direction * sign;
      store_axes(batch.edge[k], {signs * (from.y * along.z - from.z * along.y),
                                 signs * (from.z * along.x - from.x * along.z),
                                 signs * (from.x * along.y - from.y * along.x)});
    }
    if (!kPatches) {
      store_axes(batch.nearness,
                 {gather(buffers.pu, plane), gather(buffers.pv, plane), gather(buffers.pw, plane)});
      store(batch.shows, select(front, content, kLost));
    }
    f(first, batch, reaches, reached, lane_bits((any & kBelow) == none));
  }
}

template <std::size_t kCorners>
void draw_polygons(const Polygons& polygons, const View& view, const Face* faces, int resolution,
                   const Buffers& buffers) {
  for_each_batch<kCorners, false>(
      polygons, view, buffers,
      [&](std::size_t, const Batch<kCorners>& batch, const Ints* reaches, int reached, std::uint32_t) {
        for (int f = 0; f < 5; ++f)
          if ((reached >> f & 1) != 0) draw_face(batch, reaches[f], faces[f], resolution, buffers);
      });
}

Floats square_root(const Floats& x) {
  alignas(64) float root[kLanes];
  store(root, x);
  for (float& r : root) r = __builtin_sqrtf(r);
  return load(root);
}

// arctan √z / √z up to tan² π/8, to 2e-8 and rounding: the polynomial that equals it at the Chebyshev points.
constexpr float kTanEighth = 0.414213562F;
Floats arctan_ratio(const Floats& z) {
  Floats p = z * 0.0797629181F - 0.138484902F;
  p = p * z + 0.199740824F;
  p = p * z - 0.333327858F;
  return 1.0F + z * p;
}

// The angle of (x, y) with y ≥ 0, in [0, π]: t = min(|x|, y) / max(|x|, y) or, above tan π/8, (t − 1) / (t + 1).
Floats upper_angle(const Floats& y, const Floats& x) {
  const Floats width = abs(x);
  const Ints steep = y > width;
  const Floats low = min(y, width), high = max(y, width);
  const Ints reduced = low > kTanEighth * high;
  const Floats numerator = select(reduced, low - high, low), sum = select(reduced, low + high, high);
  const Floats t = numerator / max(sum, 1e-35F);
  Floats angle = t * arctan_ratio(t * t);
  angle = select(reduced, angle + 0.785398163F, angle);
  angle = select(steep, 1.57079633F - angle, angle);
  return select(x < 0.0F, 3.14159265F - angle, angle);
}

// The form factor of the element at the eye to polygons above its horizon, 1/(2π) Σ θ_k n·(a × b) / |a × b| [Lambert1760].
template <std::size_t kCorners>
Floats whole_factor(const Batch<kCorners>& batch) {
  Floats sum = 0.0F;
  for (std::size_t k = 0; k < kCorners; ++k) {
    const Axes &a = batch.corner[k], &b = batch.corner[(k + 1) % kCorners], &c = batch.edge[k];
    const auto dot = [](const Axes& p, const Axes& q) {
      return load(p.value[0]) * load(q.value[0]) + load(p.value[1]) * load(q.value[1]) +
             load(p.value[2]) * load(q.value[2]);
    };
    const Floats square = dot(c, c), along = dot(a, b), inverse = 1.0F / along;
    const Floats z = square * (inverse * inverse);
    const Ints narrow = (z < kTanEighth * kTanEighth) & (along > 0.0F);
    Floats per_length = inverse * arctan_ratio(z);
    if (lane_bits(narrow) != 0xffff) {
      const Floats length = square_root(square);
      per_length = select(narrow, per_length, upper_angle(length, along) / max(length, 1e-35F));
    }
    sum = sum + per_length * load(c.value[2]);
  }
  return max(sum * 0.159154943F, 0.0F);
}

// What the tiles [first, last] of columns and rows show of a facet: bits for some and for something else.
enum : std::uint32_t { kSome = 1, kElse = 2 };
inline std::uint32_t shown(const Buffers& buffers, std::size_t first_tile, std::size_t columns,
                           const Ints& own, std::int32_t c0, std::int32_t c1, std::int32_t r0,
                           std::int32_t r1) {
  std::uint32_t some = 0, other = 0;
  for (std::int32_t r = r0; r <= r1; ++r) {
    for (std::int32_t c = c0; c <= c1; c += kLanes) {
      const std::size_t at = first_tile + static_cast<std::size_t>(r) * columns + static_cast<std::size_t>(c);
      const std::uint32_t in = c1 - c >= 15 ? 0xffffU : (2U << (c1 - c)) - 1;
      const Ints one = load(buffers.first + at), two = load(buffers.second + at);
      const Ints is_one = one == own, is_two = two == own;
      some |= lane_bits(is_one | is_two | (two == kMixed)) & in;
      other |= ~lane_bits(is_one & is_two) & in;
    }
  }
  return (some != 0 ? std::uint32_t{kSome} : 0U) | (other != 0 ? std::uint32_t{kElse} : 0U);
}

// The lanes of patches whose tiles on a face show their facet, and those whose tiles show something else.
void look_at_tiles(const Buffers& buffers, const Face& face, std::int32_t own_item, const Range& columns,
                   const Range& rows, std::uint32_t lanes, std::uint32_t& some, std::uint32_t& other) {
  const auto tile_columns = static_cast<std::size_t>(face.tile_columns);
  const std::size_t first_tile = face.first_cell / kLanes;
  const Ints own = own_item;
  const std::uint32_t together =
      shown(buffers, first_tile, tile_columns, own, columns.least, columns.most, rows.least, rows.most);
  if (together != (kSome | kElse)) {
    (together == kSome ? some : other) |= lanes;
    return;
  }
  // Two by two tiles or fewer are looked at in all lanes at once.
  const Ints c0 = load(columns.first), c1 = load(columns.last), r0 = load(rows.first), r1 = load(rows.last);
  const std::uint32_t large = lanes & lane_bits((c1 > c0 + 1) | (r1 > r0 + 1));
  if (lanes != large) {
    Ints any = 0, all = -1;
    for (const Ints& r : {r0, r1})
      for (const Ints& c : {c0, c1}) {
        std::int32_t at[kLanes];
        store(at, r * face.tile_columns + c);
        const Ints one = gather(buffers.first + first_tile, at),
                   two = gather(buffers.second + first_tile, at);
        const Ints is_one = one == own, is_two = two == own;
        any = any | is_one | is_two | (two == kMixed);
        all = all & is_one & is_two;
      }
    some |= lanes & ~large & lane_bits(any);
    other |= lanes & ~large & ~lane_bits(all);
  }
  for (lanes = large; lanes != 0; lanes &= lanes - 1) {
    const auto k = static_cast<std::size_t>(__builtin_ctz(lanes));
    const std::uint32_t it = shown(buffers, first_tile, tile_columns, own, columns.first[k], columns.last[k],
                                   rows.first[k], rows.last[k]);
    some |= (it & kSome) << k;
    other |= (it / kElse) << k;
  }
}

// Shares of the cells with their centres in a patch, and of those of them that show its facet.
struct Counted {
  float all[kLanes] = {}, won[kLanes] = {};
  std::int32_t box[kLanes] = {};  // cells of the bounding box
};
template <std::size_t kCorners>
void count_cells(const Batch<kCorners>& batch, const Bounds& b, const Face& face, int resolution,
                 std::int32_t own_item, const Buffers& buffers, const float* share, std::uint32_t lanes,
                 Counted& out) {
  const float per_cell = static_cast<float>(resolution) / 2;
  Range columns, rows;
  lanes &= cells_between(b.u_low, b.u_high, -1, per_cell, resolution, columns) &
           cells_between(b.v_low, b.v_high, face.v0, per_cell, face.rows, rows);
  const Ints own = own_item;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto k = static_cast<std::size_t>(__builtin_ctz(lanes));
    Linear edge[kCorners];
    for (std::size_t e = 0; e < kCorners; ++e) edge[e] = linear(batch.edge[e], face, k);
    Floats won = 0.0F, all = 0.0F;
    for_each_tile<kCorners>(
        edge, face, columns, rows, k, [](const Floats&) {},
        [&](std::size_t at, const Floats&, const Ints& inside) {
          const Floats part = select(inside, load(share + at), 0.0F);
          all = all + part;
          won = won + select(load(buffers.item + at) == own, part, 0.0F);
        });
    out.won[k] += sum_of(won);
    out.all[k] += sum_of(all);
    out.box[k] += (columns.last[k] - columns.first[k] + 1) * (rows.last[k] - rows.first[k] + 1);
  }
}

// Of a patch whose bounding box has fewer cells than these the share that is seen is that of its cells, not a ratio of the whole: it may
// have none, and would never count what its neighbours hide of it.
constexpr std::int32_t kFewCells = 4;

// The factors from the eye to patches, behind the first `count` of buffers.factor: of one that tiles show whole its closed form; of one
// that they show in part F = F_whole Σ ΔF (cells that show its facet) / Σ ΔF (cells in it).
template <std::size_t kCorners>
void add_patches(const Polygons& polygons, const View& view, const Face* faces, int resolution,
                 const Buffers& buffers, const float* share, std::size_t& count) {
  const float per_cell = static_cast<float>(resolution) / 2;
  for_each_batch<kCorners, true>(
      polygons, view, buffers,
      [&](std::size_t first, const Batch<kCorners>& batch, const Ints* reaches, int reached,
          std::uint32_t above) {
        const std::int32_t own = polygons.plane[first] + 1;
        Bounds bounds[5];
        std::uint32_t active[5] = {}, seen = 0, hidden = 0;
        for (int f = 0; f < 5; ++f) {
          if ((reached >> f & 1) == 0) continue;
          const Face& face = faces[f];
          bounds[f] = bounds_of(batch, face);
          const Bounds& b = bounds[f];
          Range columns, rows;
          const Ints across = tiles_between(reaches[f], b.u_low, b.u_high, -1, per_cell, resolution, columns);
          active[f] = lane_bits(tiles_between(across, b.v_low, b.v_high, face.v0, per_cell, face.rows, rows));
          if (active[f] != 0) look_at_tiles(buffers, face, own, columns, rows, active[f], seen, hidden);
        }
        if (seen == 0) return;
        float exact[kLanes];
        store(exact, whole_factor(batch));
        Counted counted;
        const std::uint32_t parts = seen & (hidden | ~above);
        if (parts != 0)
          for (int f = 0; f < 5; ++f)
            if ((active[f] & parts) != 0)
              count_cells(batch, bounds[f], faces[f], resolution, own, buffers, share, active[f] & parts,
                          counted);
        const std::int32_t* const content = polygons.content + first;
        for (std::uint32_t l = seen; l != 0; l &= l - 1) {
          const auto k = static_cast<std::size_t>(__builtin_ctz(l));
          const bool ratio = (above >> k & 1) != 0 && counted.box[k] >= kFewCells && counted.all[k] > 0;
          const bool whole = (parts >> k & 1) == 0 || (ratio && counted.won[k] == counted.all[k]);
          const float value = whole   ? exact[k]
                              : ratio ? exact[k] * (counted.won[k] / counted.all[k])
                                      : counted.won[k];
          buffers.content[count] = whole ? content[k] : -content[k];
          buffers.factor[count] = value;
          count += value > 0 ? 1 : 0;
        }
      });
}

// What tiles show, and sums[4·item + k] += ΔF, k a number that neighbouring cells do not share: additions to one place would wait for
// each other.
void add_shares(const Buffers& buffers, const float* share, const double* tile_share, std::size_t cells,
                double* sums) {
  for (std::size_t c = 0; c < cells; c += kLanes) {
    const std::int32_t* const item = buffers.item + c;
    const Ints first = item[0];
    const Ints other = ~(load(item) == first) & (load(share + c) > 0.0F);
    const std::uint32_t others = lane_bits(other);
    if (others == 0) {
      buffers.first[c / kLanes] = buffers.second[c / kLanes] = item[0];
      sums[4 * static_cast<std::size_t>(item[0])] += tile_share[c / kLanes];
      continue;
    }
    const std::int32_t second = item[__builtin_ctz(others)];
    const bool two = lane_bits(other & ~(load(item) == second)) == 0;
    buffers.first[c / kLanes] = item[0];
    buffers.second[c / kLanes] = two ? second : kMixed;
    for (std::size_t k = 0; k < kLanes; ++k)
      sums[4 * static_cast<std::size_t>(item[k]) + k % kTile] += static_cast<double>(share[c + k]);
  }
}

double add_factors(const Items& items, const View& view, const Face* faces, int resolution, std::size_t cells,
                   const float* share, const double* tile_share, double weight, const Buffers& buffers,
                   double* sums) {
  planes_to_local(items, view, buffers);
  for (std::size_t c = 0; c < cells; ++c) buffers.item[c] = kLost;
  for (std::size_t c = 0; c < cells; ++c) buffers.nearness[c] = 0;
  draw_polygons<4>(items.facet_quads, view, faces, resolution, buffers);
  draw_polygons<3>(items.facet_triangles, view, faces, resolution, buffers);
  for (std::size_t k = 0; k < 4 * (items.planes + 1); ++k) buffers.shares[k] = 0;
  add_shares(buffers, share, tile_share, cells, buffers.shares);
  std::size_t count = 0;
  add_patches<4>(items.quads, view, faces, resolution, buffers, share, count);
  add_patches<3>(items.triangles, view, faces, resolution, buffers, share, count);
  const auto shown_of = [&](std::size_t item) {
    const double* const s = buffers.shares + 4 * item;
    return (s[0] + s[1]) + (s[2] + s[3]);
  };
  const double lost = shown_of(kLost);
  double exact = 0, counted = 0;
  for (std::size_t k = 0; k < count; ++k)
    (buffers.content[k] > 0 ? exact : counted) += static_cast<double>(buffers.factor[k]);
  for (std::size_t p = 0; p < items.planes; ++p)
    if (items.single[p] != kLost) counted += shown_of(p + 1);
  // What the cells show that show anything.
  double of_exact = 1, of_counted = counted > 0 ? (1 - lost - exact) / counted : 0;
  if (!(of_counted > 0.5 && of_counted < 2))
    of_exact = of_counted = exact + counted > 0 ? (1 - lost) / (exact + counted) : 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t content = buffers.content[k];
    sums[content > 0 ? content : -content] +=
        weight * (content > 0 ? of_exact : of_counted) * static_cast<double>(buffers.factor[k]);
  }
  for (std::size_t p = 0; p < items.planes; ++p)
    if (items.single[p] != kLost) sums[items.single[p]] += weight * of_counted * shown_of(p + 1);
  return lost;
}

}  // namespace
}  // namespace radiosity::item_buffer

namespace radiosity::RADIOSITY_KERNEL {
extern const item_buffer::Kernel item_buffer_kernel{RADIOSITY_LEVEL, item_buffer::add_factors};
}
