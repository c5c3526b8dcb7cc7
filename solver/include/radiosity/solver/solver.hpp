// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "radiosity/solver/radiosity_system.hpp"

namespace radiosity {

/// How far shooting has come, in its own units: enough to go on to the bits of a run that was not ended.
struct ShootingState {
  BandArray received, unshot;    ///< n × bands solved: B and ΔB
  double shot = 0, arrived = 0;  ///< m², over the shots so far
  double trust = 1, before = 0;  ///< in the ambient term, and the share unshot when that was last judged
  std::vector<double> history;   ///< SolveReport::history
};

struct SolverOptions {
  double tolerance = 1e-6;   ///< of the residual, see SolveReport::residual
  Index max_iterations = 0;  ///< 0: the solver's own limit
  double relaxation =
      1;  ///< ω ∈ (0, 2): each step of Gauss–Seidel is taken ω times; other solvers take 1 only
  /// Shooting: let the radiosities that `step` sees, and the result where the solve ends early, include the light that is still
  /// under way, as if it fell evenly on everything [Cohen1988].
  bool ambient = false;
  /// Called with iteration 0 and B = E, then after each iteration, with the number of iterations done, the residual
  /// estimate and B so far (n × bands, W/m²). Returning false stops the solve; what has been reached is kept.
  std::function<bool(Index iteration, double residual, const BandArray& radiosity)> step = {};
  /// The same without B, which costs shooting solvers as much as a shot.
  std::function<bool(Index iteration, double residual)> progress = {};
  /// Shooting: the state of an earlier run of the same that was ended, and where that of this one goes, every few shots. Gathering
  /// solvers begin anew: F, which they need, took far longer than they do.
  std::shared_ptr<const ShootingState> partial = {};
  std::function<void(Index shots, const std::function<ShootingState()>& state)> save = {};
};

enum class SolveStatus { converged, iteration_limit, stopped, failed };

struct SolveReport {
  SolveStatus status = SolveStatus::failed;
  Index iterations = 0;  ///< passes over F (gathering) or shots (shooting)
  /// Unaccounted share of the power, the largest over bands b and over components C of the scene, which exchange no light:
  ///   Σ_{i∈C} A_i |E_i − B_i + ρ_i Σ_j F_ij B_j| / Σ_{i∈C} A_i E_i    (E + ρ H₀ for E where light comes from outside),
  /// recomputed from B by Solver::solve. Where rows of F are computed on demand it is the solver's own estimate, the share of
  /// unshot power of the whole scene.
  double residual = 0;
  std::vector<double> history;  ///< residual estimate after each iteration, the starting value first
  /// W/m², 1 × bands: no radiosity is further from the solution than max_i |r_i| / min_i (1 − ρ_i Σ_j F_ij). Infinite where
  /// a patch loses nothing; not-a-number where rows of F are computed on demand.
  BandArray error_bound;
  /// λ_max/λ_min of I − ρF, 1 × bands, estimated from below: from the mean loss of the components, and from what conjugate gradients saw of
  /// the spectrum. An error ε of F changes B by about condition · ε. Not-a-number where rows of F are computed on demand.
  BandArray condition;
  std::string message;  ///< one sentence, with the numbers
  std::string warning;  ///< a sentence where `error_bound` says nothing about B; otherwise empty
};

struct SolveResult {
  BandArray radiosity;  ///< B, n × bands, W/m²
  SolveReport report;
};

/// Solves B = E + ρ (H₀ + F B). Authors implement `iterate`; `solve` checks inputs, leaves out bands that are dark, black or equal to
/// another, scales the others, stops, and recomputes the residual.
class Solver {
 public:
  virtual ~Solver() = default;

  /// Throws InputError on a tolerance that is not positive, a negative iteration limit, a relaxation that this solver cannot
  /// take, an F without the rows that it reads, and where there is no solution or more than one: in a band in which nothing is
  /// absorbed in all of a component that nothing leaves. Not converging is a status of the report, never an exception.
  SolveResult solve(const RadiositySystem& system, const SolverOptions& options = {}) const;

  /// Takes a relaxation other than 1.
  virtual bool relaxes() const { return false; }

  /// Reads rows of F, a FormFactorRows; other solvers only apply F, any FormFactorOperator.
  virtual bool reads_rows() const { return false; }

  /// The limit of iterations where SolverOptions::max_iterations is 0.
  virtual Index default_max_iterations(Index patches) const = 0;

 protected:
  /// What `iterate` reports to `solve` after each iteration: an estimate of the residual. False means: stop now.
  using Step = std::function<bool(double residual)>;

  struct State {
    BandArray radiosity;  ///< E at the start
    /// Eigenvalues of I − ρF that were met, per band.
    BandValues least, largest;
  };

  /// Improves `state` in place until `step` returns false, which it does at
  ///   residual ≤ tolerance.
  /// Inputs are checked; in each band something is emitted, between 1 and 2 W/m² at most, and something reflects.
  virtual void iterate(const RadiositySystem& system, const SolverOptions& options, State& state,
                       const Step& step) const = 0;
  /// What rounding leaves of a residual, as a share of Σ A B: a solve has converged when it came that close. B itself is
  /// rounded, and near ρ = 1 so much larger than E that this shows.
  virtual double rounding() const { return 4 * std::numeric_limits<double>::epsilon(); }
};

/// The largest over bands and components of Σ A_i |r_i| / Σ A_i E_i; components without emission do not count.
double power_share(const RadiositySystem& system, const BandArray& residual);

/// a/b where b > 0, elsewhere 0; divides by nothing else.
BandArray divide_or_zero(const BandArray& a, const BandArray& b);

/// A row of the table of solvers.
struct SolverInfo {
  std::string_view name;
  std::string_view summary;
  std::string_view citation;
  bool
      gathers;  ///< uses all of F in each iteration, so F is stored for it; the others shoot, one row at a time
  std::unique_ptr<Solver> (*make)();
};

inline constexpr std::string_view kDefaultSolver = "conjugate-gradient";

std::span<const SolverInfo> solvers();

/// Throws InputError that lists the names there are.
const SolverInfo& find_solver(std::string_view name);

}  // namespace radiosity
