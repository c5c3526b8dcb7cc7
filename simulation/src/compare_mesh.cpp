// SPDX-License-Identifier: GPL-3.0-or-later
#include "compare_mesh.hpp"

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/estimate_seconds.hpp"

namespace radiosity {
namespace {

double longest_edge(const PatchMesh& mesh) {
  double longest = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) longest = std::max(longest, mesh.longest_edge(i));
  return longest;
}

}  // namespace

PreparedMesh prepare(Patches patches, const PatchOptions& options, const Stopwatch& watch) {
  PreparedMesh out{{.options = options}, std::make_unique<Patches>(std::move(patches)), {}};
  PatchMesh& mesh = out.patches->mesh;  // its patches, which the visibility refers to, stay the same
  out.visibility = std::make_unique<const Visibility>(mesh);
  mesh = mesh.with_clusters(clusters_apart(*out.visibility));
  if (mesh.clustered() && !mesh.symmetry().none()) out.visibility = std::make_unique<const Visibility>(mesh);
  out.facts.size = out.patches->patch_size > 0 ? out.patches->patch_size : longest_edge(mesh);
  out.facts.patches = mesh.cluster_count();
  out.facts.seconds = watch.elapsed();
  return out;
}

PreparedMesh prepare(const Scene& scene, const PatchOptions& options) {
  const Stopwatch watch;
  return prepare(make_patches(scene, options), options, watch);
}

std::optional<SolvedRun> solve_on(const PreparedMesh& mesh, const FormFactorMethodInfo& info,
                                  const FormFactorOptions& settings, double tolerance, Budget& budget,
                                  double until) {
  const Stopwatch watch;
  const auto method = info.make(*mesh.visibility, settings);
  AssemblyOptions assembly;
  assembly.memory_limit_bytes = budget.bytes();
  assembly.progress = [&](double) { return budget.go_on(until); };
  AssembledFormFactors assembled = assemble(*method, *mesh.visibility, assembly);
  if (!assembled.report.completed) return std::nullopt;
  SolverOptions options;
  options.tolerance = tolerance;
  SolveResult result = find_solver("conjugate-gradient")
                           .make()
                           ->solve(RadiositySystem(assembled.matrix, mesh.mesh()), options);
  SolvedRun out;
  if (result.report.status != SolveStatus::converged) out.failure = result.report.message;
  out.radiosity = mesh.mesh().per_patch(result.radiosity);
  out.seconds = watch.elapsed();
  out.rays = assembled.report.rays;
  out.f = std::move(assembled.matrix);
  return out;
}

double predict_seconds(const PreparedMesh& mesh, const FormFactorMethodInfo& info,
                       const FormFactorOptions& settings, const Budget& budget) {
  return estimate_seconds(*info.make(*mesh.visibility, settings), mesh.facts.patches, 8,
                          budget.seconds() / 400);
}

}  // namespace radiosity
