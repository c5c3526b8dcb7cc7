// SPDX-License-Identifier: GPL-3.0-or-later
#include "occluders.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "radiosity/meshing/tolerances.hpp"
#include "winding_number.hpp"

namespace radiosity {
namespace {

double twice_area(std::span<const Vec3> polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    sum += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]);
  return sum.norm();
}

Eigen::AlignedBox3d box_of(std::span<const Vec3> points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : points) box.extend(x);
  return box;
}

// Within [0, 2π), of angles less than 2π beside that.
double turned_into_circle(double angle) {
  constexpr double kCircle = 2 * std::numbers::pi;
  return angle < 0 ? angle + kCircle : angle >= kCircle ? angle - kCircle : angle;
}

// Leaves of a convex polygon what lies below the plane n·x = d.
void keep_below(std::vector<Vec3>& polygon, const Vec3& n, double d, std::vector<Vec3>& below) {
  below.clear();
  if (polygon.empty()) return;
  const Vec3* a = &polygon.back();
  double ha = n.dot(*a) - d;
  for (const Vec3& b : polygon) {
    const double hb = n.dot(b) - d;
    if ((ha < 0 && hb > 0) || (ha > 0 && hb < 0)) below.push_back(*a + ha / (ha - hb) * (b - *a));
    if (hb <= 0) below.push_back(b);
    a = &b;
    ha = hb;
  }
  polygon.swap(below);
}

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

// Whether an edge of one of two polygons in about one plane has all of one on its one side and all of the other on its other side.
bool beside(std::span<const Vec3> a, std::span<const Vec3> b, const Vec3& normal, double extent) {
  const double slack = tolerance::kGrazed * extent;
  const auto divides = [&](const Vec3& from, const Vec3& to) {
    const Vec3 across = normal.cross(to - from).normalized();
    const auto side = [&](std::span<const Vec3> polygon, double sign) {
      return std::all_of(polygon.begin(), polygon.end(),
                         [&](const Vec3& x) { return sign * across.dot(x - from) <= slack; });
    };
    return (side(a, 1) && side(b, -1)) || (side(a, -1) && side(b, 1));
  };
  const auto any_edge = [&](std::span<const Vec3> polygon) {
    for (std::size_t k = 0; k < polygon.size(); ++k)
      if (divides(polygon[k], polygon[k + 1 == polygon.size() ? 0 : k + 1])) return true;
    return false;
  };
  return any_edge(a) || any_edge(b);
}

}  // namespace

double point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q) {
  double sum = 0;
  Vec3 a = q.back() - x;
  for (const Vec3& corner : q) {
    const Vec3 b = corner - x;
    const Vec3 c = a.cross(b);
    const double along = a.dot(b);
    const double square = c.squaredNorm();
    // |c| / a·b is the tangent of the angle. Of a small one the series of its arc is exact to a double: what is left out is below 2^-52 / 9 of it.
    constexpr double kSmall = 0x1p-13;
    if (along > 0 && square < kSmall * along * along) {
      const double t = square / (along * along);
      sum += n.dot(c) / along * (1 - t * (1.0 / 3 - t * (1.0 / 5 - t / 7)));
    } else if (square > 0) {
      const double length = std::sqrt(square);
      sum += n.dot(c) / length * std::atan2(length, along);
    }
    a = b;
  }
  return -sum / (2 * std::numbers::pi);
}

namespace {

double slack(const PatchMesh& mesh) {
  return std::max(tolerance::kOnPlane * 10 * mesh.diagonal(),
                  tolerance::kDegenerateHeight *
                      std::max(mesh.lower().cwiseAbs().maxCoeff(), mesh.upper().cwiseAbs().maxCoeff()));
}

}  // namespace

Occluders::Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets,
                     const std::vector<PatchGroup>& groups, std::span<const Index> rows, const Vec3& origin)
    : slack_(slack(mesh)), groups_(groups), row_(mesh.patch_count(), -1) {
  std::vector<Index> all;
  if (rows.empty()) {
    all.resize(row_.size());
    std::iota(all.begin(), all.end(), 0);
    rows = all;
  }
  usable_ = take(facets, origin, all.size(), all.empty() ? std::numeric_limits<std::size_t>::max() : kMost);
  if (!usable_) return;
  complete_ = polygons_.size() <= kMost;
  if (!complete_) {
    polygons_.resize(kHiders);
    words_ = (kHiders + 63) / 64;
  }
  if (complete_) find_solids();
  for (std::size_t k = 0; k < rows.size(); ++k) row_[rows[k]] = static_cast<Index>(k);
  clear(patch_sides_, rows.size());
  patch_sides_.left.assign(patch_sides_.back.size(), 0);
  clear(group_sides_, groups.size());
  tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    const PatchGroup& group = groups[g];
    const std::size_t other_side = facets[group.facet].back;
    mark(group_sides_, g, group.corners, group.normal, group.offset, group.facet, other_side);
    for (const Index i : group.patches) {
      if (row_[i] < 0) continue;
      mark(patch_sides_, row_[i], mesh, i, origin, group.facet, other_side);
      mark_left(row_[i], facets);
    }
  });
}

