// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/visibility.hpp"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "radiosity/meshing/patch_locator.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "winding_number.hpp"

namespace radiosity {
namespace {

// What Embree makes; it gives null where there is no memory.
template <class Object>
Object* made(Object* object) {
  if (object == nullptr) throw std::bad_alloc();
  return object;
}

// No facet reaches behind the plane of another. Scenes with so many planes that the test would cost more than it can save
// count as not convex.
bool is_convex(const std::vector<Facet>& facets, double diagonal) {
  constexpr double kMostTests = 2e8;
  const double depth = tolerance::kConvex * diagonal;
  double tests = 0;
  for (const Facet& facet : facets) {
    for (const Facet::Piece& piece : facet.pieces) {
      for (const Facet& other : facets) {
        for (const Facet::Piece& p : other.pieces) {
          for (const Vec3& v : p.corners)
            if (piece.normal.dot(v - piece.corners[0]) < -depth) return false;
          tests += static_cast<double>(p.corners.size());
        }
      }
      if (tests > kMostTests) return false;
    }
  }
  return true;
}

// Triangles of a convex polygon of n corners. Those of a fan of many corners are long and thin, and their boxes overlap: every ray
// would look at all of them. Halving the ring makes boxes as small as the triangles' places on it.
std::vector<std::array<std::size_t, 3>> triangles_of_convex(std::size_t n) {
  constexpr std::size_t kFan = 8;
  std::vector<std::array<std::size_t, 3>> triangles;
  if (n <= kFan) {
    for (std::size_t k = 1; k + 1 < n; ++k) triangles.push_back({0, k, k + 1});
    return triangles;
  }
  std::vector<std::array<std::size_t, 2>> arcs{{0, n - 1}};
  while (!arcs.empty()) {
    const auto [first, last] = arcs.back();
    arcs.pop_back();
    if (last - first < 2) continue;
    const std::size_t middle = (first + last) / 2;
    triangles.push_back({first, middle, last});
    arcs.push_back({first, middle});
    arcs.push_back({middle, last});
  }
  return triangles;
}

// Whether the polygons enclose more room than matter: Σ x·n A / 3 is the volume of matter where they are closed.
bool inside_a_room(const std::vector<Facet>& facets, const Vec3& centre) {
  double volume = 0;
  for (const Facet& facet : facets) {
    for (const Facet::Piece& piece : facet.pieces) {
      const Vec3 a = piece.corners[0] - centre;
      for (std::size_t k = 1; k + 1 < piece.corners.size(); ++k)
        volume += a.dot((piece.corners[k] - centre).cross(piece.corners[k + 1] - centre)) / 6;
    }
  }
  return volume < 0;
}

}  // namespace

struct Visibility::Impl {
  struct Plane {
    float nx, ny, nz, d;  // n·x = d, n a unit vector
    std::uint32_t facet = 0;
    std::uint32_t back = 0;  // the other side of the facet; `facet` where there is none
    float clear = 0;         // what is higher over the plane is neither in it nor part of the facet
    // Rays may start so high that they need no filter: what is missed below is too near for rays.
    bool flat() const { return clear <= static_cast<float>(tolerance::kNearPlane); }
    float height(float x, float y, float z) const { return nx * x + ny * y + nz * z - d; }
  };

  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  bool sixteen = false;  // rays at once, where the processor has vectors of as many; or else eight
  struct alignas(64) Triangle {
    float nx, ny, nz;  // front normal
    std::uint32_t facet;
    Eigen::Vector2f origin, along_u, along_v;  // the locator's coordinates of a point (u, v) of the triangle
    std::array<std::array<float, 3>, 3> corners;  // scaled
  };
  std::vector<Triangle> triangles;     // of the facets' pieces: what is traced
  std::vector<PatchLocator> locators;  // of facets
  std::vector<Plane> planes;           // of patches, scaled

  const Plane* plane_of(Index patch) const { return patch == kNothing ? nullptr : &planes[patch]; }

  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  // A facet never hides a point of itself, whatever rounding did to its corners.
  bool is_side_of(const Plane& plane, unsigned triangle) const {
    return triangles[triangle].facet == plane.facet || triangles[triangle].facet == plane.back;
  }

  bool lies_in(const Plane& plane, unsigned triangle) const {
    if (is_side_of(plane, triangle)) return true;
    for (const auto& x : triangles[triangle].corners)
      if (std::abs(plane.height(x[0], x[1], x[2])) > tolerance::kSamePlane) return false;
    return true;
  }

