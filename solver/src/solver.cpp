// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/solver.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "solvers.hpp"

namespace radiosity {
namespace {

constexpr std::array<SolverInfo, 4> kSolvers{{
    {"conjugate-gradient", "conjugate gradients on the symmetric form (diag(A/ρ) − S) B = diag(A/ρ) E",
     "HestenesStiefel1952", true, make_conjugate_gradient},
    {"gauss-seidel", "gathering, with the values of the sweep under way", "Goral1984", true,
     make_gauss_seidel},
    {"jacobi", "gathering, one bounce of light an iteration", "Goral1984", true, make_jacobi},
    {"progressive", "shooting from the patch with most unshot power; F is not stored", "Cohen1988", false,
     make_progressive},
}};

// A band in which nothing absorbs and nothing escapes has no solution when it emits, and no unique one when it does not.
void require_sink(const RadiositySystem& system) {
  if (!system.form_factors().stored()) return;
  double escaped = 0;
  for (Index i = 0; i < system.size(); ++i) escaped += system.areas()[i] * system.form_factors().escaped(i);
  if (escaped > tolerance::kNoEscape * system.areas().sum()) return;
  for (Index b = 0; b < system.bands(); ++b) {
    if ((system.reflectance().col(b) == 1).all() && (system.emission().col(b) > 0).any()) {
      throw InputError(fmt::format(
          "band {}: reflectance is 1 everywhere in a closed scene: power is emitted but can neither be "
          "absorbed nor escape, so there is no steady state; lower a reflectance or open the scene",
          b));
    }
  }
}

std::string describe(const SolveReport& report, const SolverOptions& options) {
  switch (report.status) {
    case SolveStatus::converged:
      return fmt::format("converged after {} iterations: residual {:.2e} ≤ tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::iteration_limit:
      return fmt::format("stopped at the limit of {} iterations: residual {:.2e} > tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::stopped:
      return fmt::format("stopped on request after {} iterations: residual {:.2e}, tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::failed:
      break;
  }
  return fmt::format(
      "no further progress after {} iterations: residual {:.2e} > tolerance {:.2e}; F is too far from "
      "reciprocal or closed for this solver",
      report.iterations, report.residual, options.tolerance);
}

}  // namespace

double power_share(const RadiositySystem& system, const BandArray& r) {
  double largest = 0;
  for (Index b = 0; b < system.bands(); ++b) {
    const double emitted = (system.areas() * system.emission().col(b)).sum();
    if (emitted > 0) largest = std::max(largest, (system.areas() * r.col(b).abs()).sum() / emitted);
  }
  return largest;
}

BandArray residual(const RadiositySystem& system, const BandArray& radiosity) {
  BandArray gathered;
  system.form_factors().multiply(radiosity, gathered);
  return system.emission() - radiosity + system.reflectance() * gathered;
}

SolveResult Solver::solve(const RadiositySystem& system, const SolverOptions& options) const {
  if (!(options.tolerance > 0 && std::isfinite(options.tolerance))) {
    throw InputError(fmt::format("tolerance: {} is not positive", options.tolerance));
  }
  if (options.max_iterations < 0) {
    throw InputError(fmt::format("max_iterations: {} is negative; 0 takes the solver's own limit",
                                 options.max_iterations));
  }
  require_sink(system);

  SolveResult result;
  SolveReport& report = result.report;
  result.radiosity = system.emission();
  const bool dark = (system.emission() == 0).all();
  const bool black = (system.reflectance() == 0).all();
  if (dark || black) {  // B = E
    report.status = SolveStatus::converged;
    report.history = {0};
    report.message = dark ? "nothing is emitted: B = 0" : "nothing reflects: B = E";
    return result;
  }

  const Index limit =
      options.max_iterations > 0 ? options.max_iterations : default_max_iterations(system.size());
  report.status = SolveStatus::failed;
  iterate(system, options.tolerance, result.radiosity, [&](double estimate) {
    report.residual = estimate;
    report.iterations = static_cast<Index>(report.history.size());
    report.history.push_back(estimate);
    const bool go_on = !options.step || options.step(report.iterations, estimate, result.radiosity);
    if (estimate <= options.tolerance) {
      report.status = SolveStatus::converged;
    } else if (!go_on) {
      report.status = SolveStatus::stopped;
    } else if (report.iterations >= limit) {
      report.status = SolveStatus::iteration_limit;
    } else {
      return true;
    }
    return false;
  });
  if (system.form_factors().stored()) {
    report.residual = power_share(system, residual(system, result.radiosity));
    if (report.status == SolveStatus::converged && !(report.residual <= options.tolerance)) {
      report.status = SolveStatus::failed;
    }
  }
  report.message = describe(report, options);
  return result;
}

std::span<const SolverInfo> solvers() {
  return kSolvers;
}

const SolverInfo& find_solver(std::string_view name) {
  std::string names;
  for (const auto& solver : kSolvers) {
    if (solver.name == name) return solver;
    names += names.empty() ? "" : ", ";
    names += solver.name;
  }
  throw InputError(fmt::format("solver '{}' is unknown; there are {}", name, names));
}

}  // namespace radiosity
