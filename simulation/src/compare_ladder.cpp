// SPDX-License-Identifier: GPL-3.0-or-later
#include "compare_ladder.hpp"

#include <fmt/format.h>

#include <cmath>

namespace radiosity {
namespace {

// To three digits, as it will be typed.
double rounded(double size) {
  const double unit = std::pow(10.0, std::floor(std::log10(size)) - 2);
  return std::stod(fmt::format("{:.6g}", std::round(size / unit) * unit));
}

}  // namespace

void add_coarser(MeshSeries& series, const Scene& scene) {
  const ComparedMesh user = series.user().facts;
  Index fewest = 0;
  for (const double factor : {4.0, 2.0}) {
    const double size = rounded(factor * user.size);
    PreparedMesh coarse = prepare(scene, PatchSize{size});
    if (coarse.facts.patches > 0.7 * user.patches || coarse.facts.patches <= fewest) continue;
    fewest = coarse.facts.patches;
    coarse.facts.size = size;
    if (factor == 2) series.twice_as_coarse = series.own;
    series.meshes.insert(series.meshes.end() - 1, std::move(coarse));
    ++series.own;
  }
}

void add_finer(MeshSeries& series, const Scene& scene) {
  series.meshes.push_back(prepare(scene, PatchSize{rounded(series.user().facts.size / 2)}));
}

std::vector<FormFactorOptions> ladder(const FormFactorMethodInfo& method) {
  const FormFactorOptions standard = method.defaults;
  const bool has_cells = standard.has_resolution();
  std::vector<FormFactorOptions> steps;
  if (has_cells) {
    for (Index samples = 1; samples <= 4 * standard.samples; samples *= 4)
      for (Index resolution = standard.resolution / 4; resolution <= 2 * standard.resolution; resolution *= 2)
        steps.push_back({.samples = samples, .resolution = resolution});
  } else {
    for (const double factor : {1.0 / 16, 1.0 / 4, 1.0, 4.0, 16.0})
      steps.push_back({.samples = std::max<Index>(1, static_cast<Index>(factor * standard.samples))});
  }
  return steps;
}

std::vector<ComparedRun> planned_runs(const MeshSeries& series, bool on_all_meshes, std::uint64_t seed) {
  std::vector<ComparedRun> out;
  for (std::size_t m = 0; m < series.meshes.size(); ++m) {
    if (m != series.own && !on_all_meshes) continue;
    for (const FormFactorMethodInfo& info : form_factor_methods()) {
      const bool exact = info.make(*series.meshes[m].visibility)->exact();
      for (FormFactorOptions settings : ladder(info)) {
        const bool standard =
            settings.samples == info.defaults.samples && settings.resolution == info.defaults.resolution;
        if (exact && !standard) continue;  // the settings change nothing
        settings.seed = seed;
        out.push_back(
            {.mesh = m, .method = std::string(info.name), .settings = settings, .standard = standard});
      }
    }
  }
  return out;
}

}  // namespace radiosity