  Index patch_at(unsigned triangle, float u, float v) const {
    const Triangle& t = triangles[triangle];
    return locators[t.facet].at(t.origin + u * t.along_u + v * t.along_v);
  }

  // What the filter needs to let rays pass through the planes they connect. Rays that connect none are not filtered at all.
  struct Context {
    Context(const Impl* all, const Plane* start, const Plane* end = nullptr)
        : impl(all), from(start), to(end) {
      rtcInitIntersectContext(&base);
      if (from != nullptr || to != nullptr) base.filter = filter;
    }
    void pass_backs() {
      fronts_only = true;
      base.filter = filter;
    }

    RTCIntersectContext base;
    const Impl* impl;
    const Plane* from;          // null for rays from anywhere
    const Plane* to;            // null for rays without an end
    bool fronts_only = false;   // backs are passed through
    bool only_opposed = false;  // what does not face `from` is passed through
    // Until this distance, rays pass through what shows its front while `inwards`, and else its back.
    float leaving = 0;
    bool inwards = false;
  };
  static void filter(const RTCFilterFunctionNArguments* args);

  // Of the rays of a packet from `first` on, those that are `wanted`, with origins moved by `lift`. Whether some met no front.
  template <class Lanes>
  bool first_hits(Packet& packet, std::size_t first, const std::array<bool, 16>& wanted,
                  const Eigen::Vector3f& lift, Context& context) const;
  template <class Lanes>
  void first_hits(Packet& packet) const;
  // Keeps of those that are `wanted` what something lies before within `lift`, but for the plane they start from. Whether any is left.
  template <class Lanes>
  bool lifted_through(const Packet& packet, std::size_t first, std::array<bool, 16>& wanted,
                      const Eigen::Vector3f& lift) const;

  // Whether a polygon lies against the patch, facing it.
  bool faced(const Plane& plane, const Eigen::Vector3f& x) const;

