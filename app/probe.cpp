// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/probe.hpp"

#include <cmath>
#include <vector>

#include "commands.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/io/sensors.hpp"
#include "radiosity/io/solution_file.hpp"
#include "stages.hpp"

namespace radiosity::app {

int run_probe(const Options& options) {
  Job job(options);
  if (options.speaks()) check_outputs(options, ".csv");
  const std::vector<Sensor> sensors = read_sensors(options.points_file);
  const SolvedMesh solved = read_solution(options.scene);
  job.report.seconds.read = job.stage.lap();
  job.console.line("solution", "{}, {} patches", options.scene.string(), solved.mesh.patch_count());

  const Visibility visibility(solved.mesh);
  ProbeOptions probe_options;
  probe_options.samples = options.flags.samples.value_or(probe_options.samples);
  probe_options.seed = options.flags.seed.value_or(probe_options.seed);
  if (options.shared) probe_options.ranks = options.shared->ranks;
  ProgressBar bar(job.console, "gathering");
  probe_options.progress = [&](double fraction) { return bar(fraction); };
  const ProbeResult result =
      probe(visibility, solved.patch_radiosity, solved.vertex_radiosity, sensors, probe_options);
  job.report.seconds.solve = job.stage.lap();

  if (!options.speaks()) return result.completed ? kDone : kNotConverged;
  // Half a list would look like a whole one: nothing of it is written.
  Outputs outputs(job);
  job.report.converged = result.completed;
  if (result.completed) {
    // Sums and squares of large values need not be finite where their means are.
    const auto count = static_cast<double>(sensors.size());
    job.report.probe = {
        static_cast<Index>(sensors.size()), result.samples,
        (result.irradiance / count).colwise().sum().transpose(),
        result.standard_error.matrix().colwise().stableNorm().transpose().array() / std::sqrt(count)};
    const double mean = (result.irradiance / static_cast<double>(result.irradiance.size())).sum();
    job.console.line(
        "sensors", "{} with {} rays each; irradiance {:.4g} W/m² in the mean, standard error {:.2g} W/m² rms",
        sensors.size(), result.samples, mean,
        result.standard_error.matrix().stableNorm() /
            std::sqrt(static_cast<double>(result.standard_error.size())));
    outputs.will_write(options.output);
    write_irradiance(options.output, sensors, result);
  } else {
    job.console.line("sensors", "interrupted; nothing is written");
  }
  outputs.finish();
  return result.completed ? kDone : kNotConverged;
}

}  // namespace radiosity::app
