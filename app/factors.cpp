// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "commands.hpp"
#include "radiosity/io/form_factor_file.hpp"
#include "radiosity/io/matrix_market.hpp"
#include "stages.hpp"

namespace radiosity::app {

int run_factors(const Options& options) {
  Job job(options);
  const bool hdf5 = options.output.extension() == ".h5";
  check_outputs(options, hdf5 || options.output.extension() == ".mtx" ? options.output.extension().string()
                                                                      : ".mtx or .h5");
  const LoadedScene loaded = read_stage(job, options.scene, MissingMaterials::allow);
  const SceneSettings settings = override_settings(loaded.settings, options.flags);
  Telling telling(job, settings);
  const auto [scene, matrix] = scene_form_factors(loaded.scene, settings, telling.options());
  telling.finish(scene);

  // Half a matrix would look like a whole one: nothing of it is written.
  job.report.converged = scene.form_factors.assembly.completed;
  Outputs outputs(job);
  job.stage.lap();
  if (job.report.converged) {
    outputs.will_write(options.output);
    if (hdf5)
      write_form_factors(options.output, matrix, scene.patches.mesh, scene.form_factors, RADIOSITY_VERSION,
                         options.command_line);
    else
      write_matrix_market(
          options.output, matrix,
          fmt::format("radiosity {}\n{}\nForm factors of the {} patches of {} by method {}.\n"
                      "Row i, column j: the fraction of what leaves patch i that arrives at patch j.",
                      RADIOSITY_VERSION, options.command_line, matrix.size(), options.scene.string(),
                      scene.form_factors.method));
  }
  outputs.finish();
  return job.report.converged ? kDone : kNotConverged;
}

}  // namespace radiosity::app
