// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/path_traced.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "pipelines.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "ray_caster.hpp"

namespace radiosity {
namespace {

using std::numbers::pi;
using Row = Eigen::Ref<Eigen::Array<double, 1, Eigen::Dynamic>>;
constexpr double kDelta = std::numeric_limits<double>::infinity();

/// Points on all that emits, chosen by power: with density p = max E / P per area, P = Σ A max E.
class Emitters {
 public:
  explicit Emitters(const PatchMesh& mesh) : mesh_(mesh) {
    for (Index j = 0; j < mesh.patch_count(); ++j) {
      const double emitted = mesh.material_of(j).emission.maxCoeff();
      if (!(emitted > 0)) continue;
      for (const auto& t : mesh.triangles(j)) {
        const Vec3& a = mesh.vertex(t[0]);
        const Vec3 ab = mesh.vertex(t[1]) - a, ac = mesh.vertex(t[2]) - a;
        power_ += emitted * ab.cross(ac).norm() / 2;
        triangles_.push_back({j, a, ab, ac, power_});
      }
    }
  }

  bool empty() const { return triangles_.empty(); }
  double density(Index patch) const { return mesh_.material_of(patch).emission.maxCoeff() / power_; }

  struct Point {
    Index patch;
    Vec3 x;
  };
  Point sample(RandomStream& random) const {
    const double where = random.uniform() * power_;
    const Triangle& t =
        *std::upper_bound(triangles_.begin(), triangles_.end() - 1, where,
                          [](double p, const Triangle& triangle) { return p < triangle.power_up_to; });
    const double root = std::sqrt(random.uniform()), s = random.uniform();
    return {t.patch, t.a + root * (1 - s) * t.ab + root * s * t.ac};
  }

 private:
  struct Triangle {
    Index patch;
    Vec3 a, ab, ac;
    double power_up_to;
  };
  const PatchMesh& mesh_;
  std::vector<Triangle> triangles_;
  double power_ = 0;
};

/// The rendering equation [Kajiya1986] by random paths from the eye. A surface has the BRDF
///   f = ρ/π + k_s (n + 1)/(2π) cosⁿα / max(cosθ_i, cosθ_o),   α the angle to the mirror's direction,
/// whose second part gives back at most k_s and becomes a mirror as n → ∞ [Neumann1999], and refracts the share k_t by Snell's law, which
/// is mirrored where all is reflected. All this holds for light from behind as well, where light is let through. Where the surface is a
/// sheet, with a patch on either side, it is thin, and light goes straight through it. Transported is L / η², so that what refraction
/// does to radiance needs no factor. Lights that are no surfaces are looked for from each point, straight through sheets; no path that is
/// refracted or mirrored on its way could find them. Light of emitters is found from each point by two ways, a point on them and the next
/// direction of the path, which share it by the balance heuristic [VeachGuibas1995]. A path goes on with the share of its light that
/// does, in the band where that is most (Russian roulette), and weighs the more: no bias. Where indices depend on the band, it goes on
/// with one of them.
class PathTracing final : public Pipeline {
 public:
  PathTracing(ViewScene drawn, const PipelineOptions& options)
      : Pipeline(std::move(drawn)), caster_(mesh()), emitters_(mesh()), seed_(options.seed) {
    for (const Light& light : scene().lights)
      if (!light.surface) lights_.emplace_back(light, light.intensity.transpose());
  }

  Index bands() const { return mesh().bands(); }

  /// One estimate of the irradiance at a place, added to `sum`.
  void irradiance(const Place& place, RandomStream& random, Row sum) const {
    const Bands none = Bands::Zero(mesh().bands());
    const Finish white{none + 1, none, none, none, kDelta, none + 1, false, false};
    const Vec3 n = place.normal.normalized();
    const Rough rough{n, n, 1, 0, kDelta};
    Bands weight = white.diffuse;
    add_direct({place.patch, true, 0, place.position, n}, rough, white, weight, random, sum);
    const Vec3 d = cosine_direction(n, random);
    path(place.position, d, place.patch, rough.density(d), random, weight, sum);
  }

 private:
  using Bands = Finish::Bands;

