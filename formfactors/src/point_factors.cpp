// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/point_factors.hpp"

#include <tbb/collaborative_call_once.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

#include "occluders.hpp"
#include "polygon_factor.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

thread_local Occluders::Scratch point_scratch;

// Of 4 × 4 strata along an edge of the unit square, two rays in each.
int blocks_of(Index rays) {
  return static_cast<int>(std::ceil(std::sqrt(rays / 32.0)));
}

}  // namespace

struct PointFactors::Impl {
  Impl(const Visibility& v, Index rays, std::uint64_t s);

  struct Wall {
    std::vector<Vec3> corners;  // relative to the centre
    Vec3 normal;
    Eigen::AlignedBox3d box;  // of what touches it
  };
  struct Plane {
    Vec3 normal, point;  // normal towards the side that x is on
  };
  std::vector<Plane> surfaces_at(const Vec3& x, const Vec3& n, const Outlook* outlook) const;
  bool shines_towards(const Vec3& x, Index lamp) const;
  std::vector<Vec3> front_part(const Vec3& x, const Vec3& n, Index lamp) const;
  template <class Classify>
  void add_single(const Vec3& x, const Vec3& from, const Vec3& n, Index j, std::span<const Vec3> seen,
                  const Classify& classify, RandomStream& random, View& view) const;
  Single by_rays(const Vec3& x, const Vec3& n, Index j, double whole, RandomStream& random) const;
  void cast(const Vec3& x, const Vec3& n, int edge, RandomStream& random, View& view) const;
  // Those that touch a patch.
  const std::vector<std::size_t>& walls_at(Index patch) const;

  const Visibility& visibility;
  std::uint64_t seed;
  int blocks;
  Vec3 centre;
  double diagonal;
  double step;               // off a surface, in double precision
  std::vector<Index> lamps;  // that are not covered
  std::vector<std::uint8_t> is_lamp;
  std::vector<Wall> walls;
  mutable tbb::collaborative_once_flag walls_found;
  mutable std::vector<std::vector<std::size_t>> walls_of;  // of patches
  std::vector<Index> facet_of;                             // patches
  std::optional<Occluders> occluders;                      // absent where shadow rays are used
};

PointFactors::Impl::Impl(const Visibility& v, Index rays, std::uint64_t s)
    : visibility(v),
      seed(s),
      blocks(blocks_of(rays)),
      centre((v.mesh().lower() + v.mesh().upper()) / 2),
      diagonal(v.mesh().diagonal()),
      step(tolerance::kBesideSurface * diagonal +
           tolerance::kDegenerateHeight *
               std::max(v.mesh().lower().cwiseAbs().maxCoeff(), v.mesh().upper().cwiseAbs().maxCoeff())) {
  const PatchMesh& mesh = visibility.mesh();
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if ((mesh.material_of(i).emission > 0).any()) lamps.push_back(i);
  if (lamps.size() > kMostLamps) lamps.clear();
  is_lamp.resize(mesh.patch_count(), 0);
  for (const Index j : lamps) is_lamp[j] = 1;
  std::erase_if(lamps, [&](Index j) { return visibility.covered(j); });
  for (const Facet& facet : visibility.facets()) {
    for (const Facet::Piece& piece : facet.pieces) {
      Wall& wall = walls.emplace_back(Wall{piece.corners, piece.normal, {}});
      for (Vec3& c : wall.corners) {
        c -= centre;
        wall.box.extend(c);
      }
      const Vec3 margin = Vec3::Constant(tolerance::kContact * diagonal);
      wall.box.extend(Vec3(wall.box.min() - margin));
      wall.box.extend(Vec3(wall.box.max() + margin));
    }
  }
  facet_of.resize(mesh.patch_count());
  for (std::size_t f = 0; f < visibility.facets().size(); ++f)
    for (const Index i : visibility.facets()[f].patches) facet_of[i] = static_cast<Index>(f);
  occluders.emplace(mesh, visibility.facets(), facet_of, lamps, centre);
  if (!occluders->usable()) occluders.reset();
}

