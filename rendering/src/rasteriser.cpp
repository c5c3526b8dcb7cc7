// SPDX-License-Identifier: GPL-3.0-or-later
#include "rasteriser.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace radiosity {
namespace {

/// What is drawn begins at kEyePlane · (distance of the furthest vertex) before the eye: a point in the plane of the eye has no place on
/// the screen. Depths keep 10 of 16 digits there.
constexpr double kEyePlane = 1e-6;

/// The back of a sheet without thickness must lose against the front in the same place although both depths are rounded: at grazing
/// angles double precision leaves 10⁻⁹ of the depth.
constexpr double kSheetDepth = 1e-9;

/// A side of the view volume: what is inside has normal·(x, y, w) ≥ least.
struct ClipPlane {
  Vec3 normal;
  double least;
  double height(const Vec3& h) const { return normal.dot(h) - least; }
};

/// The view transform, and the volume that holds all samples.
class View {
 public:
  View(const Pinhole& eye, const SampleGrid& grid) : eye_(eye) {
    for (int column = 0; column < grid.columns(); ++column) x.push_back(2 * grid.u(column) - 1);
    for (int row = 0; row < grid.rows(); ++row) y.push_back(1 - 2 * grid.v(row));
    columns_per_x_ = grid.width / (2.0 * grid.stride);
    rows_per_y_ = grid.height / (2.0 * grid.stride);
  }

  Vec3 homogeneous(const Vec3& p) const {
    const Vec3 way = p - eye_.position();
    return {way.dot(eye_.right()) / eye_.right().squaredNorm(), way.dot(eye_.up()) / eye_.up().squaredNorm(),
            way.dot(eye_.forward())};
  }

  /// Samples of squares that reach over the border of the image may lie outside it.
  std::array<ClipPlane, 5> volume(double nearest) const {
    const double wide = std::max(1.0, x.back()), high = std::max(1.0, -y.back());
    return {
        {{{0, 0, 1}, nearest}, {{1, 0, wide}, 0}, {{-1, 0, wide}, 0}, {{0, 1, high}, 0}, {{0, -1, high}, 0}}};
  }

  Vec3 direction(int column, int row) const {
    return eye_.forward() + x[column] * eye_.right() + y[row] * eye_.up();
  }
  double column_of(double at) const { return (at - x.front()) * columns_per_x_; }
  double row_of(double at) const { return (y.front() - at) * rows_per_y_; }
  int columns() const { return static_cast<int>(x.size()); }
  int rows() const { return static_cast<int>(y.size()); }

  std::vector<double> x, y;  ///< of the samples' columns and rows: −1 to 1 from left to right, and upwards

 private:
  const Pinhole& eye_;
  double columns_per_x_, rows_per_y_;
};

struct ClipVertex {
  Vec3 h;  ///< x, y, w
  Vec3
      line;  ///< of the edge to the next vertex: line·(x, y, 1) ≥ 0 inside; 0: a side of the image, where all samples are inside
};

/// Polygons in view, with the values of their vertices one after the other.
struct Piece {
  std::vector<ClipVertex> vertices;
  std::vector<double> values;
};

struct Face {
  Index polygon;
  bool back;
  std::size_t count;             ///< of its vertices
  const ClipVertex* first;       ///< of them
  const double* values;          ///< theirs
  int left, right, top, bottom;  ///< samples [left, right) × [top, bottom) hold it
  Vec3 depth;                    ///< 1/w = depth·(x, y, 1)
  double least, most;            ///< of 1/w
  std::span<const ClipVertex> vertices() const { return {first, count}; }
  double inverse_w(double x, double y) const {
    return std::clamp(depth.x() * x + depth.y() * y + depth.z(), least, most);
  }
};

/// Faces of consecutive polygons.
struct Batch {
  Piece drawn;
  std::vector<Face> faces;
};

/// `turn`: 1 or, of backs, −1 where the new edge is to be tested; 0 at the sides of the image.
void clip(Piece& piece, const ClipPlane& plane, std::size_t width, double turn, Piece& result) {
  result.vertices.clear();
  result.values.clear();
  const std::size_t n = piece.vertices.size();
  std::optional<std::size_t> leaves;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t next = (k + 1) % n;
    const ClipVertex &a = piece.vertices[k], &b = piece.vertices[next];
    const double ha = plane.height(a.h), hb = plane.height(b.h);
    const double *va = piece.values.data() + k * width, *vb = piece.values.data() + next * width;
    if (ha >= 0) {
      result.vertices.push_back(a);
      result.values.insert(result.values.end(), va, va + width);
    }
    if ((ha >= 0) == (hb >= 0)) continue;
    // From the end inside, whichever polygon asks: neighbours get the same bits.
    const double t = ha >= 0 ? ha / (ha - hb) : hb / (hb - ha);
    const auto between = [t, inside = ha >= 0]<class T>(const T& p, const T& q) -> T {
      return inside ? p + t * (q - p) : q + t * (p - q);
    };
    if (ha >= 0) leaves = result.vertices.size();
    result.vertices.push_back({between(a.h, b.h), ha >= 0 ? Vec3(Vec3::Zero()) : a.line});
    for (std::size_t j = 0; j < width; ++j) result.values.push_back(between(va[j], vb[j]));
  }
  if (leaves) {
    ClipVertex& a = result.vertices[*leaves];
    a.line = turn * a.h.cross(result.vertices[(*leaves + 1) % result.vertices.size()].h);
  }
  std::swap(piece, result);
}

