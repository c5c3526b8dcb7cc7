// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/compare.hpp"

#include <fmt/format.h>

#include "compare_measure.hpp"
#include "radiosity/meshing/error.hpp"
#include "relative_error.hpp"
#include "solve_once.hpp"

namespace radiosity {
namespace {

std::vector<std::string> notes_on(const Reference& reference, bool clustered, bool has_finer, bool traced,
                                  bool not_traced) {
  std::vector<std::string> notes;
  if (clustered)
    notes.emplace_back(
        "patches are clusters of smaller faces: errors are those of means over clusters; a solve gathers "
        "light for their members in the end, which is not in the times");
  if (not_traced)
    notes.emplace_back("path tracing does not fit a tenth of the budget: nothing independent judges");
  if (reference.exact_s)
    notes.push_back(fmt::format(
        "the reference is of rays: factors pair by pair, exact here, would take about {:.2g} s; a budget "
        "of {:.2g} s would do",
        *reference.exact_s, kSafety * *reference.exact_s / (2 * kReferenceShare)));
  if (!has_finer)
    notes.emplace_back(
        traced
            ? "no reference on finer patches fits the budget: errors are those that path tracing tells, on "
              "the user's patches alone"
            : "no reference on finer patches fits the budget, so the errors say nothing of what the size of "
              "the patches does");
  return notes;
}

}  // namespace

Comparison compare(const Scene& given, const PatchOptions& patches, const CompareOptions& options) {
  if (!(options.budget_s > 0))
    throw InputError(fmt::format("budget: {} s is not positive", options.budget_s));
  Budget budget(options);
  const Scene scene = merge_equal_bands(with_decided_sides(given));
  MeshSeries series;
  series.meshes.push_back(prepare(scene, patches));
  if (options.meshed) options.meshed(*series.user().patches);

  Comparison out;
  auto reference = make_reference(series.user(), kReferenceShare * budget.seconds(), options.seed, budget);
  if (reference) {
    ComparedTracing tracing;
    const auto traced =
        trace_reference(*series.user().visibility, options.trace, options.seed, budget, tracing);
    if (traced) out.tracing = tracing;
    out.solvers = compare_solvers(series.user().mesh(), *reference->f, traced, budget);
    reference->f.reset();
    add_coarser(series, scene);
    std::optional<FinerReference> finer;
    if (const auto refined = refine_reference(series.user(), scene, *reference, options.seed, budget)) {
      if (refined->k > 2) add_finer(series, scene);
      finer = restrict_reference(*refined, series);
      for (std::size_t m = 0; m < series.meshes.size(); ++m)
        series.meshes[m].facts.own_noise = finer->noise[m];
      out.finer = with_patch_error(*finer, refined->k, *reference, series, options.seed, budget);
      if (traced) out.finer->traced = traced->error(finer->radiosity[series.own]);
      out.where_patches = error_map(series.user().mesh(), reference->radiosity, finer->radiosity[series.own]);
    }
    out.runs = compare_methods(series, *reference, finer, traced, options.seed, budget);
    out.notes = notes_on(*reference, series.user().mesh().clustered(), finer.has_value(), traced.has_value(),
                         options.trace && !traced);
    out.factors = reference->facts;
    if (traced) out.factors.traced = traced->error(reference->radiosity);
    out.radiosity = std::move(reference->radiosity);
  } else if (!budget.interrupted()) {
    throw InputError(
        fmt::format("a budget of {} s does not suffice for a reference of {} rays for each of {} patches; "
                    "allow more time or larger patches",
                    budget.seconds(), kLeastRays, series.user().facts.patches));
  }
  for (const PreparedMesh& mesh : series.meshes) out.meshes.push_back(mesh.facts);
  out.own = series.own;
  out.mesh = std::move(series.meshes[series.own].patches->mesh);
  out.budget_s = budget.seconds();
  out.completed = !budget.interrupted();
  out.seconds = budget.elapsed();
  return out;
}

}  // namespace radiosity
