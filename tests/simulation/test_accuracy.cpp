// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/accuracy.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace radiosity::test {
namespace {

AccuracyRound round(std::string_view method, double form_factors, double patches, double seconds) {
  AccuracyRound round;
  round.method = &find_form_factor_method(method);
  round.options = {.samples = method == "analytic" ? 36 : 1024};
  round.reciprocal = method == "analytic";
  round.patch_size = 0.4;
  round.patches = 500;
  round.seconds = seconds;
  round.error.form_factors = form_factors;
  round.error.patches = patches;
  round.error.order = 1.5;
  round.error.total = std::hypot(form_factors, patches);
  return round;
}

/// What the formulas of AccuracyPlan say of a plan that scales one round.
double expected_noise(const AccuracyRound& round, const AccuracyPlan& plan) {
  const double more = plan.options.samples / static_cast<double>(round.options.samples);
  return *round.error.form_factors * std::pow(more, round.reciprocal ? -1 : -0.5);
}
double expected_patch_error(const AccuracyRound& round, const AccuracyPlan& plan) {
  return *round.error.patches * std::pow(plan.patches / round.patches, -*round.error.order / 2);
}

TEST(AccuracyPlan, BringsTheErrorBelowTheGoal) {
  for (const std::string_view method : {"analytic", "hemisphere"}) {
    const AccuracyRound first = round(method, 0.01, 0.05, 1);
    const auto plan = plan_accuracy(std::span(&first, 1), {.error = 0.01});
    ASSERT_TRUE(plan.has_value());
    const double total = std::hypot(expected_noise(first, *plan), expected_patch_error(first, *plan));
    EXPECT_LT(total, 0.01) << method;
    EXPECT_GT(total, 0.007) << method;
    EXPECT_NEAR(plan->patch_size * std::sqrt(plan->patches), 0.4 * std::sqrt(500), 1e-9);
  }
}

TEST(AccuracyPlan, SplitsTheErrorWhereTheCostIsLeast) {
  // Any other split of the same total must cost more: T ~ n^1.3 N^0.8 with n ~ e_p^(−2/p), N ~ e_f^−2.
  const AccuracyRound first = round("hemisphere", 0.01, 0.05, 1);
  const auto plan = plan_accuracy(std::span(&first, 1), {.error = 0.01});
  const double noise = expected_noise(first, *plan), patches = expected_patch_error(first, *plan);
  const double total = std::hypot(noise, patches), angle = std::atan2(noise, patches);
  const auto cost = [&](double turn) {
    const double e_f = total * std::sin(angle + turn), e_p = total * std::cos(angle + turn);
    return std::pow(e_p, -2 / 1.5 * 1.3) * std::pow(e_f, -2 * 0.8);
  };
  EXPECT_LT(cost(0), cost(0.1));
  EXPECT_LT(cost(0), cost(-0.1));
}

TEST(AccuracyPlan, TakesTheCheaperMethod) {
  // With the same errors, pairs cost n² and directions n^1.3 N^0.8.
  const std::array rounds{round("analytic", 1e-4, 0.05, 1), round("hemisphere", 0.01, 0.05, 0.1)};
  EXPECT_EQ(plan_accuracy(rounds, {.error = 0.03})->method->name, "hemisphere");
  const std::array noisy{round("analytic", 1e-4, 0.01, 1), round("hemisphere", 0.3, 0.01, 1)};
  EXPECT_EQ(plan_accuracy(noisy, {.error = 0.005})->method->name, "analytic");
}

TEST(AccuracyPlan, DoesTheBestThatTimeAndMemoryAllow) {
  const AccuracyRound first = round("hemisphere", 0.02, 0.05, 1);
  const auto free = plan_accuracy(std::span(&first, 1), {.error = 0.005});
  ASSERT_TRUE(free.has_value());
  const auto hurried = plan_accuracy(std::span(&first, 1), {.error = 0.005, .seconds = free->seconds / 3});
  ASSERT_TRUE(hurried.has_value());
  EXPECT_LE(hurried->seconds, free->seconds / 3);
  EXPECT_GT(hurried->error, free->error);
  const auto cramped = plan_accuracy(std::span(&first, 1),
                                     {.error = 0.005, .bytes = static_cast<std::size_t>(free->bytes / 3)});
  ASSERT_TRUE(cramped.has_value());
  EXPECT_LE(cramped->bytes, free->bytes / 3);
  EXPECT_GT(cramped->error, free->error);
  EXPECT_FALSE(plan_accuracy(std::span(&first, 1), {.error = 0.005, .seconds = 1e-3}));
}

TEST(AccuracyPlan, BuysNoSamplesForWhatTheyDoNotMend) {
  AccuracyRound first = round("hemisphere", 0.03, 0.01, 1);
  const auto noisy = plan_accuracy(std::span(&first, 1), {.error = 0.03});
  first.error.unsampled = 0.0298;
  const auto near = plan_accuracy(std::span(&first, 1), {.error = 0.03});
  ASSERT_TRUE(noisy && near);
  EXPECT_GT(noisy->options.samples, first.options.samples);
  EXPECT_LE(near->options.samples, first.options.samples);
  EXPECT_GT(near->patches, noisy->patches);
}

TEST(AccuracyPlan, LearnsFromTheRoundsHowTheErrorsFall) {
  // With ten times the patches the error of the patches fell by a tenth only, where an order of 1.5 was told.
  std::array rounds{round("hemisphere", 0.02, 0.022, 1), round("hemisphere", 0.02, 0.02, 20)};
  rounds[1].patches = 5000;
  const auto alone = plan_accuracy(std::span(&rounds[1], 1), {.error = 0.02});
  const auto both = plan_accuracy(rounds, {.error = 0.02});
  ASSERT_TRUE(alone && both);
  EXPECT_GT(both->patches, 1.1 * alone->patches);
  EXPECT_LE(both->patches, 4 * 5000);  // no order is trusted further
  // Noise that falls with the patches, as that of sampled lamps does, takes fewer samples.
  rounds[0].error.form_factors = 0.06;
  const auto falling = plan_accuracy(rounds, {.error = 0.02});
  ASSERT_TRUE(falling);
  EXPECT_LT(falling->options.samples, both->options.samples);
}

TEST(AccuracyPlan, LooksForTheErrorOfPatchesOnAFinerMesh) {
  AccuracyRound first = round("hemisphere", 0.001, 0, 1);
  first.error.patches.reset();
  first.error.total.reset();
  const auto plan = plan_accuracy(std::span(&first, 1), {.error = 0.01});
  ASSERT_TRUE(plan.has_value());
  EXPECT_NEAR(plan->patches, 2000, 1e-6);
}

TEST(AccuracyPlan, ScalesNoRoundWhoseFormFactorsHaveAnUnknownError) {
  std::array rounds{round("analytic", 1e-4, 0.05, 1), round("hemisphere", 0.01, 0.05, 0.1)};
  rounds[1].error.form_factors.reset();
  rounds[1].error.total.reset();
  EXPECT_EQ(plan_accuracy(rounds, {.error = 0.03})->method->name, "analytic");
  EXPECT_FALSE(plan_accuracy(std::span(&rounds[1], 1), {.error = 0.03}));
}

}  // namespace
}  // namespace radiosity::test
