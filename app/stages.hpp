// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "options.hpp"
#include "radiosity/io/checkpoints.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/report.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "radiosity/simulation/stopwatch.hpp"
#include "terminal.hpp"

namespace radiosity::app {

/// What the subcommands share: their words, and the report that they fill.
struct Job {
  explicit Job(const Options& given);

  const Options& options;
  Console console;
  Report report;
  Stopwatch total, stage;
};

/// Refuses an output that could not be written, before any work is done for it.
void check_outputs(const Options& options, const std::string& extension);

/// Reads a scene and decides which faces have backs.
LoadedScene read_stage(Job& job, const std::filesystem::path& file,
                       MissingMaterials missing = MissingMaterials::refuse,
                       const ChordError& chord_error = {});

/// The same on one of several processes: rank 0 reads the file, and all get what it holds.
LoadedScene read_stage_shared(Job& job, const std::filesystem::path& file);
/// Tells of every process what it did; on all of them at once.
void note_ranks(Job& job, const SolvedScene& solved);

void warn(Job& job, const std::vector<std::string>& warnings);
/// Names the lights that radiosity takes nothing from.
void warn_of_lights(Job& job, const LoadedScene& loaded);
void tell_patches(Job& job, const Patches& patches, const PatchOptions& options);

/// "samples 4, resolution 128": what is in force.
std::string settings_text(const FormFactorOptions& options);

/// A scene in the library's hands: tells of each stage when it ends, and how far the others are.
class Telling {
 public:
  Telling(Job& job, const SceneSettings& settings, std::span<const LightingSetup> setups = {});

  /// What the command line asks for. They refer to this object.
  SolveOptions options();
  /// Fills its part of the report, and says how the rounds of an accuracy ended.
  void finish(const SolvedScene& solved);

 private:
  void stage(SolveStage ended, const SolvedScene& scene);
  void form_factors(const SolvedScene& scene);
  void solution(const SolvedScene& scene);
  void elements(const SolvedScene& scene);
  void warn_anew(const SolvedScene& scene);
  void hide_bar();

  Job& job_;
  const SceneSettings& settings_;
  std::span<const LightingSetup> setups_;
  std::optional<ProgressBar> bar_;
  std::optional<SolveStage> bar_stage_;
  std::size_t warnings_ = 0, rounds_ = 0;  ///< told
};

/// Scene → solution, told and reported.
SolvedScene solve_stage(Job& job, const LoadedScene& loaded, const SceneSettings& settings,
                        const std::function<void(Index iteration, const BandArray& radiosity)>& step = {},
                        Checkpoints* checkpoints = nullptr);

/// Files that this run writes. Those that were not there before are removed again unless all went well.
class Outputs {
 public:
  explicit Outputs(Job& job) : job_(job) {}
  ~Outputs();
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// To be called before the file (or the folder, with what is in it) is written; `tell`: the last lines name it.
  void will_write(const std::filesystem::path& file, bool tell = true);
  /// Takes the times, writes the report where one is wanted, prints the last lines, and keeps the files.
  void finish();
  /// The last alone: of a rank that does not speak.
  void keep() { keep_ = true; }

 private:
  Job& job_;
  std::vector<std::filesystem::path> files_, made_;
  bool keep_ = false;
};

}  // namespace radiosity::app
