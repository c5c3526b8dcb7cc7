// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "item_buffer.hpp"
#include "methods.hpp"
#include "patch_groups.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "viewpoints.hpp"

namespace radiosity {
namespace {

using item_buffer::kLanes;

/// All patches as items, and the arrays that item_buffer::Items points to. The planes are those of the facets: depths of
/// patches of one wall agree to the bit.
struct ItemArrays {
  explicit ItemArrays(const Visibility& visibility);
  item_buffer::Items items() const {
    return {triangles.polygons(), quads.polygons(), nx.size(), nx.data(), ny.data(), nz.data(),
            offset.data()};
  }

  struct List {
    void add(const Visibility& visibility, std::span<const Index> vertices, std::int32_t p,
             std::int32_t shown);
    item_buffer::Polygons polygons() const {
      return {plane.size(), numbers.data(), plane.data(), content.data()};
    }
    std::size_t count = 0;
    std::vector<float> numbers;
    std::vector<std::int32_t> plane, content;
  };
  List triangles, quads;
  std::vector<double> nx, ny, nz, offset;
  std::vector<std::int32_t> plane_of;  // of patches: the number of their facet
};

void ItemArrays::List::add(const Visibility& visibility, std::span<const Index> vertices, std::int32_t p,
                           std::int32_t shown) {
  const std::size_t lane = count++ % kLanes, corners = vertices.size(),
                    size = item_buffer::kNumbersPerCorner * corners * kLanes;
  if (lane == 0) {  // all of which are this polygon, and shown in its place, until others come
    numbers.resize(numbers.size() + size);
    plane.resize(plane.size() + kLanes);
    content.resize(content.size() + kLanes);
  }
  float* const batch = &numbers[numbers.size() - size];
  for (std::size_t to = lane; to < kLanes; ++to) {
    for (std::size_t k = 0; k < corners; ++k) {
      const Vec3 x = visibility.scaled(visibility.mesh().vertex(vertices[k]));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double value = x[static_cast<Index>(axis)];
        const auto high = static_cast<float>(value);
        batch[(6 * k + axis) * kLanes + to] = high;
        batch[(6 * k + 3 + axis) * kLanes + to] = static_cast<float>(value - static_cast<double>(high));
      }
      batch[(6 * corners + k) * kLanes + to] = vertices[k] > vertices[(k + 1) % corners] ? -1.0F : 1.0F;
    }
    plane[plane.size() - kLanes + to] = p;
    content[content.size() - kLanes + to] = shown;
  }
}

ItemArrays::ItemArrays(const Visibility& visibility) {
  const PatchMesh& mesh = visibility.mesh();
  plane_of.resize(mesh.patch_count());
  for (const Facet& facet : visibility.facets()) {
    for (const Index i : facet.patches) plane_of[i] = static_cast<std::int32_t>(nx.size());
    const bool whole = facet.patches.size() > 1;
    const Vec3& n = whole ? facet.pieces[0].normal : mesh.normal(facet.patches[0]);
    nx.push_back(n.x());
    ny.push_back(n.y());
    nz.push_back(n.z());
    offset.push_back(n.dot(visibility.scaled(mesh.centroid(facet.patches[0]))));
  }
  for (const PatchGroup& group : patch_groups(mesh, visibility.facets(), Vec3::Zero()))
    for (const Index i : group.patches) {
      if (visibility.covered(i)) continue;
      const std::int32_t shown = item_buffer::kLost + 1 + static_cast<std::int32_t>(mesh.cluster(i));
      if (is_convex_quad(mesh, i))  // planar: drawn in one piece
        quads.add(visibility, mesh.corners(i), plane_of[i], shown);
      else
        for (const auto& t : mesh.triangles(i)) triangles.add(visibility, t, plane_of[i], shown);
    }
}

/// The hemicube [CohenGreenberg1985]: half a cube of half-width 1 over points of the patch. A cell of area ΔA
/// = h² carries
///   top:   ΔF = ΔA / (π (u² + v² + 1)²)        sides:  ΔF = v ΔA / (π (u² + v² + 1)²),  v the height over
///   the patch,
/// and an item buffer tells which patch fills it. The table is scaled to sum to exactly 1. Each patch's cubes
/// are turned about the normal by a random angle, which decorrelates the aliasing between patches [Baum1989].
/// The points are those of a Gauss rule over the patch,  F_ij ≈ Σ_k w_k F(x_k → j); with one point it is the
/// classical hemicube over the centre.
class Hemicube final : public FormFactorMethod {
 public:
  Hemicube(const Visibility& visibility, const FormFactorOptions& options, const item_buffer::Kernel& kernel);

  void rows(Index first, Index last, bool upper, const Sink& sink) const override;
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  FormFactorOptions options() const override {
    return {.samples = points_, .resolution = resolution_, .seed = seed_};
  }
  std::optional<double> direction_share() const override { return direction_share_; }
  Index max_entries_per_row() const override {
    return static_cast<Index>(std::min(static_cast<std::size_t>(points_) * cells_,
                                       static_cast<std::size_t>(visibility_.mesh().cluster_count())));
  }

