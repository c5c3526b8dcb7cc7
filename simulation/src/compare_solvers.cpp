// SPDX-License-Identifier: GPL-3.0-or-later
#include "compare_measure.hpp"

#include <cmath>

namespace radiosity {
namespace {

constexpr double kSolverShare = 0.1;  // of the budget
constexpr int kDigits = 8;            // the tolerances are 10^−1 … 10^−kDigits

std::vector<SolverRun> measure(const SolverInfo& info, const RadiositySystem& system, const PatchMesh& mesh,
                               const BandArray& exact, const std::optional<TracedReference>& traced,
                               Budget& budget, double until) {
  std::vector<SolverRun> out;
  const auto next_tolerance = [&] { return std::pow(10.0, -1 - static_cast<double>(out.size())); };
  const double passes = info.gathers ? 1 : 1.0 / system.size();  // over F, per iteration
  double paused = 0;                                             // to measure errors
  const Stopwatch watch;
  SolverOptions options;
  options.tolerance = std::pow(10.0, -kDigits);
  options.step = [&](Index iteration, double residual, const BandArray& of_clusters) {
    const double reached = watch.elapsed();
    const BandArray radiosity = mesh.per_patch(of_clusters);
    while (out.size() < kDigits && residual <= next_tolerance())
      out.push_back({.solver = std::string(info.name),
                     .tolerance = next_tolerance(),
                     .products = iteration * passes,
                     .seconds = reached - paused,
                     .residual = residual,
                     .error = relative_error(mesh, radiosity, exact).rms,
                     .traced = traced ? std::optional(traced->error(radiosity)) : std::nullopt});
    paused += watch.elapsed() - reached;
    return budget.go_on(until);
  };
  const SolveReport report = info.make()->solve(system, options).report;
  while (out.size() < kDigits)
    out.push_back({.solver = std::string(info.name),
                   .tolerance = next_tolerance(),
                   .left_out = report.status == SolveStatus::stopped ? "not reached in the time for solvers"
                                                                     : report.message});
  return out;
}

}  // namespace

std::vector<SolverRun> compare_solvers(const PatchMesh& mesh, const FormFactorMatrix& f,
                                       const std::optional<TracedReference>& traced, Budget& budget) {
  const RadiositySystem system(f, mesh);
  SolverOptions options;
  options.tolerance = 1e-12;
  const BandArray exact =
      mesh.per_patch(find_solver("conjugate-gradient").make()->solve(system, options).radiosity);
  const double end = std::min(budget.elapsed() + kSolverShare * budget.seconds(), budget.end());
  auto waiting = static_cast<double>(std::size(solvers()));
  std::vector<SolverRun> out;
  for (const SolverInfo& info : solvers()) {
    const double now = budget.elapsed();
    for (SolverRun& run : measure(info, system, mesh, exact, traced, budget, now + (end - now) / waiting--))
      out.push_back(std::move(run));
  }
  return out;
}

}  // namespace radiosity
