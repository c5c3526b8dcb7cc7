// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// SplitMix64 [Steele2014]: a stream of random numbers that costs nothing to start, one for each patch or
/// pair.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t stream) : state_(mix(seed + mix(stream + kGolden))) {}

  std::uint64_t next() { return mix(state_ += kGolden); }

  /// In [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

/// The k-th of `count` of n things: one in each of as many stretches, not at the same place in all of them, as what stands in rows is
/// alike.
inline Index one_of_stretch(Index k, Index count, Index n) {
  const double place = k + std::fmod(0.6180339887 * k, 1);  // by the golden ratio
  return static_cast<Index>(place * n / count);
}

/// A pair of numbers in [0, 1)².
struct Sample2 {
  double u, v;
};

/// Point k of the R2 sequence, shifted by `shift` on the torus: additive recurrence with the plastic number,
/// whose first N points fill the unit square more evenly than random ones for every N [Roberts2018].
inline Sample2 r2_point(std::uint64_t k, Sample2 shift) {
  constexpr double kPlastic = 1.32471795724474602596;
  const double n = static_cast<double>(k);
  const double u = shift.u + n / kPlastic;
  const double v = shift.v + n / (kPlastic * kPlastic);
  return {u - std::floor(u), v - std::floor(v)};
}

/// A point of i and a point of j together: point k of the additive recurrence in four dimensions with g⁵ = g + 1, the
/// same sequence as r2_point [Roberts2018]. Two 2-D sequences side by side would leave most pairs of points unvisited.
inline std::array<Sample2, 2> r4_points(std::uint64_t k, const std::array<double, 4>& shift) {
  constexpr double kG = 1.16730397826141868426;
  std::array<double, 4> x = shift;
  double step = 1;
  for (double& c : x) {
    step /= kG;
    c += static_cast<double>(k) * step;
    c -= std::floor(c);
  }
  return {{{x[0], x[1]}, {x[2], x[3]}}};
}

/// Maps [0,1)² to a patch so that equal areas get equal shares: first one of its triangles, by area, then uniformly
/// in it by (1 − √u, v√u).
class PatchSampler {
 public:
  PatchSampler(const PatchMesh& mesh, Index patch) {
    for (const auto& t : mesh.triangles(patch)) {
      const Vec3& a = mesh.vertex(t[0]);
      const Vec3 ab = mesh.vertex(t[1]) - a;
      const Vec3 ac = mesh.vertex(t[2]) - a;
      area_ += ab.cross(ac).norm() / 2;
      triangles_.push_back({a, ab, ac, area_});
    }
  }

  Vec3 at(Sample2 s) const {
    const double where = s.u * area_;
    double below = 0;
    for (const Triangle& t : triangles_) {
      if (where < t.area_up_to || &t == &triangles_.back()) {
        const double r = std::sqrt(std::min(1.0, (where - below) / (t.area_up_to - below)));
        return t.a + (1 - s.v) * r * t.ab + s.v * r * t.ac;
      }
      below = t.area_up_to;
    }
    return triangles_.front().a;  // not reached: every patch has a triangle
  }

 private:
  struct Triangle {
    Vec3 a, ab, ac;
    double area_up_to;
  };
  std::vector<Triangle> triangles_;
  double area_ = 0;
};

/// Two unit vectors that complete n to a right-handed frame.
inline void tangents(const Vec3& n, Vec3& t, Vec3& b) {
  t = (std::abs(n.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY()).cross(n).normalized();
  b = n.cross(t);
}

/// Area-preserving map of the unit square to the unit disk [ShirleyChiu1997]; squares stay nearly square.
inline Sample2 concentric_disk(Sample2 s) {
  const double a = 2 * s.u - 1;
  const double b = 2 * s.v - 1;
  if (a == 0 && b == 0) return {0, 0};
  constexpr double kQuarter = std::numbers::pi / 4;
  const bool steep = std::abs(a) <= std::abs(b);
  const double r = steep ? b : a;
  const double phi = steep ? 2 * kQuarter - kQuarter * (a / b) : kQuarter * (b / a);
  return {r * std::cos(phi), r * std::sin(phi)};
}

}  // namespace radiosity