Occluders::Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets, std::span<const Index> facet_of,
                     std::span<const Index> lamps, const Vec3& origin)
    : slack_(slack(mesh)) {
  usable_ = take(facets, origin, lamps.size(), std::numeric_limits<std::size_t>::max());
  if (!usable_) return;
  clear(patch_sides_, lamps.size());
  tbb::parallel_for(std::size_t{0}, lamps.size(), [&](std::size_t k) {
    const Index facet = facet_of[lamps[k]];
    mark(patch_sides_, k, mesh, lamps[k], origin, facet, facets[facet].back);
  });
}

bool Occluders::take(const std::vector<Facet>& facets, const Vec3& origin, std::size_t patches,
                     std::size_t most) {
  constexpr std::size_t kMostBytes = 1 << 28;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    for (const Facet::Piece& piece : facets[f].pieces) {
      Convex polygon{piece.corners, piece.normal, 0, {}, f};
      for (Vec3& c : polygon.corners) {
        c -= origin;
        polygon.offset += piece.normal.dot(c) / static_cast<double>(piece.corners.size());
      }
      for (std::size_t k = 0; k < polygon.corners.size(); ++k)
        polygon.inward.push_back(
            piece.normal.cross(polygon.corners[(k + 1) % polygon.corners.size()] - polygon.corners[k]));
      polygon.box = box_of(polygon.corners);
      sort_by_angle(polygon);
      polygons_.push_back(std::move(polygon));
    }
    words_ = (polygons_.size() + 63) / 64;
    if (polygons_.size() > most || 4 * sizeof(std::uint64_t) * words_ * patches > kMostBytes) return false;
  }
  std::ranges::stable_sort(polygons_, std::greater{},
                           [](const Convex& polygon) { return twice_area(polygon.corners); });
  return true;
}

void Occluders::clear(Sides& sides, std::size_t count) const {
  for (auto* mask : {&sides.front, &sides.back, &sides.facing}) mask->assign(count * words_, 0);
}

// From a polygon to those that share a corner while all corners are behind or on all planes. What is on the surface of the hull is
// the whole of it when it fills the sphere seen from within.
void Occluders::find_solids() {
  std::map<std::array<double, 3>, std::vector<std::size_t>> at;  // a corner
  const auto key = [](const Vec3& c) { return std::array{c.x(), c.y(), c.z()}; };
  for (std::size_t o = 0; o < polygons_.size(); ++o)
    for (const Vec3& c : polygons_[o].corners) at[key(c)].push_back(o);
  const auto behind = [&](const Convex& a, const Convex& b) {
    return std::all_of(a.corners.begin(), a.corners.end(),
                       [&](const Vec3& c) { return b.normal.dot(c) - b.offset <= slack_; });
  };
  std::vector<bool> seen(polygons_.size(), false);
  for (std::size_t start = 0; start < polygons_.size(); ++start) {
    if (seen[start]) continue;
    std::vector<std::size_t> members{start};
    seen[start] = true;
    for (std::size_t next = 0; next < members.size(); ++next)
      for (const Vec3& c : polygons_[members[next]].corners)
        for (const std::size_t o : at[key(c)]) {
          if (seen[o] || !std::all_of(members.begin(), members.end(), [&](std::size_t m) {
                return behind(polygons_[o], polygons_[m]) && behind(polygons_[m], polygons_[o]);
              }))
            continue;
          members.push_back(o);
          seen[o] = true;
        }
    Vec3 middle = Vec3::Zero();
    double corners = 0;
    for (const std::size_t o : members)
      for (const Vec3& c : polygons_[o].corners) {
        middle += c;
        ++corners;
      }
    middle /= corners;
    if (std::any_of(members.begin(), members.end(), [&](std::size_t o) {
          return polygons_[o].normal.dot(middle) - polygons_[o].offset >= -slack_;
        }))
      continue;  // flat
    double angle = 0;
    for (const std::size_t o : members) {
      const auto& c = polygons_[o].corners;
      for (std::size_t k = 1; k + 1 < c.size(); ++k) angle += solid_angle({c[0], c[k], c[k + 1]}, middle);
    }
    if (std::abs(std::abs(angle) / (4 * std::numbers::pi) - 1) > tolerance::kNoEscape) continue;
    for (const std::size_t o : members) polygons_[o].solid = solids_.size();
    solids_.push_back(std::move(members));
  }
}