  bool shows_front(unsigned triangle, float dx, float dy, float dz) const {
    const Triangle& t = triangles[triangle];
    return t.nx * dx + t.ny * dy + t.nz * dz < 0;
  }
};

void Visibility::Impl::filter(const RTCFilterFunctionNArguments* args) {
  const auto* context = reinterpret_cast<const Context*>(args->context);
  const unsigned n = args->N;
  for (unsigned k = 0; k < n; ++k) {
    if (args->valid[k] == 0) continue;
    if (context->fronts_only &&
        !context->impl->shows_front(RTCHitN_primID(args->hit, n, k), RTCRayN_dir_x(args->ray, n, k),
                                    RTCRayN_dir_y(args->ray, n, k), RTCRayN_dir_z(args->ray, n, k))) {
      args->valid[k] = 0;
      continue;
    }
    const float t = RTCRayN_tfar(args->ray, n, k);
    if (t < context->leaving &&
        context->impl->shows_front(RTCHitN_primID(args->hit, n, k), RTCRayN_dir_x(args->ray, n, k),
                                   RTCRayN_dir_y(args->ray, n, k),
                                   RTCRayN_dir_z(args->ray, n, k)) == context->inwards) {
      args->valid[k] = 0;
      continue;
    }
    const float x = RTCRayN_org_x(args->ray, n, k) + t * RTCRayN_dir_x(args->ray, n, k);
    const float y = RTCRayN_org_y(args->ray, n, k) + t * RTCRayN_dir_y(args->ray, n, k);
    const float z = RTCRayN_org_z(args->ray, n, k) + t * RTCRayN_dir_z(args->ray, n, k);
    const unsigned triangle = RTCHitN_primID(args->hit, n, k);
    if (context->only_opposed) {
      const Plane& from = *context->from;
      const Triangle& met = context->impl->triangles[triangle];
      if (context->impl->is_side_of(from, triangle) ||
          met.nx * from.nx + met.ny * from.ny + met.nz * from.nz > tolerance::kOpposed)
        args->valid[k] = 0;
      continue;
    }
    for (const Plane* plane : {context->from, context->to}) {
      if (plane != nullptr && (context->impl->is_side_of(*plane, triangle) ||
                               (plane->height(x, y, z) < 2 * tolerance::kSamePlane &&
                                context->impl->lies_in(*plane, triangle)))) {
        args->valid[k] = 0;
      }
    }
  }
}

bool Visibility::Impl::faced(const Plane& plane, const Eigen::Vector3f& x) const {
  Context context(this, &plane);
  context.only_opposed = true;
  const Eigen::Vector3f n(plane.nx, plane.ny, plane.nz);
  const Eigen::Vector3f start = x - 4 * tolerance::kSamePlane * n;
  RTCRay ray{};
  ray.org_x = start.x();
  ray.org_y = start.y();
  ray.org_z = start.z();
  ray.dir_x = n.x();
  ray.dir_y = n.y();
  ray.dir_z = n.z();
  ray.tfar = 8 * tolerance::kSamePlane;
  ray.mask = ~0U;
  rtcOccluded1(scene, &context.base, &ray);
  return ray.tfar < 0;
}

Visibility::Visibility(const PatchMesh& cell)
    : cell_(cell),
      whole_(cell.symmetry().none() ? nullptr : std::make_unique<const PatchMesh>(cell.with_images())),
      mesh_(whole_ ? *whole_ : cell),
      centre_((mesh_.lower() + mesh_.upper()) / 2),
      scale_(1 / mesh_.diagonal()),
      facets_(carried_or_found_facets(mesh_)),
      convex_(is_convex(*facets_, mesh_.diagonal())),
      impl_(std::make_unique<Impl>()) {
  const PatchMesh& mesh = mesh_;
  impl_->locators.reserve(facets_->size());
  for (std::size_t f = 0; f < facets_->size(); ++f) {
    const PatchLocator& locator = impl_->locators.emplace_back(mesh, (*facets_)[f]);
    for (const Facet::Piece& piece : (*facets_)[f].pieces) {
      for (const auto& [a, b, d] : triangles_of_convex(piece.corners.size())) {
        const std::array<Vec3, 3> x{piece.corners[a], piece.corners[b], piece.corners[d]};
        Impl::Triangle& t = impl_->triangles.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
          const Eigen::Vector3f p = scaled(x[c]).cast<float>();
          t.corners[c] = {p.x(), p.y(), p.z()};
        }
        const Eigen::Vector3f n = piece.normal.cast<float>();
        t.nx = n.x();
        t.ny = n.y();
        t.nz = n.z();
        t.facet = static_cast<std::uint32_t>(f);
        t.origin = locator.flat(x[0]);
        t.along_u = locator.flat(x[1]) - t.origin;
        t.along_v = locator.flat(x[2]) - t.origin;
      }
    }
  }
  impl_->planes.reserve(mesh.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const Vec3& n = mesh.normal(i);
    const double d = n.dot(scaled(mesh.centroid(i)));
    impl_->planes.push_back({static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()),
                             static_cast<float>(d)});
  }
  for (std::size_t f = 0; f < facets_->size(); ++f) {
    const Facet& facet = (*facets_)[f];
    // Heights over a patch's plane are at most those over the facet's and what the tilt between the two adds.
    const Vec3& normal = facet.pieces[0].normal;
    const Vec3& origin = facet.pieces[0].corners[0];
    double deviation = 0;
    Eigen::AlignedBox3d box;
    for (const Facet::Piece& piece : facet.pieces) {
      for (const Vec3& c : piece.corners) {
        deviation = std::max(deviation, std::abs(normal.dot(c - origin)));
        box.extend(c);
      }
    }
    for (const Index i : facet.patches) {
      Impl::Plane& plane = impl_->planes[i];
      plane.facet = static_cast<std::uint32_t>(f);
      plane.back = static_cast<std::uint32_t>(facet.back == Facet::kNoBack ? f : facet.back);
      const double rise = deviation + std::abs(normal.dot(mesh.centroid(i) - origin)) +
                          (mesh.normal(i) - normal).norm() * box.diagonal().norm();
      plane.clear =
          static_cast<float>(rise * scale_) + 3 * tolerance::kSamePlane;  // with room for rounded origins
    }
  }

  impl_->device = made(rtcNewDevice(nullptr));
  impl_->sixteen = rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  impl_->scene = made(rtcNewScene(impl_->device));
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  const std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> owned(
      made(rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE)), &rtcReleaseGeometry);
  const RTCGeometry geometry = owned.get();
  const std::size_t count = impl_->triangles.size();
  auto* v = static_cast<float*>(made(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count)));
  for (const auto& triangle : impl_->triangles)
    for (const auto& x : triangle.corners) v = std::copy(x.begin(), x.end(), v);
  auto* t = static_cast<unsigned*>(made(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), count)));
  std::iota(t, t + 3 * count, 0U);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(impl_->scene, geometry, 0);
  // One thread builds the tree: its shape, and with it the winner where two surfaces are hit at the same
  // distance, must not depend on the number of threads. (The device option "threads=1" would hold back the whole process.)
  tbb::task_arena(1).execute([&] { rtcCommitScene(impl_->scene); });
  if (const RTCError error = rtcGetDeviceError(impl_->device); error != RTC_ERROR_NONE) {
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    throw std::runtime_error("Embree fails with error " + std::to_string(error));
  }

  covered_.assign(mesh.patch_count(), 0);
  if (!convex_) find_covered();
}

