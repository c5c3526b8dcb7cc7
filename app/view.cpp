// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "false_colour.hpp"
#include "radiosity/io/linear_image.hpp"
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
  SceneSettings settings;  ///< the scene file's, whose cameras are used
  bool converged = true;
};

ViewScene view_scene(PatchMesh patches, std::optional<BandArray> vertex_radiosity,
                     std::span<const Light> more_lights) {
  const auto mesh = std::make_shared<const PatchMesh>(std::move(patches));
  std::vector<Light> lights = lights_of_emitters(*mesh);
  lights.insert(lights.end(), more_lights.begin(), more_lights.end());
  return {mesh, std::move(vertex_radiosity), std::move(lights), ambient_irradiance(*mesh, more_lights)};
}

/// With their images.
std::vector<Light> unfolded(std::vector<Light> lights, const Symmetry& symmetry) {
  const std::size_t count = lights.size();
  for (const SymmetryImage& image : images(symmetry))
    for (std::size_t k = 0; k < count; ++k) {
      if (lights[k].kind == LightKind::directional && image.planes.empty()) continue;  // the same light
      Light light = lights[k];
      light.position = image.of_point(light.position, 0);
      light.direction = image.of_direction(light.direction);
      lights.push_back(std::move(light));
    }
  return lights;
}

/// A .vtp without radiosity arrays is a mesh like any other.
std::optional<Shown> read_solved(Job& job, std::span<const Light> lights) {
  const std::filesystem::path& file = job.options.scene;
  const bool in_pieces = file.extension() == ".pvtp";
  if ((file.extension() != ".vtp" && !in_pieces) || !std::filesystem::is_regular_file(file)) return {};
  job.stage.lap();
  try {
    SolvedMesh solved = read_solution(file);
    job.report.seconds.read = job.stage.lap();
    job.console.line("solution", "{}, {} patches", file.string(), solved.mesh.patch_count());
    const double exposure =
        solved.exposure ? *solved.exposure : automatic_exposure(solved.mesh, solved.patch_radiosity);
    return Shown{
        view_scene(std::move(solved.mesh), std::move(solved.vertex_radiosity), lights), exposure, {}};
  } catch (const IoError&) {
    if (in_pieces) throw;
    return {};
  }
}

/// [camera], or the one that is named, or the first of those that have names; nothing where there is none.
std::optional<Camera> camera_of(const SceneSettings& settings, const std::string& name,
                                const std::filesystem::path& file) {
  const auto& cameras = settings.cameras;
  if (name.empty()) {
    if (settings.camera || cameras.empty()) return settings.camera;
    return cameras.begin()->second;
  }
  if (const auto found = cameras.find(name); found != cameras.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, camera] : cameras) names.push_back(known);
  throw InputError(
      fmt::format("{}: there is no [camera.{}]{}", file.string(), name, did_you_mean(name, names)));
}

Camera override_camera(Camera camera, const Options::View& view) {
  camera.position = view.position.value_or(camera.position);
  camera.target = view.target.value_or(camera.target);
  camera.up = view.up.value_or(camera.up);
  camera.vertical_fov_deg = view.vertical_fov_deg.value_or(camera.vertical_fov_deg);
  return camera;
}

/// So many pixels, at the point of the shape's ball that is nearest to the eye, or at a hundredth of its size where the eye is in it.
ChordError by_size_on_screen(const Camera& camera, const Options::View& view) {
  const double pixel =
      2 * std::tan(camera.vertical_fov_deg * std::numbers::pi / 360) / view.height;  // at 1 m
  return [=, position = camera.position, pixels = *view.tessellation](const CurvedShape& shape) {
    const Ball ball = enclosing_ball(shape);
    const double nearest = std::max((ball.centre - position).norm() - ball.radius, 0.01 * size(shape));
    return pixels * pixel * nearest;
  };
}

Shown show_scene(Job& job, const PipelineInfo& pipeline, const std::optional<Camera>& wanted) {
  const Options::View& view = job.options.view;
  ChordError chord_error;
  if (view.tessellation) {
    // The camera may be in the scene file, or be one that has all of the scene in view.
    const LoadedScene first = read_scene(job.options.scene);
    std::optional<Camera> camera = wanted;
    if (!camera) camera = camera_of(first.settings, view.camera_name, job.options.scene);
    if (!camera) camera = automatic_camera(make_patches(first.scene, KeepFaces{}).mesh.unfolded());
    chord_error = by_size_on_screen(override_camera(*camera, view), view);
  }
  const LoadedScene loaded = read_stage(job, job.options.scene, MissingMaterials::refuse, chord_error);
  if (!pipeline.solved) {
    const Patches patches = make_patches(loaded.scene, KeepFaces{});
    warn(job, patches.warnings);
    return {view_scene(patches.mesh.unfolded(), {}, unfolded(loaded.lights, loaded.scene.symmetry())),
            {},
            loaded.settings};
  }
  // Before the work of a solve is done for it.
  std::optional<Camera> camera = wanted;
  if (!camera) camera = camera_of(loaded.settings, view.camera_name, job.options.scene);
  if (camera || view.position)
    refuse_eye_in_matter(make_patches(loaded.scene, KeepFaces{}).mesh.unfolded(),
                         override_camera(camera.value_or(Camera{}), view));
  SolvedScene solved = solve_stage(job, {loaded.scene, {}, {}, {}, {}, loaded.lights}, loaded.settings);
  const double exposure = automatic_exposure(solved.patches.mesh, solved.solution.radiosity);
  const SolvedScene::Told told = solved.told_of_setup(0);
  return {view_scene(told.mesh.unfolded(), told.mesh.unfolded(told.solution.vertex_radiosity),
                     unfolded(loaded.lights, loaded.scene.symmetry())),
          exposure, loaded.settings, job.report.converged};
}