// The patch is behind the polygon, and outside of its solid (in the plane of a side it may look into it); or the polygon is one side of
// a sheet.
void Occluders::mark_left(std::size_t row, const std::vector<Facet>& facets) {
  std::vector<bool> outside;
  for (const auto& members : solids_)
    outside.push_back(std::any_of(members.begin(), members.end(), [&](std::size_t o) {
      return bit(patch_sides_.front, row, o) && !bit(patch_sides_.back, row, o);
    }));
  for (std::size_t o = 0; o < polygons_.size(); ++o) {
    const Convex& polygon = polygons_[o];
    const bool left =
        bit(patch_sides_.back, row, o) && ((polygon.solid != kNoSolid && outside[polygon.solid]) ||
                                           facets[polygon.facet].back != Facet::kNoBack);
    patch_sides_.left[row * words_ + o / 64] |= static_cast<std::uint64_t>(left) << (o % 64);
  }
}

double Occluders::angle_of(const Convex& polygon, const Vec3& direction) {
  return std::atan2(polygon.v.dot(direction), polygon.u.dot(direction));
}

void Occluders::sort_by_angle(Convex& polygon) {
  constexpr std::size_t kFewCorners = 16;
  const std::vector<Vec3>& corners = polygon.corners;
  if (corners.size() <= kFewCorners) return;
  for (const Vec3& c : corners) polygon.middle += (c - corners[0]) / static_cast<double>(corners.size());
  polygon.middle += corners[0];
  polygon.u = (corners[0] - polygon.middle).normalized();
  polygon.v = polygon.normal.cross(polygon.u);
  for (const Vec3& c : corners)
    polygon.angles.push_back(turned_into_circle(angle_of(polygon, c - polygon.middle)));
  polygon.angles[0] = 0;
  if (!std::is_sorted(polygon.angles.begin(), polygon.angles.end())) {
    polygon.angles.clear();  // as thin as rounding
    return;
  }
  polygon.first_direction = angle_of(polygon, corners[1] - corners[0]);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 edge = corners[k + 1 == corners.size() ? 0 : k + 1] - corners[k];
    polygon.directions.push_back(turned_into_circle(angle_of(polygon, edge) - polygon.first_direction));
  }
  if (!std::is_sorted(polygon.directions.begin(), polygon.directions.end()))
    polygon.directions.clear();  // straight but for rounding somewhere
  polygon.inner_radius = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 edge = corners[k + 1 == corners.size() ? 0 : k + 1] - corners[k];
    if (edge.norm() > 0)
      polygon.inner_radius =
          std::min(polygon.inner_radius, edge.cross(polygon.middle - corners[k]).norm() / edge.norm());
  }
}

// Inside the wedge from the middle round the points, the polygon ends at the edges that reach into the wedge.
Occluders::Edges Occluders::edges_near(const Convex& polygon, std::span<const Vec3> points) {
  const std::size_t n = polygon.corners.size();
  const Edges all{0, n};
  if (polygon.angles.empty()) return all;
  constexpr double kPi = std::numbers::pi;
  double reference = 0, low = 0, high = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3 d = points[k] - polygon.middle;
    const double angle = angle_of(polygon, d);
    if (k == 0) reference = angle;
    double turn = angle - reference;  // within [−π, π]
    if (std::abs(turn) > kPi) turn -= std::copysign(2 * kPi, turn);
    low = std::min(low, turn);
    high = std::max(high, turn);
  }
  if (high - low > 0.9 * kPi) return all;
  const auto edge_at = [&](double angle) {
    const auto after =
        std::upper_bound(polygon.angles.begin(), polygon.angles.end(), turned_into_circle(angle));
    return static_cast<std::size_t>(after - polygon.angles.begin()) - 1;
  };
  const std::size_t first = edge_at(reference + low);
  const std::size_t count = (edge_at(reference + high) + n - first) % n + 1;
  // One more on either side, for rounding.
  return count + 2 < n ? Edges{(first + n - 1) % n, count + 2} : all;
}