bool Visibility::faced(Index patch, const Eigen::Vector3f& x) const {
  return impl_->faced(impl_->planes[patch], x);
}

// Winding numbers before patches that a polygon lies against. Closed surfaces give 1 in a room and 0 in matter, or 0 and −1; lamps
// and screens of one face in there add the share of the sphere that they take. Where the numbers before all other patches are not
// whole but for that, the scene is open and nothing can be told.
void Visibility::find_covered() {
  const auto inside = [&](Index i) -> Vec3 {
    const auto& corner = mesh_.triangles(i)[0];
    return (mesh_.vertex(corner[0]) + mesh_.vertex(corner[1]) + mesh_.vertex(corner[2])) / 3;
  };
  std::vector<std::uint8_t> faced(covered_.size());
  tbb::parallel_for(Index{0}, mesh_.patch_count(), [&](Index i) {
    const auto k = static_cast<std::size_t>(i);
    faced[k] = impl_->faced(impl_->planes[k], scaled(inside(i)).cast<float>()) ? 1 : 0;
  });
  std::vector<Index> candidates, others;
  for (Index i = 0; i < mesh_.patch_count(); ++i) (faced[i] != 0 ? candidates : others).push_back(i);
  if (candidates.empty()) return;

  const WindingNumber winding_number(*facets_);
  const auto w_before = [&](Index i) {
    return winding_number(inside(i) + tolerance::kContact * mesh_.diagonal() * mesh_.normal(i));
  };
  constexpr std::size_t kLookedAt = 1000;
  const std::size_t step = std::max<std::size_t>(1, others.size() / kLookedAt);
  double area = 0, whole = 0;
  for (std::size_t k = 0; k < others.size(); k += step) {
    const double w = w_before(others[k]);
    area += mesh_.area(others[k]);
    if (std::abs(w - std::round(w)) < tolerance::kWholeWinding) whole += mesh_.area(others[k]);
  }
  if (!(whole > tolerance::kMostlyClosed * area)) return;
  const double matter = inside_a_room(*facets_, centre_) ? 0 : -1;
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t k) {
    covered_[candidates[k]] = w_before(candidates[k]) < matter + 0.5 ? 1 : 0;
  });
}

Visibility::~Visibility() = default;

// Rays that Embree traces together.
struct EightLanes {
  static constexpr std::size_t kCount = 8;
  using Rays = RTCRayHit8;
  using Segments = RTCRay8;
  static constexpr auto trace = rtcIntersect8;
  static constexpr auto block = rtcOccluded8;
};
struct SixteenLanes {
  static constexpr std::size_t kCount = 16;
  using Rays = RTCRayHit16;
  using Segments = RTCRay16;
  static constexpr auto trace = rtcIntersect16;
  static constexpr auto block = rtcOccluded16;
};

