// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/compare.hpp"

#include "commands.hpp"
#include "radiosity/io/comparison.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "stages.hpp"

namespace radiosity::app {

int run_compare(const Options& options) {
  Job job(options);
  require_comparison_directory(options.output);
  const LoadedScene loaded = read_stage(job, options.scene);
  const SceneSettings settings = override_settings(loaded.settings, options.flags);
  warn_of_lights(job, loaded);
  require_emission(loaded.scene, options.scene);
  const PatchOptions patches = settings.patches.value_or(PatchOptions{});

  CompareOptions compare_options;
  compare_options.budget_s = options.budget_s;
  compare_options.seed = settings.seed.value_or(compare_options.seed);
  compare_options.memory_limit_bytes = options.memory_limit_bytes;
  compare_options.meshed = [&](const Patches& made) {
    job.report.seconds.mesh = job.stage.lap();
    tell_patches(job, made, patches);
  };
  compare_options.trace = [](const auto& mesh, std::span<const Place> places, Index paths,
                             std::uint64_t seed) {
    return path_traced(mesh, places, paths, seed).irradiance;
  };
  const Comparison comparison = [&] {
    ProgressBar bar(job.console, "comparing");
    compare_options.progress = [&](double fraction) { return bar(fraction); };
    return compare(loaded.scene, patches, compare_options);
  }();
  job.report.converged = comparison.completed;
  job.report.seconds.solve = job.stage.lap();
  if (comparison.runs.empty()) {
    job.console.line("compared", "interrupted before there was a reference; nothing is written");
    return kNotConverged;
  }
  const ComparisonOrigin origin{RADIOSITY_VERSION, options.command_line, shell_quoted(options.scene.string()),
                                settings.camera, options.threads};
  const ComparedReference& reference = comparison.finer ? *comparison.finer : comparison.factors;
  job.console.line("reference", "{} with {} samples on {} patches; errs by {:.2g} % itself", reference.method,
                   reference.settings.samples, reference.patches, 100 * reference.own_error());
  if (reference.traced)
    job.console.line(
        "path tracing",
        "of {} patches: the reference errs by {:.2g} ± {:.2g} %, by {:.2g} ± {:.2g} % in the mean",
        comparison.tracing->patches, 100 * reference.traced->rms, 100 * reference.traced->standard_error,
        100 * reference.traced->mean, 100 * reference.traced->mean_standard_error);
  for (const std::string& note : comparison.notes) job.console.line("note", "{}", note);
  for (const Advice& line : advice(comparison))
    job.console.line("for", "{}", advice_text(comparison, line, origin));
  Outputs outputs(job);
  job.stage.lap();
  for (const auto& file : comparison_files(options.output)) outputs.will_write(file);
  write_comparison(options.output, comparison, origin);
  outputs.finish();
  return comparison.completed ? kDone : kNotConverged;
}

}  // namespace radiosity::app
