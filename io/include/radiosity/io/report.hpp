// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/simulation/error_estimate.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

/// REPORT.json as a value. Parts that a command did not reach are absent from the file.
struct Report {
  std::string version, command;
  bool converged = false;

  struct SceneFacts {
    std::string file;
    Index surfaces = 0, patches = 0, bands = 0;
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

  /// What the scene did not need, and why: a sentence each.
  struct Modelled {
    Index bands = 0;
    bool occlusion = true;
    std::vector<std::string> left_out;
    /// Counted, not timed; absent where the run does not tell.
    struct Saved {
      /// Columns of B that F was not multiplied with: bands left out × iterations.
      std::optional<std::uint64_t> band_products;
      std::optional<std::uint64_t> radiosity_bytes;  ///< of B: 8 × patches × bands left out
      std::optional<std::uint64_t>
          visibility_tests;                       ///< pairs not asked whether anything stands between them
      std::optional<std::uint64_t> pairs_behind;  ///< pairs without a factor to compute, as they face away
    } saved;
  };
  std::optional<Modelled> modelled;

  struct FormFactorFacts {
    std::string method, storage;  ///< storage: dense | sparse | rows
    std::vector<std::pair<std::string, double>> parameters;
    std::size_t nonzeros = 0, bytes = 0;
    AssemblyReport assembly;
  };
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

  /// How an accuracy that was asked for was reached, or was not.
  struct Accuracy {
    double goal = 0;  ///< relative, as the total of `error`
    bool reached = false;
    struct Round {
      std::string method;
      Index samples = 0, patches = 0;
      double patch_size_m = 0, seconds = 0;
      std::optional<double> error;  ///< absent where a part of it is not known
    };
    std::vector<Round> rounds;
  };
  std::optional<Accuracy> accuracy;

  /// Irradiance at sensors, per band: mean over them, and root mean square of their standard errors, W/m².
  struct Probe {
    Index sensors = 0, samples = 0;
    Eigen::ArrayXd irradiance_mean, standard_error_rms;
  };
  std::optional<Probe> probe;

  struct Seconds {
    double read = 0, mesh = 0, form_factors = 0, solve = 0, error = 0, write = 0, total = 0;
  } seconds;
  std::uint64_t peak_memory_bytes = 0;
};

/// Writes the JSON with the stable names of docs/formats.md. Throws IoError when it cannot be written.
void write_report(const std::filesystem::path& file, const Report& report);

/// Largest resident memory of this process so far.
std::uint64_t peak_memory_bytes();

}  // namespace radiosity
