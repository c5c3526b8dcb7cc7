// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "radiosity/solver/radiosity_system.hpp"

namespace radiosity {

struct SolverOptions {
  double tolerance = 1e-6;   ///< of the residual, see SolveReport::residual
  Index max_iterations = 0;  ///< 0: the solver's own limit
  /// Called with iteration 0 and B = E, then after each iteration, with the number of iterations done, the residual
  /// estimate and B so far (n × bands, W/m²). Returning false stops the solve; what has been reached is kept.
  std::function<bool(Index iteration, double residual, const BandArray& radiosity)> step = {};
};

enum class SolveStatus { converged, iteration_limit, stopped, failed };

struct SolveReport {
  SolveStatus status = SolveStatus::failed;
  Index iterations = 0;  ///< passes over F (gathering) or shots (shooting)
  /// Unaccounted share of the power, the largest over bands b, recomputed from B by the shell:
  ///   Σ_i A_i |E_i − B_i + ρ_i Σ_j F_ij B_j| / Σ_i A_i E_i.
  /// Where rows of F are computed on demand it is the solver's own estimate: the share of unshot power.
  double residual = 0;
  std::vector<double> history;  ///< residual estimate after each iteration, the starting value first
  std::string message;          ///< one sentence, with the numbers
};

struct SolveResult {
  BandArray radiosity;  ///< B, n × bands, W/m²
  SolveReport report;
};

/// Solves (I − ρF)B = E. Authors implement `iterate`; the shell checks inputs, stops, and recomputes the
/// residual.
class Solver {
 public:
  virtual ~Solver() = default;

  /// Throws InputError on a tolerance that is not positive or a negative iteration limit, and where no
  /// solution exists: ρ = 1 on all of a closed scene. Not converging is a status of the report, never an
  /// exception.
  SolveResult solve(const RadiositySystem& system, const SolverOptions& options = {}) const;

 protected:
  /// What `iterate` reports to the shell after each iteration: an estimate of the residual. False means: stop now.
  using Step = std::function<bool(double residual)>;

  /// Starts from `radiosity` = E and improves it in place until `step` returns false, which it does at
  ///   residual ≤ tolerance.
  /// Inputs are checked, something is emitted and something reflects.
  virtual void iterate(const RadiositySystem& system, double tolerance, BandArray& radiosity,
                       const Step& step) const = 0;
  virtual Index default_max_iterations(Index patches) const = 0;
};

/// A row of the table of solvers.
struct SolverInfo {
  std::string_view name;
  std::string_view summary;
  std::string_view citation;
  bool needs_stored_rows;  ///< reads F many times; the others read one row at a time and F is not stored for
                           ///< them
  std::unique_ptr<Solver> (*make)();
};

std::span<const SolverInfo> solvers();

/// Throws InputError that lists the names there are.
const SolverInfo& find_solver(std::string_view name);

}  // namespace radiosity
