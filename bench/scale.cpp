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
#include "radiosity/formfactors/sides.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/report.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "radiosity/simulation/stopwatch.hpp"

/// Office buildings with more and more elements: seconds of each stage, memory, and the true error, from path tracing at random places.
namespace {

using namespace radiosity;

/// √(Σ (ρ H − ρ Ĥ)² / Σ (ρ Ĥ)²) over cells that are chosen by area, Ĥ the mean over a cell by path tracing from random points of it,
/// less the noise of Ĥ in the same measure, from the spread of the points; and the standard error of that, from the spread of the cells.
struct Truth {
  double error = 0, standard_error = 0;
};

/// Of each column of `irradiance`, which has a row for each patch of the mesh; the cells are its clusters.
std::vector<Truth> truths(const PatchMesh& patches, const PatchMesh& mesh, const BandArray& irradiance,
                          Index cells, Index paths) {
  constexpr Index kPoints = 128;  // per cell
  const auto faces = std::make_shared<const PatchMesh>(patches);
  const Visibility visibility(*faces);
  std::mt19937_64 random(7);
  const auto draw = [&] { return test::uniform(random); };
  const auto choose = [&](const std::vector<double>& up_to) {
    return static_cast<Index>(std::upper_bound(up_to.begin(), up_to.end() - 1, draw() * up_to.back()) -
                              up_to.begin());
  };
  std::vector<double> up_to;
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    const bool emits = (mesh.material_of(mesh.members(c)[0]).emission > 0).any();
    up_to.push_back((c > 0 ? up_to.back() : 0) + (emits ? 0 : mesh.cluster_areas()[c]));
  }
  std::vector<Place> places;
  BandArray told = BandArray::Zero(cells, irradiance.cols());
  Eigen::ArrayXd reflectance(cells);
  for (Index k = 0; k < cells;) {
    const Index c = choose(up_to);
    const auto members = mesh.members(c);
    std::vector<double> areas;
    for (const Index i : members) areas.push_back((areas.empty() ? 0 : areas.back()) + mesh.area(i));
    std::vector<Place> points;
    while (static_cast<Index>(points.size()) < kPoints) {
      const Index i = members[static_cast<std::size_t>(choose(areas))];
      const Vec3 x = PatchSampler(mesh, i).at({draw(), draw()});
      const Vec3& n = mesh.normal(i);
      // What lies against another patch is nobody's business.
      const Visibility::Hit over = visibility.first_hit(x + 1e-4 * n, n);
      if (over.patch != Visibility::kNothing && !over.front && over.distance < 0.01) break;
      points.push_back({x, n, visibility.first_hit(x + 1e-4 * n, -n).patch});
    }
    if (static_cast<Index>(points.size()) < kPoints) continue;
    places.insert(places.end(), points.begin(), points.end());
    for (const Index i : members) told.row(k) += mesh.area(i) / areas.back() * irradiance.row(i);
    reflectance[k++] = mesh.material_of(members[0]).reflectance[0];
  }
  const PathTraced traced = path_traced(faces, places, std::max(2, paths / kPoints));
  Eigen::ArrayXd variance(cells), reference(cells);
  for (Index k = 0; k < cells; ++k) {
    const auto own = traced.irradiance.col(0).segment(k * kPoints, kPoints);
    const double mean = own.mean();
    reference[k] = reflectance[k] * mean;
    variance[k] = std::pow(reflectance[k], 2) * (own - mean).square().sum() / (kPoints * (kPoints - 1));
  }
  const double light = reference.square().sum();
  std::vector<Truth> out;
  for (const auto& column : told.colwise()) {
    const Eigen::ArrayXd excess = (reflectance * column - reference).square() - variance;
    const double of_square = std::sqrt((excess - excess.mean()).square().sum()) / light;
    const double error = std::sqrt(std::max(0.0, excess.sum()) / light);
    out.push_back({error, of_square / (2 * std::max(error, std::sqrt(of_square)))});
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Office buildings of any size: prints a Markdown table"};
  int rooms = 12;
  std::vector<double> sizes{0.4, 0.2, 0.1, 0.05};
  double patch_size = 0.6;
  Index samples = 128, places = 2000, paths = 20'000;
  std::string method, file, keep;
  double accuracy = 0;
  bool smallest = false, bare = false, chosen = false, extrapolate = false;
  app.add_option("--rooms", rooms)->capture_default_str();
  app.add_option("--scene", file, "a mesh or scene file in place of the office building");
  app.add_option("--element-size", sizes, "m; 0: not said")->capture_default_str();
  app.add_option("--patch-size", patch_size, "m; 0: not said")->capture_default_str();
  app.add_option("--accuracy", accuracy, "%; in place of patch sizes and methods");
  app.add_flag("--extrapolate", extrapolate,
               "take the error of the patches off, as for an accuracy; with --no-elements, tell the error "
               "without that, too");
  app.add_option("--element-samples", samples)->capture_default_str();
  app.add_flag("--no-elements", bare, "light is told of the patches");
  app.add_flag("--auto-elements", chosen, "elements as small as light changes");
  app.add_option("--method", method, "for the form factors; none: chosen");
  app.add_option("--keep", keep, "where the last solution stays, a .vtp");
  app.add_option("--places", places, "of the reference: cells; 0: no error")->capture_default_str();
  app.add_option("--paths", paths, "of the reference, per cell")->capture_default_str();
  app.add_flag("--smallest", smallest, "one room");
  CLI11_PARSE(app, argc, argv);
  if (smallest) {
    rooms = 1;
    sizes = {0.5};
    places = 20;
    paths = 200;
  }

  const Scene scene = file.empty() ? test::office_building(rooms) : read_scene(file).scene;
  fmt::print("{}, {} faces\n\n", file.empty() ? fmt::format("{} rooms", rooms) : file, scene.face_count());
  fmt::print(
      "| patches | elements | patches s | F s | solve s | error s | elements s | write s | all s | peak GB | "
      ".vtp MB | "
      "noise % | stated % | true % | ± % |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const auto output =
      keep.empty() ? std::filesystem::temp_directory_path() / "bench_scale.vtp" : std::filesystem::path(keep);
  for (const double size : sizes) {
    const Stopwatch all;
    SceneSettings settings;
    SolveOptions options;
    if (accuracy > 0) options.accuracy = accuracy / 100;
    options.extrapolate = extrapolate;
    if (patch_size > 0) settings.patches = PatchSize{patch_size};
    if (!method.empty()) settings.method = method;
    if (bare) settings.elements = NoElements{};
    if (chosen) settings.elements = AutoElements{};
    if (size > 0) settings.elements = ElementSize{size};
    settings.element_samples = samples;
    const SolvedScene solved = solve_scene(scene, settings, options);
    const SolvedScene::Told told = solved.told_of_setup(0);
    const Stopwatch writing;
    write_solution(output, told.mesh, told.solution, {}, 1, told.error ? &*told.error : nullptr, told.patch);
    const double write_seconds = writing.elapsed(), all_seconds = all.elapsed();
    const auto bytes = static_cast<double>(std::filesystem::file_size(output));
    if (keep.empty()) std::filesystem::remove(output);
    const double memory = static_cast<double>(peak_memory_bytes());
    const bool corrected = !solved.elements && solved.error && solved.error->correction.size() > 0;
    BandArray irradiance(told.solution.irradiance.rows(), corrected ? 2 : 1);
    irradiance.col(0) = told.solution.irradiance.col(0);
    if (corrected) irradiance.col(1) = irradiance.col(0) - solved.error->correction.col(0);
    const std::vector<Truth> t =
        places > 0 ? truths(solved.patches.mesh, solved.elements ? told.mesh : solved.patches.mesh,
                            irradiance, places, paths)
                   : std::vector<Truth>(2);
    const auto& s = solved.seconds;
    fmt::print(
        "| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} | {:.2f} "
        "| {} | "
        "{:.2f} | {:.2f} |\n",
        solved.patches.mesh.cluster_count(), told.mesh.patch_count(), s.mesh, s.form_factors, s.solve,
        s.error, s.elements, write_seconds, all_seconds, memory / 1e9, bytes / 1e6,
        solved.elements ? 100 * solved.elements->noise() : 0,
        solved.error && solved.error->total ? fmt::format("{:.2f}", 100 * *solved.error->total) : "unknown",
        100 * t[0].error, 100 * t[0].standard_error);
    if (corrected)
      fmt::print("  without the correction: true {:.2f} %, ± {:.2f} %; patches {:.2f} %, as size^{:.2g}\n",
                 100 * t[1].error, 100 * t[1].standard_error, 100 * *solved.error->patches,
                 *solved.error->order);
    if (solved.accuracy)
      for (const AccuracyRound& round : solved.accuracy->rounds)
        fmt::print("  {} of {} samples, {} patches: {:.2f} s, form factors {:.2f} %, patches {:.2f} %\n",
                   round.method->name, round.options.samples, round.patches, round.seconds,
                   100 * round.error.form_factors.value_or(NAN), 100 * round.error.patches.value_or(NAN));
    std::fflush(stdout);
  }
  return 0;
}