bool before(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

/// The samples [from, to) of a row that are inside the face.
std::pair<int, int> span_of(const Face& face, const View& view, double y) {
  int from = face.left, to = face.right;
  for (const ClipVertex& vertex : face.vertices()) {
    const double a = vertex.line.x(), b = vertex.line.y(), d = b * y + vertex.line.z();
    const bool owns = a > 0 || (a == 0 && b > 0);
    if (a == 0) {
      if (d > 0 || (d == 0 && (owns || vertex.line.isZero(0)))) continue;
      return {0, 0};
    }
    // The value never falls (a > 0) or never rises from one column to the next, rounding included: a division finds the end but for a
    // sample or so.
    const auto inside = [&](int column) {
      const double value = a * view.x[column] + d;
      return value > 0 || (value == 0 && owns);
    };
    int column = static_cast<int>(std::clamp(view.column_of(-d / a), double(from), double(to)));
    if (a > 0) {
      while (column > from && inside(column - 1)) --column;
      while (column < to && !inside(column)) ++column;
      from = column;
    } else {
      while (column < to && inside(column)) ++column;
      while (column > from && !inside(column - 1)) --column;
      to = column;
    }
  }
  return {from, to};
}

/// Values at (x, y): of the triangle in the fan of the face that holds it, where its point is Σ λ v with λ as the triangles that it
/// forms with the edges, perspective included [OlanoGreer1997].
void interpolate(const Face& face, double x, double y, Eigen::ArrayXd& values) {
  const Vec3 s(x, y, 1);
  const auto v = face.vertices();
  double best = -HUGE_VAL;
  std::array<double, 3> weights{};
  std::size_t corner = 1;
  for (std::size_t k = 1; k + 1 < v.size() && best < 0; ++k) {
    const std::array<double, 3> w{v[k].h.cross(v[k + 1].h).dot(s), v[k + 1].h.cross(v[0].h).dot(s),
                                  v[0].h.cross(v[k].h).dot(s)};
    const double least = std::min({w[0], w[1], w[2]});
    if (least <= best) continue;
    best = least;
    weights = w;
    corner = k;
  }
  // Rounding may put it a little outside.
  for (double& w : weights) w = std::max(w, 0.0);
  const double sum = weights[0] + weights[1] + weights[2];
  const Eigen::Index width = values.size();
  const auto row = [&](Eigen::Index k) {
    return Eigen::Map<const Eigen::ArrayXd>(face.values + k * width, width);
  };
  values = row(0);
  // In this form what is the same at all vertices stays so, to the bit.
  if (sum > 0)
    values += weights[1] / sum * (row(corner) - row(0)) + weights[2] / sum * (row(corner + 1) - row(0));
}

}  // namespace

Polygons triangles_of(const PatchMesh& mesh) {
  Polygons result;
  result.vertices = mesh.vertices();
  for (Index t = 0; t < static_cast<Index>(mesh.triangles().size()); ++t) {
    const auto [a, b, c] = mesh.triangles()[t];
    result.add(std::array<Polygons::Corner, 3>{{{a, a, b}, {b, b, c}, {c, c, a}}}, mesh.triangle_patch(t));
  }
  return result;
}

