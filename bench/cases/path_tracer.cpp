// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/path_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "cases/scenes.hpp"

namespace radiosity::test {
namespace {

class Tracer {
 public:
  Tracer(const Visibility& visibility, std::uint64_t seed)
      : visibility_(visibility), mesh_(visibility.mesh()), random_(seed) {
    for (Index j = 0; j < mesh_.patch_count(); ++j) {
      if (!(mesh_.material_of(j).emission > 0).any()) continue;
      for (const auto& t : mesh_.triangles(j)) {
        const Vec3& a = mesh_.vertex(t[0]);
        const Vec3 b = mesh_.vertex(t[1]) - a, c = mesh_.vertex(t[2]) - a;
        area_ += b.cross(c).norm() / 2;
        lamps_.push_back({j, a, b, c, area_});
      }
    }
  }

  BandValues path(Vec3 x, Vec3 n, Index patch) {
    BandValues sum = BandValues::Zero(mesh_.bands()), weight = BandValues::Ones(mesh_.bands());
    for (;;) {
      add_direct(x, n, patch, weight, sum);
      const double r = std::sqrt(draw()), angle = 2 * std::numbers::pi * draw();
      const Vec3 u = n.unitOrthogonal(), v = n.cross(u);
      const Vec3 d = r * std::cos(angle) * u + r * std::sin(angle) * v + std::sqrt(1 - r * r) * n;
      Visibility::Packet ray;
      ray.from = patch;
      ray.count = 1;
      set(x, ray.x, ray.y, ray.z);
      ray.dx[0] = static_cast<float>(d.x());
      ray.dy[0] = static_cast<float>(d.y());
      ray.dz[0] = static_cast<float>(d.z());
      visibility_.first_hits(ray);
      if (ray.hit[0] < 0) return sum;
      patch = ray.hit[0];
      const BandValues& reflectance = mesh_.material_of(patch).reflectance;
      const double survival = reflectance.maxCoeff();
      if (draw() >= survival) return sum;
      weight *= reflectance / survival;
      x += static_cast<double>(ray.distance[0]) * mesh_.diagonal() * d;
      n = mesh_.normal(patch);
      x -= n.dot(x - mesh_.centroid(patch)) * n;  // the ray was in single precision
    }
  }

 private:
  struct Triangle {
    Index patch;
    Vec3 a, b, c;
    double area_up_to;
  };
  using Lane = std::array<float, 16>;

  double draw() { return uniform(random_); }

  void set(const Vec3& point, Lane& x, Lane& y, Lane& z) const {
    const Eigen::Vector3f p = visibility_.scaled(point).cast<float>();
    x[0] = p.x();
    y[0] = p.y();
    z[0] = p.z();
  }

  void add_direct(const Vec3& x, const Vec3& n, Index patch, const BandValues& weight, BandValues& sum) {
    if (lamps_.empty()) return;
    const double where = draw() * area_;
    const Triangle& t =
        *std::upper_bound(lamps_.begin(), lamps_.end() - 1, where,
                          [](double value, const Triangle& triangle) { return value < triangle.area_up_to; });
    const double root = std::sqrt(draw()), s = draw();
    const Vec3 z = t.a + root * (1 - s) * t.b + root * s * t.c;
    const Vec3 r = z - x;
    const double cosines = n.dot(r) * -mesh_.normal(t.patch).dot(r);
    if (n.dot(r) <= 0 || cosines <= 0) return;
    Visibility::SightLines line;
    line.from = patch;
    line.to = t.patch;
    line.count = 1;
    set(x, line.x, line.y, line.z);
    set(z, line.tx, line.ty, line.tz);
    visibility_.blocked(line);
    const double r2 = r.squaredNorm();
    if (!line.blocked[0])
      sum += weight * mesh_.material_of(t.patch).emission * (area_ * cosines / (std::numbers::pi * r2 * r2));
  }

  const Visibility& visibility_;
  const PatchMesh& mesh_;
  std::mt19937_64 random_;
  std::vector<Triangle> lamps_;
  double area_ = 0;
};

}  // namespace

PathTraced path_traced(const Visibility& visibility, const Sensor& sensor, Index patch, Index paths,
                       std::uint64_t seed) {
  Tracer tracer(visibility, seed);
  const Index bands = visibility.mesh().bands();
  BandValues sum = BandValues::Zero(bands), squares = sum;
  const Vec3 n = sensor.normal.normalized();
  for (Index k = 0; k < paths; ++k) {
    const BandValues h = tracer.path(sensor.position, n, patch);
    sum += h;
    squares += h.square();
  }
  const double count = paths;
  const BandValues mean = sum / count;
  return {mean, ((squares / count - mean.square()).max(0) / (count - 1)).sqrt()};
}

}  // namespace radiosity::test
