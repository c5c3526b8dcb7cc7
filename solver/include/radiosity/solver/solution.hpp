// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/solver/radiosity_system.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity {

/// Where the power goes, W per band.
///   emitted  = Σ A_i E_i
///   external = Σ A_i H₀_i
///   absorbed = Σ A_i (1 − ρ_i) H_i
///   escaped  = Σ A_i B_i (1 − Σ_j F_ij)
///   imbalance = (emitted + external − absorbed − escaped) / (emitted + external);  0 where both are
/// The imbalance measures the residual and the reciprocity error of F together.
struct EnergyBalance {
  BandValues emitted_w, absorbed_w, escaped_w, imbalance;
  BandValues external_w = {};  ///< empty where the system has no external irradiance
};

EnergyBalance energy_balance(const RadiositySystem& system, const BandArray& radiosity,
                             const BandArray& irradiance);

/// Mean over the patches round each vertex, vertices × bands; 0 where there are none.
BandArray vertex_means(const PatchMesh& mesh, const BandArray& patch_values);

/// Vertex radiosities for Gouraud interpolation, vertices × bands, W/m², clamped at 0. A vertex inside a
/// smooth surface takes the mean of its patches. A vertex on a border takes
///   2·(mean of its patches) − (mean of the inner vertices joined to it by an edge, or, where none is, of the
///   inner vertices of its patches),
/// and, where there is no inner vertex either, the mean of its patches. Works on any per-patch field (n ×
/// bands).
BandArray vertex_values(const PatchMesh& mesh, const BandArray& patch_values);

/// Everything a solve gives.
struct Solution {
  BandArray radiosity;         ///< B per patch; that of its cluster where it has one
  BandArray irradiance;        ///< H per patch, likewise
  BandArray vertex_radiosity;  ///< B per vertex
  EnergyBalance energy;
  SolveReport report;
};

/// Adds to H, n × bands in W/m², and what that means to B and to the balance of power; the residual stays that of what was solved.
/// `escaped` is 1 − Σ_j F_ij of each cluster.
void add_irradiance(const PatchMesh& mesh, const Eigen::ArrayXd& escaped, const BandArray& irradiance,
                    Solution& solution);

/// `count` bands from `first` on; what the report says of all bands together stays.
EnergyBalance select_bands(const EnergyBalance& energy, Index first, Index count);
Solution select_bands(const Solution& solution, Index first, Index count);

/// Solves for the clusters of the mesh, and reconstructs.
Solution solve(const Solver& solver, const RadiositySystem& system, const PatchMesh& mesh,
               const SolverOptions& options = {});

}  // namespace radiosity
