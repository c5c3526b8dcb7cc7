// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "commands.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/matrix_market.hpp"
#include "stages.hpp"

namespace radiosity::app {

int run_factors(const Options& options) {
  Job job(options);
  check_outputs(options, ".mtx");
  const LoadedScene loaded = read_stage(job, options.scene, MissingMaterials::allow);
  const SceneSettings settings = override_settings(loaded.settings, options.flags);
  const Patches patches = patch_stage(job, loaded.scene, settings);
  const Visibility visibility(patches.mesh);
  sides_stage(job, visibility);
  const ChosenMethod chosen = method_stage(job, visibility, settings);
  const FormFactorMatrix matrix = form_factor_stage(job, *chosen.method, visibility);

  // Half a matrix would look like a whole one: nothing of it is written.
  job.report.converged = job.report.form_factors->assembly.completed;
  Outputs outputs(job);
  job.stage.lap();
  if (job.report.converged) {
    outputs.will_write(options.output);
    write_matrix_market(
        options.output, matrix,
        fmt::format("radiosity {}\n{}\nForm factors of the {} patches of {} by method {}.\n"
                    "Row i, column j: the fraction of what leaves patch i that arrives at patch j.",
                    RADIOSITY_VERSION, options.command_line, patches.mesh.patch_count(),
                    options.scene.string(), chosen.info->name));
  }
  outputs.finish();
  return job.report.converged ? kDone : kNotConverged;
}

}  // namespace radiosity::app
