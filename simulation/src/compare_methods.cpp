// SPDX-License-Identifier: GPL-3.0-or-later
#include "compare_measure.hpp"

#include <fmt/format.h>

#include <map>
#include <numeric>
#include <utility>

#include "radiosity/meshing/error.hpp"
#include "relative_error.hpp"

namespace radiosity {
namespace {

constexpr double kReferenceSamples = 10;  // rays or points of a reference over those of a run that it judges
constexpr double kDefaultShare = 0.25;    // of what is left, for the default setting of a method

struct Judges {
  const Reference& reference;                    // of the user's mesh
  const std::optional<FinerReference>& finer;    // of all meshes
  const std::optional<TracedReference>& traced;  // of the user's mesh
};

// Why no reference is accurate enough to judge a run; empty where they are.
std::string not_judged(const MeshSeries& series, const Judges& judges, const ComparedRun& run) {
  const auto same = [&](const ComparedReference& reference) { return reference.method == run.method; };
  if (!same(judges.reference.facts) && !(judges.finer && same(judges.finer->facts))) return {};
  const PreparedMesh& mesh = series.meshes[run.mesh];
  const auto method = find_form_factor_method(run.method).make(*mesh.visibility, run.settings);
  const bool by_directions = method->direction_share() > 0;
  const auto outdoes = [&](const ComparedReference& reference) {
    if (!same(reference)) return false;
    // Means over fine patches have the rays of all of them, and of both solutions.
    const double times =
        by_directions ? static_cast<double>(reference.patches) / mesh.facts.patches * reference.solves : 1;
    return kReferenceSamples * run.settings.samples > times * reference.settings.samples;
  };
  const bool outdone = (run.mesh == series.own && outdoes(judges.reference.facts)) ||
                       (judges.finer && outdoes(judges.finer->facts));
  if (method->exact() || !outdone) return {};
  return fmt::format("has more than a tenth of the reference's {}", by_directions ? "rays" : "points");
}

// Fills in what a run measures. Returns why it was left out; empty where it was not.
std::string measure(ComparedRun& run, const MeshSeries& series, const Judges& judges, Budget& budget) {
  const PreparedMesh& mesh = series.meshes[run.mesh];
  const double left = budget.left();
  const bool over = !budget.go_on();
  if (budget.interrupted()) return "interrupted";
  if (over || kSafety * run.predicted_s > left)
    return fmt::format("would take about {:.2g} s; {:.2g} s of the budget were left", run.predicted_s,
                       std::max(left, 0.0));
  std::optional<SolvedRun> solved;
  try {
    solved =
        solve_on(mesh, find_form_factor_method(run.method), run.settings, SolverOptions{}.tolerance, budget);
  } catch (const InputError& error) {  // more memory than allowed
    return error.what();
  }
  if (!solved) return budget.interrupted() ? "interrupted" : "stopped: the budget was over";
  if (solved->failure) return *solved->failure;
  run.seconds = mesh.facts.seconds + solved->seconds;
  run.bytes = static_cast<double>(solved->f->bytes());
  run.rays = solved->rays;
  if (run.mesh == series.own) {
    run.factors = relative_error(mesh.mesh(), solved->radiosity, judges.reference.radiosity);
    if (judges.traced) run.traced = judges.traced->error(solved->radiosity);
    run.where = error_map(mesh.mesh(), solved->radiosity, judges.reference.radiosity);
  }
  if (judges.finer)
    run.total = relative_error(mesh.mesh(), solved->radiosity, judges.finer->radiosity[run.mesh]);
  return {};
}

// The order to run in. The cheapest first would never come to an expensive default.
std::vector<std::size_t> turns(const std::vector<ComparedRun>& runs, std::size_t own, double left) {
  const auto key = [&](std::size_t r) {
    const ComparedRun& run = runs[r];
    const bool shown =
        run.standard && run.mesh == own && run.predicted_s <= kDefaultShare * std::max(0.0, left);
    return std::pair{!shown, run.predicted_s};
  };
  std::vector<std::size_t> order(runs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

// That of the default setting, or of the finest that ran without it; runs are by mesh, method and setting.
void keep_one_map_per_method(std::vector<ComparedRun>& runs) {
  std::map<std::string, ComparedRun*> kept;
  for (ComparedRun& run : runs) {
    if (run.where.size() == 0) continue;
    ComparedRun*& best = kept[run.method];
    ComparedRun* worse = best && best->standard ? &run : std::exchange(best, &run);
    if (worse) worse->where.resize(0);
  }
}

}  // namespace

std::vector<ComparedRun> compare_methods(const MeshSeries& series, const Reference& reference,
                                         const std::optional<FinerReference>& finer,
                                         const std::optional<TracedReference>& traced, std::uint64_t seed,
                                         Budget& budget) {
  const Judges judges{reference, finer, traced};
  std::vector<ComparedRun> runs = planned_runs(series, finer.has_value(), seed);
  const ComparedRun* cheaper = nullptr;  // than all those of its mesh and method that follow
  for (ComparedRun& run : runs) {
    run.left_out = not_judged(series, judges, run);
    if (!run.left_out.empty() || budget.interrupted()) continue;
    if (cheaper != nullptr && cheaper->mesh == run.mesh && cheaper->method == run.method) {
      run.left_out = fmt::format("would take more than {:.2g} s; {:.2g} s of the budget were left",
                                 cheaper->predicted_s, std::max(budget.left(), 0.0));
      continue;
    }
    run.predicted_s =
        predict_seconds(series.meshes[run.mesh], find_form_factor_method(run.method), run.settings, budget);
    if (!run.settings.has_resolution() && run.predicted_s > budget.left()) cheaper = &run;
  }
  for (const std::size_t r : turns(runs, series.own, budget.left()))
    if (runs[r].left_out.empty()) runs[r].left_out = measure(runs[r], series, judges, budget);
  keep_one_map_per_method(runs);
  return runs;
}

}  // namespace radiosity
