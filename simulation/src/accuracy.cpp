// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace radiosity {
namespace {

constexpr double kAim = 0.85;       // of the goal: what an estimate of it wavers by
constexpr double kMostGrowth = 32;  // of the number of patches, beyond which an extrapolation is not trusted
constexpr double kSolverShare = 0.05;  // of the error: passes over F are cheap

// Exponents of a kind of method, and what its numbers of samples may be: see plan_accuracy.
struct Kind {
  double q, a, b;
  double least, most;
  bool dense;  // rows without zeros to speak of, however few the samples
};
constexpr double kMostSamples = 1 << 18;
constexpr Kind kPairs{2, 2, 0.5, 1, kMostSamples, true};
constexpr Kind kRays{1, 1.3, 0.8, 64, kMostSamples, false};
constexpr Kind kCells{1, 1.8, 0.6, 4, 16, true};  // more viewpoints do not mend what the cells are wrong by

// What fulfils the goal with the patches and samples of one round scaled up.
AccuracyPlan scale(const AccuracyRound& round, double target) {
  const double p = round.error.order.value_or(1);
  const Kind& kind = round.reciprocal ? kPairs : round.options.has_resolution() ? kCells : kRays;
  const double q = kind.q, a = kind.a, b = round.exact ? 0 : kind.b;
  const double squared = target * target * (1 - kSolverShare * kSolverShare);
  const double patch_error = round.error.patches.value_or(0);
  const double noise = *round.error.form_factors;

  double more_samples = 1;
  double noise_squared = 0;
  if (noise > 0) {
    noise_squared = squared * (b / q) / (a / p + b / q);
    more_samples = std::pow(noise * noise / noise_squared, 1 / q);
    // Samples are whole and bounded: what is then over or under goes to the patches.
    const double samples = static_cast<double>(round.options.samples);
    more_samples =
        std::clamp(more_samples, std::min(1.0, kind.least / samples), std::max(1.0, kind.most / samples));
    noise_squared = noise * noise * std::pow(more_samples, -q);
  }
  const double patch_squared = std::max(squared - noise_squared, 0.1 * squared);
  // Where joined patches did not tell the error of the patches, smaller ones must.
  const double more_patches =
      !round.error.patches
          ? 4
          : std::clamp(std::pow(patch_error * patch_error / patch_squared, 1 / p), 0.25, kMostGrowth);

  AccuracyPlan plan;
  plan.method = round.method;
  plan.options = round.options;
  plan.options.samples =
      static_cast<Index>(std::ceil(more_samples * static_cast<double>(round.options.samples)));
  plan.patch_size = round.patch_size / std::sqrt(more_patches);
  plan.patches = more_patches * round.patches;
  plan.tolerance = kSolverShare * target;
  plan.error = std::sqrt(noise_squared + patch_error * patch_error * std::pow(more_patches, -p)) / kAim;
  plan.seconds = round.seconds * std::pow(more_patches, a) * std::pow(more_samples, b);
  plan.bytes = assembly_bytes(plan.patches, kind.dense ? plan.patches : plan.options.samples);
  return plan;
}

}  // namespace

std::optional<AccuracyPlan> plan_accuracy(std::span<const AccuracyRound> rounds, const AccuracyGoal& goal) {
  // The last round of each method knows best.
  std::vector<const AccuracyRound*> latest;
  double reached = std::numeric_limits<double>::infinity();
  for (const AccuracyRound& round : rounds) {
    if (!round.error.form_factors) continue;  // nothing to scale
    const auto same = std::find_if(latest.begin(), latest.end(),
                                   [&](const AccuracyRound* other) { return other->method == round.method; });
    same == latest.end() ? latest.push_back(&round) : void(*same = &round);
    if (round.error.total) reached = std::min(reached, *round.error.total);
  }
  const auto fits = [&](const AccuracyPlan& plan) {
    return plan.seconds <= goal.seconds && (goal.bytes == 0 || plan.bytes <= static_cast<double>(goal.bytes));
  };
  // A looser target costs less: the tightest one that fits.
  for (double target = goal.error; kAim * target < reached; target *= 1.05) {
    std::optional<AccuracyPlan> best;
    for (const AccuracyRound* round : latest) {
      const AccuracyPlan plan = scale(*round, kAim * target);
      if (fits(plan) && (!best || plan.seconds < best->seconds)) best = plan;
    }
    if (best) return best;
    if (!std::isfinite(reached) && target > 1) break;
  }
  return std::nullopt;
}

}  // namespace radiosity
