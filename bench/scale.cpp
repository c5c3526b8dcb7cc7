// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <random>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/report.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "radiosity/simulation/stopwatch.hpp"

/// Office buildings with more and more elements: seconds of each stage, memory, and the true error, from path tracing at random places.
namespace {

using namespace radiosity;

/// √(Σ (ρ H − ρ Ĥ)² / Σ (ρ Ĥ)²) over places that are uniform by area, Ĥ from path tracing, and the noise of Ĥ in the same measure. The
/// noise is taken out of the error.
struct Truth {
  double error = 0, noise = 0;
};

Truth truth(const Scene& scene, const PatchMesh& mesh, const BandArray& irradiance, Index places,
            Index paths) {
  const auto faces = std::make_shared<const PatchMesh>(make_patches(scene, KeepFaces{}).mesh);
  const Visibility visibility(*faces);
  std::vector<double> up_to(mesh.patch_count());
  double area = 0;
  for (Index e = 0; e < mesh.patch_count(); ++e) {
    if (!(mesh.material_of(e).emission > 0).any()) area += mesh.area(e);
    up_to[e] = area;
  }
  std::mt19937_64 random(7);
  const auto draw = [&] { return test::uniform(random); };
  std::vector<Place> chosen;
  std::vector<Index> elements;
  while (static_cast<Index>(chosen.size()) < places) {
    const auto e =
        static_cast<Index>(std::upper_bound(up_to.begin(), up_to.end(), draw() * area) - up_to.begin());
    const Vec3 x = PatchSampler(mesh, e).at({draw(), draw()});
    const Vec3& n = mesh.normal(e);
    // A place under a leg or behind a board that touches it is inside of that.
    if (!visibility.first_hit(x + 1e-4 * n, n).front) continue;
    chosen.push_back({x, n, visibility.first_hit(x + 1e-4 * n, -n).patch});
    elements.push_back(e);
  }
  const PathTraced traced = path_traced(faces, chosen, paths);
  Eigen::ArrayXd square(places), variance(places), reference(places);
  for (Index k = 0; k < places; ++k) {
    const double reflectance = mesh.material_of(elements[k]).reflectance[0];
    reference[k] = reflectance * traced.irradiance(k, 0);
    square[k] = std::pow(reflectance * irradiance(elements[k], 0) - reference[k], 2);
    variance[k] = std::pow(reflectance * traced.standard_error(k, 0), 2);
  }
  const double light = reference.square().sum();
  return {std::sqrt(std::max(0.0, square.sum() - variance.sum()) / light), std::sqrt(variance.sum() / light)};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Office buildings of any size: prints a Markdown table"};
  int rooms = 12;
  std::vector<double> sizes{0.4, 0.2, 0.1, 0.05};
  double patch_size = 0.6;
  Index samples = 128, places = 2000, paths = 20'000;
  std::string method;
  bool smallest = false;
  app.add_option("--rooms", rooms)->capture_default_str();
  app.add_option("--element-size", sizes, "m")->capture_default_str();
  app.add_option("--patch-size", patch_size, "m")->capture_default_str();
  app.add_option("--element-samples", samples)->capture_default_str();
  app.add_option("--method", method, "for the form factors; none: chosen");
  app.add_option("--places", places, "of the reference; 0: no error")->capture_default_str();
  app.add_option("--paths", paths, "of the reference, per place")->capture_default_str();
  app.add_flag("--smallest", smallest, "one room");
  CLI11_PARSE(app, argc, argv);
  if (smallest) {
    rooms = 1;
    sizes = {0.5};
    places = 20;
    paths = 200;
  }

  const Scene scene = test::office_building(rooms);
  fmt::print("{} rooms, {} faces\n\n", rooms, scene.face_count());
  fmt::print(
      "| patches | elements | patches s | F s | solve s | error s | elements s | write s | all s | peak GB | "
      ".vtp MB | "
      "noise % | stated % | true % | ± % |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const auto file = std::filesystem::temp_directory_path() / "bench_scale.vtp";
  for (const double size : sizes) {
    const Stopwatch all;
    SceneSettings settings;
    settings.patches = PatchSize{patch_size};
    if (!method.empty()) settings.method = method;
    settings.elements = ElementSize{size};
    settings.element_samples = samples;
    const SolvedScene solved = solve_scene(scene, settings);
    const Stopwatch writing;
    double bytes = 0;
    {
      const SolvedScene::Told told = solved.told_of_setup(0);
      write_solution(file, told.mesh, told.solution, {}, 1, told.error ? &*told.error : nullptr, told.patch);
      bytes = static_cast<double>(std::filesystem::file_size(file));
      std::filesystem::remove(file);
    }
    const double write_seconds = writing.elapsed(), all_seconds = all.elapsed();
    const double memory = static_cast<double>(peak_memory_bytes());
    const Elements& elements = *solved.elements;
    const Truth t = places > 0 ? truth(scene, elements.mesh, elements.irradiance, places, paths) : Truth{};
    const auto& s = solved.seconds;
    fmt::print(
        "| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} | {:.2f} "
        "| {} | "
        "{:.2f} | {:.2f} |\n",
        solved.patches.mesh.patch_count(), elements.mesh.patch_count(), s.mesh, s.form_factors, s.solve,
        s.error, s.elements, write_seconds, all_seconds, memory / 1e9, bytes / 1e6, 100 * elements.noise(),
        solved.error && solved.error->total ? fmt::format("{:.2f}", 100 * *solved.error->total) : "unknown",
        100 * t.error, 100 * t.noise);
    std::fflush(stdout);
  }
  return 0;
}