void Occluders::mark(Sides& sides, std::size_t i, std::span<const Vec3> corners, const Vec3& normal,
                     double offset, std::size_t facet, std::size_t other_side) const {
  double extent = 0;
  for (const Vec3& x : corners) extent = std::max(extent, (x - corners[0]).norm());
  for (std::size_t o = 0; o < polygons_.size(); ++o) {
    const Convex& polygon = polygons_[o];
    double low = std::numeric_limits<double>::infinity(), high = -low, highest = -low;
    for (const Vec3& x : corners) {
      const double h = polygon.normal.dot(x) - polygon.offset;
      low = std::min(low, h);
      high = std::max(high, h);
    }
    const bool front = low >= -std::max(slack_, tolerance::kGrazed * high);
    const bool back = high <= std::max(slack_, -tolerance::kGrazed * low);
    for (const Vec3& c : polygon.corners) highest = std::max(highest, normal.dot(c) - offset);
    const bool facing =
        polygon.facet != facet && polygon.facet != other_side && highest > slack_ &&
        !(highest <= tolerance::kGrazed * extent && beside(polygon.corners, corners, normal, extent));
    const std::size_t word = i * words_ + o / 64;
    sides.front[word] |= static_cast<std::uint64_t>(front) << (o % 64);
    sides.back[word] |= static_cast<std::uint64_t>(back) << (o % 64);
    sides.facing[word] |= static_cast<std::uint64_t>(facing) << (o % 64);
  }
}

void Occluders::mark(Sides& sides, std::size_t i, const PatchMesh& mesh, Index patch, const Vec3& origin,
                     std::size_t facet, std::size_t other_side) const {
  thread_local std::vector<Vec3> corners;
  corners.clear();
  for (const Index v : mesh.corners(patch)) corners.push_back(mesh.vertex(v) - origin);
  const Vec3& normal = mesh.normal(patch);
  mark(sides, i, corners, normal, normal.dot(mesh.centroid(patch) - origin), facet, other_side);
}

bool Occluders::between(const Sides& a, std::size_t i, std::span<const Vec3> p, const Sides& b, std::size_t j,
                        std::span<const Vec3> q, std::vector<int>& result) const {
  const Box box = box_of(p).merged(box_of(q));
  result.clear();
  for (std::size_t w = 0; w < words_; ++w) {
    const std::size_t of_p = i * words_ + w, of_q = j * words_ + w;
    std::uint64_t bits =
        ~(a.front[of_p] & b.front[of_q]) & ~(a.back[of_p] & b.back[of_q]) & a.facing[of_p] & b.facing[of_q];
    for (; bits != 0; bits &= bits - 1) {
      const int o = static_cast<int>(w * 64) + std::countr_zero(bits);
      if (!box.intersects(polygons_[o].box)) continue;
      if (hides(polygons_[o], p, q)) return false;
      result.push_back(o);
    }
  }
  return true;
}

// Planes through an edge of one and the corner of the other that have both on one side.
void Occluders::make_shaft(std::span<const Vec3> p, std::span<const Vec3> q, Scratch& scratch) const {
  constexpr double kAlike = 1e-9;
  auto& shaft = scratch.shaft;
  shaft.clear();
  const auto support = [&](std::span<const Vec3> a, std::span<const Vec3> b) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : a) middle += x / static_cast<double>(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      const Vec3& e0 = a[k];
      const Vec3 e = a[k + 1 == a.size() ? 0 : k + 1] - e0;
      // Turned about the edge from the middle outwards, past all corners of b.
      const double least = slack_ * slack_ * e.squaredNorm();
      Vec3 normal = Vec3::Zero();
      for (const Vec3& c : b)
        if (normal.dot(c - e0) > 0 || normal.squaredNorm() <= least) {
          normal = e.cross(c - e0);
          if (normal.dot(middle - e0) > 0) normal = -normal;
        }
      const double length = normal.norm();
      if (length <= slack_ * e.norm()) continue;
      normal /= length;
      const auto outside = [&](const Vec3& v) { return normal.dot(v - e0) > slack_; };
      if (std::any_of(b.begin(), b.end(), outside)) continue;
      const double offset = normal.dot(e0);
      if (std::none_of(shaft.begin(), shaft.end(), [&](const Scratch::Plane& plane) {
            return std::abs(plane.offset - offset) <= slack_ && (plane.normal - normal).lpNorm<1>() <= kAlike;
          }))
        shaft.push_back({normal, offset});
    }
  };
  if (p.size() > 2) support(p, q);
  if (q.size() > 2) support(q, p);
}