template <class Lanes>
bool Visibility::Impl::first_hits(Packet& packet, std::size_t first, const std::array<bool, 16>& wanted,
                                  const Eigen::Vector3f& lift, Context& context) const {
  constexpr std::size_t kCount = Lanes::kCount;
  context.base.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) std::array<int, kCount> valid;
  typename Lanes::Rays rays;
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::size_t k = first + i;
    valid[i] = wanted[k] ? -1 : 0;
    rays.ray.org_x[i] = packet.x[k] + lift.x();
    rays.ray.org_y[i] = packet.y[k] + lift.y();
    rays.ray.org_z[i] = packet.z[k] + lift.z();
    rays.ray.dir_x[i] = packet.dx[k];
    rays.ray.dir_y[i] = packet.dy[k];
    rays.ray.dir_z[i] = packet.dz[k];
    rays.ray.tnear[i] = 0;
    rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = ~0U;
    rays.ray.flags[i] = 0;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  Lanes::trace(valid.data(), scene, &context.base, &rays);
  // Where the hits are, in their locators; what those will look at is on its way meanwhile.
  std::array<Eigen::Vector2f, kCount> place;
  std::array<const PatchLocator*, kCount> locator;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const Triangle& t = triangles[rays.hit.primID[i]];
    place[i] = t.origin + rays.hit.u[i] * t.along_u + rays.hit.v[i] * t.along_v;
    locator[i] = &locators[t.facet];
    locator[i]->prefetch(place[i]);
  }
  bool any_back = false, all_fronts = true;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (valid[i] == 0) continue;
    const std::size_t k = first + i;
    valid[i] = 0;
    packet.hit[k] = kNothing;
    packet.distance[k] = rays.ray.tfar[i];
    if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      all_fronts = false;
      continue;
    }
    const bool front = shows_front(rays.hit.primID[i], packet.dx[k], packet.dy[k], packet.dz[k]);
    packet.hit[k] = front ? locator[i]->at(place[i]) : kBack;
    if (front) continue;
    // A wall without thickness shows each side its own front: look for one at the same place as the back.
    const float slack = tolerance::kSamePlane / std::hypot(packet.dx[k], packet.dy[k], packet.dz[k]);
    rays.ray.tnear[i] = std::max(0.0F, rays.ray.tfar[i] - slack);
    rays.ray.tfar[i] += slack;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    valid[i] = -1;
    any_back = true;
  }
  if (!any_back) return !all_fronts;
  context.pass_backs();
  Lanes::trace(valid.data(), scene, &context.base, &rays);
  for (std::size_t i = 0; i < kCount; ++i) {
    if (valid[i] == 0) continue;
    if (rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
      packet.hit[first + i] = patch_at(rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i]);
    else
      all_fronts = false;
  }
  return !all_fronts;
}

template <class Lanes>
bool Visibility::Impl::lifted_through(const Packet& packet, std::size_t first, std::array<bool, 16>& wanted,
                                      const Eigen::Vector3f& lift) const {
  Context context(this, plane_of(packet.from));
  alignas(64) std::array<int, Lanes::kCount> valid;
  typename Lanes::Segments segments;
  for (std::size_t i = 0; i < Lanes::kCount; ++i) {
    const std::size_t k = first + i;
    valid[i] = wanted[k] ? -1 : 0;
    segments.org_x[i] = packet.x[k];
    segments.org_y[i] = packet.y[k];
    segments.org_z[i] = packet.z[k];
    segments.dir_x[i] = lift.x();
    segments.dir_y[i] = lift.y();
    segments.dir_z[i] = lift.z();
    segments.tnear[i] = 0;
    segments.tfar[i] = 1;
    segments.time[i] = 0;
    segments.mask[i] = ~0U;
    segments.flags[i] = 0;
  }
  Lanes::block(valid.data(), scene, &context.base, &segments);
  bool any = false;
  for (std::size_t i = 0; i < Lanes::kCount; ++i) {
    wanted[first + i] = valid[i] != 0 && segments.tfar[i] < 0;
    any |= wanted[first + i];
  }
  return any;
}

template <class Lanes>
void Visibility::Impl::first_hits(Packet& packet) const {
  const Plane* const from = plane_of(packet.from);
  const auto count = static_cast<std::size_t>(packet.count);
  std::array<bool, 16> wanted;
  for (std::size_t k = 0; k < 16; ++k) wanted[k] = k < count;
  for (std::size_t first = 0; first < count; first += Lanes::kCount) {
    if (from != nullptr && from->flat()) {
      const Eigen::Vector3f lift = from->clear * Eigen::Vector3f(from->nx, from->ny, from->nz);
      Context unfiltered(this, nullptr);
      if (!first_hits<Lanes>(packet, first, wanted, lift, unfiltered)) continue;
      // What met no front may have been lifted through a wall that leans over the patch's border.
      for (std::size_t k = first; k < std::min(count, first + Lanes::kCount); ++k)
        wanted[k] = packet.hit[k] < 0;
      if (!lifted_through<Lanes>(packet, first, wanted, lift)) continue;
    }
    Context filtered(this, from);
    first_hits<Lanes>(packet, first, wanted, Eigen::Vector3f::Zero(), filtered);
  }
}

