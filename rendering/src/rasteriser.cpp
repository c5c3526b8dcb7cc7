// SPDX-License-Identifier: GPL-3.0-or-later
#include "rasteriser.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "radiosity/meshing/tolerances.hpp"

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
  Vec3 h;  ///< (x, y, w)
  /// Of the edge to the next vertex: line·(x, y, 1) ≥ 0 inside; 0: a side of the image, where all samples are inside.
  Vec3 line;
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

/// One call of `rasterise`, stage by stage.
class Rasteriser {
 public:
  Rasteriser(const Polygons& polygons, const BandArray& values, const Pinhole& eye, const SampleGrid& grid)
      : polygons_(polygons), values_(values), eye_(eye), view_(eye, grid), h_(polygons.vertices.size()) {
    tbb::parallel_for(std::size_t{0}, h_.size(),
                      [&](std::size_t v) { h_[v] = view_.homogeneous(polygons.vertices[v]); });
    double furthest = std::numeric_limits<double>::min();  // where all is behind the eye
    for (const Vec3& v : h_) furthest = std::max(furthest, v.z());
    volume_ = view_.volume(kEyePlane * furthest);
  }

  /// Faces of the polygons in view, in the order that is given, or in their own.
  std::vector<Batch> faces(std::optional<std::span<const Index>> order) const {
    const std::size_t count = order ? order->size() : polygons_.count();
    constexpr std::size_t kBatch = 1024;
    std::vector<Batch> batches((count + kBatch - 1) / kBatch);
    tbb::parallel_for(std::size_t{0}, batches.size(), [&](std::size_t b) {
      Batch& batch = batches[b];
      Piece piece, clipped;
      for (std::size_t k = b * kBatch; k < std::min(count, (b + 1) * kBatch); ++k)
        add(order ? (*order)[k] : static_cast<Index>(k), batch, piece, clipped);
      std::size_t start = 0;
      for (Face& face : batch.faces) {
        face.first = batch.drawn.vertices.data() + start;
        face.values = batch.drawn.values.data() + start * values_.cols();
        start += face.count;
      }
    });
    return batches;
  }

  /// Scan conversion of rows [first, last): the face that is seen at each sample, null where there is none.
  std::vector<const Face*> scan(const std::vector<Batch>& batches, bool by_depth, int first, int last) const {
    const int columns = view_.columns();
    std::vector<const Face*> seen(columns * (last - first), nullptr);
    std::vector<double> nearest(by_depth ? seen.size() : 0, 0.0);
    for (const Batch& batch : batches)
      for (const Face& face : batch.faces)
        for (int row = std::max(first, face.top); row < std::min(last, face.bottom); ++row) {
          const double y = view_.y[row];
          const auto [from, to] = span_of(face, view_, y);
          for (int column = from; column < to; ++column) {
            const int sample = (row - first) * columns + column;
            if (by_depth) {
              const double inverse_w = face.inverse_w(view_.x[column], y);
              if (inverse_w <= nearest[sample]) continue;
              nearest[sample] = inverse_w;
            }
            seen[sample] = &face;
          }
        }
    return seen;
  }

