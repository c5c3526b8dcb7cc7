// SPDX-License-Identifier: GPL-3.0-or-later
#include "occluders.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

// Splits a convex polygon by the plane n·x = d; points within slack of it belong to both sides.
void split(std::span<const Vec3> polygon, const Vec3& n, double d, double slack, std::vector<Vec3>& below,
           std::vector<Vec3>& above) {
  below.clear();
  above.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3& a = polygon[k];
    const Vec3& b = polygon[k + 1 == polygon.size() ? 0 : k + 1];
    const double ha = n.dot(a) - d;
    const double hb = n.dot(b) - d;
    if (ha <= slack) below.push_back(a);
    if (ha >= -slack) above.push_back(a);
    if ((ha < -slack && hb > slack) || (ha > slack && hb < -slack)) {
      const Vec3 cut = a + ha / (ha - hb) * (b - a);
      below.push_back(cut);
      above.push_back(cut);
    }
  }
}

}  // namespace

double point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q) {
  double sum = 0;
  Vec3 a = q.back() - x;
  for (const Vec3& corner : q) {
    const Vec3 b = corner - x;
    const Vec3 c = a.cross(b);
    const double length = c.norm();
    if (length > 0) sum += n.dot(c) / length * std::atan2(length, a.dot(b));
    a = b;
  }
  return -sum / (2 * std::numbers::pi);
}

Occluders::Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets, const Vec3& origin)
    : slack_(tolerance::kOnPlane * 10 * mesh.diagonal()) {
  for (const Facet& facet : facets) {
    for (const Facet::Piece& piece : facet.pieces) {
      Convex polygon{piece.corners, piece.normal, piece.normal.dot(piece.corners[0] - origin)};
      for (Vec3& c : polygon.corners) c -= origin;
      polygons_.push_back(std::move(polygon));
    }
    if (polygons_.size() > kMost) return;
  }
  usable_ = true;
  mark_sides(mesh, origin);
}

void Occluders::mark_sides(const PatchMesh& mesh, const Vec3& origin) {
  words_ = (polygons_.size() + 63) / 64;
  const auto n = static_cast<std::size_t>(mesh.patch_count());
  for (Mask* mask : {&front_, &back_, &facing_}) mask->assign(n * words_, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const auto patch = static_cast<Index>(i);
    const Vec3& normal = mesh.normal(patch);
    const double height = normal.dot(mesh.centroid(patch) - origin);
    for (std::size_t o = 0; o < polygons_.size(); ++o) {
      const Convex& polygon = polygons_[o];
      bool front = true;
      bool back = true;
      for (const Index v : mesh.corners(patch)) {
        const double h = polygon.normal.dot(mesh.vertex(v) - origin) - polygon.offset;
        front = front && h >= -slack_;
        back = back && h <= slack_;
      }
      bool facing = false;
      for (const Vec3& c : polygon.corners) facing = facing || normal.dot(c) - height > slack_;
      const std::uint64_t bit = std::uint64_t{1} << (o % 64);
      const std::size_t word = i * words_ + o / 64;
      if (front) front_[word] |= bit;
      if (back) back_[word] |= bit;
      if (facing) facing_[word] |= bit;
    }
  }
}

