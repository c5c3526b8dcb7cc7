// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/curved_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

using std::numbers::pi;

/// Adds faces, turned over where fronts are on the other side.
class Facets {
 public:
  Facets(const CurvedShape& shape, Index material, Scene::Arrays& arrays)
      : shape_(shape), material_(material), arrays_(arrays) {}

  [[noreturn]] void fail(const std::string& rule) const {
    throw InputError(fmt::format("shape '{}': {}", shape_.name, rule));
  }
  void require_positive(double value, const char* what) const {
    if (!(value > 0 && std::isfinite(value)))
      fail(fmt::format("{} {} m is not positive and finite", what, value));
  }
  void require_finite(const Vec3& x, const char* what) const {
    if (!x.allFinite()) fail(fmt::format("{} {} {} {} is not finite", what, x.x(), x.y(), x.z()));
  }
  /// Before they are made.
  void require_count(double count, double chord_error) const {
    if (!(count <= tolerance::kMostPiecesOfFace))
      fail(fmt::format("a chord error of {} m takes {:.3g} facets, more than {:.0g}", chord_error, count,
                       tolerance::kMostPiecesOfFace));
  }

  Index vertex(const Vec3& x) {
    arrays_.vertices.push_back(x);
    return static_cast<Index>(arrays_.vertices.size()) - 1;
  }
  void face(std::vector<Index> corners) {
    if (shape_.flip) std::reverse(corners.begin(), corners.end());
    arrays_.add_face(corners, material_);
  }

 private:
  const CurvedShape& shape_;
  Index material_;
  Scene::Arrays& arrays_;
};

/// The icosahedron on the unit sphere, counter-clockwise from outside.
struct Icosahedron {
  std::array<Vec3, 12> corners;
  std::array<std::array<int, 3>, 20> faces;
};
Icosahedron icosahedron() {
  // A pole, two rings of five, the other pole.
  Icosahedron result{};
  const double height = 1 / std::sqrt(5.0), radius = 2 / std::sqrt(5.0);
  result.corners[0] = Vec3::UnitZ();
  result.corners[11] = -Vec3::UnitZ();
  for (std::size_t k = 0; k < 5; ++k) {
    const double angle = 2 * pi * static_cast<double>(k) / 5;
    result.corners[1 + k] = {radius * std::cos(angle), radius * std::sin(angle), height};
    result.corners[6 + k] = {radius * std::cos(angle + pi / 5), radius * std::sin(angle + pi / 5), -height};
  }
  for (int k = 0; k < 5; ++k) {
    const int next = (k + 1) % 5;
    const auto row = static_cast<std::size_t>(4 * k);
    result.faces[row] = {0, 1 + k, 1 + next};
    result.faces[row + 1] = {1 + k, 6 + k, 1 + next};
    result.faces[row + 2] = {1 + next, 6 + k, 6 + next};
    result.faces[row + 3] = {11, 6 + next, 6 + k};
  }
  return result;
}

/// Point (i, j) of ν on a face of the icosahedron: (ν − i − j) a + i b + j c on the unit sphere.
Vec3 on_sphere(const Vec3& a, const Vec3& b, const Vec3& c, int i, int j, int frequency) {
  return ((frequency - i - j) * a + i * b + j * c).normalized();
}

/// How far the unit sphere is from the facets of one face of the icosahedron, which is like all others: 1 − the distance of the plane.
double sagitta(const Icosahedron& ico, int frequency) {
  const auto [a, b, c] = ico.faces[0];
  const auto at = [&](int i, int j) {
    return on_sphere(ico.corners[static_cast<std::size_t>(a)], ico.corners[static_cast<std::size_t>(b)],
                     ico.corners[static_cast<std::size_t>(c)], i, j, frequency);
  };
  double most = 0;
  for (int i = 0; i < frequency; ++i)
    for (int j = 0; i + j < frequency; ++j)
      for (const bool upper : {true, false}) {
        if (!upper && i + j + 2 > frequency) continue;
        const Vec3 p = upper ? at(i, j) : at(i + 1, j + 1), q = at(i + 1, j), r = at(i, j + 1);
        most = std::max(most, 1 - std::abs((q - p).cross(r - p).normalized().dot(p)));
      }
  return most;
}