const std::vector<std::size_t>& PointFactors::Impl::walls_at(Index patch) const {
  tbb::collaborative_call_once(walls_found, [&] {
    const PatchMesh& mesh = visibility.mesh();
    std::vector<Eigen::AlignedBox3d> of_patches, of_walls;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      Eigen::AlignedBox3d& box = of_patches.emplace_back();
      for (const Index v : mesh.corners(i)) box.extend(mesh.vertex(v) - centre);
    }
    for (const Wall& wall : walls) of_walls.push_back(wall.box);
    walls_of.resize(of_patches.size());
    for_each_pair_that_meets(of_patches, of_walls,
                             [&](std::size_t i, std::size_t w) { walls_of[i].push_back(w); });
    for (auto& list : walls_of) std::sort(list.begin(), list.end());
  });
  return walls_of[patch];
}

// Points are relative to the centre from here on.

// Those that x lies on.
std::vector<PointFactors::Impl::Plane> PointFactors::Impl::surfaces_at(const Vec3& x, const Vec3& n,
                                                                       const Outlook* outlook) const {
  const double touch = tolerance::kContact * diagonal;
  std::vector<Plane> planes;
  const std::size_t count = outlook ? outlook->walls.size() : walls.size();
  for (std::size_t w = 0; w < count; ++w) {
    const Wall& wall = walls[outlook ? outlook->walls[w] : w];
    if (!wall.box.contains(x)) continue;
    const auto& c = wall.corners;
    bool on = std::abs(wall.normal.dot(x - c[0])) <= touch;
    for (std::size_t k = 0; on && k < c.size(); ++k) {
      const Vec3 edge = c[k + 1 == c.size() ? 0 : k + 1] - c[k];
      on = wall.normal.dot(edge.cross(x - c[k])) >= -touch * edge.norm();
    }
    if (on)
      planes.push_back({n.dot(wall.normal) < -tolerance::kParallel ? Vec3(-wall.normal) : wall.normal, c[0]});
  }
  return planes;
}

namespace {

// x, or where it lies on surfaces, a point at least `height` from each of them. Where several meet, to step off one may lead back
// to another: repeated, the steps converge.
template <class Planes>
Vec3 beside(const Vec3& x, const Planes& planes, double height) {
  constexpr int kPasses = 16;
  Vec3 y = x;
  for (int pass = 0; pass < kPasses; ++pass) {
    for (const auto& plane : planes) {
      const double lacking = height - plane.normal.dot(y - plane.point);
      if (lacking > 0) y += lacking * plane.normal;
    }
  }
  return y;
}

}  // namespace

bool PointFactors::Impl::shines_towards(const Vec3& x, Index lamp) const {
  const PatchMesh& mesh = visibility.mesh();
  return mesh.normal(lamp).dot(x - (mesh.centroid(lamp) - centre)) > 0;
}

// Of a lamp; empty where none is above the horizon.
std::vector<Vec3> PointFactors::Impl::front_part(const Vec3& x, const Vec3& n, Index lamp) const {
  const PatchMesh& mesh = visibility.mesh();
  std::vector<Vec3> corners;
  double low = std::numeric_limits<double>::infinity();
  for (const Index c : mesh.corners(lamp)) {
    corners.push_back(mesh.vertex(c) - centre);
    low = std::min(low, n.dot(corners.back() - x));
  }
  if (low < 0) corners = polygon::clip(corners, n, x, tolerance::kOnPlane * diagonal);
  return corners.size() < 3 ? std::vector<Vec3>{} : corners;
}

