// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/calibration.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>

#include "cases/scenes.hpp"
#include "radiosity/meshing/refine.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::test {
namespace {

struct Setting {
  std::string_view method;
  FormFactorOptions options;
  bool extrapolate = false;
};

std::vector<Setting> settings_of(std::string_view method) {
  std::vector<Setting> all{{"analytic", {}},
                           {"analytic", {.samples = 2}},
                           {"hemisphere", {.samples = 256}},
                           {"hemisphere", {.samples = 4096}},
                           {"hemicube", {.samples = 1, .resolution = 64}},
                           {"hemicube", {}},
                           {"analytic", {}, true},
                           {"hemisphere", {.samples = 4096}, true},
                           {"hemicube", {}, true}};
  std::erase_if(all, [&](const Setting& setting) { return !method.empty() && setting.method != method; });
  return all;
}

std::string name_of(const Setting& setting) {
  std::string name(setting.method);
  if (setting.options.has_samples()) name += fmt::format(", {} samples", setting.options.samples);
  if (setting.options.has_resolution()) name += fmt::format(", {} cells", setting.options.resolution);
  if (setting.extrapolate) name += ", extrapolated";
  return name;
}

SolvedScene solved(const Scene& scene, const PatchOptions& patches, const Setting& setting, bool estimate) {
  SceneSettings settings;
  settings.patches = patches;
  settings.method = std::string(setting.method);
  settings.samples = setting.options.samples;
  settings.resolution = setting.options.resolution;
  SolveOptions options;
  options.estimate_error = estimate;
  options.extrapolate = setting.extrapolate;
  return solve_scene(scene, settings, options);
}

/// Means over the patches of a mesh of what its patches cut into 4 × 4 have, by exact factors.
BandArray finer_solution(const PatchMesh& mesh) {
  const Refinement fine = refine(mesh, 4);
  const SolvedScene reference = solved(scene_of(fine.mesh), KeepFaces{}, {"analytic", {}}, false);
  return restrict_to(fine.coarsening, fine.mesh.areas(), reference.solution.radiosity);
}

std::optional<TracedReference> traced_reference(const PatchMesh& mesh, const TraceIrradiance& trace) {
  if (!trace) return {};
  const Visibility visibility(mesh);
  TracedReference out(visibility, trace, 512);
  for (int round = 0; round < 32; ++round) out.add_round(128);
  return out;
}

double relative(const PatchMesh& mesh, const BandArray& b, const BandArray& exact) {
  double above = 0, below = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const double reflected = exact(i, 0) - mesh.emission()(i, 0);
    above += mesh.area(i) * (b(i, 0) - exact(i, 0)) * (b(i, 0) - exact(i, 0));
    below += mesh.area(i) * reflected * reflected;
  }
  return std::sqrt(above / below);
}

}  // namespace

std::vector<CalibrationCase> calibration(int rooms, bool smaller_too,
                                         const std::function<void(const CalibrationCase&)>& seen,
                                         std::string_view method, const TraceIrradiance& trace) {
  const std::vector<Setting> settings = settings_of(method);
  std::vector<CalibrationCase> all;
  const auto add = [&](const std::string& scene, const Setting& setting, double truth, double estimate,
                       std::optional<TracedError> traced = {}) {
    all.push_back({scene, name_of(setting), truth, estimate, traced});
    if (seen) seen(all.back());
  };
  const auto against_finer = [&](const std::string& name, const Scene& scene, std::array<double, 2> sizes) {
    for (const double size : std::span(sizes).first(smaller_too ? 2 : 1)) {
      const PatchMesh mesh = make_patches(scene, PatchSize{size}).mesh.with_clusters({});
      const BandArray exact = finer_solution(mesh);
      const auto traced = traced_reference(mesh, trace);
      for (const Setting& setting : settings) {
        const SolvedScene result = solved(scene, PatchSize{size}, setting, true);
        add(fmt::format("{}, {} patches", name, mesh.patch_count()), setting,
            relative(mesh, result.solution.radiosity, exact), result.error->known,
            traced ? std::optional(traced->error(result.solution.radiosity)) : std::nullopt);
      }
    }
  };
  against_finer("cube, ρ = ½", lit_cube(0.5, 0.5, 0.5), {0.25, 0.125});
  against_finer("cube, ρ = 0.2, 0.7, 0.5", lit_cube(0.2, 0.7, 0.5), {0.25, 0.125});

  std::optional<TracedReference> furnace;
  for (const Setting& setting : settings) {  // R1: B = E/(1 − ρ); what the box covers sees nothing
    const SolvedScene result = solved(box_on_floor(), PatchSize{0.17}, setting, true);
    const PatchMesh& mesh = result.patches.mesh;
    const Visibility visibility(mesh);
    BandArray exact = BandArray::Constant(mesh.patch_count(), 1, 2);
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (visibility.covered(i)) exact(i, 0) = 1;
    if (trace && !furnace) furnace = traced_reference(mesh, trace);
    add(fmt::format("furnace with a box, {} patches", mesh.patch_count()), setting,
        relative(mesh, result.solution.radiosity, exact), result.error->known,
        furnace ? std::optional(furnace->error(result.solution.radiosity)) : std::nullopt);
  }

  MeshBuilder ball;
  ball.use_material(grey("ball", 0.8, 0)).sphere(Vec3::Zero(), 1, 2, Facing::inward);
  ball.use_material(grey("lamp", 0, 1)).box(Vec3::Constant(-0.2), Vec3::Constant(0.2), 1, Facing::outward);
  const auto kept = {std::pair{std::string("ball round a cube"), ball.build()},
                     std::pair{std::string("shell"),
                               concentric_spheres(1, 2, grey("inner", 0.5, 1), grey("outer", 0.7, 0))}};
  for (const auto& [name, mesh] : kept) {
    const Scene scene = scene_of(mesh);
    const SolvedScene exact = solved(scene, KeepFaces{}, {"analytic", {.samples = 256}}, false);
    for (const Setting& setting : settings) {
      if (setting.extrapolate) continue;  // to smaller patches
      const SolvedScene result = solved(scene, KeepFaces{}, setting, true);
      add(fmt::format("{}, {} faces", name, mesh.patch_count()), setting,
          relative(result.patches.mesh, result.solution.radiosity, exact.solution.radiosity),
          std::hypot(*result.error->form_factors, result.error->solver));  // the truth has the same patches
    }
  }
  for (int room = 1; room <= rooms; ++room)
    against_finer(fmt::format("random room {}", room), random_room(static_cast<std::uint64_t>(room)),
                  {0.7, 0.5});
  return all;
}

}  // namespace radiosity::test