void Visibility::first_hits(Packet& packet) const {
  if (impl_->sixteen)
    impl_->first_hits<SixteenLanes>(packet);
  else
    impl_->first_hits<EightLanes>(packet);
}

void Visibility::blocked(SightLines& lines) const {
  const bool swap = lines.to < lines.from;  // the same ray both ways, so that V is symmetric to the bit
  Impl::Context context(impl_.get(), impl_->plane_of(lines.from), &impl_->planes[lines.to]);
  alignas(64) std::array<int, 16> valid;
  RTCRay16 rays;
  for (int k = 0; k < 16; ++k) {
    const auto i = static_cast<std::size_t>(k);
    valid[i] = k < lines.count ? -1 : 0;
    const float sign = swap ? -1.0F : 1.0F;
    rays.org_x[i] = swap ? lines.tx[i] : lines.x[i];
    rays.org_y[i] = swap ? lines.ty[i] : lines.y[i];
    rays.org_z[i] = swap ? lines.tz[i] : lines.z[i];
    rays.dir_x[i] = sign * (lines.tx[i] - lines.x[i]);
    rays.dir_y[i] = sign * (lines.ty[i] - lines.y[i]);
    rays.dir_z[i] = sign * (lines.tz[i] - lines.z[i]);
    rays.tnear[i] = 0;
    rays.tfar[i] = 1;
    rays.time[i] = 0;
    rays.mask[i] = ~0U;
    rays.flags[i] = 0;
  }
  rtcOccluded16(valid.data(), impl_->scene, &context.base, &rays);
  for (int k = 0; k < lines.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    lines.blocked[i] = rays.tfar[i] < 0;
  }
}

bool Visibility::visible(const Vec3& x, Index i, const Vec3& y, Index j) const {
  if (mesh_.normal(i).dot(y - x) <= 0 || mesh_.normal(j).dot(x - y) <= 0) return false;
  SightLines lines;
  lines.from = i;
  lines.to = j;
  lines.count = 1;
  const Eigen::Vector3f a = scaled(x).cast<float>();
  const Eigen::Vector3f b = scaled(y).cast<float>();
  lines.x[0] = a.x();
  lines.y[0] = a.y();
  lines.z[0] = a.z();
  lines.tx[0] = b.x();
  lines.ty[0] = b.y();
  lines.tz[0] = b.z();
  blocked(lines);
  return !lines.blocked[0];
}

Visibility::Hit Visibility::first_hit(const Vec3& origin, const Vec3& direction, Index from) const {
  Impl::Context context(impl_.get(), impl_->plane_of(from));
  const Eigen::Vector3f o = scaled(origin).cast<float>();
  const Eigen::Vector3f d = (direction * scale_).cast<float>();
  RTCRayHit ray{};
  ray.ray.org_x = o.x();
  ray.ray.org_y = o.y();
  ray.ray.org_z = o.z();
  ray.ray.dir_x = d.x();
  ray.ray.dir_y = d.y();
  ray.ray.dir_z = d.z();
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0U;
  if (from != kNothing) {
    context.leaving = tolerance::kLeaving / d.norm();
    context.inwards = mesh_.normal(from).dot(direction) < 0;
    const Eigen::Vector3f above = o + (context.inwards ? -tolerance::kSamePlane : tolerance::kSamePlane) *
                                          mesh_.normal(from).cast<float>();
    ray.ray.org_x = above.x();
    ray.ray.org_y = above.y();
    ray.ray.org_z = above.z();
  }
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context.base, &ray);
  Hit hit;
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.patch = impl_->patch_at(ray.hit.primID, ray.hit.u, ray.hit.v);
  hit.front = impl_->shows_front(ray.hit.primID, d.x(), d.y(), d.z());
  hit.distance = static_cast<double>(ray.ray.tfar);
  if (hit.front) return hit;
  const float slack = tolerance::kSamePlane / d.norm();
  ray.ray.tnear = std::max(0.0F, ray.ray.tfar - slack);
  ray.ray.tfar += slack;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  context.pass_backs();
  rtcIntersect1(impl_->scene, &context.base, &ray);
  if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
    hit.patch = impl_->patch_at(ray.hit.primID, ray.hit.u, ray.hit.v);
    hit.front = true;
  }
  return hit;
}

}  // namespace radiosity