// Shadow rays start at `from`.
template <class Classify>
void PointFactors::Impl::add_single(const Vec3& x, const Vec3& from, const Vec3& n, Index j,
                                    std::span<const Vec3> seen, const Classify& classify,
                                    RandomStream& random, View& view) const {
  if (seen.empty()) return;
  const double whole = point_factor(x, n, seen);
  if (!(whole > 0)) return;
  Single single{j, 0, 0};
  switch (classify()) {
    case Occluders::View::hidden:
      break;
    case Occluders::View::free:
      single.factor = whole;
      break;
    case Occluders::View::partial:
      single.factor = occluders->visible_point_factor(x, n, seen, whole, point_scratch);
      break;
    case Occluders::View::crowded:
      single = by_rays(from, n, j, whole, random);
      break;
  }
  view.singles.push_back(single);
}

// F(visible) = F(whole) − ∫ (1 − V) cosθ cosθ' / (π r²) dA, the integral by two points in each of 4 × 4 equal parts of the patch.
PointFactors::Single PointFactors::Impl::by_rays(const Vec3& x, const Vec3& n, Index j, double whole,
                                                 RandomStream& random) const {
  const PatchMesh& mesh = visibility.mesh();
  const PatchSampler sampler(mesh, j);
  const Vec3& normal = mesh.normal(j);
  const Eigen::Vector3f from = visibility.scaled(x + centre).cast<float>();
  std::array<std::array<double, 16>, 2> hidden{};
  for (auto& replicate : hidden) {
    Visibility::SightLines lines;
    lines.from = Visibility::kNothing;
    lines.to = j;
    lines.count = 16;
    for (std::size_t k = 0; k < 16; ++k) {
      const Sample2 s{(static_cast<double>(k % 4) + random.uniform()) / 4,
                      (static_cast<double>(k / 4) + random.uniform()) / 4};
      const Vec3 y = sampler.at(s);
      const Vec3 r = y - centre - x;
      const double r2 = r.squaredNorm();
      replicate[k] = mesh.area(j) * std::max(0.0, n.dot(r)) * std::max(0.0, -normal.dot(r)) /
                     (std::numbers::pi * r2 * r2);
      const Eigen::Vector3f to = visibility.scaled(y).cast<float>();
      lines.x[k] = from.x();
      lines.y[k] = from.y();
      lines.z[k] = from.z();
      lines.tx[k] = to.x();
      lines.ty[k] = to.y();
      lines.tz[k] = to.z();
    }
    visibility.blocked(lines);
    for (std::size_t k = 0; k < 16; ++k)
      if (!lines.blocked[k]) replicate[k] = 0;
  }
  Single single{j, whole, 0};
  for (std::size_t k = 0; k < 16; ++k) {
    const double a = hidden[0][k];
    const double b = hidden[1][k];
    single.factor -= (a + b) / 32;
    single.variance += (a - b) * (a - b) / (4 * 16 * 16);
  }
  return single;
}

void PointFactors::Impl::cast(const Vec3& x, const Vec3& n, int edge, RandomStream& random,
                              View& view) const {
  view.rays.resize(32 * edge * edge);
  Vec3 t, b;
  tangents(n, t, b);
  const double cell = 1.0 / (4 * edge);
  const double metre = diagonal;  // of one unit of the scaled scene
  const Eigen::Vector3f start = visibility.scaled(x + centre).cast<float>();
  Visibility::Packet packet;
  packet.from = Visibility::kNothing;
  packet.count = 16;
  packet.x.fill(start.x());
  packet.y.fill(start.y());
  packet.z.fill(start.z());
  std::array<Vec3, 16> directions;
  for (int block = 0; block < edge * edge; ++block) {
    for (int replicate = 0; replicate < 2; ++replicate) {
      for (int k = 0; k < 16; ++k) {
        const auto lane = static_cast<std::size_t>(k);
        const Sample2 disk = concentric_disk({(block % edge * 4 + k % 4 + random.uniform()) * cell,
                                              (block / edge * 4 + k / 4 + random.uniform()) * cell});
        const double z = std::sqrt(std::max(0.0, 1 - disk.u * disk.u - disk.v * disk.v));
        directions[lane] = disk.u * t + disk.v * b + z * n;
        packet.dx[lane] = static_cast<float>(directions[lane].x());
        packet.dy[lane] = static_cast<float>(directions[lane].y());
        packet.dz[lane] = static_cast<float>(directions[lane].z());
      }
      visibility.first_hits(packet);
      for (int k = 0; k < 16; ++k) {
        const auto lane = static_cast<std::size_t>(k);
        Ray& ray = view.rays[2 * (16 * block + k) + replicate];
        ray.patch = packet.hit[lane];
        ray.single = ray.patch >= 0 && is_lamp[ray.patch] != 0;
        if (ray.patch >= 0)
          ray.hit = x + centre + static_cast<double>(packet.distance[lane]) * metre * directions[lane];
      }
    }
  }
}

