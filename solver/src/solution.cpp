// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/solution.hpp"

#include <fmt/format.h>

#include <limits>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

EnergyBalance energy_balance(const RadiositySystem& system, const BandArray& radiosity,
                             const BandArray& irradiance) {
  const auto power = [&](const BandArray& exitance) -> BandValues {
    return (exitance.colwise() * system.areas()).colwise().sum().transpose();
  };
  // Of rows on demand it is known only now.
  const Eigen::ArrayXd escaped = system.on_demand() ? system.form_factors().escaped() : system.escaped();
  EnergyBalance energy;
  energy.emitted_w = power(system.emission());
  energy.absorbed_w = power(system.absorptance() * irradiance);
  energy.escaped_w = power(radiosity.colwise() * escaped);
  BandValues received = energy.emitted_w;
  if (system.external_irradiance().size() > 0) {
    energy.external_w = power(system.external_irradiance());
    received += energy.external_w;
  }
  for (const BandValues* power_w : {&received, &energy.absorbed_w, &energy.escaped_w})
    if (!power_w->isFinite().all())
      throw InputError(
          fmt::format("the power exceeds what a double holds, {:.2g} W: scale the emission, all light is "
                      "proportional to it",
                      std::numeric_limits<double>::max()));
  energy.imbalance = (received > 0).select((received - energy.absorbed_w - energy.escaped_w) / received, 0.0);
  return energy;
}

Solution solve(const Solver& solver, const RadiositySystem& system, const PatchMesh& mesh,
               const SolverOptions& options) {
  Solution solution;
  SolveResult result = solver.solve(system, options);
  solution.radiosity = std::move(result.radiosity);
  solution.report = std::move(result.report);
  solution.irradiance = system.irradiance(solution.radiosity);
  solution.energy = energy_balance(system, solution.radiosity, solution.irradiance);
  solution.radiosity = mesh.per_patch(solution.radiosity);
  solution.irradiance = mesh.per_patch(solution.irradiance);
  solution.vertex_radiosity = vertex_values(mesh, solution.radiosity);
  return solution;
}

EnergyBalance select_bands(const EnergyBalance& energy, Index first, Index count) {
  EnergyBalance part = energy;
  for (BandValues* values :
       {&part.emitted_w, &part.absorbed_w, &part.escaped_w, &part.imbalance, &part.external_w})
    if (values->size() > 0) *values = values->segment(first, count).eval();
  return part;
}

Solution select_bands(const Solution& solution, Index first, Index count) {
  Solution part = solution;
  for (BandArray* values : {&part.radiosity, &part.irradiance, &part.vertex_radiosity,
                            &part.report.error_bound, &part.report.condition})
    if (values->cols() > 0) *values = values->middleCols(first, count).eval();
  part.energy = select_bands(solution.energy, first, count);
  return part;
}

}  // namespace radiosity
