// SPDX-License-Identifier: GPL-3.0-or-later
#include "item_buffer.hpp"

#include <utility>

#include "radiosity/meshing/tolerances.hpp"

namespace radiosity::item_buffer {
namespace {

// The compiler's vector types as wide as the registers; wider ones would be taken apart lane by lane.
#if defined(__AVX512F__)
constexpr std::size_t kBytes = 64;
#elif defined(__AVX__)
constexpr std::size_t kBytes = 32;
#else
constexpr std::size_t kBytes = 16;
#endif

using FloatPart = float __attribute__((vector_size(kBytes)));
using IntPart = std::int32_t __attribute__((vector_size(kBytes)));

constexpr std::size_t kParts = kLanes * sizeof(float) / kBytes;
struct Floats {
  FloatPart part[kParts];
};
struct Ints {
  IntPart part[kParts];
};

// Unrolled by a pack: arrays that loops index stay in memory.
template <std::size_t k, class F, class... A>
inline auto one(F f, const A&... a) {
  return f(a.part[k]...);
}
template <class R, class F, std::size_t... k, class... A>
inline R all(std::index_sequence<k...>, F f, const A&... a) {
  return {{one<k>(f, a...)...}};
}
template <class R, class F, class... A>
inline R each(F f, const A&... a) {
  return all<R>(std::make_index_sequence<kParts>(), f, a...);
}

inline Floats operator+(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x + y; }, a, b);
}
inline Floats operator-(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x - y; }, a, b);
}
inline Floats operator*(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x * y; }, a, b);
}
inline Floats operator/(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x / y; }, a, b);
}
inline Floats operator-(const Floats& a) {
  return each<Floats>([](auto x) { return -x; }, a);
}
// Comparisons give −1 for true and 0 for false.
inline Ints operator<(const Floats& a, const Floats& b) {
  return each<Ints>([](auto x, auto y) { return x < y; }, a, b);
}
inline Ints operator>(const Floats& a, const Floats& b) {
  return b < a;
}
inline Ints operator>=(const Floats& a, const Floats& b) {
  return each<Ints>([](auto x, auto y) { return x >= y; }, a, b);
}
inline Ints operator>(const Ints& a, const Ints& b) {
  return each<Ints>([](auto x, auto y) { return x > y; }, a, b);
}
inline Ints operator==(const Ints& a, const Ints& b) {
  return each<Ints>([](auto x, auto y) { return x == y; }, a, b);
}
inline Ints operator&(const Ints& a, const Ints& b) {
  return each<Ints>([](auto x, auto y) { return x & y; }, a, b);
}
inline Ints operator|(const Ints& a, const Ints& b) {
  return each<Ints>([](auto x, auto y) { return x | y; }, a, b);
}
inline Ints operator^(const Ints& a, const Ints& b) {
  return each<Ints>([](auto x, auto y) { return x ^ y; }, a, b);
}
inline Ints operator~(const Ints& a) {
  return each<Ints>([](auto x) { return ~x; }, a);
}
template <class V>
inline V select(const Ints& mask, const V& a, const V& b) {
  return each<V>([](auto m, auto x, auto y) { return m ? x : y; }, mask, a, b);
}
inline Floats min(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x < y ? x : y; }, a, b);
}
inline Floats max(const Floats& a, const Floats& b) {
  return each<Floats>([](auto x, auto y) { return x > y ? x : y; }, a, b);
}
inline Floats abs(const Floats& a) {
  return max(a, -a);
}
inline Ints truncated(const Floats& a) {
  return each<Ints>([](auto x) { return __builtin_convertvector(x, IntPart); }, a);
}
inline Floats splat(float x) {
  return each<Floats>([x](auto zero) { return x - zero; }, Floats{});
}
inline Ints splat(std::int32_t x) {
  return each<Ints>([x](auto zero) { return x - zero; }, Ints{});
}
// Part by part: whole structs would be copied through general registers.
template <class V, class Part, class T, std::size_t... k>
inline V load_parts(const T* p, std::index_sequence<k...>) {
  const auto load_part = [p](std::size_t n) {
    Part v;
    __builtin_memcpy(&v, p + n * kBytes / sizeof(T), kBytes);
    return v;
  };
  return {{load_part(k)...}};
}
inline Floats load(const float* p) {
  return load_parts<Floats, FloatPart>(p, std::make_index_sequence<kParts>());
}
inline Ints load(const std::int32_t* p) {
  return load_parts<Ints, IntPart>(p, std::make_index_sequence<kParts>());
}
template <class T, class V>
inline void store(T* p, const V& v) {
  for (std::size_t k = 0; k < kParts; ++k) __builtin_memcpy(p + k * kBytes / sizeof(T), &v.part[k], kBytes);
}
template <class T>
inline auto gather(const T* base, const std::int32_t* index) {
  alignas(64) T values[kLanes];
  for (std::size_t k = 0; k < kLanes; ++k) values[k] = base[index[k]];
  return load(values);
}
// Planes through the eye that bound the faces' pyramids: a bit is set where the vertex is on the negative side. kAbove is set
// where it is higher over the patch's plane than what counts as lying in it.
constexpr std::int32_t kAbove = 1 << 7;

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

