// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/solution.hpp"

#include <fmt/format.h>

#include <limits>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

BandValues power_of(const BandArray& exitance, const Eigen::ArrayXd& areas) {
  return (exitance.colwise() * areas).colwise().sum().transpose();
}

BandValues received_of(const EnergyBalance& energy) {
  return energy.external_w.size() > 0 ? BandValues(energy.emitted_w + energy.external_w) : energy.emitted_w;
}

BandValues imbalance_of(const EnergyBalance& energy) {
  const BandValues received = received_of(energy);
  return (received > 0).select((received - energy.absorbed_w - energy.escaped_w) / received, 0.0);
}

}  // namespace

EnergyBalance energy_balance(const RadiositySystem& system, const BandArray& radiosity,
                             const BandArray& irradiance) {
  const auto power = [&](const BandArray& exitance) { return power_of(exitance, system.areas()); };
  // Of rows on demand it is known only now.
  const Eigen::ArrayXd escaped = system.on_demand() ? system.form_factors().escaped() : system.escaped();
  EnergyBalance energy;
  energy.emitted_w = power(system.emission());
  energy.absorbed_w = power(system.absorptance() * irradiance);
  energy.escaped_w = power(radiosity.colwise() * escaped);
  if (system.external_irradiance().size() > 0) energy.external_w = power(system.external_irradiance());
  BandValues received = received_of(energy);
  for (const BandValues* power_w : {&received, &energy.absorbed_w, &energy.escaped_w})
    if (!power_w->isFinite().all())
      throw InputError(
          fmt::format("the power exceeds what a double holds, {:.2g} W: scale the emission, all light is "
                      "proportional to it",
                      std::numeric_limits<double>::max()));
  energy.imbalance = imbalance_of(energy);
  return energy;
}

void add_irradiance(const PatchMesh& mesh, const Eigen::ArrayXd& escaped, const BandArray& irradiance,
                    Solution& solution) {
  const BandArray reflected = mesh.reflectance() * irradiance;
  solution.irradiance += irradiance;
  solution.radiosity += reflected;
  solution.vertex_radiosity = vertex_values(mesh, solution.radiosity);
  EnergyBalance& energy = solution.energy;
  energy.absorbed_w += power_of(mesh.per_cluster(mesh.absorptance() * irradiance), mesh.cluster_areas());
  energy.escaped_w += power_of(mesh.per_cluster(reflected).colwise() * escaped, mesh.cluster_areas());
  energy.imbalance = imbalance_of(energy);
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
