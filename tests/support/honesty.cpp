// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/honesty.hpp"

#include <fmt/format.h>

#include <cmath>

#include "radiosity/simulation/error_estimate.hpp"
#include "support/scenes.hpp"

namespace radiosity::test {
namespace {

struct Setting {
  std::string_view method;
  FormFactorOptions options;
};

std::vector<Setting> settings_of(std::string_view method) {
  std::vector<Setting> all{{"analytic", {}},
                           {"analytic", {.samples = 2}},
                           {"hemisphere", {.samples = 256}},
                           {"hemisphere", {.samples = 4096}},
                           {"hemicube", {.samples = 1, .resolution = 64}},
                           {"hemicube", {}}};
  std::erase_if(all, [&](const Setting& setting) { return !method.empty() && setting.method != method; });
  return all;
}

std::string name_of(const Setting& setting) {
  std::string name(setting.method);
  if (setting.options.samples > 0) name += fmt::format(", {} samples", setting.options.samples);
  if (setting.options.resolution > 0) name += fmt::format(", {} cells", setting.options.resolution);
  return name;
}

struct Solved {
  Patches patches;
  BandArray radiosity;
  std::optional<ErrorEstimate> estimate;
};

Solved solve_scene(const Scene& scene, const PatchOptions& patch_options, const Setting& setting,
                   bool estimate) {
  Solved out{make_patches(scene, patch_options), {}, {}};
  const Visibility visibility(out.patches.mesh);
  const FormFactorMethodInfo& info = find_form_factor_method(setting.method);
  AssemblyReport assembly;
  const FormFactorMatrix f = assemble(*info.make(visibility, setting.options), visibility, {}, &assembly);
  const auto solver = find_solver("conjugate-gradient").make();
  const Solution solution = solve(*solver, RadiositySystem(f, out.patches.mesh), out.patches.mesh);
  out.radiosity = solution.radiosity;
  if (estimate)
    out.estimate = estimate_error({scene, out.patches, visibility, info, setting.options, AssemblyOptions{},
                                   *solver, SolverOptions{}, solution, assembly.lamps, assembly.unrestored(),
                                   assembly.unreliable, assembly.pair_rows});
  return out;
}

double relative(const PatchMesh& mesh, const BandArray& b, const BandArray& exact) {
  double above = 0, below = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (std::isnan(exact(i, 0))) continue;
    const double reflected = exact(i, 0) - mesh.emission()(i, 0);
    above += mesh.area(i) * (b(i, 0) - exact(i, 0)) * (b(i, 0) - exact(i, 0));
    below += mesh.area(i) * reflected * reflected;
  }
  return std::sqrt(above / below);
}

}  // namespace

std::vector<Honesty> honesty(int rooms, const std::function<void(const Honesty&)>& seen,
                             std::string_view method) {
  const std::vector<Setting> settings = settings_of(method);
  std::vector<Honesty> all;
  const auto add = [&](const std::string& scene, const Setting& setting, double truth, double estimate) {
    all.push_back({scene, name_of(setting), truth, estimate});
    if (seen) seen(all.back());
  };
  const auto against_finer = [&](const std::string& name, const Scene& scene,
                                 std::initializer_list<double> sizes, double finest) {
    const Solved reference = solve_scene(scene, PatchSize{finest}, {"analytic", {}}, false);
    for (const double size : sizes)
      for (const Setting& setting : settings) {
        const Solved solved = solve_scene(scene, PatchSize{size}, setting, true);
        const BandArray exact = restrict_to(solved.patches.mesh, reference.patches.mesh, reference.radiosity);
        add(fmt::format("{}, {} patches", name, solved.patches.mesh.patch_count()), setting,
            relative(solved.patches.mesh, solved.radiosity, exact), solved.estimate->known);
      }
  };
  against_finer("cube, ρ = ½", lit_cube(0.5, 0.5, 0.5), {0.25, 0.125}, 1.0 / 32);
  against_finer("cube, ρ = 0.2, 0.7, 0.5", lit_cube(0.2, 0.7, 0.5), {0.25, 0.125}, 1.0 / 32);

  for (const Setting& setting : settings) {  // R1: B = E/(1 − ρ); what the box covers sees nothing
    const Solved solved = solve_scene(box_on_floor(), PatchSize{0.17}, setting, true);
    const PatchMesh& mesh = solved.patches.mesh;
    const Visibility visibility(mesh);
    BandArray exact = BandArray::Constant(mesh.patch_count(), 1, 2);
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (visibility.covered(i)) exact(i, 0) = 1;
    add(fmt::format("furnace with a box, {} patches", mesh.patch_count()), setting,
        relative(mesh, solved.radiosity, exact), solved.estimate->known);
  }

  MeshBuilder ball;
  ball.use_material(grey("ball", 0.8, 0)).sphere(Vec3::Zero(), 1, 2, Facing::inward);
  ball.use_material(grey("lamp", 0, 1)).box(Vec3::Constant(-0.2), Vec3::Constant(0.2), 1, Facing::outward);
  const auto kept = {std::pair{std::string("ball round a cube"), ball.build()},
                     std::pair{std::string("shell"),
                               concentric_spheres(1, 2, grey("inner", 0.5, 1), grey("outer", 0.7, 0))}};
  for (const auto& [name, mesh] : kept) {
    const Scene scene = scene_of(mesh);
    const Solved exact = solve_scene(scene, KeepFaces{}, {"analytic", {.samples = 256}}, false);
    for (const Setting& setting : settings) {
      const Solved solved = solve_scene(scene, KeepFaces{}, setting, true);
      add(fmt::format("{}, {} faces", name, mesh.patch_count()), setting,
          relative(solved.patches.mesh, solved.radiosity, exact.radiosity), solved.estimate->known);
    }
  }
  for (int room = 1; room <= rooms; ++room)
    against_finer(fmt::format("random room {}", room), random_room(static_cast<std::uint64_t>(room)),
                  {0.7, 0.5}, 0.14);
  return all;
}

}  // namespace radiosity::test
