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

// Differences from the eye are taken in double precision: what is near is seen sharply wherever the eye is.
void to_local(const Items& items, const View& view, const Buffers& out) {
  const double ex = view.eye[0], ey = view.eye[1], ez = view.eye[2];
  float m[9];
  for (int k = 0; k < 9; ++k) m[k] = static_cast<float>(view.frame[k]);
  float *lx = out.local[0], *ly = out.local[1], *lz = out.local[2], *mx = out.local[3], *my = out.local[4];
  for (std::size_t v = 0; v < items.vertices; ++v) {
    const auto dx = static_cast<float>(items.x[v] - ex);
    const auto dy = static_cast<float>(items.y[v] - ey);
    const auto dz = static_cast<float>(items.z[v] - ez);
    lx[v] = m[0] * dx + m[1] * dy + m[2] * dz;
    ly[v] = m[3] * dx + m[4] * dy + m[5] * dz;
    lz[v] = m[6] * dx + m[7] * dy + m[8] * dz;
  }
  for (std::size_t v = 0; v < items.vertices; v += kLanes) {
    const Floats x = load(lx + v), y = load(ly + v), z = load(lz + v);
    store(mx + v, -x);
    store(my + v, -y);
    const auto bit = [](const Ints& mask, std::int32_t value) { return mask & splat(value); };
    const Ints code = bit(z < x, 1) | bit(z < -x, 2) | bit(z < y, 4) | bit(z < -y, 8) | bit(x < y, 16) |
                      bit(x < -y, 32) | bit(z < splat(0.0F), 64) |
                      bit(z > splat(tolerance::kSamePlane), kAbove);
    store(out.code + v, code);
  }
}

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

// Lists the items that may appear on each face: not those with all corners on the wrong side of one plane of its pyramid,
// nor below the horizon, nor in the patch's own plane.
void cull(const Items& items, const Buffers& out, std::int32_t* const* lists, std::size_t* counts) {
  for (int f = 0; f < 5; ++f) counts[f] = 0;
  for (std::size_t first = 0; first < items.items; first += kLanes) {
    Ints all = gather(out.code, items.corner[0] + first);
    Ints any = all;
    for (int k = 1; k < 4; ++k) {
      const Ints code = gather(out.code, items.corner[k] + first);
      all = all & code;
      any = any | code;
    }
    const Ints facing = gather(out.front, items.plane + first);
    const Ints none = splat(0);
    const Ints skipped = ((any & splat(kAbove)) == none) | (facing == none);
    for (int f = 0; f < 5; ++f) {
      const Ints reaches =
          ~skipped & (((all & splat(kPyramids[f].positive)) | (~any & splat(kPyramids[f].negative))) == none);
      std::int32_t flags[kLanes];
      store(flags, reaches);
      std::int32_t* list = lists[f];
      std::size_t n = counts[f];
      for (std::size_t k = 0; k < kLanes; ++k) {
        list[n] = static_cast<std::int32_t>(first + k);
        n += static_cast<std::size_t>(-flags[k]);
      }
      counts[f] = n;
    }
  }
}

struct Triple {
  Floats u, v, w;
};