Occluders::View Occluders::classify(Index i, std::span<const Vec3> p, Index j, std::span<const Vec3> q,
                                    Scratch& scratch) const {
  // What has both patches on one side, or lies behind one of them, cannot stand between them.
  scratch.candidates.clear();
  const std::size_t wi = static_cast<std::size_t>(i) * words_;
  const std::size_t wj = static_cast<std::size_t>(j) * words_;
  for (std::size_t w = 0; w < words_; ++w) {
    std::uint64_t between = ~(front_[wi + w] & front_[wj + w]) & ~(back_[wi + w] & back_[wj + w]) &
                            facing_[wi + w] & facing_[wj + w];
    for (; between != 0; between &= between - 1) {
      scratch.candidates.push_back(static_cast<int>(w * 64) + std::countr_zero(between));
    }
  }
  if (scratch.candidates.empty()) return View::free;
  if (scratch.candidates.size() > kMostToTest) return View::crowded;

  // The shaft: planes through an edge of one and a corner of the other that have both on one side.
  scratch.shaft.clear();
  const auto support = [&](std::span<const Vec3> a, std::span<const Vec3> b) {
    for (std::size_t k = 0; k < a.size(); ++k) {
      const Vec3& e0 = a[k];
      const Vec3 e = a[k + 1 == a.size() ? 0 : k + 1] - e0;
      for (const Vec3& c : b) {
        Vec3 normal = e.cross(c - e0);
        const double length = normal.norm();
        if (length <= slack_ * e.norm()) continue;
        normal /= length;
        const double offset = normal.dot(e0);
        double low = 0;
        double high = 0;
        for (const auto& polygon : {a, b}) {
          for (const Vec3& v : polygon) {
            const double h = normal.dot(v) - offset;
            low = std::min(low, h);
            high = std::max(high, h);
          }
        }
        if (high <= slack_) {
          scratch.shaft.push_back({normal, offset});
        } else if (low >= -slack_) {
          scratch.shaft.push_back({-normal, -offset});
        }
      }
    }
  };
  support(p, q);
  support(q, p);
  const auto outside_shaft = [&](int o) {
    const auto& corners = polygons_[static_cast<std::size_t>(o)].corners;
    return std::any_of(scratch.shaft.begin(), scratch.shaft.end(), [&](const Scratch::Plane& plane) {
      return std::all_of(corners.begin(), corners.end(),
                         [&](const Vec3& c) { return plane.normal.dot(c) - plane.offset >= -slack_; });
    });
  };
  std::erase_if(scratch.candidates, outside_shaft);
  if (scratch.candidates.empty()) return View::free;
  if (scratch.candidates.size() > kMostShadows) return View::crowded;

  // Hidden when one convex polygon meets the segments between all pairs of corners, hence all segments.
  for (const int o : scratch.candidates) {
    const Convex& polygon = polygons_[static_cast<std::size_t>(o)];
    const auto meets_all = [&] {
      for (const Vec3& x : p) {
        const double hx = polygon.normal.dot(x) - polygon.offset;
        for (const Vec3& y : q) {
          const double hy = polygon.normal.dot(y) - polygon.offset;
          if (hx * hy >= 0) return false;
          const Vec3 cut = x + hx / (hx - hy) * (y - x);
          for (std::size_t k = 0; k < polygon.corners.size(); ++k) {
            const Vec3& a = polygon.corners[k];
            const Vec3& b = polygon.corners[k + 1 == polygon.corners.size() ? 0 : k + 1];
            if (polygon.normal.dot((b - a).cross(cut - a)) < 0) return false;
          }
        }
      }
      return true;
    };
    if (meets_all()) return View::hidden;
  }
  return View::partial;
}

double Occluders::visible_point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q,
                                       Scratch& scratch) const {
  auto& pieces = scratch.pieces;
  pieces.resize(1);
  pieces[0].assign(q.begin(), q.end());
  for (const int o : scratch.candidates) {
    const Convex& polygon = polygons_[static_cast<std::size_t>(o)];
    const double hx = polygon.normal.dot(x) - polygon.offset;
    if (std::abs(hx) <= slack_) continue;
    const double side = hx > 0 ? 1 : -1;
    // The shadow: beyond the polygon's plane, and inside the planes through x and the polygon's edges. What a plane leaves
    // outside stays visible; what is inside all of them is hidden.
    auto& next = scratch.next;
    std::size_t kept = 0;
    const auto keep = [&](const std::vector<Vec3>& piece) {
      if (next.size() <= kept) next.emplace_back();
      next[kept++] = piece;
    };
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      std::vector<Vec3>& rest = pieces[k];
      for (std::size_t e = 0; e <= polygon.corners.size() && rest.size() >= 3; ++e) {
        Vec3 normal = side * polygon.normal;  // the last plane is the polygon's own
        double offset = side * polygon.offset;
        if (e < polygon.corners.size()) {
          const Vec3& a = polygon.corners[e];
          const Vec3& b = polygon.corners[e + 1 == polygon.corners.size() ? 0 : e + 1];
          normal = side * (a - x).cross(b - x);
          const double length = normal.norm();
          if (length == 0) continue;
          normal /= length;
          offset = normal.dot(x);
        }
        split(rest, normal, offset, slack_, scratch.inside, scratch.outside);
        if (scratch.outside.size() >= 3) keep(scratch.outside);
        rest.swap(scratch.inside);
      }
    }
    next.resize(std::max(next.size(), kept));
    pieces.swap(next);
    pieces.resize(kept);
    if (kept == 0) return 0;
  }
  double sum = 0;
  for (const auto& piece : pieces) sum += point_factor(x, n, piece);
  return sum;
}

}  // namespace radiosity
