// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "methods.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "sampling.hpp"

namespace radiosity {
namespace {

constexpr Index kEmpty = -1;  // the cell looks out of the scene
constexpr Index kBackSide = -2;

// A convex piece of a patch, at most four corners, as it is drawn into the item buffers.
struct Item {
  std::array<Index, 4> corner;
  int corners;
  Index patch;
};

std::vector<Item> convex_items(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  std::vector<Item> items;
  items.reserve(static_cast<std::size_t>(mesh.patch_count()));
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (visibility.covered(i)) continue;
    const auto c = mesh.corners(i);
    bool whole = c.size() == 4;  // a planar convex quad is drawn in one piece
    for (std::size_t k = 0; whole && k < 4; ++k) {
      const Vec3& a = mesh.vertex(c[k]);
      const Vec3 e = mesh.vertex(c[(k + 1) % 4]) - a;
      const Vec3 f = mesh.vertex(c[(k + 2) % 4]) - a;
      whole = e.cross(f).dot(mesh.normal(i)) > 0 &&
              std::abs(mesh.normal(i).dot(a - mesh.centroid(i))) <= tolerance::kPlanarity * f.norm();
    }
    if (whole) {
      items.push_back({{c[0], c[1], c[2], c[3]}, 4, i});
    } else {
      for (const auto& t : mesh.triangles(i)) items.push_back({{t[0], t[1], t[2], t[2]}, 3, i});
    }
  }
  return items;
}

// One face of the hemicube: cell (column, row) has its centre at (u, v) = (−1 + (column + ½) h, v0 + (row +
// ½) h), h = 2/r, in the direction  u·right + v·up + forward  of the local frame.
struct Face {
  std::array<int, 3> right, up, forward;  // rows of the map from local coordinates to (u, v, w)
  int rows;
  float v0;
};

struct Local {
  float x, y, z;
};

inline float along(const std::array<int, 3>& axis, const Local& p) {
  return static_cast<float>(axis[0]) * p.x + static_cast<float>(axis[1]) * p.y +
         static_cast<float>(axis[2]) * p.z;
}

/// The hemicube [CohenGreenberg1985]: half a cube of half-width 1 over points of the patch. A cell of area ΔA
/// = h² carries
///   top:   ΔF = ΔA / (π (u² + v² + 1)²)        sides:  ΔF = v ΔA / (π (u² + v² + 1)²),  v the height over
///   the patch,
/// and an item buffer tells which patch fills it. The table is scaled to sum to exactly 1. Each patch's cubes
/// are turned about the normal by a random angle, which decorrelates the aliasing between patches [Baum1989].
class Hemicube final : public FormFactorMethod {
 public:
  Hemicube(const Visibility& visibility, const FormFactorOptions& options);

  void rows(Index first, Index last, bool upper, const Sink& sink) const override;
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  Index setting() const override { return resolution_; }
  Index max_entries_per_row() const override {
    return static_cast<Index>(
        std::min<std::size_t>(kPoints * cells_, static_cast<std::size_t>(visibility_.mesh().patch_count())));
  }

 private:
  static constexpr int kPoints = 4;

  struct Buffers {
    std::vector<Local> vertices;
    std::vector<std::uint8_t>
        outside;              // bit per plane through the point that the vertex is on the negative side of
    std::vector<Index> item;  // patch per cell, faces one after the other
    std::vector<float> nearness;  // 1/w of what fills the cell
  };

  void draw(const Vec3& eye, const Vec3& t, const Vec3& b, const Vec3& n, Buffers& buffers) const;
  void draw_item(const Item& item, bool front, const Face& face, std::size_t offset, Buffers& buffers) const;

  const Visibility& visibility_;
  std::uint64_t seed_;
  int resolution_;
  std::vector<Item> items_;
  std::array<Face, 5> faces_;
  std::size_t cells_ = 0;
  std::vector<double> delta_;  // ΔF per cell, faces one after the other
};

Hemicube::Hemicube(const Visibility& visibility, const FormFactorOptions& options)
    : visibility_(visibility),
      seed_(options.seed),
      resolution_(options.resolution + options.resolution % 2),  // side faces are half as high
      items_(convex_items(visibility)) {
  const int r = resolution_;
  faces_ = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, r, -1},
             {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, r / 2, 0},
             {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}, r / 2, 0},
             {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}, r / 2, 0},
             {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}, r / 2, 0}}};
  const double h = 2.0 / r;
  for (const Face& face : faces_) {
    for (int row = 0; row < face.rows; ++row) {
      for (int column = 0; column < r; ++column) {
        const double u = -1 + (column + 0.5) * h;
        const double v = static_cast<double>(face.v0) + (row + 0.5) * h;
        const double q = u * u + v * v + 1;
        delta_.push_back((face.forward[2] != 0 ? 1 : v) / (q * q));
      }
    }
  }
  cells_ = delta_.size();
  const double sum = std::accumulate(delta_.begin(), delta_.end(), 0.0);
  for (double& d : delta_) d /= sum;
}