// Bit k is set where the mask is, in lane k.
std::uint32_t lane_bits(const Ints& mask) {
  alignas(64) constexpr std::int32_t kBits[kLanes] = {1,       1 << 1,  1 << 2,  1 << 3, 1 << 4,  1 << 5,
                                                      1 << 6,  1 << 7,  1 << 8,  1 << 9, 1 << 10, 1 << 11,
                                                      1 << 12, 1 << 13, 1 << 14, 1 << 15};
  std::int32_t bits[kLanes];
  store(bits, mask & load(kBits));
  std::int32_t all = 0;
  for (const std::int32_t b : bits) all |= b;
  return static_cast<std::uint32_t>(all);
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
      d[k] = (load(corner + k * kLanes) - splat(high[k])) + (load(corner + (3 + k) * kLanes) - splat(low[k]));
    const auto along = [&](std::size_t row) {
      return splat(m[row]) * d[0] + splat(m[row + 1]) * d[1] + splat(m[row + 2]) * d[2];
    };
    return {along(0), along(3), along(6)};
  }
  float high[3], low[3], m[9];
};

Ints code_of(const Triple& p) {
  const auto& [x, y, z] = p;
  const auto bit = [](const Ints& mask, std::int32_t value) { return mask & splat(value); };
  return bit(z < x, 1) | bit(z < -x, 2) | bit(z < y, 4) | bit(z < -y, 8) | bit(x < y, 16) | bit(x < -y, 32) |
         bit(z < splat(0.0F), 64) | bit(z > splat(tolerance::kSamePlane), kAbove);
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

template <std::size_t kCorners>
void draw_face(const Batch<kCorners>& batch, const Ints& reaches, const Face& face, int resolution,
               const Buffers& buffers) {
  const float per_cell = static_cast<float>(resolution) / 2;
  const std::int32_t right = face.right, up = face.up, forward = face.forward;
  const float *const tile_u = face.tile_u, *const tile_v = face.tile_v;
  const auto tile_columns = static_cast<std::size_t>(face.tile_columns);
  float* const depths = buffers.nearness + face.first_cell;
  std::int32_t* const cells = buffers.item + face.first_cell;
  const Floats infinite = splat(3e38F);
  // Bounds of u and v, times w > 0: those of the corners in front of the eye; where an edge passes w = 0 the polygon goes to
  // infinity in its direction there.
  Floats u_low = infinite, u_high = -infinite, v_low = infinite, v_high = -infinite;
  for (std::size_t k = 0; k < kCorners; ++k) {
    const Axes &a = batch.corner[k], &b = batch.corner[(k + 1) % kCorners];
    const Floats aw = load(a.value[forward]), bw = load(b.value[forward]);
    const Ints a_front = aw > splat(1e-6F), b_front = bw > splat(1e-6F);
    const Floats per_w = splat(1.0F) / aw;
    const Floats u = load(a.value[right]) * per_w, v = load(a.value[up]) * per_w;
    u_low = select(a_front, min(u_low, u), u_low);
    u_high = select(a_front, max(u_high, u), u_high);
    v_low = select(a_front, min(v_low, v), v_low);
    v_high = select(a_front, max(v_high, v), v_high);
    const Ints crosses = a_front ^ b_front;
    if (lane_bits(crosses) == 0) continue;
    const auto at_zero = [&](std::int32_t axis) {  // where w = 0, times the difference of w
      const Floats at = aw * load(b.value[axis]) - bw * load(a.value[axis]);
      return select(a_front, at, -at);
    };
    const Floats cross_u = at_zero(right), cross_v = at_zero(up);
    const Floats slack = splat(1e-5F) * (abs(aw) + abs(bw));
    u_high = select(crosses & (cross_u > -slack), infinite, u_high);
    u_low = select(crosses & (cross_u < slack), -infinite, u_low);
    v_high = select(crosses & (cross_v > -slack), infinite, v_high);
    v_low = select(crosses & (cross_v < slack), -infinite, v_low);
  }
  // Cells whose centres may be inside; a hundredth of a cell for rounding.
  const float columns = static_cast<float>(resolution - 1), rows = static_cast<float>(face.rows - 1);
  const auto first_cell = [&](const Floats& low, float origin, float last) {
    const Floats c = (low - splat(origin)) * splat(per_cell) + splat(0.49F);
    return truncated(min(max(c, splat(0.0F)), splat(last + 1)));
  };
  const auto last_cell = [&](const Floats& high, float origin, float last) {
    const Floats c = min((high - splat(origin)) * splat(per_cell) - splat(0.49F), splat(last));
    return select(c < splat(0.0F), splat(-1), truncated(max(c, splat(0.0F))));
  };
  const Ints first_column = first_cell(u_low, -1, columns), last_column = last_cell(u_high, -1, columns);
  const Ints first_row = first_cell(v_low, face.v0, rows), last_row = last_cell(v_high, face.v0, rows);
  std::int32_t column_first[kLanes], column_last[kLanes], row_first[kLanes], row_last[kLanes];
  store(column_first, first_column);
  store(column_last, last_column);
  store(row_first, first_row);
  store(row_last, last_row);
  std::uint32_t lanes = lane_bits(reaches & ~(first_column > last_column) & ~(first_row > last_row));
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
    // Linear in u and v: a[0] u + a[1] v + a[2]; ≥ 0 inside of an edge.
    struct Linear {
      Floats a[3];
    };
    const auto linear = [&](const Axes& axes) {
      return Linear{
          {splat(axes.value[right][lane]), splat(axes.value[up][lane]), splat(axes.value[forward][lane])}};
    };
    Linear edge[kCorners];
    for (std::size_t k = 0; k < kCorners; ++k) edge[k] = linear(batch.edge[k]);
    const Linear nearness = linear(batch.nearness);
    const Ints shows = splat(batch.shows[lane]);
    const auto tile_first = static_cast<std::size_t>(column_first[lane] / kTile) * kLanes,
               tile_last = static_cast<std::size_t>(column_last[lane] / kTile) * kLanes;
    const auto row_end = static_cast<std::size_t>(row_last[lane] / kTile) * kLanes;
    for (std::size_t row = static_cast<std::size_t>(row_first[lane] / kTile) * kLanes; row <= row_end;
         row += kLanes) {
      const Floats v = load(tile_v + row);
      Floats rest[kCorners];
      for (std::size_t k = 0; k < kCorners; ++k) rest[k] = edge[k].a[1] * v + edge[k].a[2];
      const Floats rest_near = nearness.a[1] * v + nearness.a[2];
      float* const depth = depths + row * tile_columns;
      std::int32_t* const cell = cells + row * tile_columns;
      for (std::size_t tile = tile_first; tile <= tile_last; tile += kLanes) {
        const Floats u = load(tile_u + tile);
        Floats inside = edge[0].a[0] * u + rest[0];
        for (std::size_t k = 1; k < kCorners; ++k) inside = min(inside, edge[k].a[0] * u + rest[k]);
        const Floats near = nearness.a[0] * u + rest_near;
        const Floats before = load(depth + tile);
        const Ints wins = (inside >= splat(0.0F)) & (near > before);
        store(depth + tile, select(wins, near, before));
        store(cell + tile, select(wins, shows, load(cell + tile)));
      }
    }
  }
}