PointFactors::PointFactors(const Visibility& visibility, Index rays, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(visibility, rays, seed)) {}

PointFactors::~PointFactors() = default;

Index PointFactors::rays() const {
  return 32 * impl_->blocks * impl_->blocks;
}

void PointFactors::view(const Vec3& x, const Vec3& n, std::uint64_t stream, View& view,
                        const Outlook* outlook, Index rays) const {
  RandomStream random(impl_->seed, stream);
  view.singles.clear();
  const Vec3 centred = x - impl_->centre;
  const auto surfaces = impl_->surfaces_at(centred, n, outlook);
  const Vec3 near = beside(centred, surfaces, impl_->step);
  const Vec3 off = beside(centred, surfaces, tolerance::kContact * impl_->diagonal);
  const auto& occluders = impl_->occluders;
  if (outlook) {
    for (const Outlook::Lamp& lamp : outlook->lamps) {
      if (!impl_->shines_towards(near, impl_->lamps[lamp.number])) continue;
      const auto classify = [&] {
        return lamp.free ? Occluders::View::free
                         : occluders->classify(near, lamp.between, lamp.number, lamp.front, point_scratch);
      };
      impl_->add_single(near, off, n, impl_->lamps[lamp.number], lamp.front, classify, random, view);
    }
  } else {
    if (occluders && !impl_->lamps.empty()) occluders->look_from(near, n, point_scratch);
    for (std::size_t k = 0; k < impl_->lamps.size(); ++k) {
      if (!impl_->shines_towards(near, impl_->lamps[k])) continue;
      const std::vector<Vec3> front = impl_->front_part(near, n, impl_->lamps[k]);
      const auto classify = [&] {
        return occluders ? occluders->classify(near, point_scratch.near, k, front, point_scratch)
                         : Occluders::View::crowded;
      };
      impl_->add_single(near, off, n, impl_->lamps[k], front, classify, random, view);
    }
  }
  impl_->cast(off, n, rays > 0 ? blocks_of(rays) : impl_->blocks, random, view);
}

std::optional<PointFactors::Outlook> PointFactors::outlook(Index patch) const {
  const PatchMesh& mesh = impl_->visibility.mesh();
  const Vec3& n = mesh.normal(patch);
  std::vector<Vec3> p;
  for (const Index v : mesh.corners(patch)) p.push_back(mesh.vertex(v) - impl_->centre);
  if (!impl_->occluders || !polygon::is_convex(p, n, -tolerance::kGrazed)) return {};
  Outlook out;
  out.walls = impl_->walls_at(patch);
  if (impl_->lamps.empty()) return out;
  impl_->occluders->look_from(p, n, impl_->facet_of[patch], impl_->visibility.facets(), point_scratch);
  for (std::size_t k = 0; k < impl_->lamps.size(); ++k) {
    const Index j = impl_->lamps[k];
    if (std::none_of(p.begin(), p.end(), [&](const Vec3& x) { return impl_->shines_towards(x, j); }))
      continue;
    std::vector<Vec3> front = impl_->front_part(mesh.centroid(patch) - impl_->centre, n, j);
    if (front.empty()) continue;
    const auto seen = impl_->occluders->classify(p, k, front, point_scratch);
    if (seen == Occluders::View::hidden) continue;
    out.lamps.push_back({k, std::move(front), seen == Occluders::View::free, point_scratch.candidates});
  }
  return out;
}

}  // namespace radiosity
