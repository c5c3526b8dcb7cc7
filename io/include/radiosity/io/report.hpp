// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

/// REPORT.json as a value. Parts that a command did not reach are absent from the file.
struct Report {
  std::string version, command;
  bool converged = false;

  struct SceneFacts {
    std::string file;
    Index surfaces = 0, patches = 0, pieces = 0,
          bands = 0;  ///< pieces: polygons, of which patches may be clusters
    double area_m2 = 0;
    Vec3 lower, upper;
    Repairs repairs;
    /// Where sides = "auto": see DecidedSides.
    struct AutoSides {
      Index sheets = 0, faces = 0;
      double area_m2 = 0;
      Index unseen_sheets = 0, solids = 0;
    };
    std::optional<AutoSides> auto_sides;
    std::vector<std::string> warnings;
  };
  std::optional<SceneFacts> scene;

  std::optional<Modelled> modelled;
  std::optional<FormFactorFacts> form_factors;

  struct SolverFacts {
    std::string name;
    double tolerance = 0;
    SolveReport report;
  };
  std::optional<SolverFacts> solver;
  std::optional<EnergyBalance> energy;
  std::vector<std::pair<std::string, EnergyBalance>> setups;
  std::optional<ErrorEstimate> error;
  std::optional<AccuracyReport> accuracy;

  struct ElementFacts {
    Index count = 0, samples = 0;
    double size_m = 0, noise = 0;  ///< Elements::noise
  };
  std::optional<ElementFacts> elements;

  /// Irradiance at sensors, per band: mean over them, and root mean square of their standard errors, W/m².
  struct Probe {
    Index sensors = 0, samples = 0;
    Eigen::ArrayXd irradiance_mean, standard_error_rms;
  };
  std::optional<Probe> probe;

  struct Seconds {
    double read = 0, mesh = 0, form_factors = 0, solve = 0, error = 0, elements = 0, write = 0, total = 0;
  } seconds;
  std::uint64_t peak_memory_bytes = 0;

  /// What each process of a run of several did, up to the end of its solve.
  struct Rank {
    double rows = 0, form_factor_bytes = 0;
    double form_factors_s = 0, solve_s = 0;     ///< waiting included
    double received_bytes = 0, exchange_s = 0;  ///< from others; waiting for them included
    double peak_memory_bytes = 0;
  };
  std::vector<Rank> ranks;  ///< empty: one process
};

/// Writes the JSON with the stable names of docs/formats.md. Throws IoError when it cannot be written.
void write_report(const std::filesystem::path& file, const Report& report);

/// Largest resident memory of this process so far.
std::uint64_t peak_memory_bytes();

}  // namespace radiosity