  std::uint64_t rays() const override { return caster_.rays(); }

  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    tbb::parallel_for(0, grid.rows(), [&](int row) {
      if (grid.stopped()) return;
      Bands weight(mesh().bands());
      for (int column = 0; column < grid.columns(); ++column) {
        const std::uint64_t pixel =
            static_cast<std::uint64_t>(row * grid.stride) * static_cast<std::uint64_t>(grid.width) +
            static_cast<std::uint64_t>(column * grid.stride);
        RandomStream random(seed_, pixel << 32 | static_cast<std::uint64_t>(grid.sample));
        weight.setOnes();
        path(eye.position(), eye.direction(grid.u(column), grid.v(row)).normalized(), Visibility::kNothing,
             kDelta, random, weight, values.row(static_cast<Eigen::Index>(row) * grid.columns() + column));
      }
    });
  }

  /// Adds what arrives along one path, by the weight that it has. `density` of its direction is per solid angle, infinite where it is
  /// the only one.
  void path(Vec3 origin, Vec3 d, Index from, double density, RandomStream& random, Bands& weight,
            Row sum) const {
    for (int k = 0; k < tolerance::kLongestPath; ++k) {
      const auto hit = caster_.cast(origin, d, from);
      if (!hit) return;
      const Finish& finish = caster_.finish(hit->patch);
      if (hit->front && (finish.emission > 0).any())
        sum += weight * finish.emission * share_of_direction(*hit, d, density);

      // The chances of what may happen here.
      if (!hit->front && !finish.lets_through) return;  // other backs are black
      const double most = weight.maxCoeff();
      double diffuse = (weight * finish.diffuse).maxCoeff() / most;
      double gloss = (weight * finish.mirrored).maxCoeff() / most;
      double through = (weight * finish.transmitted).maxCoeff() / most;
      const double total = diffuse + gloss + through;
      if (!(total > 0)) return;
      for (double* chance : {&diffuse, &gloss, &through}) *chance /= std::max(1.0, total);

      const bool mirror_like = std::isinf(finish.shininess);
      const Vec3 mirror = mirrored(d, hit->n);
      const Rough rough{hit->n, mirror, diffuse, mirror_like ? 0 : gloss, finish.shininess};
      if (rough.diffuse + rough.lobe > 0) {
        add_direct(*hit, rough, finish, weight, random, sum);
        add_lights(*hit, rough, finish, weight, sum);
      }

      const double event = random.uniform();
      origin = hit->x;
      from = hit->patch;
      if (event < through) {
        weight *= finish.transmitted / through;
        density = kDelta;
        const Index band = caster_.disperses(hit->patch) ? one_band(weight, random) : 0;
        d = caster_.through(*hit, hit->n, d, band).value_or(mirror);
      } else if (event >= through + diffuse + gloss) {
        return;
      } else if (mirror_like && event >= through + diffuse) {
        weight *= finish.mirrored / gloss;
        density = kDelta;
        d = mirror;
      } else {
        d = event < through + diffuse ? cosine_direction(hit->n, random)
                                      : lobe_direction(mirror, finish.shininess, random);
        density = rough.density(d);
        const double cosine = hit->n.dot(d);
        if (!(cosine > 0 && density > 0)) return;
        rough.weigh(finish, d, cosine / density, weight);
      }
      if (!(weight.maxCoeff() > 0)) return;
    }
  }

  /// Leaves one band of the weight, chosen by its share of the sum, which it then has: the mean is what all had.
  static Index one_band(Bands& weight, RandomStream& random) {
    const double sum = weight.sum();
    double left = random.uniform() * sum;
    Index band = 0;
    const auto last = static_cast<Index>(weight.size()) - 1;
    while (band < last && left >= weight[band]) left -= weight[band++];
    while (band > 0 && weight[band] == 0) --band;  // rounding went past the last that has any
    weight.setZero();
    weight[band] = sum;
    return band;
  }

  /// Diffuse reflection and gloss at a point, with their chances.
  struct Rough {
    Vec3 n, mirror;
    double diffuse, lobe, exponent;

    /// (n + 1)/(2π) cosⁿα
    double about_mirror(const Vec3& d) const {
      return (exponent + 1) / (2 * pi) * std::pow(std::max(0.0, mirror.dot(d)), exponent);
    }
    /// Per solid angle, with which the path goes on along d.
    double density(const Vec3& d) const {
      double p = diffuse * std::max(0.0, n.dot(d)) / pi;
      if (lobe > 0) p += lobe * about_mirror(d);
      return p;
    }
    /// weight · f(d) · factor
    void weigh(const Finish& finish, const Vec3& d, double factor, Bands& weight) const {
      if (lobe > 0) {
        const double gloss = factor * about_mirror(d) / std::max(n.dot(mirror), n.dot(d));
        weight *= factor / pi * finish.diffuse + gloss * finish.mirrored;
      } else {
        weight *= factor / pi * finish.diffuse;
      }
    }
  };