/// What tells the exposure of a scene that was not solved.
LinearImage coarse(const Pipeline& pipeline, const Camera& camera, DrawOptions options) {
  options.width = std::max(1, options.width / 4);
  options.height = std::max(1, options.height / 4);
  options.samples = 1;
  options.standard_error = false;
  return pipeline.draw(camera, options);
}

void tell(const Console& console, const LinearImage& image, Index samples) {
  if (image.samples == 0)
    console.line("samples", "stopped: pixels stand for their neighbours");
  else
    console.line("samples", "{}{} per pixel", image.samples,
                 image.completed ? "" : fmt::format(" of {}, stopped:", samples));
  if ((image.radiosity == 0).all())
    console.line(
        "warning",
        "the image is black: no light comes from what the camera sees, which may be backs of surfaces; is "
        "it inside of a wall, or does it look past the scene?");
  if (image.standard_error)
    console.line("noise", "{:.3g} W/m² rms, the mean is {:.3g}",
                 std::sqrt(image.standard_error->square().mean()), image.radiosity.mean());
}

}  // namespace

int run_view(const Options& options) {
  Job job(options);
  std::string extension = options.output.extension().string();
  if (extension != ".exr" && extension != ".hdr" && extension != ".png") extension = ".png, .exr or .hdr";
  check_outputs(options, extension);
  const Options::View& view = options.view;
  const PipelineInfo& info = find_pipeline(view.pipeline);
  std::optional<Camera> wanted;
  std::vector<Light> lights;
  if (!view.camera_file.empty()) {
    LoadedScene other = read_scene(view.camera_file);
    wanted = camera_of(other.settings, view.camera_name, view.camera_file);
    lights = std::move(other.lights);
    if (!wanted)
      throw InputError(
          fmt::format("{}: --scene needs a scene file with a [camera]", view.camera_file.string()));
  }
  const auto camera_for = [&](const SceneSettings& settings, const PatchMesh& mesh) {
    if (!wanted) wanted = camera_of(settings, view.camera_name, options.scene);
    const Camera camera = override_camera(wanted ? *wanted : automatic_camera(mesh), view);
    job.console.line("camera", "at {:.4g} {:.4g} {:.4g}, towards {:.4g} {:.4g} {:.4g}, {:.4g}° high",
                     camera.position.x(), camera.position.y(), camera.position.z(), camera.target.x(),
                     camera.target.y(), camera.target.z(), camera.vertical_fov_deg);
    return camera;
  };
  if (!view.false_colour.empty())
    return view_false_colour(job, [&](const PatchMesh& mesh) { return camera_for({}, mesh); });
  auto solved = read_solved(job, lights);
  if (solved && view.tessellation)
    throw InputError(
        fmt::format("{}: --tessellation is for scenes with [shapes]; what is solved has its facets",
                    options.scene.string()));
  Shown shown = solved ? *std::move(solved) : show_scene(job, info, wanted);
  const Camera camera = camera_for(shown.settings, *shown.scene.mesh);
  PipelineOptions settings;
  settings.seed = options.flags.seed.value_or(settings.seed);
  settings.depth = view.depth.value_or(settings.depth);
  settings.classical_attenuation = view.classical_attenuation;
  settings.attenuation_length = view.attenuation_length.value_or(settings.attenuation_length);
  const std::unique_ptr<Pipeline> pipeline = info.make(std::move(shown.scene), settings);

  DrawOptions draw{.width = view.width, .height = view.height, .samples = view.samples};
  draw.standard_error = info.random && draw.samples > 1;
  const bool display = extension == ".png";
  double exposure = 0;
  if (display) {
    exposure = view.exposure    ? *view.exposure
               : shown.exposure ? *shown.exposure
                                : automatic_exposure(coarse(*pipeline, camera, draw));
    if (!info.random) draw.brightest = 1 / exposure;
  }
  job.console.line("image", "{} × {} pixels by {}{}", view.width, view.height, info.name,
                   display ? fmt::format(", exposure {:.4g} /(W/m²)", exposure) : ", in W/m²");
  Outputs outputs(job);
  job.stage.lap();
  outputs.will_write(options.output);
  const auto write = [&](const LinearImage& image) {
    if (display)
      write_png(options.output, tone_map(image, exposure));
    else
      write_linear_image(options.output, image);
  };
  // Whoever waits is shown what there is, but writing must not take longer than drawing.
  constexpr double kEvery = 0.5;  // s
  Stopwatch shown_last;
  draw.stop = [&] {
    return interrupted() || (options.time_limit > 0 && job.total.elapsed() > options.time_limit);
  };
  draw.refined = [&](const LinearImage& image) {
    if (shown_last.elapsed() > kEvery) {
      write(image);
      shown_last.lap();
    }
    return !draw.stop();
  };
  const LinearImage image = pipeline->draw(camera, draw);
  write(image);
  tell(job.console, image, draw.samples);
  outputs.finish();
  return shown.converged && image.completed ? kDone : kNotConverged;
}

}  // namespace radiosity::app