// Planes through the eye that bound the faces' pyramids. A bit is set where the vertex is on the negative
// side.
std::uint8_t side_bits(const Local& p) {
  const auto bit = [](bool negative, int k) { return static_cast<unsigned>(negative) << k; };
  return static_cast<std::uint8_t>(bit(p.z - p.x < 0, 0) | bit(p.z + p.x < 0, 1) | bit(p.z - p.y < 0, 2) |
                                   bit(p.z + p.y < 0, 3) | bit(p.x - p.y < 0, 4) | bit(p.x + p.y < 0, 5) |
                                   bit(p.z < 0, 6));
}

// For each face: planes of which its pyramid is on the positive and on the negative side.
//   top: |x| ≤ z, |y| ≤ z;   +x: |y| ≤ x, 0 ≤ z ≤ x;   and so on round.
constexpr std::array<std::array<unsigned, 2>, 5> kPyramid{{
    {0b0001111, 0},
    {0b1110000, 0b0000001},
    {0b1000000, 0b0110010},
    {0b1100000, 0b0010100},
    {0b1010000, 0b0101000},
}};

// A homogeneous rasteriser [OlanoGreer1997]: the direction q = (u, v, 1) of a cell meets the item iff q·(a ×
// b) ≥ 0 for each edge ab (counter-clockwise seen from the eye), which needs no clipping, whatever lies
// behind the eye. In a row of cells each edge bounds u from one side. With plane N·p = d the nearness is 1/w
// = N·q / d.
void Hemicube::draw_item(const Item& item, bool front, const Face& face, std::size_t offset,
                         Buffers& buffers) const {
  std::array<std::array<float, 3>, 4> p;  // corners as (u, v, w), not yet divided
  for (int k = 0; k < item.corners; ++k) {
    const auto c = static_cast<std::size_t>(k);
    const Local& v = buffers.vertices[static_cast<std::size_t>(item.corner[c])];
    p[c] = {along(face.right, v), along(face.up, v), along(face.forward, v)};
  }
  const auto cross = [](const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return std::array<float, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                a[0] * b[1] - a[1] * b[0]};
  };
  std::array<std::array<float, 3>, 4> edge;
  for (int k = 0; k < item.corners; ++k) {
    const auto c = static_cast<std::size_t>(k);
    edge[c] = cross(p[c], p[static_cast<std::size_t>((k + 1) % item.corners)]);
    if (front) edge[c] = {-edge[c][0], -edge[c][1], -edge[c][2]};
  }
  const auto minus = [](const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return std::array<float, 3>{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  std::array<float, 3> normal = cross(minus(p[1], p[0]), minus(p[2], p[0]));
  const float d = normal[0] * p[0][0] + normal[1] * p[0][1] + normal[2] * p[0][2];
  if (d == 0) return;
  // A wall without thickness shows each side its own front: at equal depth the front wins.
  const float nearer = (front ? 1.0F : 1.0F - tolerance::kDepthTie) / d;
  for (float& c : normal) c *= nearer;
  const int r = resolution_;
  const float h = 2.0F / static_cast<float>(r);
  // Rows that the item can reach: exact where all corners are in front of the eye.
  int row_first = 0;
  int row_last = face.rows - 1;
  float low = std::numeric_limits<float>::max();
  float high = -low;
  bool in_front = true;
  for (int k = 0; k < item.corners; ++k) {
    const auto& c = p[static_cast<std::size_t>(k)];
    if (c[2] <= 1e-6F) {
      in_front = false;
      break;
    }
    low = std::min(low, c[1] / c[2]);
    high = std::max(high, c[1] / c[2]);
  }
  if (in_front) {
    const auto row_of = [&](float v) {
      return static_cast<int>(std::clamp((v - face.v0) / h, -1.0F, static_cast<float>(face.rows) + 1));
    };
    row_first = std::max(row_first, row_of(low) - 1);
    row_last = std::min(row_last, row_of(high) + 1);
  }
  for (int row = row_first; row <= row_last; ++row) {
    const float v = face.v0 + (static_cast<float>(row) + 0.5F) * h;
    float u_first = -1;
    float u_last = 1;
    for (int k = 0; k < item.corners; ++k) {
      const auto& e = edge[static_cast<std::size_t>(k)];
      const float rest = e[1] * v + e[2];
      if (e[0] > 0) {
        u_first = std::max(u_first, -rest / e[0]);
      } else if (e[0] < 0) {
        u_last = std::min(u_last, -rest / e[0]);
      } else if (rest < 0) {
        u_last = -2;
      }
    }
    if (u_first > u_last) continue;
    const int first = std::max(0, static_cast<int>(std::ceil((u_first + 1) / h - 0.5F)));
    const int last = std::min(r - 1, static_cast<int>(std::floor((u_last + 1) / h - 0.5F)));
    const std::size_t start = offset + static_cast<std::size_t>(row) * static_cast<std::size_t>(r);
    const float slope = normal[0] * h;
    const float nearness = normal[1] * v + normal[2] + normal[0] * (0.5F * h - 1);
    const Index patch = front ? item.patch : kBackSide;
    Index* items = buffers.item.data() + start;
    float* depths = buffers.nearness.data() + start;
    for (int column = first; column <= last; ++column) {
      const float w = nearness + slope * static_cast<float>(column);
      if (w > depths[column]) {
        depths[column] = w;
        items[column] = patch;
      }
    }
  }
}

void Hemicube::draw(const Vec3& eye, const Vec3& t, const Vec3& b, const Vec3& n, Buffers& buffers) const {
  const PatchMesh& mesh = visibility_.mesh();
  Eigen::Matrix3d frame;
  frame << t.transpose(), b.transpose(), n.transpose();
  const double scale = 1 / mesh.diagonal();
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    const Eigen::Vector3f p = ((frame * (mesh.vertex(v) - eye)) * scale).cast<float>();
    const auto k = static_cast<std::size_t>(v);
    buffers.vertices[k] = {p.x(), p.y(), p.z()};
    buffers.outside[k] = side_bits(buffers.vertices[k]);
  }
  std::fill(buffers.item.begin(), buffers.item.end(), kEmpty);
  std::fill(buffers.nearness.begin(), buffers.nearness.end(), 0.0F);
  for (const Item& item : items_) {
    unsigned all = 0x7F;
    unsigned any = 0;
    float top = 0;
    for (int k = 0; k < item.corners; ++k) {
      const auto v = static_cast<std::size_t>(item.corner[static_cast<std::size_t>(k)]);
      all &= buffers.outside[v];
      any |= buffers.outside[v];
      top = std::max(top, buffers.vertices[v].z);
    }
    if (top <= tolerance::kSamePlane) continue;  // below the horizon, or in the patch's own plane
    const bool front = mesh.normal(item.patch).dot(eye - mesh.vertex(item.corner[0])) > 0;
    std::size_t offset = 0;
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      // Outside when all corners are on the wrong side of one of the pyramid's planes.
      const bool reaches = (all & kPyramid[f][0]) == 0 && (~any & kPyramid[f][1]) == 0;
      if (reaches) draw_item(item, front, faces_[f], offset, buffers);
      offset += static_cast<std::size_t>(faces_[f].rows) * static_cast<std::size_t>(resolution_);
    }
  }
}