  /// Light of a point on the emitters, A f E cosθ cosθ' / r² with the share that is left to this way.
  void add_direct(const SurfaceHit& at, const Rough& rough, const Finish& finish, const Bands& weight,
                  RandomStream& random, Row sum) const {
    if (emitters_.empty()) return;
    const Emitters::Point point = emitters_.sample(random);
    const Vec3 way = point.x - at.x;
    const double r = way.norm();
    const Vec3 d = way / r;
    const double cosine = at.n.dot(d), emitted = -mesh().normal(point.patch).dot(d);
    if (!(r > 0 && cosine > 0 && emitted > 0)) return;
    if (!caster_.reaches(at.x, d, at.patch, r)) return;
    const double density = emitters_.density(point.patch) * r * r / emitted;  // per solid angle
    Bands light = weight;
    rough.weigh(finish, d, cosine / (density + rough.density(d)), light);
    sum += light * caster_.finish(point.patch).emission;
  }

  /// Light without extent: π f cosθ H.
  void add_lights(const SurfaceHit& at, const Rough& rough, const Finish& finish, const Bands& weight,
                  Row sum) const {
    for (const auto& [light, intensity] : lights_) {
      const Arriving arrived = arriving(light, at.x);
      const double cosine = at.n.dot(arrived.to);
      if (!(cosine > 0 && arrived.share > 0)) continue;
      Bands given = weight;
      rough.weigh(finish, arrived.to, pi * cosine * arrived.share, given);
      given *= intensity;
      caster_.dim(at, arrived.to, arrived.distance, given, true);
      sum += given;
    }
  }

  /// What is left to directions of the light of an emitter that one has met.
  double share_of_direction(const SurfaceHit& hit, const Vec3& d, double density) const {
    if (density == kDelta) return 1;
    const double of_point = emitters_.density(hit.patch) * hit.distance * hit.distance / -hit.n.dot(d);
    return density / (density + of_point);
  }

  static Vec3 around(const Vec3& axis, double cosine, RandomStream& random) {
    Vec3 t, b;
    tangents(axis, t, b);
    const double angle = 2 * pi * random.uniform(), sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return sine * std::cos(angle) * t + sine * std::sin(angle) * b + cosine * axis;
  }
  static Vec3 cosine_direction(const Vec3& n, RandomStream& random) {
    return around(n, std::sqrt(1 - random.uniform()), random);
  }
  /// With density (n + 1)/(2π) cosⁿα.
  static Vec3 lobe_direction(const Vec3& mirror, double exponent, RandomStream& random) {
    return around(mirror, std::pow(1 - random.uniform(), 1 / (exponent + 1)), random);
  }

  RayCaster caster_;
  Emitters emitters_;
  std::vector<std::pair<Light, Bands>> lights_;  // without extent, and their intensity as a row
  std::uint64_t seed_;
};

}  // namespace

PathTraced path_traced(std::shared_ptr<const PatchMesh> mesh, std::span<const Place> places, Index paths,
                       std::uint64_t seed) {
  if (paths < 2) throw InputError(fmt::format("{} paths: a standard error needs at least two", paths));
  const PathTracing tracing({std::move(mesh)}, {});
  const auto count = static_cast<Eigen::Index>(places.size());
  PathTraced result{BandArray(count, tracing.bands()), BandArray(count, tracing.bands())};
  tbb::parallel_for(Eigen::Index{0}, count, [&](Eigen::Index s) {
    Finish::Bands sum = Finish::Bands::Zero(tracing.bands()), squares = sum, h = sum;
    for (Index k = 0; k < paths; ++k) {
      RandomStream random(seed, static_cast<std::uint64_t>(s) << 32 | static_cast<std::uint64_t>(k));
      h.setZero();
      tracing.irradiance(places[s], random, h);
      sum += h;
      squares += h.square();
    }
    const double n = paths;
    result.irradiance.row(s) = sum / n;
    result.standard_error.row(s) = ((squares / n - (sum / n).square()).max(0) / (n - 1)).sqrt();
  });
  return result;
}

std::unique_ptr<Pipeline> make_path_tracing(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<PathTracing>(std::move(scene), options);
}

}  // namespace radiosity
