// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "compare_measure.hpp"

namespace radiosity {
namespace {

constexpr double kTracedShare = 0.1;  // of the budget
constexpr Index kPatches = 256;
constexpr Index kRounds = 16,
                kLeastRounds = 4;  // a machine with other work may be slower than it was in the trial
constexpr Index kTrial = 16;       // paths, to see what they cost
constexpr Index kLeastPaths = 2, kMostPaths = 1 << 14;

}  // namespace

std::optional<TracedReference> trace_reference(const Visibility& visibility, const TraceIrradiance& trace,
                                               std::uint64_t seed, Budget& budget, ComparedTracing& facts) {
  if (!trace) return std::nullopt;
  const double start = budget.elapsed(), share = kTracedShare * budget.seconds(), until = start + share;
  TracedReference trial(visibility, trace, kPatches, seed);
  trial.add_round(kTrial);
  const double per_path = std::max(1e-9, (budget.elapsed() - start) / kTrial);
  const double paths = 0.6 * (until - budget.elapsed()) / kRounds / per_path;
  if (!(paths >= kLeastPaths)) return std::nullopt;
  facts.paths = static_cast<Index>(std::min<double>(kMostPaths, paths));
  TracedReference out(visibility, trace, kPatches, seed);
  while (out.rounds() < kRounds && budget.go_on(until + share)) out.add_round(facts.paths);
  if (out.rounds() < kLeastRounds || budget.interrupted()) return std::nullopt;
  facts.patches = out.patches();
  facts.rounds = out.rounds();
  facts.seconds = budget.elapsed() - start;
  facts.noise = out.noise();
  return out;
}

}  // namespace radiosity