// A homogeneous rasteriser [OlanoGreer1997]: the direction q = (u, v, 1) of a cell meets the item iff q·(a × b) ≥ 0 for each
// edge ab (counter-clockwise seen from the eye), which needs no clipping, whatever lies behind the eye. Two items that share
// an edge see it with the opposite sign, to the bit, so no cell falls between them. (This file is built without fused
// multiply-add, which a compiler may use for some lanes and not for others.)
void draw_face(const Items& items, const Face& face, int resolution, const std::int32_t* list,
               std::size_t count, const Buffers& buffers) {
  const float* const axis_u = buffers.local[face.right];
  const float* const axis_v = buffers.local[face.up];
  const float* const axis_w = buffers.local[face.forward];
  const float per_cell = static_cast<float>(resolution) / 2;
  const Floats infinite = splat(3e38F);
  // Of planes: nearness along the face's axes; up and forward are never −z.
  const auto plane_part = [&](std::int32_t axis, const std::int32_t* plane) {
    const float* const part[3] = {buffers.pu, buffers.pv, buffers.pw};
    const Floats n = gather(part[axis % 3], plane);
    return axis < 3 ? n : -n;
  };
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::int32_t* const item = list + first;
    std::int32_t plane[kLanes];
    std::int32_t facing[kLanes];
    std::int32_t content[kLanes];
    store(plane, gather(items.plane, item));
    store(facing, gather(buffers.front, plane));
    store(content, gather(items.content, item));
    Triple p[4];
    Ints corner[4];
    for (int k = 0; k < 4; ++k) {
      corner[k] = gather(items.corner[k], item);
      std::int32_t index[kLanes];
      store(index, corner[k]);
      p[k] = {gather(axis_u, index), gather(axis_v, index), gather(axis_w, index)};
    }
    // Bounds of u and v, times w > 0: those of the corners in front of the eye; where an edge passes w = 0 the item goes to
    // infinity in its direction there.
    Floats u_low = infinite, u_high = -infinite, v_low = infinite, v_high = -infinite;
    alignas(64) float edge[4][3][kLanes];
    const Floats sign = select(load(facing) == splat(1), splat(-1.0F), splat(1.0F));
    for (int k = 0; k < 4; ++k) {
      const Triple &a = p[k], &b = p[(k + 1) % 4];
      // a × b = a × (b − a), from the vertex of the smaller number: both items see the same bits, and the line passes the
      // vertices within a rounding of their distance, not of that divided by the edge's length.
      const Ints turned = corner[k] > corner[(k + 1) % 4];
      const Triple from{select(turned, b.u, a.u), select(turned, b.v, a.v), select(turned, b.w, a.w)};
      const Triple along{select(turned, a.u, b.u) - from.u, select(turned, a.v, b.v) - from.v,
                         select(turned, a.w, b.w) - from.w};
      const Floats direction = select(turned, splat(-1.0F), splat(1.0F));
      const Triple e{direction * (from.v * along.w - from.w * along.v),
                     direction * (from.w * along.u - from.u * along.w),
                     direction * (from.u * along.v - from.v * along.u)};
      store(edge[k][0], e.u * sign);
      store(edge[k][1], e.v * sign);
      store(edge[k][2], e.w * sign);
      const Ints a_front = a.w > splat(1e-6F), b_front = b.w > splat(1e-6F);
      const Floats u = a.u / a.w, v = a.v / a.w;
      u_low = select(a_front, min(u_low, u), u_low);
      u_high = select(a_front, max(u_high, u), u_high);
      v_low = select(a_front, min(v_low, v), v_low);
      v_high = select(a_front, max(v_high, v), v_high);
      const Ints crosses = a_front ^ b_front;
      const Floats cross_u = select(a_front, e.v, -e.v), cross_v = select(a_front, -e.u, e.u);
      const Floats slack = splat(1e-5F) * (abs(a.w) + abs(b.w));
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
    std::int32_t column_first[kLanes], column_last[kLanes], row_first[kLanes], row_last[kLanes];
    store(column_first, first_cell(u_low, -1, columns));
    store(column_last, last_cell(u_high, -1, columns));
    store(row_first, first_cell(v_low, face.v0, rows));
    store(row_last, last_cell(v_high, face.v0, rows));
    alignas(64) float nearness[3][kLanes];
    store(nearness[0], plane_part(face.right, plane));
    store(nearness[1], plane_part(face.up, plane));
    store(nearness[2], plane_part(face.forward, plane));

    const std::size_t lanes = count - first < kLanes ? count - first : kLanes;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (column_first[lane] > column_last[lane] || row_first[lane] > row_last[lane]) continue;
      const std::int32_t shows = facing[lane] > 0 ? content[lane] : kLost;
      const int tile_first = column_first[lane] / kTile, tile_last = column_last[lane] / kTile;
      const int tile_row_last = row_last[lane] / kTile;
      for (int tile_row = row_first[lane] / kTile; tile_row <= tile_row_last; ++tile_row) {
        const Floats v = load(face.tile_v + static_cast<std::size_t>(tile_row) * kLanes);
        Floats rest[4];
        for (int k = 0; k < 4; ++k) rest[k] = splat(edge[k][1][lane]) * v + splat(edge[k][2][lane]);
        const Floats rest_near = splat(nearness[1][lane]) * v + splat(nearness[2][lane]);
        const std::size_t row_of_tiles = face.first_cell + static_cast<std::size_t>(tile_row) *
                                                               static_cast<std::size_t>(face.tile_columns) *
                                                               kLanes;
        for (int tile = tile_first; tile <= tile_last; ++tile) {
          const std::size_t offset = static_cast<std::size_t>(tile) * kLanes;
          const Floats u = load(face.tile_u + offset);
          const Floats inside =
              min(min(splat(edge[0][0][lane]) * u + rest[0], splat(edge[1][0][lane]) * u + rest[1]),
                  min(splat(edge[2][0][lane]) * u + rest[2], splat(edge[3][0][lane]) * u + rest[3]));
          const Floats near = splat(nearness[0][lane]) * u + rest_near;
          float* const depth = buffers.nearness + row_of_tiles + offset;
          std::int32_t* const cell = buffers.item + row_of_tiles + offset;
          const Floats before = load(depth);
          const Ints wins = (inside >= splat(0.0F)) & (near > before);
          store(depth, select(wins, near, before));
          store(cell, select(wins, splat(shows), load(cell)));
        }
      }
    }
  }
}

void draw(const Items& items, const View& view, const Face* faces, int resolution, std::size_t cells,
          const Buffers& buffers) {
  to_local(items, view, buffers);
  planes_to_local(items, view, buffers);
  std::int32_t* lists[5];
  std::size_t counts[5];
  for (std::size_t f = 0; f < 5; ++f) lists[f] = buffers.list + f * (items.items + kLanes);
  cull(items, buffers, lists, counts);
  for (std::size_t c = 0; c < cells; ++c) buffers.item[c] = kLost;
  for (std::size_t c = 0; c < cells; ++c) buffers.nearness[c] = 0;
  for (std::size_t f = 0; f < 5; ++f) {
    // Beyond the end the last batch looks at item 0, and draws nothing of it.
    for (std::size_t k = 0; k < kLanes; ++k) lists[f][counts[f] + k] = 0;
    draw_face(items, faces[f], resolution, lists[f], counts[f], buffers);
  }
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
