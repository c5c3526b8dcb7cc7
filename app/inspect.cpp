// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include "commands.hpp"
#include "radiosity/formfactors/estimate_seconds.hpp"
#include "radiosity/formfactors/sides.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/output.hpp"
#include "stages.hpp"

namespace radiosity::app {
namespace {

std::string band_text(const BandValues& values) {
  if ((values == values[0]).all()) return fmt::format("{:.4g}", values[0]);
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(fmt::format("{:.4g}", value));
  return fmt::format("{}", fmt::join(texts, " "));
}

std::string sides_text(Sides sides) {
  return sides == Sides::front ? "front" : sides == Sides::both ? "both" : "auto";
}

void print_materials(const Console& console, const Scene& scene) {
  std::vector<Index> faces(scene.materials().size());
  for (Index f = 0; f < scene.face_count(); ++f) ++faces[scene.material(f)];

  std::vector<std::vector<std::string>> rows = {
      {"material", "faces", "area m²", "sides", "reflectance", "emission"}};
  for (Index m = 0; m < static_cast<Index>(scene.materials().size()); ++m) {
    const Material& material = scene.materials()[m];
    rows.push_back({material.name, fmt::format("{}", faces[m]), fmt::format("{:.4g}", scene.material_area(m)),
                    sides_text(material.sides), band_text(material.reflectance),
                    band_text(material.emission) + (material.emits_power ? " W" : " W/m²")});
  }
  std::vector<std::size_t> widths(rows.front().size());
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string text;
    for (std::size_t c = 0; c < widths.size(); ++c) text += fmt::format("{:<{}}  ", rows[r][c], widths[c]);
    console.line(r == 0 ? "materials" : "", "{}", text);
  }
}

/// A row of a method that looks at pairs takes seconds or minutes beyond.
constexpr Index kMostPairsOfRow = 100'000;

}  // namespace

int run_inspect(const Options& options) {
  Job job(options);
  if (!options.report_file.empty()) require_writable(options.report_file, ".json");
  const LoadedScene loaded = read_stage(job, options.scene, MissingMaterials::allow);
  const Vec3 &lower = loaded.scene.lower(), &upper = loaded.scene.upper();
  job.console.line("bounds", "{:.6g} … {:.6g}, {:.6g} … {:.6g}, {:.6g} … {:.6g} m", lower.x(), upper.x(),
                   lower.y(), upper.y(), lower.z(), upper.z());
  print_materials(job.console, loaded.scene);

  const SceneSettings settings = override_settings(loaded.settings, options.flags);
  const PatchOptions patch_options = settings.patches.value_or(PatchOptions{});
  job.stage.lap();
  const Patches patches = make_patches(loaded.scene, patch_options);
  job.report.seconds.mesh = job.stage.lap();
  tell_patches(job, patches, patch_options);
  const Index n = patches.mesh.cluster_count();
  const Visibility visibility(patches.mesh);
  warn(job, side_warnings(seen_sides(visibility), patches.mesh));
  job.console.line("occlusion", "{}",
                   visibility.convex() ? "none: no patch can stand between two others"
                                       : "some patches may stand between others");
  job.console.line("form factors", "{} at most ({} × {} single precision)", bytes_text(4.0 * n * n), n, n);

  const int threads = options.threads > 0
                          ? options.threads
                          : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const std::string_view automatic = choose_method(visibility, {}).info->name;
  job.console.line("estimate", "time for the form factors on {} {}, from a sample of rows:", threads,
                   threads == 1 ? "thread" : "threads");
  for (const FormFactorMethodInfo& info : form_factor_methods()) {
    FormFactorOptions method_options;
    method_options.samples = settings.samples.value_or(0);
    method_options.resolution = settings.resolution.value_or(0);
    method_options.tolerance = settings.factor_tolerance.value_or(0);
    method_options.seed = settings.seed.value_or(method_options.seed);
    const auto method = info.make(visibility, method_options);
    const std::string time = method->reciprocal() && n > kMostPairsOfRow
                                 ? fmt::format("not timed: each row has {} pairs", n)
                                 : "about " + seconds_text(estimate_seconds(*method, n));
    job.console.line("", "{:<12} {}, {}{}", info.name, time, settings_text(method->options()),
                     info.name == automatic ? "; what auto would choose" : "");
  }
  job.report.converged = true;
  job.stage.lap();  // the estimates are no writing
  Outputs(job).finish();
  return kDone;
}

}  // namespace radiosity::app
