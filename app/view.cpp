// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "commands.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/png.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "stages.hpp"

namespace radiosity::app {
namespace {

struct Lit {
  PatchMesh mesh;
  BandArray vertex_radiosity;
  double exposure;
  std::optional<Camera> camera;  ///< the scene file's
  bool converged = true;
};

/// A .vtp without radiosity arrays is a mesh like any other.
std::optional<Lit> read_solved(Job& job) {
  const std::filesystem::path& file = job.options.scene;
  if (file.extension() != ".vtp" || !std::filesystem::is_regular_file(file)) return {};
  job.stage.lap();
  try {
    SolvedMesh solved = read_solution(file);
    job.report.seconds.read = job.stage.lap();
    job.console.line("solution", "{}, {} patches", file.string(), solved.mesh.patch_count());
    const double exposure =
        solved.exposure ? *solved.exposure : automatic_exposure(solved.mesh, solved.patch_radiosity);
    return Lit{std::move(solved.mesh), std::move(solved.vertex_radiosity), exposure, {}};
  } catch (const IoError&) {
    return {};
  }
}

Lit solve_scene(Job& job) {
  const LoadedScene loaded = read_stage(job, job.options.scene);
  SolvedScene solved = solve_stage(job, {loaded.scene, {}, {}, {}, {}}, loaded.settings);
  const double exposure = automatic_exposure(solved.patches.mesh, solved.solution.radiosity);
  SolvedScene::Told told = solved.told_of_setup(0);
  return {std::move(told.mesh), std::move(told.solution.vertex_radiosity), exposure, loaded.settings.camera,
          job.report.converged};
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

}  // namespace

int run_view(const Options& options) {
  Job job(options);
  check_outputs(options, ".png");
  std::optional<Camera> wanted = camera_of(options.view.camera_file);
  auto solved = read_solved(job);
  const Lit lit = solved ? *std::move(solved) : solve_scene(job);

  const Options::View& view = options.view;
  if (!wanted) wanted = lit.camera;
  const Camera camera = override_camera(wanted ? *wanted : automatic_camera(lit.mesh), view);
  const double exposure = view.exposure.value_or(lit.exposure);
  job.console.line("camera", "at {:.4g} {:.4g} {:.4g}, towards {:.4g} {:.4g} {:.4g}, {:.4g}° high",
                   camera.position.x(), camera.position.y(), camera.position.z(), camera.target.x(),
                   camera.target.y(), camera.target.z(), camera.vertical_fov_deg);
  job.console.line("image", "{} × {} pixels, exposure {:.4g} /(W/m²)", view.width, view.height, exposure);
  Outputs outputs(job);
  job.stage.lap();
  outputs.will_write(options.output);
  write_png(options.output,
            render(Visibility(lit.mesh), lit.vertex_radiosity, camera, view.width, view.height, exposure));
  outputs.finish();
  return lit.converged ? kDone : kNotConverged;
}

}  // namespace radiosity::app
