// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "item_buffer.hpp"
#include "methods.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "viewpoints.hpp"

namespace radiosity {
namespace {

using item_buffer::kLanes;

/// Facets and patches, and the arrays that item_buffer::Items points to. The planes are those of the facets: depths of
/// patches of one wall agree to the bit.
struct ItemArrays {
  explicit ItemArrays(const Visibility& visibility);
  item_buffer::Items items() const {
    return {facet_triangles.polygons(),
            facet_quads.polygons(),
            triangles.polygons(),
            quads.polygons(),
            single.data(),
            nx.size(),
            nx.data(),
            ny.data(),
            nz.data(),
            offset.data()};
  }

  struct List {
    void add(const Visibility& visibility, std::span<const Vec3> corners, std::int32_t p, std::int32_t shown);
    /// The next one starts kLanes of its own.
    void close() { count = plane.size(); }
    item_buffer::Polygons polygons() const {
      return {plane.size(), numbers.data(), plane.data(), content.data()};
    }
    std::size_t count = 0;
    std::vector<float> numbers;
    std::vector<std::int32_t> plane, content;
  };
  void add(const Visibility& visibility, bool facet, std::span<const Vec3> corners, std::int32_t p,
           std::int32_t shown) {
    if (facet)
      (corners.size() == 4 ? facet_quads : facet_triangles).add(visibility, corners, p, shown);
    else
      (corners.size() == 4 ? quads : triangles).add(visibility, corners, p, shown);
  }
  List facet_triangles, facet_quads, triangles, quads;
  std::vector<std::int32_t> single;  // of facets: what their only patch is content of
  std::vector<double> nx, ny, nz, offset;
  std::vector<std::int32_t> plane_of;  // of patches: the number of their facet
};

void ItemArrays::List::add(const Visibility& visibility, std::span<const Vec3> vertices, std::int32_t p,
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
      const Vec3 x = visibility.scaled(vertices[k]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double value = x[static_cast<Index>(axis)];
        const auto high = static_cast<float>(value);
        batch[(6 * k + axis) * kLanes + to] = high;
        batch[(6 * k + 3 + axis) * kLanes + to] = static_cast<float>(value - static_cast<double>(high));
      }
      const Vec3 &a = vertices[k], &b = vertices[(k + 1) % corners];
      batch[(6 * corners + k) * kLanes + to] =
          std::lexicographical_compare(b.begin(), b.end(), a.begin(), a.end()) ? -1.0F : 1.0F;
    }
    plane[plane.size() - kLanes + to] = p;
    content[content.size() - kLanes + to] = to == lane ? shown : item_buffer::kLost;
  }
}

/// Orders patches so that kLanes and kLanes of them are neighbours.
void bring_together(const PatchMesh& mesh, std::span<Index> patches) {
  if (patches.size() <= kLanes) return;
  Eigen::AlignedBox3d box;
  for (const Index i : patches) box.extend(mesh.centroid(i));
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t batches = (patches.size() + kLanes - 1) / kLanes, middle = batches / 2 * kLanes;
  std::ranges::nth_element(patches, patches.begin() + static_cast<std::ptrdiff_t>(middle),
                           [&](Index a, Index b) {
                             const double ca = mesh.centroid(a)[axis], cb = mesh.centroid(b)[axis];
                             return ca != cb ? ca < cb : a < b;
                           });
  bring_together(mesh, patches.first(middle));
  bring_together(mesh, patches.subspan(middle));
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
  const auto content = [&](Index i) {
    return item_buffer::kLost + 1 + static_cast<std::int32_t>(mesh.cluster(i));
  };
  const auto add_patch = [&](Index i, bool facet, std::int32_t shown) {
    std::vector<Vec3> corners;
    if (is_convex_quad(mesh, i)) {  // planar: drawn in one piece
      for (const Index v : mesh.corners(i)) corners.push_back(mesh.vertex(v));
      add(visibility, facet, corners, plane_of[i], shown);
      return;
    }
    for (const auto& t : mesh.triangles(i)) {
      corners = {mesh.vertex(t[0]), mesh.vertex(t[1]), mesh.vertex(t[2])};
      add(visibility, facet, corners, plane_of[i], shown);
    }
  };
  single.assign(nx.size(), item_buffer::kLost);
  for (std::size_t f = 0; f < visibility.facets().size(); ++f) {
    const Facet& facet = visibility.facets()[f];
    const auto p = static_cast<std::int32_t>(f);
    if (facet.patches.size() == 1) {
      if (visibility.covered(facet.patches[0])) continue;
      single[f] = content(facet.patches[0]);
      add_patch(facet.patches[0], true, p + 1);
      continue;
    }
    std::vector<Index> patches;
    std::ranges::copy_if(facet.patches, std::back_inserter(patches),
                         [&](Index i) { return !visibility.covered(i); });
    if (patches.empty()) continue;
    for (const Facet::Piece& piece : facet.pieces) {
      const std::vector<Vec3>& c = piece.corners;
      if (c.size() == 4)
        add(visibility, true, c, p, p + 1);
      else
        for (std::size_t k = 1; k + 1 < c.size(); ++k)
          add(visibility, true, std::array{c[0], c[k], c[k + 1]}, p, p + 1);
    }
    const auto others =
        std::ranges::stable_partition(patches, [&](Index i) { return is_convex_quad(mesh, i); });
    bring_together(mesh, {patches.begin(), others.begin()});
    bring_together(mesh, others);
    for (const Index i : patches) add_patch(i, false, content(i));
    triangles.close();
    quads.close();
  }
}

