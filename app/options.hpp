// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "radiosity/io/read_scene.hpp"
#include "radiosity/rendering/pipeline.hpp"
#include "shared_run.hpp"

namespace radiosity::app {

/// The command line breaks a rule: exit status 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The command line as values. Where a flag was not given its optional is empty or its path is.
struct Options {
  std::string command;       ///< solve | factors | inspect | view | probe | compare
  std::string command_line;  ///< as it could be typed again
  std::filesystem::path scene, output, report_file, series_file, paraview_file, points_file;
  SceneSettings flags;  ///< what overrides the scene file; `camera` is not used
  int threads = 0;      ///< 0: every core
  bool quiet = false;
  std::filesystem::path form_factor_file;  ///< read instead of computed
  bool resume = false;                     ///< take up what an earlier run left
  double checkpoint_s = 120;               ///< between savings of the state of a solve
  bool close = true;                       ///< restore reciprocity and closure
  double accuracy = 0;                 ///< largest error that is wanted, %; 0: settings are chosen by hand
  double time_limit = 0;               ///< s; 0: none
  bool estimate_error = true;          ///< solve cheaper problems too, to tell how far the result is off
  double budget_s = 120;               ///< of compare
  std::size_t memory_limit_bytes = 0;  ///< of F; 0: the memory of this machine
  std::optional<std::string> petsc;    ///< options of PETSc, which is to solve
  std::optional<SharedRun> shared;     ///< not of the command line: this process is one of several
  /// Of several processes rank 0 alone tells, and writes what is not in pieces.
  bool speaks() const { return !shared || shared->ranks->rank() == 0; }

  struct View {
    std::filesystem::path camera_file;
    std::optional<Vec3> position, target, up;
    std::optional<double> vertical_fov_deg;
    int width = 800, height = 600;
    std::optional<double> exposure;  ///< 1/(W/m²)
    std::string pipeline = "radiosity", camera_name;
    Index samples = DrawOptions{}.samples;  ///< per pixel
    std::optional<int> depth;
    bool classical_attenuation = false;
    std::optional<double> attenuation_length;  ///< m
    std::optional<double> tessellation;        ///< pixels
    std::string false_colour,
        band;  ///< an array, and a band of it by name or number; empty: none, the mean of all
    bool logarithmic = false;
    std::optional<std::pair<double, double>> range;
    std::vector<double> isolines;       ///< values
    std::optional<int> isolines_count;  ///< or so many round ones, at most
  } view;
};

/// Nothing when --help or --version was asked for and printed. Throws UsageError.
std::optional<Options> parse_command_line(int argc, char** argv);

/// An argument as it would be typed in a shell: between quotes where it needs them.
std::string shell_quoted(const std::string& argument);

/// "; did you mean 'solve'?" of the first known word that begins with `word`, or else the nearest; "." where none is near.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& known);

/// The scene file's settings, with those flags in their place that were given.
SceneSettings override_settings(const SceneSettings& scene, const SceneSettings& flags);

}  // namespace radiosity::app
