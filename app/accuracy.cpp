// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "radiosity/meshing/error.hpp"
#include "stages.hpp"

namespace radiosity::app {
namespace {

constexpr Index kPilotPatches = 600;  // seconds at most, whatever the method

// Methods that are tried, too, where the plan costs that much without them.
struct OtherPilot {
  std::string_view method;
  double dear_s;
};
constexpr std::array kOtherPilots{OtherPilot{"hemisphere", 0.5}, OtherPilot{"analytic", 10}};
constexpr Index kManyPatches = 10 * kPilotPatches;  // beyond which no pilot is a small solve
constexpr int kMostRounds = 8;
constexpr double kMostPatches = std::numeric_limits<Index>::max();
constexpr double kMemoryInUse = 0.8;  // of the limit: a mesh may have more patches than its size lets expect

class Rounds {
 public:
  Rounds(Job& job, const LoadedScene& loaded, SceneSettings settings)
      : job_(job),
        quiet_([&job] {
          Options options = job.options;
          options.quiet = true;
          return options;
        }()),
        loaded_(loaded),
        settings_(std::move(settings)),
        goal_(job.options.accuracy / 100) {
    facts_.goal = goal_;
  }

  Solved run() {
    pilots();
    while (!reached() && rounds_.size() < kMostRounds && !interrupted()) {
      const auto plan = plan_accuracy(rounds_, limits());
      if (!plan) break;
      job_.console.line("", "next: {}, about {:.0f} patches, {} samples; expected {:.2g} % in {}",
                        plan->method->name, plan->patches, plan->options.samples, 100 * plan->error,
                        seconds_text(plan->seconds));
      const std::size_t before = rounds_.size();
      SceneSettings next = settings_;
      next.method = std::string(plan->method->name);
      next.samples = plan->options.samples;
      if (plan->options.resolution > 0) next.resolution = plan->options.resolution;
      if (plan->patch_size > 0)
        next.patches = PatchSize{plan->patch_size};
      else
        next.patches = AutoPatches{static_cast<Index>(std::min(plan->patches, kMostPatches))};
      next.tolerance = plan->tolerance;
      solve(next);
      if (rounds_.size() == before) break;  // interrupted, or the faces made more patches than expected
    }
    return finish();
  }

 private:
  void pilots() {
    SceneSettings first = settings_;
    first.tolerance = 0.02 * goal_;
    if (settings_.method.value_or(std::string(kAutoMethod)) != kAutoMethod) {
      pilot(first);
      return;
    }
    // Pairs where they are closed forms, rays where faces are many, else hemicubes of four viewpoints and 32 cells: the cheapest of
    // docs/trade.md without the error of a single viewpoint.
    first.method = kAutoMethod;
    first.samples = std::nullopt;  // those of a scene file are of no certain method
    first.resolution = 32;
    pilot(first);
    // Nothing that samples comes near exact pairs; what costs n² is no pilot where faces are many, unless rays do not tell what
    // they are wrong by.
    const Solved& done = best_->first;
    const bool rays = done.method == "hemisphere";
    const bool known = done.error && done.error->form_factors;
    if (done.exact || (rays && known) || done.patches.mesh.patch_count() > kManyPatches) return;
    first.resolution = std::nullopt;
    for (const OtherPilot& other : kOtherPilots) {
      if (interrupted() || reached()) return;
      if (rays && other.method == "hemisphere") continue;
      const auto plan = plan_accuracy(rounds_, limits());
      if (plan && plan->seconds < other.dear_s) return;
      first.method = other.method;
      pilot(first);
    }
  }

  // Faces that are many leave no coarser mesh to compare a coarse one with.
  void pilot(SceneSettings settings) {
    for (Index target = kPilotPatches;;) {
      settings.patches = AutoPatches{target};
      const std::size_t before = rounds_.size();
      solve(settings);
      if (interrupted() || rounds_.size() == before || rounds_.back().error.patches) return;
      target = std::max(target, rounds_.back().patches);
      if (target > kManyPatches) return;
      target *= 4;
    }
  }

