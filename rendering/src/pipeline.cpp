// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/pipeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "pipelines.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/find_named.hpp"
#include "ray_caster.hpp"

namespace radiosity {
namespace {

constexpr std::array<PipelineInfo, 6> kPipelines{{
    {"radiosity", "visible surfaces, vertex radiosities interpolated, no lighting step", "Goral1984", true,
     false, false, false, make_second_pass},
    {"gouraud", "z-buffer, local lighting of the vertices, interpolated; no shadows",
     "Gouraud1971, Catmull1974", false, false, false, true, make_gouraud},
    {"phong", "z-buffer, local lighting of each sample by interpolated normals; no shadows",
     "Phong1975, Catmull1974", false, false, false, true, make_phong},
    {"priority", "binary space partition, drawn back to front, lighting as phong; no shadows",
     "Fuchs1980, Phong1975", false, false, false, true, make_priority},
    {"ray-tracing", "mirrors and glass by recursive rays, over a solution or lights without extent",
     "Whitted1980", false, false, true, false, make_ray_tracing},
    {"path-tracing", "the rendering equation by random paths: the reference for all others", "Kajiya1986",
     false, true, false, false, make_path_tracing},
}};

/// A coarse image at full size: each pixel shows the sample of its square.
LinearImage enlarged(const SampleGrid& grid, const BandArray& values) {
  LinearImage image{grid.width, grid.height,
                    BandArray(static_cast<Eigen::Index>(grid.width) * grid.height, values.cols())};
  for (int y = 0, pixel = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x, ++pixel)
      image.radiosity.row(pixel) = values.row(y / grid.stride * grid.columns() + x / grid.stride);
  return image;
}

}  // namespace

void refuse_eye_in_matter(const PatchMesh& mesh, const Camera& camera) {
  constexpr int kDirections = 1000;  // spread over the sphere [Gonzalez2010]
  const RayCaster caster(mesh);
  std::optional<SurfaceHit> nearest;
  for (int k = 0; k < kDirections; ++k) {
    const double z = (2 * k + 1.0) / kDirections - 1, r = std::sqrt(1 - z * z);
    const double angle = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
    const auto hit = caster.cast(camera.position, {r * std::cos(angle), r * std::sin(angle), z});
    if (!hit || hit->front || caster.finish(hit->patch).lets_through) return;
    if (!nearest || hit->distance < nearest->distance) nearest = hit;
  }
  throw InputError(
      fmt::format("{}: at {:.6g} {:.6g} {:.6g} it is inside of a wall or a thing: whatever way it looks it "
                  "sees backs of surfaces, "
                  "which are black, the nearest {:.3g} m away of material '{}' (face {}). Move it before "
                  "fronts; or, where fronts "
                  "look the wrong way, a scene file may say flip = true or sides = \"both\"",
                  title(camera), camera.position.x(), camera.position.y(), camera.position.z(),
                  nearest->distance, mesh.material_of(nearest->patch).name, mesh.surface(nearest->patch)));
}

std::vector<Sample2> sample_places(Index n) {
  std::vector<Sample2> points, result(static_cast<std::size_t>(n));
  for (Index k = 0; k < n; ++k) points.push_back(r2_point(static_cast<std::uint64_t>(k), {0.5, 0.5}));
  for (double Sample2::*axis : {&Sample2::u, &Sample2::v}) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return points[a].*axis < points[b].*axis; });
    for (std::size_t k = 0; k < order.size(); ++k)
      result[order[k]].*axis = (static_cast<double>(k) + 0.5) / static_cast<double>(n);
  }
  return result;
}

Pipeline::Pipeline(ViewScene scene) : scene_(std::move(scene)) {
  validate(scene_);
}

LinearImage Pipeline::draw(const Camera& camera, const DrawOptions& options) const {
  const auto [width, height] = std::pair(options.width, options.height);
  if (width < 1 || height < 1 || options.samples < 1)
    throw InputError(fmt::format("image of {} x {} pixels with {} samples: all must be at least 1", width,
                                 height, options.samples));
  if (options.standard_error && options.samples < 2)
    throw InputError("a standard error needs at least two samples per pixel, not 1");
  const Pinhole eye(camera, width, height);
  BandArray values;
  bool first = true;
  /// False where it was stopped: then values are missing.
  const auto look = [&](SampleGrid grid) {
    values.setZero(static_cast<Eigen::Index>(grid.columns()) * grid.rows(), mesh().bands());
    if (!first && options.stop) grid.stop = &options.stop;
    sample(eye, grid, values);
    if (grid.stopped()) return false;
    if (std::exchange(first, false) && (values == 0).all()) refuse_eye_in_matter(mesh(), camera);
    values = values.min(options.brightest);
    return true;
  };
  LinearImage image{width, height, {}};
  const auto stopped = [&] {
    image.completed = false;
    return std::move(image);
  };
  if (options.refined)
    for (const int stride : {4, 2}) {
      const SampleGrid grid{width, height, stride, 0.5, 0.5, 0};
      if (!look(grid)) return stopped();
      image = enlarged(grid, values);
      if (!options.refined(image)) return stopped();
    }

  const std::uint64_t before = rays();
  const std::vector<Sample2> place = sample_places(options.samples);
  BandArray sum, squares;
  for (Index k = 0; k < options.samples; ++k) {
    const auto [x, y] = place[k];
    if (!look({width, height, 1, x, y, k})) return stopped();
    if (k == 0) {
      sum = values;
      if (options.standard_error) squares = values.square();
    } else {
      sum += values;
      if (options.standard_error) squares += values.square();
    }
    const double n = image.samples = k + 1;
    image.rays = rays() - before;
    const bool last = image.samples == options.samples;
    if (!last && !options.refined && !options.stop) continue;
    image.radiosity = sum / n;
    if (options.standard_error && k > 0)
      image.standard_error = ((squares / n - image.radiosity.square()).max(0) / (n - 1)).sqrt();
    if (options.refined && !options.refined(image) && !last) return stopped();
  }
  return image;
}

std::unique_ptr<Pipeline> PipelineInfo::make(ViewScene scene, const PipelineOptions& options) const {
  if (solved && !scene.vertex_radiosity)
    throw InputError(fmt::format("the pipeline '{}' shows a solution, and there is none", name));
  if (options.depth < 1)
    throw InputError(fmt::format("depth {}: rays must be followed to at least 1 surface", options.depth));
  if (!(options.attenuation_length > 0))
    throw InputError(fmt::format("attenuation length {} m: must be positive", options.attenuation_length));
  return factory(std::move(scene), options);
}

std::span<const PipelineInfo> pipelines() {
  return kPipelines;
}

const PipelineInfo& find_pipeline(std::string_view name) {
  return find_named(kPipelines, "pipeline", name);
}

}  // namespace radiosity
