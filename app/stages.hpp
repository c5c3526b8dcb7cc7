// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "options.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/report.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/simulation/error_estimate.hpp"
#include "radiosity/solver/solution.hpp"
#include "terminal.hpp"

namespace radiosity::app {

/// The stages that the subcommands share. Each prints its lines and fills its part of the report.
struct Job {
  explicit Job(const Options& given);

  const Options& options;
  Console console;
  Report report;
  Stopwatch total, stage;
  std::string_view where_few = "analytic";  ///< what --method auto takes where patches are few
  bool look_outwards = false;               ///< fronts do: sides_stage has said so
};

/// Refuses an output that could not be written, before any work is done for it.
void check_outputs(const Options& options, const std::string& extension);

/// Memory and closure, as the options say.
AssemblyOptions assembly_options(const Options& options);

LoadedScene read_stage(Job& job, const std::filesystem::path& file,
                       MissingMaterials missing = MissingMaterials::refuse);

Patches patch_stage(Job& job, const Scene& scene, const SceneSettings& settings);
/// What patch_stage says of patches, for those that were made elsewhere.
void tell_patches(Job& job, const Patches& patches, const PatchOptions& options);

/// Says the total, or why there is none, its parts and its notes.
void tell_error(Job& job, const ErrorEstimate& error);

/// Warns where fronts look outwards, or light meets backs.
void sides_stage(Job& job, const Visibility& visibility);

/// The rule behind --method auto: pairs where they are closed forms, `where_few` where patches are few, otherwise rays.
struct MethodChoice {
  std::string name, why;
};
MethodChoice choose_method(const Visibility& visibility, std::string_view where_few);

struct ChosenMethod {
  const FormFactorMethodInfo* info;
  FormFactorOptions options;
  std::unique_ptr<FormFactorMethod> method;
};
/// "samples 4, resolution 128": what is in force.
std::string settings_text(const FormFactorMethod& method);

ChosenMethod method_stage(Job& job, const Visibility& visibility, const SceneSettings& settings);

/// All rows of F, or what Ctrl-C left of them: see job.report.form_factors->assembly.completed.
FormFactorMatrix form_factor_stage(Job& job, const FormFactorMethod& method, const Visibility& visibility);

struct Solved {
  Patches patches;
  Solution solution;
  std::optional<ErrorEstimate> error;
  std::string method, solver;
  FormFactorOptions options;  ///< in force
  bool exact = false, reciprocal = false;
};
/// Scene → solution, through all the stages above. `step` is called after each iteration of the solver. Patches and
/// solution have the bands of the scene, then those of each set-up.
using Step = std::function<void(Index iteration, const BandArray& radiosity)>;
Solved solve_stage(Job& job, const Scene& scene, const SceneSettings& settings, const Step& step = {},
                   std::span<const LightingSetup> setups = {});

/// The same with settings that reach --accuracy, found in rounds; the report is that of the best.
Solved solve_to_accuracy(Job& job, const LoadedScene& loaded, const SceneSettings& settings);

/// Files that this run writes. Those that were not there before are removed again unless all went well.
class Outputs {
 public:
  explicit Outputs(Job& job) : job_(job) {}
  ~Outputs();
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// To be called before the file (or the folder, with what is in it) is written.
  void will_write(const std::filesystem::path& file);
  /// Takes the times, writes the report where one is wanted, prints the last lines, and keeps the files.
  void finish();

 private:
  Job& job_;
  std::vector<std::filesystem::path> files_, made_;
  bool keep_ = false;
};

}  // namespace radiosity::app
