// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "radiosity/formfactors/estimate_seconds.hpp"
#include "radiosity/meshing/error.hpp"
#include "solve_once.hpp"

namespace radiosity {
namespace {

constexpr Index kPilotPatches = 750;  // seconds at most, whatever the method

// Methods that are tried, too, where that takes at most this share of what is planned without them.
constexpr std::array<std::string_view, 2> kOtherPilots{"hemisphere", "analytic"};
constexpr double kPilotShare = 0.1;
constexpr Index kManyPatches = 10 * kPilotPatches;  // beyond which no pilot is a small solve
constexpr int kMostRounds = 8;
constexpr double kMostPatches = std::numeric_limits<Index>::max();
constexpr double kMemoryInUse = 0.8;  // of the limit: a mesh may have more patches than its size lets expect

// A round is solved without a word: it is told as a whole.
SolveOptions options_of_rounds(SolveOptions options) {
  options.ended = {};
  options.step = {};
  options.estimate_error = true;
  options.extrapolate = true;
  return options;
}

class Rounds {
 public:
  Rounds(const SceneToSolve& task, const SceneSettings& settings)
      : options_(task.options),
        round_options_(options_of_rounds(task.options)),
        task_{task.scene, round_options_, task.setups, task.watch},
        settings_(settings) {
    report_.goal = *options_.accuracy;
  }

  SolvedScene run() {
    pilots();
    while (!reached() && report_.rounds.size() < kMostRounds && !stopped()) {
      const auto plan = plan_accuracy(report_.rounds, limits());
      if (!plan) {
        limited_ = limited_ || plan_accuracy(report_.rounds, {.error = limits().error});
        break;
      }
      if (options_.round_planned) options_.round_planned(*plan);
      const std::size_t before = report_.rounds.size();
      SceneSettings next = settings_;
      next.method = std::string(plan->method->name);
      next.samples = plan->options.samples;
      if (plan->options.has_resolution()) next.resolution = plan->options.resolution;
      if (plan->patch_size > 0)
        next.patches = PatchSize{plan->patch_size};
      else
        next.patches = AutoPatches{static_cast<Index>(std::min(plan->patches, kMostPatches))};
      next.tolerance = plan->tolerance;
      solve(next);
      if (report_.rounds.size() == before) break;  // stopped, or the faces made more patches than expected
    }
    report_.reached = reached();
    if (!report_.reached)
      report_.why_not = stopped()                              ? "the work was stopped or its time was up"
                        : best_->error && !best_->error->total ? "a part of the error is unknown"
                        : limited_
                            ? "time or memory do not allow more"
                            : "finer meshes and more samples did not bring the estimate down far enough";
    best_->accuracy = std::move(report_);
    return std::move(*best_);
  }

 private:
  void pilots() {
    SceneSettings first = settings_;
    first.tolerance = 0.02 * report_.goal;
    if (settings_.method && *settings_.method != kAutoMethod) {
      pilot(first);
      return;
    }
    // Pairs where they are closed forms, rays where faces are many, else hemicubes of four viewpoints and 32 cells: the cheapest of
    // docs/trade.md without the error of a single viewpoint.
    first.method.reset();
    first.samples.reset();  // those of a scene file are of no certain method
    first.resolution = 32;
    pilot(first);
    // Nothing that samples comes near exact pairs; what costs n² is no pilot where faces are many, unless rays do not tell what
    // they are wrong by.
    const bool rays = best_->form_factors.method == "hemisphere";
    const bool known = best_->error && best_->error->form_factors;
    if (best_->form_factors.exact || (rays && known) || best_->patches.mesh.cluster_count() > kManyPatches)
      return;
    first.resolution.reset();
    for (const std::string_view other : kOtherPilots) {
      if (stopped() || reached()) return;
      if (rays && other == "hemisphere") continue;
      const auto plan = plan_accuracy(report_.rounds, limits());
      if (plan && seconds_of_pilot(other) > kPilotShare * plan->seconds_of_goal) continue;
      first.method = other;
      pilot(first);
    }
  }