void Hemicube::rows(Index first, Index last, bool, const Sink& sink) const {
  const PatchMesh& mesh = visibility_.mesh();
  Buffers buffers;
  buffers.vertices.resize(static_cast<std::size_t>(mesh.vertex_count()));
  buffers.outside.resize(buffers.vertices.size());
  buffers.item.resize(cells_);
  buffers.nearness.resize(cells_);
  std::vector<double> factor(static_cast<std::size_t>(mesh.patch_count()), 0);
  std::vector<Index> columns;
  std::vector<double> values;
  for (Index i = first; i < last; ++i) {
    if (visibility_.covered(i)) {
      sink(i, {}, {}, 1);
      continue;
    }
    RandomStream random(seed_, static_cast<std::uint64_t>(i));
    const Sample2 shift{random.uniform(), random.uniform()};
    const Vec3& n = mesh.normal(i);
    Vec3 t, b;
    tangents(n, t, b);
    const PatchSampler patch(mesh, i);
    columns.clear();
    double lost = 0;
    for (int point = 0; point < kPoints; ++point) {
      const double turn = std::numbers::pi / 2 * random.uniform();
      const Vec3 x = std::cos(turn) * t + std::sin(turn) * b;
      const Vec3 eye = patch.at(r2_point(static_cast<std::uint64_t>(point), shift));
      draw(eye, x, n.cross(x), n, buffers);
      for (std::size_t c = 0; c < cells_; ++c) {
        const double share = delta_[c] / kPoints;
        const Index j = buffers.item[c];
        if (j < 0) {
          lost += share;
          continue;
        }
        double& f = factor[static_cast<std::size_t>(j)];
        if (f == 0) columns.push_back(j);
        f += share;
      }
    }
    std::sort(columns.begin(), columns.end());
    values.clear();
    for (const Index j : columns) {
      values.push_back(factor[static_cast<std::size_t>(j)]);
      factor[static_cast<std::size_t>(j)] = 0;
    }
    sink(i, columns, values, lost);
  }
}

}  // namespace

std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility& visibility,
                                                const FormFactorOptions& options) {
  return std::make_unique<Hemicube>(visibility, options);
}

}  // namespace radiosity