void add(const Sphere& sphere, double chord_error, Facets& facets) {
  facets.require_finite(sphere.centre, "centre");
  facets.require_positive(sphere.radius, "radius");
  const Icosahedron ico = icosahedron();
  int frequency = 2;
  // It falls with 1/ν² but for the smallest ν.
  for (double off; (off = sphere.radius * sagitta(ico, frequency)) > chord_error;) {
    const double next = std::max(frequency + 1.0, std::floor(frequency * std::sqrt(off / chord_error)));
    facets.require_count(20 * next * next, chord_error);
    frequency = static_cast<int>(next);
  }
  // A vertex on an edge of the icosahedron is made once: it is known by its corners and their weights.
  std::map<std::array<std::pair<int, int>, 3>, Index> made;
  const auto vertex = [&](const std::array<int, 3>& face, int i, int j) {
    std::array<std::pair<int, int>, 3> key{{{face[0], frequency - i - j}, {face[1], i}, {face[2], j}}};
    for (auto& [corner, weight] : key)
      if (weight == 0) corner = 0;
    std::sort(key.begin(), key.end());
    const auto [entry, added] = made.try_emplace(key, 0);
    if (added) {
      Vec3 sum = Vec3::Zero();
      for (const auto& [corner, weight] : key) sum += weight * ico.corners[static_cast<std::size_t>(corner)];
      entry->second = facets.vertex(sphere.centre + sphere.radius * sum.normalized());
    }
    return entry->second;
  };
  for (const auto& face : ico.faces)
    for (int i = 0; i < frequency; ++i)
      for (int j = 0; i + j < frequency; ++j) {
        const Index q = vertex(face, i + 1, j), r = vertex(face, i, j + 1);
        facets.face({vertex(face, i, j), q, r});
        if (i + j + 2 <= frequency) facets.face({vertex(face, i + 1, j + 1), r, q});
      }
}

/// Sides of the n-gon in a circle that is nowhere further from it than the chord error.
int sides(double radius, double chord_error, const Facets& facets) {
  const double n = chord_error < radius ? std::ceil(pi / std::acos(1 - chord_error / radius)) : 0;
  facets.require_count(n, chord_error);
  return std::max(16, static_cast<int>(n));
}

/// Counter-clockwise about the axis.
std::vector<Index> ring(const Vec3& centre, const Vec3& axis, double radius, int n, Facets& facets) {
  const Vec3 u = axis.unitOrthogonal(), v = axis.cross(u);
  std::vector<Index> vertices;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * pi * k / n;
    vertices.push_back(facets.vertex(centre + radius * (std::cos(angle) * u + std::sin(angle) * v)));
  }
  return vertices;
}

void add(const Cylinder& cylinder, double chord_error, Facets& facets) {
  facets.require_finite(cylinder.base, "base");
  facets.require_finite(cylinder.top, "top");
  facets.require_positive(cylinder.radius, "radius");
  const Vec3 way = cylinder.top - cylinder.base;
  facets.require_positive(way.norm(), "length from base to top");
  const int n = sides(cylinder.radius, chord_error, facets);
  const Vec3 axis = way.normalized();
  const std::vector<Index> low = ring(cylinder.base, axis, cylinder.radius, n, facets),
                           high = ring(cylinder.top, axis, cylinder.radius, n, facets);
  for (std::size_t k = 0; k < low.size(); ++k) {
    const std::size_t next = (k + 1) % low.size();
    facets.face({low[k], low[next], high[next], high[k]});
  }
  if (!cylinder.caps) return;
  facets.face(high);
  facets.face({low.rbegin(), low.rend()});
}

void add(const Disk& disk, double chord_error, Facets& facets) {
  facets.require_finite(disk.centre, "centre");
  facets.require_positive(disk.radius, "radius");
  facets.require_finite(disk.normal, "normal");
  if (!(disk.normal.norm() > 0)) facets.fail("normal 0 0 0 is none");
  facets.face(ring(disk.centre, disk.normal.normalized(), disk.radius,
                   sides(disk.radius, chord_error, facets), facets));
}

/// Bernstein polynomials at k/n, whose sums read from either end of a curve have the same bits.
std::array<double, 4> bernstein(int k, int n) {
  const double t = static_cast<double>(k) / n, s = static_cast<double>(n - k) / n;
  return {s * s * s, 3 * (s * s) * t, 3 * (t * t) * s, t * t * t};
}
Vec3 blend(const std::array<double, 4>& b, const Vec3& p0, const Vec3& p1, const Vec3& p2, const Vec3& p3) {
  return (b[0] * p0 + b[3] * p3) + (b[1] * p1 + b[2] * p2);
}

