// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <bit>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "radiosity/io/checkpoints.hpp"
#include "radiosity/io/form_factor_file.hpp"
#include "radiosity/io/paraview_script.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/rendering/render.hpp"
#include "stages.hpp"

namespace radiosity::app {
namespace {

/// The steps of a solve that --series wants. They are kept until the end, because the exposure that suits all
/// of them is that of the result: every pass over F, or the shots 0, 1, 2, 4, 8, …
class Steps {
 public:
  explicit Steps(bool shooting) : shooting_(shooting) {}

  void add(Index iteration, const BandArray& radiosity) {
    const bool wanted =
        !shooting_ || iteration == 0 || std::has_single_bit(static_cast<std::uint32_t>(iteration));
    if (wanted) keep(iteration, radiosity);
  }

  void keep(Index iteration, const BandArray& radiosity) {
    if (steps_.empty() || steps_.back().first < iteration) steps_.emplace_back(iteration, radiosity);
  }

  void write(const std::filesystem::path& file, const PatchMesh& mesh, double exposure) const {
    SolutionSeries series(file, mesh);
    for (const auto& [iteration, radiosity] : steps_) series.add(iteration, radiosity, exposure);
    series.finish();
  }

 private:
  bool shooting_;
  std::vector<std::pair<Index, BandArray>> steps_;
};

}  // namespace

int run_solve(const Options& options) {
  Job job(options);
  const bool speaks = options.speaks(), pieces = in_pieces(options.output);
  if (speaks)
    check_outputs(options, pieces ? ".pvtp" : is_solution(options.output) ? ".vtp" : ".vtp or .pvtp");
  const LoadedScene loaded =
      options.shared ? read_stage_shared(job, options.scene) : read_stage(job, options.scene);
  SceneSettings settings = override_settings(loaded.settings, options.flags);
  if (!options.form_factor_file.empty()) {
    const FormFactorFileFacts made = read_form_factor_facts(options.form_factor_file);
    settings.method = made.method;
    settings.samples = made.options.samples > 0 ? std::optional(made.options.samples) : std::nullopt;
    settings.resolution = made.options.resolution > 0 ? std::optional(made.options.resolution) : std::nullopt;
    settings.factor_tolerance =
        made.options.tolerance > 0 ? std::optional(made.options.tolerance) : std::nullopt;
    if (!settings.seed) settings.seed = made.options.seed;
  }
  std::optional<Checkpoints> checkpoints;
  if (options.accuracy == 0 && options.form_factor_file.empty()) {
    const std::uint64_t work = digest(loaded, settings, options.close);
    checkpoints.emplace(options.output, work, RADIOSITY_VERSION, options.checkpoint_s,
                        options.shared ? options.shared->ranks : nullptr);
    if (options.resume) {
      checkpoints->resume();
      job.console.line("resumed", "{} rows of the form factors, {} shots, {} elements",
                       checkpoints->resumed_rows(), checkpoints->resumed_shots(),
                       checkpoints->resumed_elements());
    } else if (checkpoints->found()) {
      job.console.line("note", "an earlier run left its state beside {}; with --resume it is gone on with",
                       options.output.string());
    }
  }

  const auto shown = [&](const BandArray& all) -> BandArray {  // the scene as it is, without the set-ups
    return all.leftCols(all.cols() / static_cast<Eigen::Index>(loaded.setups.size() + 1));
  };
  const bool wants_series = !options.series_file.empty();
  Steps steps(!find_solver(settings.solver ? *settings.solver : kDefaultSolver).gathers);
  std::function<void(Index, const BandArray&)> step;
  if (wants_series)
    step = [&](Index iteration, const BandArray& radiosity) { steps.add(iteration, shown(radiosity)); };
  const SolvedScene solved = solve_stage(job, loaded, settings, step, checkpoints ? &*checkpoints : nullptr);

  const bool reached = !solved.accuracy || solved.accuracy->reached;
  const int status = solved.converged() && reached ? kDone : kNotConverged;
  if (options.shared) note_ranks(job, solved);
  if (!speaks && !pieces) return status;

  Outputs outputs(job);
  const Ranks* const ranks = options.shared && pieces ? options.shared->ranks.get() : nullptr;
  for (std::size_t k = 0; k <= loaded.setups.size(); ++k) {
    const PatchMesh mesh = solved.mesh_of_setup(static_cast<Index>(k));
    const Solution solution = solved.solution_of_setup(static_cast<Index>(k));
    const double exposure = automatic_exposure(mesh, solution.radiosity);
    std::filesystem::path file = options.output;
    if (k > 0)
      file.replace_filename(
          fmt::format("{}-{}{}", file.stem().string(), loaded.setups[k - 1].name, file.extension().string()));
    if (k == 0 && wants_series && speaks) {
      // The steps of a series that was there before stay with it.
      const std::filesystem::path folder = std::filesystem::path(options.series_file).replace_extension();
      const bool made = !std::filesystem::exists(options.series_file) && !std::filesystem::exists(folder);
      outputs.will_write(options.series_file);
      if (made) outputs.will_write(folder);
      steps.keep(solution.report.iterations, solution.radiosity);
      steps.write(options.series_file, mesh, exposure);
    }
    const SolvedScene::Told told = solved.told_of_setup(static_cast<Index>(k));
    if (speaks) outputs.will_write(file);
    if (pieces)
      outputs.will_write(piece_of(file, ranks ? ranks->rank() : 0, ranks ? ranks->count() : 1), false);
    write_solution(file, told.mesh, told.solution,
                   {RADIOSITY_VERSION, options.command_line, solved.form_factors.method, solved.solver,
                    solved.converged()},
                   exposure, told.error ? &*told.error : nullptr, told.patch, ranks);
    if (k == 0 && !options.paraview_file.empty() && speaks) {
      outputs.will_write(options.paraview_file);
      write_paraview_script(options.paraview_file, file, settings.camera.value_or(automatic_camera(mesh)));
    }
  }
  if (!speaks) {
    outputs.keep();
    return status;
  }
  outputs.finish();
  const bool wants_elements = settings.elements && !std::holds_alternative<NoElements>(*settings.elements);
  if (checkpoints && solved.converged() && (solved.elements || !wants_elements)) checkpoints->remove();
  return status;
}

}  // namespace radiosity::app
