// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "compare_references.hpp"

namespace radiosity {

/// Runs and judges what is planned (see planned_runs) as far as the budget goes: default settings on the user's mesh that take no more than
/// a quarter of it first, then the cheapest. Without a finer reference, on the user's mesh alone.
std::vector<ComparedRun> compare_methods(const MeshSeries& series, const Reference& reference,
                                         const std::optional<FinerReference>& finer,
                                         const std::optional<TracedReference>& traced, std::uint64_t seed,
                                         Budget& budget);

/// Every solver at tolerances 1e-1 … 1e-8 on one F, in a tenth of the budget, an even share of what is left for each.
std::vector<SolverRun> compare_solvers(const PatchMesh& mesh, const FormFactorMatrix& f,
                                       const std::optional<TracedReference>& traced, Budget& budget);

/// What the caller's means to trace irradiance can tell in a tenth of the budget. Nothing where there is none, where not even four rounds of
/// few paths fit, or interrupted.
std::optional<TracedReference> trace_reference(const Visibility& visibility, const TraceIrradiance& trace,
                                               std::uint64_t seed, Budget& budget, ComparedTracing& facts);

}  // namespace radiosity