// Along the corners of a convex polygon n·x rises from the first edge that does not turn away from n to the last: at the start
// of the first it is least.
double Occluders::lowest(const Convex& polygon, const Vec3& n) {
  const std::vector<Vec3>& corners = polygon.corners;
  const auto height = [&](std::size_t k) { return n.dot(corners[k]); };
  double low = height(0);
  if (polygon.directions.empty()) {
    for (std::size_t k = 1; k < corners.size(); ++k) low = std::min(low, height(k));
    return low;
  }
  const double rising = angle_of(polygon, n) - std::numbers::pi / 2 - polygon.first_direction;
  const auto found = std::lower_bound(polygon.directions.begin(), polygon.directions.end(),
                                      turned_into_circle(turned_into_circle(rising)));
  const std::size_t count = corners.size();
  const auto k = static_cast<std::size_t>(found - polygon.directions.begin()) % count;
  // Those beside it too, for rounding.
  return std::min({low, height(k), height((k + 1) % count), height((k + count - 1) % count)});
}

bool Occluders::in_shaft(const Convex& polygon, const Scratch& scratch) const {
  return std::none_of(scratch.shaft.begin(), scratch.shaft.end(), [&](const Scratch::Plane& plane) {
    return lowest(polygon, plane.normal) - plane.offset >= -slack_;
  });
}

// One convex polygon that meets the segments between all pairs of corners meets all segments.
bool Occluders::hides(const Convex& polygon, std::span<const Vec3> p, std::span<const Vec3> q) const {
  const std::size_t corners = polygon.corners.size();
  for (const Vec3& x : p) {
    const double hx = polygon.normal.dot(x) - polygon.offset;
    for (const Vec3& y : q) {
      const double hy = polygon.normal.dot(y) - polygon.offset;
      if (hx * hy >= 0) return false;
      const Vec3 cut = x + hx / (hx - hy) * (y - x);
      const auto [first, count] = edges_near(polygon, std::span(&cut, 1));
      for (std::size_t e = 0, k = first; e < count; ++e) {
        if (polygon.inward[k].dot(cut - polygon.corners[k]) < 0) return false;
        k = k + 1 == corners ? 0 : k + 1;
      }
    }
  }
  return true;
}

// Where all segments between corners pass through a convex body, all segments do: seen from a point of one, what is behind the body
// is convex.
bool Occluders::solid_hides(const std::vector<std::size_t>& solid, std::span<const Vec3> p,
                            std::span<const Vec3> q) const {
  const double slack = tolerance::kGrazed;
  return std::all_of(p.begin(), p.end(), [&](const Vec3& x) {
    return std::all_of(q.begin(), q.end(), [&](const Vec3& y) {
      double enter = 0, leave = 1;
      for (const std::size_t o : solid) {
        const double hx = polygons_[o].normal.dot(x) - polygons_[o].offset;
        const double hy = polygons_[o].normal.dot(y) - polygons_[o].offset;
        if (hx > 0 && hy > 0) return false;
        if (hx > 0) enter = std::max(enter, hx / (hx - hy));
        if (hy > 0) leave = std::min(leave, hx / (hx - hy));
        if (leave - enter <= slack) return false;
      }
      return true;
    });
  });
}

