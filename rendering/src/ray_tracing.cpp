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
/// surfaces, which no solution knows. S_i is the product of k_t of what stands between point and light, whose rays are not refracted.
/// Where a surface is dull (n < kMirrorLike), k_s I_r is left out; where it is not, it shows emitting surfaces, and their lights make no
/// highlight. What is totally reflected adds k_t to k_s. Where indices depend on the band, each band has a ray of its own from there on.
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
    lights_ = scene().lights;
    surfaces_ =
        static_cast<std::size_t>(std::stable_partition(lights_.begin(), lights_.end(),
                                                       [](const Light& light) { return light.surface; }) -
                                 lights_.begin());
    divide(lights_, 0, surfaces_);
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

  /// A light's share of its intensity that reaches the eye from a point, in a band with weight 1: diffusely, and about the mirror's
  /// direction.
  struct Share {
    double diffuse = 0, lobe = 0;
  };

  /// Lights [first, last) that are asked for their shadow together, where one of them stands.
  struct Cluster {
    std::size_t first, last, light;
    double most;  // that they could add without it, each in its brightest band
    Bands free;   // the share that comes through at `light`
    bool operator<(const Cluster& other) const {
      return most < other.most || (most == other.most && first > other.first);
    }
  };
  struct Shadows {
    Bands shown, diffuse, glossy, given;  // kept, as memory takes time
    std::vector<Share> shares;            // of the lights
    std::vector<double> up_to;            // sums of what the lights before each could add
    std::vector<Cluster> queue;           // the brightest on top
  };

  std::uint64_t rays() const override { return caster_.rays(); }

  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    tbb::parallel_for(0, grid.rows(), [&](int row) {
      if (grid.stopped()) return;
      std::vector<Ray> waiting;
      Shadows shadows;
      for (int column = 0; column < grid.columns(); ++column) {
        waiting.push_back({eye.position(), eye.direction(grid.u(column), grid.v(row)).normalized(),
                           Visibility::kNothing, 0, Bands::Ones(mesh().bands())});
        while (!waiting.empty()) {
          const Ray ray = std::move(waiting.back());
          waiting.pop_back();
          follow(ray, waiting, shadows, values.row(static_cast<Eigen::Index>(row) * grid.columns() + column));
        }
      }
    });
  }

  void follow(const Ray& ray, std::vector<Ray>& waiting, Shadows& shadows, Row sum) const {
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
      Bands& shown = shadows.shown;
      if (scene().vertex_radiosity)
        shown = weight * interpolate(mesh(), *scene().vertex_radiosity, hit->patch, hit->x).transpose();
      else
        shown = weight * (finish.emission + finish.diffuse * ambient_);
      sum += shown;
      if (!scene().vertex_radiosity || surfaces_ < lights_.size() ||
          (glossy && std::isfinite(finish.shininess)))
        add_lights(*hit, finish, n, mirror, mirror_like, weight, shadows, sum);
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

  Share unshadowed(const Light& light, const SurfaceHit& hit, const Finish& finish, const Vec3& n,
                   const Vec3& mirror, bool mirror_like) const {
    const Arriving arrived = arriving(light, hit.x);
    const double cosine = n.dot(arrived.to);
    double share = arrived.share;
    if (options_.classical_attenuation) share = std::min(1.0, share);
    if (!(share > 0 && cosine > 0 && hit.n.dot(arrived.to) > 0)) return {};
    Share result;
    if (std::isfinite(finish.shininess) && !(mirror_like && light.surface))
      result.lobe = share * std::pow(std::max(0.0, mirror.dot(arrived.to)), finish.shininess);
    if (!scene().vertex_radiosity || !light.surface) result.diffuse = share * cosine;
    return result;
  }

  /// What lights add without shadows is summed up for each; whether something stands in between, for clusters of them, as in a cut
  /// through a tree of lights [Walter2005]: the brightest cluster is halved until none could add more than the share kDimLights of what
  /// the point then shows, `shown` and what the lights add. So a shadow's edge is off by at most that for each cluster it goes through,
  /// and a light that adds more is asked for by itself.
  void add_lights(const SurfaceHit& hit, const Finish& finish, const Vec3& n, const Vec3& mirror,
                  bool mirror_like, const Bands& weight, Shadows& shadows, Row sum) const {
    auto& [shown, diffuse, glossy, given, shares, up_to, queue] = shadows;
    diffuse = weight * finish.diffuse;
    glossy = weight * finish.mirrored;
    if (!(diffuse > 0).any() && !(glossy > 0).any()) return;
    shares.resize(lights_.size());
    up_to.assign(lights_.size() + 1, 0);
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      shares[k] = unshadowed(lights_[k], hit, finish, n, mirror, mirror_like);
      double most = 0;
      if (shares[k].diffuse > 0 || shares[k].lobe > 0)
        for (Eigen::Index b = 0; b < weight.size(); ++b)
          most = std::max(
              most, (shares[k].lobe * glossy[b] + shares[k].diffuse * diffuse[b]) * lights_[k].intensity[b]);
      up_to[k + 1] = up_to[k] + most;
    }
    double found = shown.maxCoeff();
    const auto free = [&](std::size_t k) {
      Bands share = Bands::Ones(weight.size());
      const Arriving arrived = arriving(lights_[k], hit.x);
      caster_.dim(hit, arrived.to, arrived.distance, share);  // S_i
      return share;
    };
    const auto settle = [&](std::size_t first, std::size_t last, const Bands& share) {
      if (!(share > 0).any()) return;
      given.setZero(weight.size());
      for (std::size_t k = first; k < last; ++k)
        if (up_to[k + 1] > up_to[k])
          for (Eigen::Index b = 0; b < weight.size(); ++b)
            given[b] +=
                (shares[k].lobe * glossy[b] + shares[k].diffuse * diffuse[b]) * lights_[k].intensity[b];
      sum += given * share;
    };
    // Where the light of `parent` is one of them, its ray is theirs; otherwise the one in the middle of what they add.
    const auto ask = [&](std::size_t first, std::size_t last, const Cluster* parent) {
      const double most = up_to[last] - up_to[first];
      if (!(most > 0)) return;
      const bool known = parent && parent->light >= first && parent->light < last;
      std::size_t light = known ? parent->light : first;
      if (!known && last - first > 1) {
        const auto middle =
            std::upper_bound(up_to.begin() + static_cast<std::ptrdiff_t>(first) + 1,
                             up_to.begin() + static_cast<std::ptrdiff_t>(last), up_to[first] + most / 2);
        light = static_cast<std::size_t>(middle - up_to.begin()) - 1;
      }
      Bands share = known ? parent->free : free(light);
      found += most * share.maxCoeff();
      if (last - first == 1) {
        settle(first, last, share);
      } else {
        queue.push_back({first, last, light, most, std::move(share)});
        std::push_heap(queue.begin(), queue.end());
      }
    };
    queue.clear();
    ask(0, surfaces_, nullptr);
    for (std::size_t k = surfaces_; k < lights_.size(); ++k) ask(k, k + 1, nullptr);
    while (!queue.empty()) {
      std::pop_heap(queue.begin(), queue.end());
      const Cluster cluster = std::move(queue.back());
      queue.pop_back();
      if (cluster.most > tolerance::kDimLights * found) {
        found -= cluster.most * cluster.free.maxCoeff();
        const std::size_t middle = (cluster.first + cluster.last) / 2;
        ask(cluster.first, middle, &cluster);
        ask(middle, cluster.last, &cluster);
      } else {
        settle(cluster.first, cluster.last, cluster.free);
      }
    }
  }

  /// Lights in an order in which each half of the range, and each half of that, is near to itself: by the longest side of its box.
  static void divide(std::vector<Light>& lights, std::size_t first, std::size_t last) {
    if (last - first < 2) return;
    Vec3 lower = lights[first].position, upper = lower;
    for (std::size_t k = first; k < last; ++k) {
      lower = lower.cwiseMin(lights[k].position);
      upper = upper.cwiseMax(lights[k].position);
    }
    Eigen::Index axis = 0;
    (upper - lower).maxCoeff(&axis);
    const auto at = [&](std::size_t k) { return lights.begin() + static_cast<std::ptrdiff_t>(k); };
    std::stable_sort(at(first), at(last),
                     [axis](const Light& a, const Light& b) { return a.position[axis] < b.position[axis]; });
    divide(lights, first, (first + last) / 2);
    divide(lights, (first + last) / 2, last);
  }

  RayCaster caster_;
  PipelineOptions options_;
  BandArray normals_;  // vertices × 3
  Bands ambient_;
  std::vector<Light> lights_;
  std::size_t surfaces_;  // the first of them, in the order of `divide`
};

}  // namespace

std::unique_ptr<Pipeline> make_ray_tracing(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<RayTracing>(std::move(scene), options);
}

}  // namespace radiosity