  void shade(const std::vector<const Face*>& seen, int first,
             const std::function<void(Eigen::Index, const Fragment&)>& f) const {
    Fragment fragment{0, Vec3::Zero(), Eigen::ArrayXd(values_.cols())};
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const Face* face = seen[k];
      if (!face || face->back) continue;
      const Eigen::Index point =
          static_cast<Eigen::Index>(first) * view_.columns() + static_cast<Eigen::Index>(k);
      const double x = view_.x[point % view_.columns()], y = view_.y[point / view_.columns()];
      fragment.patch = polygons_.patch[face->polygon];
      fragment.x =
          eye_.position() + (eye_.forward() + x * eye_.right() + y * eye_.up()) / face->inverse_w(x, y);
      interpolate(*face, x, y, fragment.values);
      f(point, fragment);
    }
  }

  int rows() const { return view_.rows(); }

 private:
  /// Positive on the left of the way from the corner to the next.
  Vec3 line_of(const Polygons::Corner& corner) const {
    const Vec3 &a = polygons_.vertices[corner.from], &b = polygons_.vertices[corner.to];
    const Vec3 &ha = h_[corner.from], &hb = h_[corner.to];
    return before(a, b) ? Vec3(ha.cross(hb)) : Vec3(-hb.cross(ha));
  }

  /// Adds the polygon to the batch, unless nothing of it is in view. The other pieces are room for it to work.
  void add(Index polygon, Batch& batch, Piece& piece, Piece& clipped) const {
    const auto corners = polygons_.polygon(polygon);
    unsigned all = ~0U, any = 0;
    for (const auto& corner : corners) {
      unsigned outside = 0;
      for (std::size_t k = 0; k < volume_.size(); ++k)
        outside |= unsigned{volume_[k].height(h_[corner.vertex]) < 0} << k;
      all &= outside;
      any |= outside;
    }
    if (all) return;
    const auto& [normal, on] = polygons_.planes[polygons_.plane[polygon]];
    const double height = normal.dot(on - eye_.position());
    if (height == 0) return;  // seen edge-on
    const bool back = height > 0;
    piece.vertices.clear();
    piece.values.clear();
    const auto width = values_.cols();
    for (const auto& corner : corners) {
      piece.vertices.push_back({h_[corner.vertex], (back ? -1 : 1) * line_of(corner)});
      const double* row = values_.data() + corner.vertex * width;
      piece.values.insert(piece.values.end(), row, row + width);
    }
    for (std::size_t k = 0; k < volume_.size(); ++k)
      if (any >> k & 1) clip(piece, volume_[k], width, k > 0 ? 0 : back ? -1 : 1, clipped);
    if (piece.vertices.size() < 3) return;

    Face face{};
    face.polygon = polygon;
    face.back = back;
    face.count = piece.vertices.size();
    Eigen::AlignedBox3d box;  // columns, rows, 1/w
    for (const ClipVertex& vertex : piece.vertices) {
      const double inverse_w = 1 / vertex.h.z();
      box.extend(
          Vec3(view_.column_of(vertex.h.x() * inverse_w), view_.row_of(vertex.h.y() * inverse_w), inverse_w));
    }
    // A thousandth of a sample more than needed, for rounding: edges decide.
    const auto first = [](double at, int count) {
      return static_cast<int>(std::clamp(std::ceil(at), 0.0, double(count)));
    };
    face.left = first(box.min().x() - 1e-3, view_.columns());
    face.right = first(box.max().x() + 1e-3, view_.columns());
    face.top = first(box.min().y() - 1e-3, view_.rows());
    face.bottom = first(box.max().y() + 1e-3, view_.rows());
    if (face.left >= face.right || face.top >= face.bottom) return;
    // A sheet has a back where it has its front, and shows the front.
    const double shift = back ? 1 - kSheetDepth : 1;
    face.depth =
        shift / height * Vec3(normal.dot(eye_.right()), normal.dot(eye_.up()), normal.dot(eye_.forward()));
    face.least = shift * box.min().z();
    face.most = shift * box.max().z();
    batch.faces.push_back(face);
    batch.drawn.vertices.insert(batch.drawn.vertices.end(), piece.vertices.begin(), piece.vertices.end());
    batch.drawn.values.insert(batch.drawn.values.end(), piece.values.begin(), piece.values.end());
  }

  const Polygons& polygons_;
  const BandArray& values_;
  const Pinhole& eye_;
  View view_;
  std::vector<Vec3> h_;  // x, y, w of the vertices
  std::array<ClipPlane, 5> volume_;
};

}  // namespace

Polygons triangles_of(const PatchMesh& mesh) {
  Polygons result;
  result.vertices = mesh.vertices();
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const Vec3 &normal = mesh.normal(i), &on = mesh.centroid(i);
    double size = 0, off = 0;
    for (const Index v : mesh.corners(i)) {
      size = std::max(size, 2 * (mesh.vertex(v) - on).norm());
      off = std::max(off, std::abs(normal.dot(mesh.vertex(v) - on)));
    }
    const bool planar = off <= tolerance::kPlanarity * size;
    if (planar) result.planes.push_back({normal, on});
    for (const auto& [a, b, c] : mesh.triangles(i)) {
      if (!planar) {
        const Vec3 &x = mesh.vertex(a), n = (mesh.vertex(b) - x).cross(mesh.vertex(c) - x);
        result.planes.push_back({n.norm() > 0 ? Vec3(n.normalized()) : normal, x});
      }
      result.add(std::array<Polygons::Corner, 3>{{{a, a, b}, {b, b, c}, {c, c, a}}}, i,
                 static_cast<Index>(result.planes.size()) - 1);
    }
  }
  return result;
}

void rasterise(const Polygons& polygons, const BandArray& values,
               std::optional<std::span<const Index>> back_to_front, const Pinhole& eye,
               const SampleGrid& grid,
               const std::function<void(Eigen::Index point, const Fragment& fragment)>& shade) {
  const Rasteriser rasteriser(polygons, values, eye, grid);
  const std::vector<Batch> batches = rasteriser.faces(back_to_front);
  constexpr int kRows = 16;
  tbb::parallel_for(0, (rasteriser.rows() + kRows - 1) / kRows, [&](int strip) {
    if (grid.stopped()) return;
    const int first = strip * kRows, last = std::min(rasteriser.rows(), first + kRows);
    rasteriser.shade(rasteriser.scan(batches, !back_to_front, first, last), first, shade);
  });
}

}  // namespace radiosity