// A homogeneous rasteriser [OlanoGreer1997]: the direction q = (u, v, 1) of a cell meets the polygon iff q·(a × b) ≥ 0 for each
// edge ab (counter-clockwise seen from the eye), which needs no clipping, whatever lies behind the eye. Two polygons that share
// an edge see it with the opposite sign, to the bit, so no cell falls between them. (This file is built without fused
// multiply-add, which a compiler may use for some lanes and not for others.)
template <std::size_t kCorners>
void draw_polygons(const Polygons& polygons, const View& view, const Face* faces, int resolution,
                   const Buffers& buffers) {
  const Camera camera(view);
  Batch<kCorners> batch;
  const float* numbers = polygons.numbers;
  for (std::size_t first = 0; first < polygons.count;
       first += kLanes, numbers += kNumbersPerCorner * kCorners * kLanes) {
    const std::int32_t* const plane = polygons.plane + first;
    const Ints facing = gather(buffers.front, plane);
    Triple corner[kCorners];
    Ints all = splat(-1), any = splat(0);
    for (std::size_t k = 0; k < kCorners; ++k) {
      corner[k] = camera.to_local(numbers + 6 * k * kLanes);
      const Ints code = code_of(corner[k]);
      all = all & code;
      any = any | code;
    }
    // Not those with all corners on the wrong side of one plane of a face's pyramid, nor below the horizon, nor in the patch's own
    // plane.
    const Ints none = splat(0);
    const Ints skipped = ((any & splat(kAbove)) == none) | (facing == none);
    Ints reaches[5];
    Ints reach = none;
    for (int f = 0; f < 5; ++f) {
      reaches[f] =
          ~skipped & (((all & splat(kPyramids[f].positive)) | (~any & splat(kPyramids[f].negative))) == none);
      reach = reach | (reaches[f] & splat(1 << f));
    }
    std::int32_t bits[kLanes];
    store(bits, reach);
    std::int32_t reached = 0;
    for (const std::int32_t b : bits) reached |= b;
    if (reached == 0) continue;

    const Floats sign = select(facing == splat(1), splat(-1.0F), splat(1.0F));
    for (std::size_t k = 0; k < kCorners; ++k) {
      store_axes(batch.corner[k], corner[k]);
      // a × b = a × (b − a), from the same one of the two for both polygons: they see the same bits, and the line passes the
      // corners within a rounding of their distance, not of that divided by the edge's length.
      const Triple &a = corner[k], &b = corner[(k + 1) % kCorners];
      const Floats direction = load(numbers + (6 * kCorners + k) * kLanes);
      const Ints turned = direction < splat(0.0F);
      const Triple from{select(turned, b.x, a.x), select(turned, b.y, a.y), select(turned, b.z, a.z)};
      const Triple along{select(turned, a.x, b.x) - from.x, select(turned, a.y, b.y) - from.y,
                         select(turned, a.z, b.z) - from.z};
      const Floats signs = direction * sign;
      store_axes(batch.edge[k], {signs * (from.y * along.z - from.z * along.y),
                                 signs * (from.z * along.x - from.x * along.z),
                                 signs * (from.x * along.y - from.y * along.x)});
    }
    store_axes(batch.nearness,
               {gather(buffers.pu, plane), gather(buffers.pv, plane), gather(buffers.pw, plane)});
    store(batch.shows, select(facing == splat(1), load(polygons.content + first), splat(kLost)));
    for (int f = 0; f < 5; ++f)
      if ((reached >> f & 1) != 0) draw_face(batch, reaches[f], faces[f], resolution, buffers);
  }
}

void draw(const Items& items, const View& view, const Face* faces, int resolution, std::size_t cells,
          const Buffers& buffers) {
  planes_to_local(items, view, buffers);
  for (std::size_t c = 0; c < cells; ++c) buffers.item[c] = kLost;
  for (std::size_t c = 0; c < cells; ++c) buffers.nearness[c] = 0;
  draw_polygons<4>(items.quads, view, faces, resolution, buffers);
  draw_polygons<3>(items.triangles, view, faces, resolution, buffers);
}

void add_shares(const std::int32_t* item, const float* share, std::size_t cells, double weight,
                double* sums) {
  for (std::size_t c = 0; c < cells; c += kTile) {
    for (std::size_t k = 0; k < kTile; ++k)
      sums[4 * static_cast<std::size_t>(item[c + k]) + k] += weight * static_cast<double>(share[c + k]);
  }
}

}  // namespace

extern const Kernel RADIOSITY_KERNEL{RADIOSITY_LEVEL, draw, add_shares};

}  // namespace radiosity::item_buffer
