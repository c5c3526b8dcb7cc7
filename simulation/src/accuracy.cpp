// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace radiosity {
namespace {

constexpr double kAim = 0.9;           // of the goal: what an estimate of it wavers by
constexpr double kSolverShare = 0.05;  // of the error: passes over F are cheap
// Of the numbers of patches and of samples in one step: by how much more of them the error falls is known the less the further away,
// and steps of this size cost little more together than the last one.
constexpr double kMostGrowth = 16, kMostLaterGrowth = 4, kMostMoreSamples = 4;

// Exponents of a kind of method, and what its numbers of samples may be: see plan_accuracy.
struct Kind {
  double q, a, b;
  double least, most;
  bool dense;  // rows without zeros to speak of, however few the samples
};
constexpr double kMostSamples = 1 << 18;
constexpr Kind kPairs{2, 2, 0.5, 1, kMostSamples, true};
constexpr Kind kRays{1, 1.3, 0.8, 64, kMostSamples, false};
constexpr Kind kCells{1, 1.8, 0.6, 1, 16, true};  // more viewpoints do not mend what the cells are wrong by

// Without noise, which is all that samples mend.
double error_of_patches(const AccuracyRound& round) {
  return std::hypot(round.error.patches.value_or(0), round.error.unsampled);
}

double noise_of(const AccuracyRound& round) {
  return std::sqrt(
      std::max(0.0, std::pow(*round.error.form_factors, 2) - std::pow(round.error.unsampled, 2)));
}

// How the errors of one round will fall, by what larger patches told and what is seen of the rounds before.
struct Trend {
  double p;  // e_p² ~ n^(−p)
  double s =
      0;  // e_f² ~ n^(−s) beside N^(−q): where lamps are sampled, they have the more samples the more patches
  double most_patches;  // n at most by this factor
};

Trend trend_of(std::span<const AccuracyRound> rounds, const AccuracyRound& round, double q) {
  constexpr double kFiner = 1.5, kLeast = 0.3, kMost = 2;
  Trend out{.p = round.error.order.value_or(1), .most_patches = kMostGrowth};
  for (const AccuracyRound& before : rounds) {
    if (!(kFiner * before.patches <= round.patches)) continue;
    const double growth = std::log(static_cast<double>(round.patches) / before.patches);
    const double error = error_of_patches(round);
    if (before.error.patches && error > 0) {
      const double seen = 2 * std::log(error_of_patches(before) / error) / growth;
      // Small faces hold the error up until patches are as small, and it falls as told from then on.
      out.p = (round.error.order.value_or(1) + std::clamp(seen, kLeast, kMost)) / 2;
      out.most_patches = kMostLaterGrowth;
    }
    if (before.method == round.method && before.error.form_factors && noise_of(round) > 0) {
      const double samples = std::log(static_cast<double>(round.options.samples) / before.options.samples);
      out.s = std::clamp((2 * std::log(noise_of(before) / noise_of(round)) - q * samples) / growth, 0.0, 1.0);
    }
  }
  return out;
}

// What fulfils the goal with the patches and samples of one round scaled up.
AccuracyPlan scale(std::span<const AccuracyRound> rounds, const AccuracyRound& round, double target) {
  const Kind& kind = round.reciprocal ? kPairs : round.options.has_resolution() ? kCells : kRays;
  const double q = kind.q, a = kind.a, b = round.exact ? 0 : kind.b;
  const auto [p, s, most_patches] = trend_of(rounds, round, q);
  const double squared = target * target * (1 - kSolverShare * kSolverShare);
  const double patch_error = error_of_patches(round);
  const double noise = noise_of(round);

  const double noise_share = noise > 0 ? (b / q) / (a / p + b / q) : 0;
  // Where joined patches did not tell the error of the patches, smaller ones must.
  const auto all_growth_to = [&](double error_squared) {
    return round.error.patches ? std::max(std::pow(patch_error * patch_error / error_squared, 1 / p), 0.25)
                               : 4;
  };
  const auto growth_to = [&](double error_squared) {
    return std::min(all_growth_to(error_squared), most_patches);
  };
  const double all_patches = all_growth_to(squared * (1 - noise_share));
  // More samples for a noise of its share, with so many times as many patches.
  const auto samples_of = [&](double patches) {
    return std::pow(noise * noise * std::pow(patches, -s) / (squared * noise_share), 1 / q);
  };
  double all_samples = 1;
  double more_patches = growth_to(squared * (1 - noise_share));
  double more_samples = 1;
  double noise_squared = noise * noise * std::pow(more_patches, -s);
  if (noise > 0) {
    const double wanted = samples_of(more_patches);
    // Samples are whole and bounded: what is then over or under goes to the patches, but for what another step can mend.
    const double samples = static_cast<double>(round.options.samples);
    const double least = std::min(1.0, kind.least / samples), most = kind.most / samples;
    all_samples = std::clamp(samples_of(all_patches), least, std::max(1.0, most));
    more_samples = std::clamp(wanted, least, std::max(1.0, std::min(most, kMostMoreSamples)));
    noise_squared *= std::pow(more_samples, -q);
    if (wanted <= kMostMoreSamples || samples * kMostMoreSamples >= kind.most)
      more_patches = growth_to(std::max(squared - noise_squared, 0.1 * squared));
  }

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
  plan.seconds_of_goal =
      std::max(plan.seconds, round.seconds * std::pow(all_patches, a) * std::pow(all_samples, b));
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
      const AccuracyPlan plan = scale(rounds, *round, kAim * target);
      if (fits(plan) && (!best || plan.seconds_of_goal < best->seconds_of_goal)) best = plan;
    }
    if (best) return best;
    if (!std::isfinite(reached) && target > 1) break;
  }
  return std::nullopt;
}

}  // namespace radiosity