  // One round; it counts when it came to an end. Without memory for it, what there is has to do.
  void solve(const SceneSettings& settings) try {
    Job job(quiet_);
    job.report = job_.report;
    job.where_few = "hemicube";
    job.stage.lap();
    Stopwatch watch;
    Solved solved = solve_stage(job, loaded_.scene, settings, {}, loaded_.setups);
    const double seconds = watch.lap();
    if (!solved.error) {
      if (!best_) best_.emplace(std::move(solved), std::move(job.report));
      return;
    }
    AccuracyRound round;
    round.method = &find_form_factor_method(solved.method);
    round.options = solved.options;
    round.exact = solved.exact;
    round.reciprocal = solved.reciprocal;
    round.patch_size = solved.patches.patch_size;
    round.patches = solved.patches.mesh.patch_count();
    round.seconds = seconds;
    round.error = *solved.error;
    facts_.rounds.push_back(
        {solved.method, round.options.samples, round.patches, round.patch_size, seconds, round.error.total});
    job_.console.line(rounds_.empty() ? "accuracy" : "", "{:.2g} %{} by {}, {} patches, {} samples, in {}",
                      100 * round.error.known, round.error.total ? "" : " and what is unknown", solved.method,
                      round.patches, round.options.samples, seconds_text(seconds));
    const bool better = !best_ || !best_->first.error || worth(round.error) < worth(*best_->first.error);
    rounds_.push_back(std::move(round));
    if (better) best_.emplace(std::move(solved), std::move(job.report));
  } catch (const MemoryLimitError&) {
    if (!best_) throw;
  }

  // An error of which a part is not known is worse than any that is.
  static std::pair<bool, double> worth(const ErrorEstimate& error) { return {!error.total, error.known}; }

  bool reached() const {
    return best_ && best_->first.error && worth(*best_->first.error) <= std::pair{false, goal_};
  }

  AccuracyGoal limits() {
    AccuracyGoal goal;
    goal.error = goal_;
    elapsed_ += watch_.lap();
    if (job_.options.time_limit > 0) goal.seconds = job_.options.time_limit - elapsed_;
    if (const std::size_t most = job_.options.memory_limit_bytes; most > 0)
      goal.bytes =
          std::max<std::size_t>(1, static_cast<std::size_t>(kMemoryInUse * static_cast<double>(most)));
    return goal;
  }

  Solved finish() {
    job_.stage.lap();
    facts_.reached = reached();
    job_.report = std::move(best_->second);
    job_.report.accuracy = facts_;
    const Solved& solved = best_->first;
    if (solved.error) tell_error(job_, *solved.error);
    if (!facts_.reached) {
      job_.console.line("not reached", "{}; this is the best there is",
                        interrupted()                          ? "stopped by Ctrl-C or the time limit"
                        : solved.error && !solved.error->total ? "a part of the error is unknown"
                        : job_.options.time_limit > 0 || job_.options.memory_limit_bytes > 0
                            ? "time or memory do not allow more"
                            : "finer meshes and more samples did not bring the estimate down far enough");
    }
    for (const std::string& warning : job_.report.scene->warnings)
      job_.console.line("warning", "{}", warning);
    return std::move(best_->first);
  }

  Job& job_;
  const Options quiet_;
  const LoadedScene& loaded_;
  const SceneSettings settings_;
  const double goal_;
  std::vector<AccuracyRound> rounds_;
  std::optional<std::pair<Solved, Report>> best_;
  Report::Accuracy facts_;
  Stopwatch watch_;
  double elapsed_ = 0;
};

}  // namespace

Solved solve_to_accuracy(Job& job, const LoadedScene& loaded, const SceneSettings& settings) {
  const SolverInfo& solver = find_solver(settings.solver.value_or(std::string(kDefaultSolver)));
  if (!solver.needs_stored_rows)
    throw InputError(fmt::format(
        "--accuracy needs an error estimate, and so form factors that are stored; {} does not store them",
        solver.name));
  return Rounds(job, loaded, settings).run();
}

}  // namespace radiosity::app
