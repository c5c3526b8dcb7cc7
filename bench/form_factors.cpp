// SPDX-License-Identifier: GPL-3.0-or-later
// Form factor methods × settings × scenes: time, memory, rays and error, side by side.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cases/known_rows.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace {

using namespace radiosity;
using test::KnownRows;
using test::KnownScene;
using test::RowErrors;

KnownScene rooms(double patch_size) {
  KnownScene out{
      "", make_patches(test::two_furnished_rooms(), PatchSize{patch_size}).mesh.with_clusters({}), {}, {}};
  out.name = fmt::format("two furnished rooms, {} patches", out.mesh.patch_count());
  return out;
}

void run(const KnownScene& scene, const KnownRows& exact, const FormFactorMethodInfo& info,
         const FormFactorOptions& options, bool close) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const Visibility visibility(scene.mesh);
  const auto method = info.make(visibility, options);
  AssemblyOptions assembly;
  assembly.close = close;
  const auto [f, report] = assemble(*method, visibility, assembly);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();

  const RowErrors errors = exact.errors([&](Index i, Index j) { return static_cast<double>(f(i, j)); });
  fmt::print("| {} | {} {}{}{} | {:.2f} | {:.1f} | {:.2g} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |\n",
             scene.name, info.name, options.samples,
             options.has_resolution() ? fmt::format(" × {}", options.resolution) : "",
             close ? "" : ", rows as they are", seconds, static_cast<double>(f.bytes()) / 1e6,
             static_cast<double>(report.rays), errors.l1, errors.frobenius, errors.largest,
             report.before.reciprocity_error_mean, report.before.closure_error_max);
  std::fflush(stdout);
}

/// Every scene at a few sizes, the smallest first.
std::vector<std::vector<std::function<KnownScene()>>> scenes() {
  const auto sizes = [](const auto& make, std::initializer_list<double> list) {
    std::vector<std::function<KnownScene()>> out;
    for (const double size : list) out.push_back([=] { return make(size); });
    return out;
  };
  const auto whole = [](double n) { return static_cast<Index>(n); };
  return {
      sizes([=](double n) { return test::empty_cube(whole(n)); }, {4, 16, 40}),
      sizes([=](double n) { return test::cube_with_box("cube with box", whole(n), Vec3::Zero()); },
            {4, 16, 32}),
      sizes(
          [=](double n) {
            return test::cube_with_box("cube with box off centre", whole(n), Vec3(0.1, -0.07, -0.12));
          },
          {16}),
      sizes(rooms, {2, 0.31, 0.09}),
      sizes(
          [=](double n) {
            return test::grids("plates at a gap of 1e-3",
                               [=](Index cut) { return test::opposed_squares(1e-3, cut * whole(n)); });
          },
          {7, 70}),
  };
}

/// The default setting and what shows how error falls with work: four times the rays or points; for hemicubes cells and
/// viewpoints, the classical one over the centre first.
std::vector<FormFactorOptions> ladder(const FormFactorMethodInfo& info, Index patches) {
  if (info.name == "analytic" && patches >= 4000) return {info.defaults};
  if (!info.defaults.has_resolution()) return {info.defaults, {.samples = 4 * info.defaults.samples}};
  std::vector<FormFactorOptions> steps;
  for (const Index samples : {1, 4})
    for (const Index resolution : {64, 128, 256})
      steps.push_back({.samples = samples, .resolution = resolution});
  if (patches < 4000) steps.push_back({.samples = 9, .resolution = 256});
  return steps;
}

/// What a method at its default setting, or a finer one, may be asked for in a few minutes.
Index most_patches(const FormFactorMethodInfo& info) {
  return info.name == "hemisphere" ? 200'000 : 12'000;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Form factor methods compared at equal error: prints a Markdown table"};
  Index rows = 48;
  bool smallest = false;
  std::string only, scene_name;
  std::vector<Index> samples, resolutions;
  double patch_size = 0;
  app.add_option("--rows", rows, "rows of F that are compared with the reference")->capture_default_str();
  app.add_option("--method", only, "only this method");
  app.add_option("--scene", scene_name, "only scenes whose name contains this");
  app.add_option("--samples", samples, "only these numbers of samples, with rows restored");
  app.add_option("--resolution", resolutions, "only these numbers of cells, with rows restored");
  app.add_option("--patch-size", patch_size, "the furnished rooms at this size alone, m");
  app.add_flag("--smallest", smallest,
               "only scenes of a hundred patches, and each method's first two settings");
  CLI11_PARSE(app, argc, argv);

  fmt::print("| scene | method | s | MB | rays | row L1 | Frobenius | largest | expected L1 | closure |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|\n");
  auto all = scenes();
  if (patch_size > 0) all = {{[=] { return rooms(patch_size); }}};
  for (auto& sizes : all) {
    if (smallest) sizes.resize(1);
    for (const auto& make : sizes) {
      const KnownScene scene = make();
      if (scene.name.find(scene_name) == std::string::npos) continue;
      const Index n = scene.mesh.patch_count();
      if (smallest && n > 200) continue;
      const KnownRows exact =
          test::known_rows(scene, n > most_patches(find_form_factor_method("analytic")) ? rows / 4 : rows);
      for (const FormFactorMethodInfo& info : form_factor_methods()) {
        if ((!only.empty() && only != info.name) || n > most_patches(info)) continue;
        if (samples.empty() && resolutions.empty()) {
          auto steps = ladder(info, n);
          if (smallest) steps.resize(std::min<std::size_t>(steps.size(), 2));
          for (const FormFactorOptions& step : steps) run(scene, exact, info, step, true);
          run(scene, exact, info, info.defaults, false);
          continue;
        }
        const auto or_default = [](const std::vector<Index>& asked, Index standard) {
          return asked.empty() ? std::vector{standard} : asked;
        };
        for (const Index s : or_default(samples, info.defaults.samples))
          for (const Index r : or_default(resolutions, info.defaults.resolution))
            run(scene, exact, info, {.samples = s, .resolution = r}, true);
      }
    }
  }
  return 0;
}