/// The hemicube [CohenGreenberg1985]: half a cube of half-width 1 over points of the patch. A cell of area ΔA
/// = h² carries
///   top:   ΔF = ΔA / (π (u² + v² + 1)²)        sides:  ΔF = v ΔA / (π (u² + v² + 1)²),  v the height over
///   the patch,
/// and an item buffer tells which facet fills it. The table is scaled to sum to exactly 1. Patches that the tiles of cells around show
/// whole get the closed form of their factor from the point; of those that something hides a part of, cells tell the share that is
/// seen. Each patch's cubes are turned about the normal by a random angle, which decorrelates the aliasing between patches
/// [Baum1989].
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
  Index max_entries_per_row() const override { return visibility_.mesh().cluster_count(); }

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
  std::vector<float> delta_;        // ΔF per cell as the item buffer stores them; 0 beyond a face's borders
  std::vector<double> tile_delta_;  // of tiles
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
  for (std::size_t k = 0; k < delta_.size(); k += item_buffer::kLanes)
    tile_delta_.push_back(std::accumulate(&delta_[k], &delta_[k] + item_buffer::kLanes, 0.0));
  direction_share_ = *std::max_element(delta.begin(), delta.end()) / sum / static_cast<double>(points_);
}

void Hemicube::rows(Index first, Index last, bool, const Sink& sink) const {
  const PatchMesh& mesh = visibility_.mesh();
  const item_buffer::Items items = arrays_.items();
  std::array<std::vector<float>, 3> plane;
  for (auto& part : plane) part.resize(items.planes);
  std::vector<std::int32_t> front(items.planes), item(cells_);
  std::vector<float> nearness(cells_);
  std::vector<std::int32_t> first_item(cells_ / kLanes + kLanes), second_item(first_item.size());
  std::vector<std::int32_t> content(1 + items.quads.count + items.triangles.count);
  std::vector<float> factor(content.size());
  std::vector<double> shares(4 * (items.planes + 1));
  const item_buffer::Buffers buffers{plane[0].data(), plane[1].data(), plane[2].data(),   front.data(),
                                     item.data(),     nearness.data(), first_item.data(), second_item.data(),
                                     shares.data(),   content.data(),  factor.data()};
  std::vector<double> sums(static_cast<std::size_t>(mesh.cluster_count()) + 1, 0);
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
      covered +=
          point.weight * kernel_.add_factors(items, view, faces_.data(), resolution_, cells_, delta_.data(),
                                             tile_delta_.data(), point.weight, buffers, sums.data());
    }
    columns.clear();
    values.clear();
    for (Index j = 0; j < mesh.cluster_count(); ++j) {
      const double f = std::exchange(sums[static_cast<std::size_t>(j) + 1], 0);
      if (f == 0) continue;
      columns.push_back(j);
      values.push_back(f);
    }
    sink(i, columns, values, covered);
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
