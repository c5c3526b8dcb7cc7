// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "radiosity/meshing/camera.hpp"
#include "radiosity/simulation/compare.hpp"

namespace radiosity {

/// Where a comparison came from.
struct ComparisonOrigin {
  std::string version, command;
  std::string scene;             ///< as it would be typed, quoted for the shell where that is needed
  std::optional<Camera> camera;  ///< absent: automatic_camera
  int threads = 0;               ///< as given; 0: every core
};

/// Throws IoError unless a comparison could be written into this directory: it must not exist yet, in a directory that does, or
/// hold nothing but the files of an earlier comparison. Leaves nothing behind. To be called before the long work.
void require_comparison_directory(const std::filesystem::path& directory);

/// The command that repeats a run, e.g. "radiosity solve room.toml -o room.vtp --patch-size 0.1 --method hemisphere --samples 256".
std::string solve_command(const Comparison& comparison, const ComparedRun& run,
                          const ComparisonOrigin& origin);

/// For an accuracy, the cheapest run that errs by no more (see error_at_most).
struct Advice {
  double error;                    ///< asked for, relative
  std::optional<std::size_t> run;  ///< of Comparison::runs; absent: none was good enough
};
/// For 5, 2, 1 and 0.5 %.
std::vector<Advice> advice(const Comparison& comparison);
/// "1 %: radiosity solve … (2.1 s, 0.8 %)"
std::string advice_text(const Comparison& comparison, const Advice& advice, const ComparisonOrigin& origin);

/// trade.csv, trade.json and index.html (see docs/formats.md) in the directory.
std::vector<std::filesystem::path> comparison_files(const std::filesystem::path& directory);

/// Writes them into the directory, which is made where it does not exist. The page needs no other file and no network. Throws
/// IoError.
void write_comparison(const std::filesystem::path& directory, const Comparison& comparison,
                      const ComparisonOrigin& origin);

}  // namespace radiosity