  // On the mesh of the best so far: form factors, and as much again for the rest and the error.
  double seconds_of_pilot(std::string_view name) const {
    const PatchMesh& mesh = best_->patches.mesh;
    const Visibility visibility(mesh);
    const auto method = find_form_factor_method(name).make(visibility);
    constexpr Index kRows = 8;
    constexpr double kPatience = 0.05;
    const double seconds = 2 * estimate_seconds(*method, mesh.cluster_count(), kRows, kPatience);
    return of_all(ranks(), seconds).front() / (ranks() != nullptr ? ranks()->count() : 1);
  }

  // Faces that are many and far from each other are no larger patches together.
  void pilot(SceneSettings settings) {
    for (Index target = kPilotPatches;;) {
      settings.patches = AutoPatches{target};
      const std::size_t before = report_.rounds.size();
      solve(settings);
      if (stopped() || report_.rounds.size() == before || report_.rounds.back().error.patches) return;
      target = std::max(target, report_.rounds.back().patches);
      if (target > kManyPatches) return;
      target *= 4;
    }
  }

  // One round; it counts when it came to an end. Without memory for it, what there is has to do.
  void solve(const SceneSettings& settings) try {
    const Stopwatch watch;
    SolvedScene solved = solve_once(task_, settings, "hemicube");
    if (solved.error) {
      const FormFactorFacts& facts = solved.form_factors;
      AccuracyRound& round = report_.rounds.emplace_back();
      round.method = &find_form_factor_method(facts.method);
      round.options = facts.options;
      round.exact = facts.exact;
      round.reciprocal = facts.reciprocal;
      round.patch_size = solved.patches.patch_size;
      round.patches = solved.patches.mesh.cluster_count();
      round.seconds = of_all(ranks(), watch.elapsed()).front();
      round.error = *solved.error;
      if (options_.round_ended) options_.round_ended(round);
    }
    const bool better =
        !best_ || (solved.error && (!best_->error || worth(*solved.error) < worth(*best_->error)));
    if (better) best_.emplace(std::move(solved));
  } catch (const MemoryLimitError&) {
    if (!best_) throw;
    limited_ = true;
  }

  // An error of which a part is not known is worse than any that is.
  static std::pair<bool, double> worth(const ErrorEstimate& error) { return {!error.total, error.known}; }

  const Ranks* ranks() const { return options_.ranks.get(); }

  // On any of the ranks.
  bool stopped() const { return !on_all(ranks(), !task_.watch.stopped()); }

  bool reached() const {
    constexpr double kWithGather = 0.96;
    return best_ && best_->error && worth(*best_->error) <= std::pair{false, left_by_gather(kWithGather)};
  }

  // A gather in the end adds noise, of up to √(1 − share²) of the goal: 0.3.
  double left_by_gather(double share) const {
    const bool gather = gathers_in_the_end(settings_, best_ && best_->patches.mesh.clustered());
    return (gather ? share : 1) * report_.goal;
  }

  AccuracyGoal limits() const {
    AccuracyGoal goal;
    constexpr double kWithGather = 0.95;  // lower than what is reached, as the last step costs most
    goal.error = left_by_gather(kWithGather);
    goal.seconds = of_all(ranks(), task_.watch.left()).front();
    const auto most = static_cast<double>(memory_limit(options_.memory_limit_bytes)) *
                      (ranks() != nullptr ? ranks()->count() : 1);
    goal.bytes = std::max<std::size_t>(1, static_cast<std::size_t>(kMemoryInUse * most));
    return goal;
  }

  const SolveOptions& options_;
  const SolveOptions round_options_;
  const SceneToSolve task_;
  const SceneSettings& settings_;
  AccuracyReport report_;
  std::optional<SolvedScene> best_;
  bool limited_ = false;  // by time or memory
};

}  // namespace

SolvedScene solve_to_accuracy(const SceneToSolve& task, const SceneSettings& settings) {
  const double accuracy = *task.options.accuracy;
  if (!(accuracy > 0)) throw InputError(fmt::format("accuracy: {} is not positive", accuracy));
  return Rounds(task, settings).run();
}

}  // namespace radiosity
