// SPDX-License-Identifier: GPL-3.0-or-later
// Speed against accuracy on four scenes, by what `radiosity compare` runs: the tables of docs/trade.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/simulation/compare.hpp"

namespace {

using namespace radiosity;

struct BenchScene {
  std::string name;
  std::function<Scene()> make;
  double patch_size;  ///< m
};

std::vector<BenchScene> scenes() {
  return {{"cube with box", test::cube_with_box, 0.125},
          {"closed Cornell box", test::closed_cornell_box, 0.06},
          {"two furnished rooms", test::two_furnished_rooms, 0.6},
          {"office floor of 12 rooms", test::office_floor, 1.2}};
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string percent(double share) {
  return fmt::format("{:.2g} %", 100 * share);
}

std::string traced(const TracedError& error) {
  return fmt::format("{:.2g} ± {:.2g} %", 100 * error.rms, 100 * error.standard_error);
}

std::string setting(const ComparedRun& run) {
  return run.settings.has_resolution()
             ? fmt::format("{} {} × {}", run.method, run.settings.samples, run.settings.resolution)
             : fmt::format("{} {}", run.method, run.settings.samples);
}

void print_reference(const ComparedReference& reference) {
  fmt::print("{} {} on {} patches ({} solve{}, {:.3g} s): its form factors err by {}{}.\n", reference.method,
             reference.settings.samples, reference.patches, reference.solves,
             reference.solves == 1 ? "" : "s", reference.seconds, percent(reference.noise),
             reference.patch_error
                 ? fmt::format(", its patches by about {} (order {:.2g}{})", percent(*reference.patch_error),
                               *reference.order, reference.order_assumed ? ", assumed" : "")
                 : "");
  if (reference.traced)
    fmt::print("By path tracing it errs by {}, by {:.2g} ± {:.2g} % in the mean.\n",
               traced(*reference.traced), 100 * reference.traced->mean,
               100 * reference.traced->mean_standard_error);
}

void print_methods(const Comparison& all) {
  fmt::print(
      "\n| method and setting | patches | s | MB | of form factors | all told | largest | by path tracing |\n"
      "|---|---|---|---|---|---|---|---|\n");
  std::size_t left_out = 0;
  for (const ComparedRun& run : all.runs) {
    if (!run.left_out.empty()) {
      ++left_out;
      continue;
    }
    if (run.mesh != all.own) continue;
    fmt::print("| {} | {} | {:.2g} | {:.3g} | {} | {} | {} | {} |\n", setting(run),
               all.meshes[run.mesh].patches, run.seconds, run.bytes / 1e6, percent(run.factors->rms),
               run.total ? percent(run.total->rms) : "–", percent(run.factors->largest),
               run.traced ? traced(*run.traced) : "–");
  }
  fmt::print("\n{} of {} runs on all meshes were left out.\n", left_out, all.runs.size());
}

void print_patches(const Comparison& all) {
  fmt::print(
      "\n| patches | size, m | noise of the reference | least error | by | s |\n|---|---|---|---|---|---|\n");
  for (std::size_t m = 0; m < all.meshes.size(); ++m) {
    const ComparedRun* best = nullptr;
    for (const ComparedRun& run : all.runs)
      if (run.mesh == m && run.total && (best == nullptr || run.total->rms < best->total->rms)) best = &run;
    if (best == nullptr) continue;
    fmt::print("| {} | {:.3g} | {} | {} | {} | {:.2g} |\n", all.meshes[m].patches, all.meshes[m].size,
               percent(all.meshes[m].own_noise), percent(best->total->rms), setting(*best), best->seconds);
  }
}

void print_advice(const Comparison& all) {
  const Measured runs = measured(all);
  fmt::print(
      "\n| wanted | method and setting | patches | s | MB | errs by at most |\n|---|---|---|---|---|---|\n");
  for (const double wanted : {0.05, 0.02, 0.01, 0.005}) {
    const auto best = cheapest(runs.by_seconds, wanted);
    if (!best) {
      fmt::print("| {} | not reached | | | | |\n", percent(wanted));
      continue;
    }
    const ComparedRun& run = all.runs[runs.index[*best]];
    fmt::print("| {} | {} | {} | {:.2g} | {:.3g} | {} |\n", percent(wanted), setting(run),
               all.meshes[run.mesh].patches, run.seconds, run.bytes / 1e6,
               percent(runs.by_seconds[*best].error));
  }
}

void print_solvers(const Comparison& all) {
  fmt::print(
      "\n| solver | products to 1e-1 | 1e-2 | 1e-4 | 1e-6 | 1e-8 | s to 1e-6 "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const SolverInfo& info : solvers()) {
    fmt::print("| {} ", info.name);
    double seconds = 0;
    for (const double tolerance : {1e-1, 1e-2, 1e-4, 1e-6, 1e-8})
      for (const SolverRun& run : all.solvers) {
        if (run.solver != info.name || std::abs(run.tolerance / tolerance - 1) > 0.01) continue;
        fmt::print("| {} ", run.left_out.empty() ? fmt::format("{:.3g}", run.products) : "–");
        if (tolerance == 1e-6) seconds = run.seconds;
      }
    fmt::print("| {} |\n", seconds > 0 ? fmt::format("{:.2g}", seconds) : "–");
  }
}

/// What the factors to lamps cost when they are computed pair by pair, and what it costs not to: F of the same mesh where
/// nothing emits has none, and is then used to solve the lit one.
void print_lamp(const Comparison& all) {
  const PatchMesh& mesh = *all.mesh;
  std::vector<Material> materials = mesh.materials();
  for (Material& material : materials) material.emission.setZero();
  const PatchMesh dark = mesh.with_materials(std::move(materials));
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  fmt::print(
      "\n| hemisphere {} | lamp patches | s | error from form factors | largest |\n|---|---|---|---|---|\n",
      info.defaults.samples);
  for (const bool pairwise : {true, false}) {
    const PatchMesh& patches = pairwise ? mesh : dark;
    const Visibility visibility(patches);
    const auto method = info.make(visibility);
    const double start = now();
    const auto [f, report] = assemble(*method, visibility);
    const double seconds = now() - start;
    const BandArray radiosity =
        find_solver("conjugate-gradient").make()->solve(RadiositySystem(f, mesh)).radiosity;
    const RelativeError error = relative_error(mesh, radiosity, all.radiosity);
    fmt::print("| lamps {} | {} | {:.2g} | {} | {} |\n", pairwise ? "pair by pair" : "by rays, too",
               report.lamps, seconds, percent(error.rms), percent(error.largest));
  }
}

/// Shooting with rows computed on demand, none of them kept, against all rows and conjugate gradients.
void print_shooting(const Comparison& all) {
  const PatchMesh& mesh = *all.mesh;
  const Visibility visibility(mesh);
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  fmt::print(
      "\n| hemisphere {} | tolerance | rows computed / n | s | error | MB of F "
      "|\n|---|---|---|---|---|---|\n",
      info.defaults.samples);
  for (const double tolerance : {0.1, 0.01}) {
    SolverOptions options;
    options.tolerance = tolerance;
    {
      const double start = now();
      const auto method = info.make(visibility);
      const FormFactorMatrix f = assemble(*method, visibility).matrix;
      const auto result = find_solver("conjugate-gradient").make()->solve(RadiositySystem(f, mesh), options);
      fmt::print("| gathering, conjugate-gradient | {:g} | 1 | {:.2g} | {} | {:.3g} |\n", tolerance,
                 now() - start, percent(relative_error(mesh, result.radiosity, all.radiosity).rms),
                 static_cast<double>(f.bytes()) / 1e6);
    }
    for (const SolverInfo& solver : solvers()) {
      if (solver.gathers) continue;
      const double start = now();
      const auto method = info.make(visibility);
      const RowsOnDemand f(*method, visibility, 0);
      const auto result = solver.make()->solve(RadiositySystem(f, mesh), options);
      fmt::print("| shooting, {} | {:g} | {:.2g} | {:.2g} | {} | 0 |\n", solver.name, tolerance,
                 static_cast<double>(result.report.iterations) / mesh.patch_count(), now() - start,
                 percent(relative_error(mesh, result.radiosity, all.radiosity).rms));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Speed against accuracy on four scenes: prints Markdown tables"};
  bool smallest = false;
  double budget = 240;
  std::string only;
  app.add_option("--budget", budget, "for each scene, s")->capture_default_str();
  app.add_option("--scene", only, "only scenes whose name contains this");
  app.add_flag("--smallest", smallest, "the first scene alone, with few patches, in a few seconds");
  CLI11_PARSE(app, argc, argv);

  auto all = scenes();
  if (smallest) {
    all.resize(1);
    all[0].patch_size = 0.25;
    budget = 4;
  }
  for (const BenchScene& scene : all) {
    if (scene.name.find(only) == std::string::npos) continue;
    CompareOptions options;
    options.budget_s = budget;
    options.trace = [](const auto& mesh, std::span<const Place> places, Index paths, std::uint64_t seed) {
      return path_traced(mesh, places, paths, seed).irradiance;
    };
    const Comparison comparison = compare(scene.make(), PatchSize{scene.patch_size}, options);
    fmt::print("\n## {}: {} patches of at most {} m\n\nSame patches: ", scene.name,
               comparison.meshes[comparison.own].patches, scene.patch_size);
    print_reference(comparison.factors);
    if (comparison.finer) {
      fmt::print("Finer patches: ");
      print_reference(*comparison.finer);
    }
    for (const std::string& note : comparison.notes) fmt::print("Note: {}.\n", note);
    print_advice(comparison);
    print_methods(comparison);
    if (comparison.finer) print_patches(comparison);
    print_solvers(comparison);
    print_lamp(comparison);
    print_shooting(comparison);
    std::fflush(stdout);
  }
  return 0;
}