// All segments meet the facet's plane within the hull of where those between corners meet it; of that nothing may be left beside
// the pieces.
bool Occluders::facet_hides(std::span<const int> pieces, std::span<const Vec3> p,
                            std::span<const Vec3> q) const {
  const Convex& first = polygons_[static_cast<std::size_t>(pieces[0])];
  const Vec3 u = (first.corners[1] - first.corners[0]).normalized(), v = first.normal.cross(u);
  std::vector<Eigen::Vector2d> points;
  for (const Vec3& x : p) {
    const double hx = first.normal.dot(x) - first.offset;
    for (const Vec3& y : q) {
      const double hy = first.normal.dot(y) - first.offset;
      if (hx * hy >= 0) return false;
      const Vec3 cut = x + hx / (hx - hy) * (y - x) - first.corners[0];
      points.emplace_back(u.dot(cut), v.dot(cut));
    }
  }
  // The hull by Andrew's monotone chain.
  std::ranges::sort(
      points, [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Eigen::Vector2d> hull;
  const auto left = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  };
  for (int way = 0; way < 2; ++way) {
    const std::size_t begin = hull.size();
    for (const auto& c : points) {
      while (hull.size() >= begin + 2 && left(hull[hull.size() - 2], hull.back(), c) <= 0) hull.pop_back();
      hull.push_back(c);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  if (hull.size() < 3) return false;
  std::vector<Vec3> whole, part, inside;
  for (const auto& c : hull) whole.push_back(first.corners[0] + c.x() * u + c.y() * v);
  double covered = 0;
  for (const int o : pieces) {
    const Convex& piece = polygons_[static_cast<std::size_t>(o)];
    part = whole;
    for (std::size_t k = 0; k < piece.corners.size() && !part.empty(); ++k)
      keep_below(part, -piece.inward[k], -piece.inward[k].dot(piece.corners[k]), inside);
    if (part.size() >= 3) covered += twice_area(part);
  }
  return covered >= (1 - tolerance::kGrazed) * twice_area(whole);
}

bool Occluders::hide_together(std::span<const int> polygons, std::span<const Vec3> p,
                              std::span<const Vec3> q) const {
  for (std::size_t k = 0; k < polygons.size(); ++k) {
    const Convex& polygon = polygons_[static_cast<std::size_t>(polygons[k])];
    const auto same = [&](int o) {
      const Convex& other = polygons_[static_cast<std::size_t>(o)];
      return polygon.solid != kNoSolid ? other.solid == polygon.solid : other.facet == polygon.facet;
    };
    const auto rest = polygons.subspan(k + 1);
    if (std::any_of(polygons.begin(), polygons.begin() + static_cast<std::ptrdiff_t>(k), same)) continue;
    if (polygon.solid != kNoSolid) {
      if (std::any_of(rest.begin(), rest.end(), same) && solid_hides(solids_[polygon.solid], p, q))
        return true;
    } else if (std::any_of(rest.begin(), rest.end(), same)) {
      std::vector<int> pieces;
      std::copy_if(polygons.begin(), polygons.end(), std::back_inserter(pieces), same);
      if (facet_hides(pieces, p, q)) return true;
    }
  }
  return false;
}

Occluders::View Occluders::approach(Index i, std::span<const Vec3> p, std::size_t g, Scratch& scratch) const {
  const PatchGroup& group = groups_[g];
  if (!between(patch_sides_, row_[i], p, group_sides_, g, group.corners, scratch.near)) return View::hidden;
  if (!scratch.near.empty() && group.patches.size() > 1) {
    make_shaft(p, group.corners, scratch);
    std::erase_if(scratch.near, [&](int o) { return !in_shaft(polygons_[o], scratch); });
  }
  if (hide_together(scratch.near, p, group.corners)) return View::hidden;
  return scratch.near.empty() ? View::free : View::partial;
}

Occluders::View Occluders::classify(Index i, std::span<const Vec3> p, Index j, std::span<const Vec3> q,
                                    Scratch& scratch) const {
  scratch.candidates.clear();
  if (scratch.near.empty()) return View::free;
  const Box box = box_of(p).merged(box_of(q));
  // Of a patch that is none of the rows its group told.
  const Index first = row_[i] < 0 ? row_[j] : row_[i], second = row_[j] < 0 ? first : row_[j];
  for (const int o : scratch.near) {
    const auto of = [&](const std::vector<std::uint64_t>& side, Index row) { return bit(side, row, o); };
    const auto outside = [&](const std::vector<std::uint64_t>& side) {
      return first != second && of(side, first) && of(side, second);
    };
    if (outside(patch_sides_.front) || outside(patch_sides_.back) || !of(patch_sides_.facing, first) ||
        !of(patch_sides_.facing, second) || !box.intersects(polygons_[o].box))
      continue;
    if (hides(polygons_[o], p, q)) return View::hidden;
    if (row_[i] < 0 || !of(patch_sides_.left, row_[i])) scratch.candidates.push_back(o);
  }
  return narrow(p, q, scratch);
}

Occluders::View Occluders::narrow(std::span<const Vec3> p, std::span<const Vec3> q, Scratch& scratch) const {
  if (scratch.candidates.empty()) return View::free;
  make_shaft(p, q, scratch);
  std::erase_if(scratch.candidates, [&](int o) { return !in_shaft(polygons_[o], scratch); });
  if (scratch.candidates.empty()) return View::free;
  if (hide_together(scratch.candidates, p, q)) return View::hidden;
  return scratch.candidates.size() > kMostShadows ? View::crowded : View::partial;
}

Occluders::ShadowGroup Occluders::shadow_group(Index i, int polygon) const {
  const Convex& p = polygons_[static_cast<std::size_t>(polygon)];
  const auto in_front = [&](std::size_t o) {
    return bit(patch_sides_.front, row_[i], o) && !bit(patch_sides_.back, row_[i], o);
  };
  if (row_[i] >= 0 && p.solid != kNoSolid &&
      std::any_of(solids_[p.solid].begin(), solids_[p.solid].end(), in_front))
    return {p.solid, true};
  return {solids_.size() + p.facet, false};
}

void Occluders::clip_to_shaft(std::vector<Vec3>& polygon, Scratch& scratch) {
  for (const Scratch::Plane& plane : scratch.shaft)
    keep_below(polygon, plane.normal, plane.offset, scratch.inside);
}

void Occluders::look_from(const Vec3& x, const Vec3& n, Scratch& scratch) const {
  scratch.near.clear();
  const double horizon = n.dot(x) + slack_;
  for (std::size_t o = 0; o < polygons_.size(); ++o) {
    const Convex& polygon = polygons_[o];
    if (std::abs(polygon.normal.dot(x) - polygon.offset) > slack_ &&
        std::any_of(polygon.corners.begin(), polygon.corners.end(),
                    [&](const Vec3& c) { return n.dot(c) > horizon; }))
      scratch.near.push_back(static_cast<int>(o));
  }
}

Occluders::View Occluders::classify(const Vec3& x, std::span<const int> polygons, std::size_t lamp,
                                    std::span<const Vec3> q, Scratch& scratch) const {
  scratch.candidates.clear();
  Box box = box_of(q);
  box.extend(x);
  for (const int o : polygons) {
    const Convex& polygon = polygons_[o];
    const double height = polygon.normal.dot(x) - polygon.offset;
    const bool in_front = height > 0;
    if (std::abs(height) > slack_ && !bit(in_front ? patch_sides_.front : patch_sides_.back, lamp, o) &&
        bit(patch_sides_.facing, lamp, o) && box.intersects(polygon.box)) {
      if (hides(polygon, std::span(&x, 1), q)) return View::hidden;
      scratch.candidates.push_back(o);
    }
  }
  return narrow(std::span(&x, 1), q, scratch);
}

void Occluders::look_from(std::span<const Vec3> p, const Vec3& n, std::size_t facet,
                          const std::vector<Facet>& facets, Scratch& scratch) const {
  clear(scratch.sides, 1);
  mark(scratch.sides, 0, p, n, n.dot(p[0]), facet, facets[facet].back);
}

Occluders::View Occluders::classify(std::span<const Vec3> p, std::size_t lamp, std::span<const Vec3> q,
                                    Scratch& scratch) const {
  if (!between(scratch.sides, 0, p, patch_sides_, lamp, q, scratch.candidates)) return View::hidden;
  return narrow(p, q, scratch);
}

// Where x sees q through the polygon's plane, into cuts; true where that is all of q.
bool Occluders::look_through(const Convex& polygon, const Vec3& x, std::span<const Vec3> q,
                             std::vector<Vec3>& cuts) const {
  const double hx = polygon.normal.dot(x) - polygon.offset;
  cuts.clear();
  for (const Vec3& y : q) {
    const double hy = polygon.normal.dot(y) - polygon.offset;
    if (std::abs(hx) > slack_ && (hx > 0 ? hy : -hy) < -slack_) cuts.push_back(x + hx / (hx - hy) * (y - x));
  }
  return cuts.size() == q.size();
}

// The candidate that many edges of may cut q, so that the pieces that they leave would be many. All of q is beyond it.
Occluders::Round Occluders::find_round(const Vec3& x, std::span<const Vec3> q, Scratch& scratch) const {
  constexpr std::size_t kManyEdges = 32;
  Round round;
  for (const int o : scratch.candidates) {
    const Convex& polygon = polygons_[o];
    if (polygon.angles.size() <= kManyEdges || !look_through(polygon, x, q, scratch.cuts)) continue;
    const double inner = polygon.inner_radius * polygon.inner_radius;
    round.hides = std::all_of(scratch.cuts.begin(), scratch.cuts.end(),
                              [&](const Vec3& c) { return (c - polygon.middle).squaredNorm() <= inner; });
    if (round.hides) break;
    if (round.polygon >= 0) continue;
    const Edges edges = edges_near(polygon, scratch.cuts);
    if (edges.count > kManyEdges) {
      round.polygon = o;
      round.edges = edges;
    }
  }
  return round;
}

// What of q, all of it beyond the polygon, is hidden by it: the factor to the part of the polygon in front of q, of which only
// these edges can be in front.
double Occluders::hidden_point_factor(const Convex& polygon, Edges edges, const Vec3& x, const Vec3& n,
                                      std::span<const Vec3> q, Scratch& scratch) {
  const auto [first, number] = edges;
  const std::size_t corners = polygon.corners.size();
  auto& part = scratch.part;
  part.clear();
  for (std::size_t k = 0; k < std::min(number + 1, corners); ++k)
    part.push_back(polygon.corners[(first + k) % corners]);
  if (number < corners) part.push_back(polygon.middle);  // the sector that q is seen through
  // q is counter-clockwise as seen from x.
  for (std::size_t k = 0; k < q.size() && part.size() >= 3; ++k) {
    const Vec3 normal = (q[k] - x).cross(q[k + 1 == q.size() ? 0 : k + 1] - x);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    keep_below(part, normal / length, normal.dot(x) / length, scratch.inside);
  }
  return part.size() < 3 ? 0 : std::abs(point_factor(x, n, part));
}

double Occluders::visible_point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q, double all,
                                       Scratch& scratch) const {
  auto& pieces = scratch.pieces;
  auto& next = scratch.next;
  auto& shadow = scratch.shadow;
  pieces.resize(std::max<std::size_t>(pieces.size(), 1));
  pieces[0].assign(q.begin(), q.end());
  std::size_t count = 1;
  bool cut = false;
  const auto [many, many_edges, hides_all] = find_round(x, q, scratch);
  if (hides_all) return 0;
  for (const int o : scratch.candidates) {
    if (o == many) continue;
    const Convex& polygon = polygons_[o];
    const double hx = polygon.normal.dot(x) - polygon.offset;
    if (std::abs(hx) <= slack_) continue;
    // The shadow: beyond the polygon's plane, and inside the planes through x and the polygon's edges. What a plane leaves
    // outside stays visible; what is inside all of them is hidden.
    const double side = hx > 0 ? 1 : -1;
    shadow.clear();
    shadow.push_back({side * polygon.normal, side * polygon.offset});
    const std::size_t corners = polygon.corners.size();
    const auto [first, number] =
        look_through(polygon, x, q, scratch.cuts) ? edges_near(polygon, scratch.cuts) : Edges{0, corners};
    Vec3 a = polygon.corners[first] - x;
    for (std::size_t e = 0, k = first; e < number; ++e) {
      k = k + 1 == corners ? 0 : k + 1;
      const Vec3 b = polygon.corners[k] - x;
      const Vec3 normal = side * a.cross(b);
      const double length = normal.norm();
      if (length > 0) shadow.push_back({normal / length, normal.dot(x) / length});
      a = b;
    }
    std::size_t kept = 0;
    const auto keep = [&](std::vector<Vec3>& piece) {
      if (next.size() <= kept) next.emplace_back();
      next[kept++].swap(piece);
    };
    for (std::size_t k = 0; k < count; ++k) {
      std::vector<Vec3>& rest = pieces[k];
      const bool untouched = std::any_of(shadow.begin(), shadow.end(), [&](const Scratch::Plane& plane) {
        return std::all_of(rest.begin(), rest.end(),
                           [&](const Vec3& y) { return plane.normal.dot(y) - plane.offset >= -slack_; });
      });
      if (untouched) {
        keep(rest);
        continue;
      }
      cut = true;
      for (const Scratch::Plane& plane : shadow) {
        split(rest, plane.normal, plane.offset, slack_, scratch.inside, scratch.outside);
        if (scratch.outside.size() >= 3) keep(scratch.outside);
        rest.swap(scratch.inside);
        if (rest.size() < 3) break;
      }
    }
    pieces.swap(next);
    count = kept;
    if (count == 0) return 0;
  }
  if (!cut && many < 0) return all;
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double whole = cut ? point_factor(x, n, pieces[k]) : all;
    sum += whole;
    if (many >= 0) sum -= hidden_point_factor(polygons_[many], many_edges, x, n, pieces[k], scratch);
  }
  return many >= 0 && sum < tolerance::kFactorRounding ? 0 : sum;
}

}  // namespace radiosity
