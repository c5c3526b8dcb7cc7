// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "interpolation.hpp"
#include "pipelines.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "ray_caster.hpp"

namespace radiosity {
namespace {

/// Recursive ray tracing [Whitted1980], its recursion a list of rays that wait:
///   I = E + ρ (H_a + Σ S_i f_att I_i (N·L)) + Σ S_i f_att I_i k_s (R·V)ⁿ + k_s I_r + k_t I_t
/// in W/m². Over a solution its radiosity takes the place of E + ρ (…), so that only mirrors and glass are added, and lights that are no
/// surfaces, which no solution knows. S_i is the product of
/// k_t of what stands between point and light, whose rays are not refracted. Where a surface is dull (n < kMirrorLike), k_s I_r is left
/// out; where it is not, it shows emitting surfaces, and their lights make no highlight. What is totally reflected adds k_t to k_s. Where indices depend on the band,
/// each band has a ray of its own from there on.
/// Normals are interpolated between the vertices.
class RayTracing final : public Pipeline {
 public:
  RayTracing(ViewScene drawn, const PipelineOptions& options)
      : Pipeline(std::move(drawn)),
        caster_(mesh()),
        options_(options),
        normals_(mesh().vertex_count(), 3),
        ambient_(scene().ambient.size() > 0 ? Bands(scene().ambient.transpose())
                                            : Bands(Bands::Zero(mesh().bands()))) {
    const std::vector<Vec3> normals = vertex_normals(mesh());
    for (Index v = 0; v < mesh().vertex_count(); ++v) normals_.row(v) = normals[v].transpose().array();
    for (const Light& light : scene().lights) {
      intensities_.push_back(light.intensity.transpose());
      other_lights_ = other_lights_ || !light.surface;
    }
  }

 private:
  using Bands = Finish::Bands;
  using Row = Eigen::Ref<Bands>;
  struct Ray {
    Vec3 origin, direction;
    Index from;
    int depth;  // surfaces met so far
    Bands weight;
  };

  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    tbb::parallel_for(0, grid.rows(), [&](int row) {
      if (grid.stopped()) return;
      std::vector<Ray> waiting;
      for (int column = 0; column < grid.columns(); ++column) {
        waiting.push_back({eye.position(), eye.direction(grid.u(column), grid.v(row)).normalized(),
                           Visibility::kNothing, 0, Bands::Ones(mesh().bands())});
        while (!waiting.empty()) {
          const Ray ray = std::move(waiting.back());
          waiting.pop_back();
          follow(ray, waiting, values.row(static_cast<Eigen::Index>(row) * grid.columns() + column));
        }
      }
    });
  }

  void follow(const Ray& ray, std::vector<Ray>& waiting, Row sum) const {
    const auto hit = caster_.cast(ray.origin, ray.direction, ray.from);
    if (!hit) return;
    const Finish& finish = caster_.finish(hit->patch);
    if (!hit->front && !finish.lets_through) return;  // the backs of other surfaces are black
    Bands weight = ray.weight;
    if (options_.classical_attenuation && ray.depth > 0) weight *= std::min(1.0, 1 / hit->distance);

    const Vec3 n = normal(*hit, ray.direction);
    Vec3 mirror = mirrored(ray.direction, n);
    if (mirror.dot(hit->n) <= 0) mirror = mirrored(ray.direction, hit->n);
    const bool glossy = (finish.mirrored > 0).any();
    const bool mirror_like = finish.shininess >= tolerance::kMirrorLike;
    if (hit->front) {
      if (scene().vertex_radiosity)
        sum += weight * interpolate(mesh(), *scene().vertex_radiosity, hit->patch, hit->x).transpose();
      else
        sum += weight * (finish.emission + finish.diffuse * ambient_);
      if (!scene().vertex_radiosity || other_lights_ || (glossy && std::isfinite(finish.shininess)))
        add_lights(*hit, finish, n, mirror, mirror_like, weight, sum);
    }

    Bands reflected = mirror_like ? Bands(weight * finish.mirrored) : Bands(Bands::Zero(weight.size()));
    if (finish.lets_through) {
      const auto refract = [&](Index band, Bands light) {
        auto way = caster_.through(*hit, n, ray.direction, band);
        if (way && way->dot(hit->n) >= 0) way = caster_.through(*hit, hit->n, ray.direction, band);
        if (way)
          add(waiting, *hit, *way, ray.depth, std::move(light));
        else
          reflected += light;
      };
      const Bands transmitted = weight * finish.transmitted;
      if (caster_.disperses(hit->patch)) {
        for (Index b = 0; b < mesh().bands(); ++b) {
          Bands light = Bands::Zero(weight.size());
          light[b] = transmitted[b];
          if (light[b] > 0) refract(b, std::move(light));
        }
      } else {
        refract(0, transmitted);
      }
    }
    add(waiting, *hit, mirror, ray.depth, std::move(reflected));
  }

  void add(std::vector<Ray>& waiting, const SurfaceHit& hit, const Vec3& direction, int depth,
           Bands weight) const {
    if (depth + 1 < options_.depth && weight.maxCoeff() > tolerance::kLeastShare)
      waiting.push_back({hit.x, direction, hit.patch, depth + 1, std::move(weight)});
  }

  /// Interpolated, or that of the patch where the other would look away from the ray.
  Vec3 normal(const SurfaceHit& hit, const Vec3& direction) const {
    const BandValues between = interpolate(mesh(), normals_, hit.patch, hit.x);
    const Vec3 n = Vec3(between[0], between[1], between[2]).normalized() * (hit.front ? 1 : -1);
    return n.dot(direction) < 0 ? n : hit.n;
  }

  void add_lights(const SurfaceHit& hit, const Finish& finish, const Vec3& n, const Vec3& mirror,
                  bool mirror_like, const Bands& weight, Row sum) const {
    for (std::size_t k = 0; k < intensities_.size(); ++k) {
      const Light& light = scene().lights[k];
      const Arriving arrived = arriving(light, hit.x);
      const double cosine = n.dot(arrived.to);
      double share = arrived.share;
      if (options_.classical_attenuation) share = std::min(1.0, share);
      if (!(share > 0 && cosine > 0 && hit.n.dot(arrived.to) > 0)) continue;
      const double lobe = std::isfinite(finish.shininess) && !(mirror_like && light.surface)
                              ? std::pow(std::max(0.0, mirror.dot(arrived.to)), finish.shininess)
                              : 0;
      Bands given = lobe * finish.mirrored;
      if (!scene().vertex_radiosity || !light.surface) given += cosine * finish.diffuse;
      if (!(given > 0).any()) continue;
      given *= weight * share * intensities_[k];
      caster_.dim(hit, arrived.to, arrived.distance, given);  // S_i
      sum += given;
    }
  }

  RayCaster caster_;
  PipelineOptions options_;
  BandArray normals_;  // vertices × 3
  Bands ambient_;
  std::vector<Bands> intensities_;  // of the lights
  bool other_lights_ = false;       // some are no surfaces
};

}  // namespace

std::unique_ptr<Pipeline> make_ray_tracing(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<RayTracing>(std::move(scene), options);
}

}  // namespace radiosity