void rasterise(const PatchMesh& mesh, const Polygons& polygons, const BandArray& values,
               std::optional<std::span<const Index>> back_to_front, const Pinhole& eye,
               const SampleGrid& grid,
               const std::function<void(Eigen::Index point, const Fragment& fragment)>& shade) {
  const View view(eye, grid);
  const auto width = values.cols();
  std::vector<Vec3> h(polygons.vertices.size());
  tbb::parallel_for(std::size_t{0}, h.size(),
                    [&](std::size_t v) { h[v] = view.homogeneous(polygons.vertices[v]); });
  double furthest = 0;
  for (const Vec3& v : h) furthest = std::max(furthest, v.z());
  if (!(furthest > 0)) return;
  const std::array<ClipPlane, 5> volume = view.volume(kEyePlane * furthest);

  const auto line_of = [&](const Polygons::Corner& corner) -> Vec3 {
    const auto from = corner.from, to = corner.to;
    return before(polygons.vertices[from], polygons.vertices[to]) ? Vec3(h[from].cross(h[to]))
                                                                  : Vec3(-h[to].cross(h[from]));
  };
  const auto add = [&](Index polygon, Batch& batch, Piece& piece, Piece& clipped) {
    const auto corners = polygons.polygon(polygon);
    unsigned all = ~0U, any = 0;
    for (const auto& corner : corners) {
      unsigned outside = 0;
      for (std::size_t k = 0; k < volume.size(); ++k)
        outside |= unsigned{volume[k].height(h[corner.vertex]) < 0} << k;
      all &= outside;
      any |= outside;
    }
    if (all) return;
    const Index patch = polygons.patch[polygon];
    const Vec3& normal = mesh.normal(patch);
    const double height = normal.dot(mesh.centroid(patch) - eye.position());
    if (height == 0) return;  // seen edge-on
    const bool back = height > 0;
    piece.vertices.clear();
    piece.values.clear();
    for (const auto& corner : corners) {
      piece.vertices.push_back({h[corner.vertex], (back ? -1 : 1) * line_of(corner)});
      const double* row = values.data() + corner.vertex * width;
      piece.values.insert(piece.values.end(), row, row + width);
    }
    for (std::size_t k = 0; k < volume.size() && !piece.vertices.empty(); ++k)
      if (any >> k & 1) clip(piece, volume[k], width, k > 0 ? 0 : back ? -1 : 1, clipped);
    if (piece.vertices.size() < 3) return;

    Face face{};
    face.polygon = polygon;
    face.back = back;
    face.least = HUGE_VAL;
    double left = HUGE_VAL, right = -HUGE_VAL, top = HUGE_VAL, bottom = -HUGE_VAL;
    for (const ClipVertex& vertex : piece.vertices) {
      const double inverse_w = 1 / vertex.h.z();
      face.least = std::min(face.least, inverse_w);
      face.most = std::max(face.most, inverse_w);
      const double column = view.column_of(vertex.h.x() * inverse_w),
                   row = view.row_of(vertex.h.y() * inverse_w);
      left = std::min(left, column);
      right = std::max(right, column);
      top = std::min(top, row);
      bottom = std::max(bottom, row);
    }
    // A thousandth of a sample more than needed, for rounding: edges decide.
    const auto first = [](double at, int count) {
      return static_cast<int>(std::clamp(std::ceil(at - 1e-3), 0.0, double(count)));
    };
    face.left = first(left, view.columns());
    face.right = first(right + 2e-3, view.columns());
    face.top = first(top, view.rows());
    face.bottom = first(bottom + 2e-3, view.rows());
    if (face.left >= face.right || face.top >= face.bottom) return;
    face.depth = Vec3(normal.dot(eye.right()), normal.dot(eye.up()), normal.dot(eye.forward())) / height;
    // A sheet has a back where it has its front, and shows the front.
    if (back) {
      face.depth *= 1 - kSheetDepth;
      face.least *= 1 - kSheetDepth;
      face.most *= 1 - kSheetDepth;
    }
    face.count = piece.vertices.size();
    batch.faces.push_back(face);
    batch.drawn.vertices.insert(batch.drawn.vertices.end(), piece.vertices.begin(), piece.vertices.end());
    batch.drawn.values.insert(batch.drawn.values.end(), piece.values.begin(), piece.values.end());
  };
  const auto count = back_to_front ? back_to_front->size() : polygons.count();
  constexpr std::size_t kBatch = 1024;
  std::vector<Batch> batches((count + kBatch - 1) / kBatch);
  tbb::parallel_for(std::size_t{0}, batches.size(), [&](std::size_t b) {
    Batch& batch = batches[b];
    Piece piece, clipped;
    for (std::size_t k = b * kBatch; k < std::min(count, (b + 1) * kBatch); ++k)
      add(back_to_front ? (*back_to_front)[k] : static_cast<Index>(k), batch, piece, clipped);
    std::size_t start = 0;
    for (Face& face : batch.faces) {
      face.first = batch.drawn.vertices.data() + start;
      face.values = batch.drawn.values.data() + start * width;
      start += face.count;
    }
  });

  constexpr int kRows = 16;
  tbb::parallel_for(0, (view.rows() + kRows - 1) / kRows, [&](int strip) {
    const int first = strip * kRows, last = std::min(view.rows(), first + kRows);
    const auto columns = view.columns();
    std::vector<const Face*> seen(columns * kRows, nullptr);
    std::vector<double> nearest(back_to_front ? 0 : seen.size(), 0.0);
    for (const Batch& batch : batches)
      for (const Face& face : batch.faces)
        for (int row = std::max(first, face.top); row < std::min(last, face.bottom); ++row) {
          const double y = view.y[row];
          const auto [from, to] = span_of(face, view, y);
          const std::size_t line = (row - first) * columns;
          for (auto column = from; column < to; ++column) {
            if (!back_to_front) {
              const double inverse_w = face.inverse_w(view.x[column], y);
              if (inverse_w <= nearest[line + column]) continue;
              nearest[line + column] = inverse_w;
            }
            seen[line + column] = &face;
          }
        }
    Fragment fragment{0, Vec3::Zero(), Eigen::ArrayXd(values.cols())};
    for (int row = first; row < last; ++row)
      for (int column = 0; column < view.columns(); ++column) {
        const Face* face = seen[(row - first) * columns + column];
        if (!face || face->back) continue;
        const double x = view.x[column], y = view.y[row];
        fragment.patch = polygons.patch[face->polygon];
        fragment.x = eye.position() + view.direction(column, row) / face->inverse_w(x, y);
        interpolate(*face, x, y, fragment.values);
        shade(static_cast<Eigen::Index>(row) * view.columns() + column, fragment);
      }
  });
}

}  // namespace radiosity