/// M_uu + 2 M_uv + M_vv: the largest second derivatives are at most 6 and 9 times the second differences of the control points.
double bending(const std::array<Vec3, 16>& p) {
  double uu = 0, uv = 0, vv = 0;
  const auto at = [&](std::size_t i, std::size_t j) -> const Vec3& { return p[4 * i + j]; };
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      if (i < 2) uu = std::max(uu, 6 * (at(i, j) - 2 * at(i + 1, j) + at(i + 2, j)).norm());
      if (j < 2) vv = std::max(vv, 6 * (at(i, j) - 2 * at(i, j + 1) + at(i, j + 2)).norm());
      if (i < 3 && j < 3)
        uv = std::max(uv, 9 * (at(i, j) - at(i + 1, j) - at(i, j + 1) + at(i + 1, j + 1)).norm());
    }
  return uu + 2 * uv + vv;
}

void add(const BezierSurface& surface, double chord_error, Facets& facets) {
  if (surface.patches.empty()) facets.fail("has no points");
  double most = 0;
  for (const auto& patch : surface.patches) {
    for (const Vec3& x : patch) facets.require_finite(x, "point");
    most = std::max(most, bending(patch));
  }
  // The same for all patches, so that neighbours have the same points on their common edge.
  const double wanted = std::max(1.0, std::ceil(std::sqrt(most / (8 * chord_error))));
  facets.require_count(2 * wanted * wanted * static_cast<double>(surface.patches.size()), chord_error);
  const int n = static_cast<int>(wanted);
  std::map<std::array<double, 3>, Index> made;
  const auto vertex = [&](const Vec3& x) {
    // + 0 makes one of the two zeros.
    const auto [entry, added] = made.try_emplace({x.x() + 0, x.y() + 0, x.z() + 0}, 0);
    if (added) entry->second = facets.vertex(x);
    return entry->second;
  };
  const auto stride = static_cast<std::size_t>(n + 1);
  for (const auto& p : surface.patches) {
    std::vector<Index> grid;
    for (int k = 0; k <= n; ++k)
      for (int l = 0; l <= n; ++l) {
        const auto u = bernstein(k, n), v = bernstein(l, n);
        std::array<Vec3, 4> row;
        for (std::size_t i = 0; i < 4; ++i)
          row[i] = blend(v, p[4 * i], p[4 * i + 1], p[4 * i + 2], p[4 * i + 3]);
        grid.push_back(vertex(blend(u, row[0], row[1], row[2], row[3])));
      }
    for (std::size_t k = 0; k + 1 < stride; ++k)
      for (std::size_t l = 0; l + 1 < stride; ++l) {
        const Index a = grid[k * stride + l], b = grid[(k + 1) * stride + l],
                    c = grid[(k + 1) * stride + l + 1], d = grid[k * stride + l + 1];
        // Edges of no length, as at the tip of a cone, leave one triangle.
        if (a != b && b != c && c != a) facets.face({a, b, c});
        if (a != c && c != d && d != a) facets.face({a, c, d});
      }
  }
}

std::pair<Vec3, Vec3> box(const BezierSurface& surface) {
  Vec3 lower = Vec3::Constant(HUGE_VAL), upper = -lower;
  for (const auto& patch : surface.patches)
    for (const Vec3& x : patch) {
      lower = lower.cwiseMin(x);
      upper = upper.cwiseMax(x);
    }
  return {lower, upper};
}

}  // namespace

double size(const CurvedShape& shape) {
  return std::visit(
      [](const auto& surface) {
        if constexpr (std::is_same_v<std::decay_t<decltype(surface)>, BezierSurface>) {
          const auto [lower, upper] = box(surface);
          return (upper - lower).norm() / 2;
        } else {
          return surface.radius;
        }
      },
      shape.surface);
}

Ball enclosing_ball(const CurvedShape& shape) {
  if (const auto* const cylinder = std::get_if<Cylinder>(&shape.surface))
    return {(cylinder->base + cylinder->top) / 2,
            std::hypot((cylinder->top - cylinder->base).norm() / 2, cylinder->radius)};
  if (const auto* const bezier = std::get_if<BezierSurface>(&shape.surface)) {
    const auto [lower, upper] = box(*bezier);
    return {(lower + upper) / 2, (upper - lower).norm() / 2};
  }
  if (const auto* const disk = std::get_if<Disk>(&shape.surface)) return {disk->centre, disk->radius};
  const auto& sphere = std::get<Sphere>(shape.surface);
  return {sphere.centre, sphere.radius};
}

void tessellate(const CurvedShape& shape, double chord_error, Index material, Scene::Arrays& arrays) {
  Facets facets(shape, material, arrays);
  facets.require_positive(chord_error, "chord error");
  std::visit([&](const auto& surface) { add(surface, chord_error, facets); }, shape.surface);
}

}  // namespace radiosity
