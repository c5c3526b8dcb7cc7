// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "commands.hpp"
#include "radiosity/io/png.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/pipeline.hpp"
#include "radiosity/rendering/render.hpp"
#include "stages.hpp"

namespace radiosity::app {
namespace {

struct Shown {
  ViewScene scene;
  std::optional<double> exposure;
  std::optional<Camera> camera;  ///< the scene file's
  bool converged = true;
};

ViewScene view_scene(PatchMesh patches, std::optional<BandArray> vertex_radiosity) {
  const auto mesh = std::make_shared<const PatchMesh>(std::move(patches));
  return {mesh, std::move(vertex_radiosity), lights_of_emitters(*mesh), ambient_irradiance(*mesh)};
}

/// A .vtp without radiosity arrays is a mesh like any other.
std::optional<Shown> read_solved(Job& job) {
  const std::filesystem::path& file = job.options.scene;
  if (file.extension() != ".vtp" || !std::filesystem::is_regular_file(file)) return {};
  job.stage.lap();
  try {
    SolvedMesh solved = read_solution(file);
    job.report.seconds.read = job.stage.lap();
    job.console.line("solution", "{}, {} patches", file.string(), solved.mesh.patch_count());
    const double exposure =
        solved.exposure ? *solved.exposure : automatic_exposure(solved.mesh, solved.patch_radiosity);
    return Shown{view_scene(std::move(solved.mesh), std::move(solved.vertex_radiosity)), exposure, {}};
  } catch (const IoError&) {
    return {};
  }
}

Shown show_scene(Job& job, const PipelineInfo& pipeline) {
  const LoadedScene loaded = read_stage(job, job.options.scene);
  if (!pipeline.solved) {
    Patches patches = make_patches(loaded.scene, KeepFaces{});
    warn(job, patches.warnings);
    return {view_scene(std::move(patches.mesh), {}), {}, loaded.settings.camera};
  }
  SolvedScene solved = solve_stage(job, {loaded.scene, {}, {}, {}, {}}, loaded.settings);
  const double exposure = automatic_exposure(solved.patches.mesh, solved.solution.radiosity);
  SolvedScene::Told told = solved.told_of_setup(0);
  return {view_scene(std::move(told.mesh), std::move(told.solution.vertex_radiosity)), exposure,
          loaded.settings.camera, job.report.converged};
}

std::optional<Camera> camera_of(const std::filesystem::path& scene_file) {
  if (scene_file.empty()) return {};
  auto camera = read_scene(scene_file).settings.camera;
  if (!camera)
    throw InputError(fmt::format("{}: --scene needs a scene file with a [camera]", scene_file.string()));
  return camera;
}

Camera override_camera(Camera camera, const Options::View& view) {
  camera.position = view.position.value_or(camera.position);
  camera.target = view.target.value_or(camera.target);
  camera.up = view.up.value_or(camera.up);
  camera.vertical_fov_deg = view.vertical_fov_deg.value_or(camera.vertical_fov_deg);
  return camera;
}

/// What tells the exposure of a scene that was not solved.
LinearImage coarse(const Pipeline& pipeline, const Camera& camera, DrawOptions options) {
  options.width = std::max(1, options.width / 4);
  options.height = std::max(1, options.height / 4);
  options.samples = 1;
  return pipeline.draw(camera, options);
}

}  // namespace

int run_view(const Options& options) {
  Job job(options);
  check_outputs(options, ".png");
  std::optional<Camera> wanted = camera_of(options.view.camera_file);
  const Options::View& view = options.view;
  const PipelineInfo& info = find_pipeline(view.pipeline);
  auto solved = read_solved(job);
  Shown shown = solved ? *std::move(solved) : show_scene(job, info);

  if (!wanted) wanted = shown.camera;
  const Camera camera = override_camera(wanted ? *wanted : automatic_camera(*shown.scene.mesh), view);
  job.console.line("camera", "at {:.4g} {:.4g} {:.4g}, towards {:.4g} {:.4g} {:.4g}, {:.4g}° high",
                   camera.position.x(), camera.position.y(), camera.position.z(), camera.target.x(),
                   camera.target.y(), camera.target.z(), camera.vertical_fov_deg);
  const std::unique_ptr<Pipeline> pipeline = info.make(std::move(shown.scene));
  DrawOptions draw{.width = view.width, .height = view.height, .samples = view.samples};
  const double exposure = view.exposure    ? *view.exposure
                          : shown.exposure ? *shown.exposure
                                           : automatic_exposure(coarse(*pipeline, camera, draw));
  if (!info.random) draw.brightest = 1 / exposure;
  job.console.line("image", "{} × {} pixels by {}, {} samples each, exposure {:.4g} /(W/m²)", view.width,
                   view.height, info.name, view.samples, exposure);
  Outputs outputs(job);
  job.stage.lap();
  outputs.will_write(options.output);
  write_png(options.output, tone_map(pipeline->draw(camera, draw), exposure));
  outputs.finish();
  return shown.converged ? kDone : kNotConverged;
}

}  // namespace radiosity::app