 private:
  const Visibility& visibility_;
  const item_buffer::Kernel& kernel_;
  std::uint64_t seed_;
  int resolution_;
  Index points_;
  ItemArrays arrays_;
  std::array<item_buffer::Face, 5> faces_{};
  std::vector<float> top_u_, top_v_, side_v_;  // centres of cells, 16 for each column or row of tiles
  std::size_t cells_ = 0;
  double direction_share_;
  std::vector<float> delta_;  // ΔF per cell as the item buffer stores them; 0 beyond a face's borders
};

Hemicube::Hemicube(const Visibility& visibility, const FormFactorOptions& options,
                   const item_buffer::Kernel& kernel)
    : visibility_(visibility),
      kernel_(kernel),
      seed_(options.seed),
      resolution_(options.resolution + options.resolution % 2),  // side faces are half as high
      points_(options.samples),
      arrays_(visibility) {
  using item_buffer::kTile;
  const int r = resolution_;
  const double h = 2.0 / r;
  const auto tiles = [](int cells) { return (cells + kTile - 1) / kTile; };
  const auto centres = [&](double from, int count, bool across) {
    std::vector<float> out;
    for (int tile = 0; tile < count; ++tile)
      for (int k = 0; k < kTile * kTile; ++k)
        out.push_back(static_cast<float>(from + (tile * kTile + (across ? k % kTile : k / kTile) + 0.5) * h));
    return out;
  };
  top_u_ = centres(-1, tiles(r), true);
  top_v_ = centres(-1, tiles(r), false);
  side_v_ = centres(0, tiles(r / 2), false);
  // Right, up and forward: 0 x, 1 y, 2 z, 3 −x, 4 −y.
  constexpr std::array<std::array<std::int32_t, 3>, 5> kAxes{
      {{0, 1, 2}, {1, 2, 0}, {4, 2, 3}, {3, 2, 1}, {0, 2, 4}}};
  std::vector<double> delta;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const bool top = f == 0;
    item_buffer::Face& face = faces_[f];
    face = {kAxes[f][0],
            kAxes[f][1],
            kAxes[f][2],
            top ? r : r / 2,
            top ? -1.0F : 0.0F,
            tiles(r),
            tiles(top ? r : r / 2),
            delta.size(),
            top_u_.data(),
            top ? top_v_.data() : side_v_.data()};
    for (int tile = 0; tile < face.tile_rows * face.tile_columns; ++tile) {
      for (int k = 0; k < kTile * kTile; ++k) {
        const int column = tile % face.tile_columns * kTile + k % kTile;
        const int row = tile / face.tile_columns * kTile + k / kTile;
        const double u = -1 + (column + 0.5) * h;
        const double v = (top ? -1 : 0) + (row + 0.5) * h;
        const double q = u * u + v * v + 1;
        delta.push_back(column < r && row < face.rows ? (top ? 1 : v) / (q * q) : 0);
      }
    }
  }
  cells_ = delta.size();
  const double sum = std::accumulate(delta.begin(), delta.end(), 0.0);
  for (const double d : delta) delta_.push_back(static_cast<float>(d / sum));
  direction_share_ = *std::max_element(delta.begin(), delta.end()) / sum / static_cast<double>(points_);
}

void Hemicube::rows(Index first, Index last, bool, const Sink& sink) const {
  const PatchMesh& mesh = visibility_.mesh();
  const item_buffer::Items items = arrays_.items();
  std::array<std::vector<float>, 3> plane;
  for (auto& part : plane) part.resize(items.planes);
  std::vector<std::int32_t> front(items.planes), item(cells_);
  std::vector<float> nearness(cells_);
  const item_buffer::Buffers buffers{plane[0].data(), plane[1].data(), plane[2].data(),
                                     front.data(),    item.data(),     nearness.data()};
  std::vector<double> sums(4 * (static_cast<std::size_t>(mesh.cluster_count()) + 1), 0);
  std::vector<Index> columns;
  std::vector<double> values;
  for (Index i = first; i < last; ++i) {
    if (all_covered(visibility_, i)) {
      sink(i, {}, {}, 1);
      continue;
    }
    RandomStream random(seed_, static_cast<std::uint64_t>(i));
    double covered = 0;
    for (const ClusterViewpoint& point : cluster_viewpoints(mesh, i, points_)) {
      if (visibility_.covered(point.patch)) {
        covered += point.weight;
        continue;
      }
      const Vec3& n = mesh.normal(point.patch);
      const auto own = static_cast<std::size_t>(arrays_.plane_of[point.patch]);
      Vec3 t, b;
      tangents(n, t, b);
      const double turn = std::numbers::pi / 2 * random.uniform();
      const Vec3 across = std::cos(turn) * t + std::sin(turn) * b;
      const Vec3 up = n.cross(across);
      const Vec3 eye = visibility_.scaled(point.x);
      const item_buffer::View view{
          {eye.x(), eye.y(), eye.z()},
          {across.x(), across.y(), across.z(), up.x(), up.y(), up.z(), n.x(), n.y(), n.z()},
          own,
          visibility_.facets()[own].back};
      kernel_.draw(items, view, faces_.data(), resolution_, cells_, buffers);
      kernel_.add_shares(item.data(), delta_.data(), cells_, point.weight, sums.data());
    }
    columns.clear();
    values.clear();
    const auto take = [&](std::size_t content) {
      double* const s = &sums[4 * content];
      const double sum = (s[0] + s[1]) + (s[2] + s[3]);
      std::fill(s, s + 4, 0.0);
      return sum;
    };
    const double lost = take(item_buffer::kLost) + covered;
    for (Index j = 0; j < mesh.cluster_count(); ++j) {
      const double f = take(static_cast<std::size_t>(j) + 1);
      if (f == 0) continue;
      columns.push_back(j);
      values.push_back(f);
    }
    sink(i, columns, values, lost);
  }
}

}  // namespace

std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility& visibility,
                                                const FormFactorOptions& options) {
  return make_hemicube(visibility, options, item_buffer::kernels().back());
}

std::unique_ptr<FormFactorMethod> make_hemicube(const Visibility& visibility,
                                                const FormFactorOptions& options,
                                                const item_buffer::Kernel& kernel) {
  return std::make_unique<Hemicube>(visibility, options, kernel);
}

}  // namespace radiosity
