// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "support/same_solution.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

// On two and on three ranks; each of them gets all of it.
void expect_the_solution_of_one_process(const Scene& scene, const SceneSettings& settings,
                                        std::optional<double> accuracy = {}) {
  SolveOptions options;
  options.accuracy = accuracy;
  const SolvedScene alone = solve_scene(scene, settings, options);
  ASSERT_TRUE(alone.converged());
  for (const int count : {2, 3}) {
    std::mutex checking;
    on_ranks(count, [&](const std::shared_ptr<const Ranks>& ranks) {
      SolveOptions on_this = options;
      on_this.ranks = ranks;
      const SolvedScene shared = solve_scene(scene, settings, on_this);
      const std::lock_guard lock(checking);
      expect_same_solution(shared, alone);
      if (!accuracy) return;
      EXPECT_EQ(shared.accuracy->reached, alone.accuracy->reached);
      ASSERT_EQ(shared.accuracy->rounds.size(), alone.accuracy->rounds.size());
      for (std::size_t k = 0; k < alone.accuracy->rounds.size(); ++k) {
        const AccuracyRound &a = shared.accuracy->rounds[k], &b = alone.accuracy->rounds[k];
        EXPECT_EQ(a.method, b.method);
        EXPECT_EQ(a.options.samples, b.options.samples);
        EXPECT_EQ(a.patch_size, b.patch_size);
        EXPECT_EQ(a.patches, b.patches);
        EXPECT_EQ(a.error.known, b.error.known);
      }
    });
  }
}

TEST(SolvingOnRanks, GivesTheBitsOfOneProcess) {
  expect_the_solution_of_one_process(closed_cornell_box(), patches_and_elements(0.07, 256));
}

// One method alone: between several, what they cost decides, and no two runs take the same time.
TEST(SolvingOnRanks, ReachesAnAccuracyInTheRoundsOfOneProcess) {
  SceneSettings settings;
  settings.method = "hemisphere";
  expect_the_solution_of_one_process(closed_cornell_box(), settings, 0.05);
}

// The room is convex: F of one process is dense, and exact.
TEST(SolvingOnRanks, ReachesAnAccuracyOfClosedFormsInTheRoundsOfOneProcess) {
  expect_the_solution_of_one_process(lit_cube(0.5, 0.4, 0.7), {}, 0.02);
}

TEST(SolvingOnRanks, GivesTheBitsOfOneProcessToElementsThatAreSmallWhereLightChanges) {
  SceneSettings settings;
  settings.patches = PatchSize{0.4};
  settings.method = "analytic";
  settings.elements = AutoElements{};
  expect_the_solution_of_one_process(cube_with_box(), settings);
}

TEST(SolvingOnRanks, RefusesWhatOneProcessDoes) {
  const auto refused = [](const SceneSettings& settings) {
    std::string message;
    on_ranks(1, [&](const std::shared_ptr<const Ranks>& ranks) {
      SolveOptions options;
      options.ranks = ranks;
      try {
        solve_scene(cube_with_box(), settings, options);
      } catch (const InputError& e) {
        message = e.what();
      }
    });
    return message;
  };
  for (const char* solver : {"gauss-seidel", "progressive", "progressive-overshoot"}) {
    SceneSettings settings;
    settings.solver = solver;
    EXPECT_THAT(refused(settings),
                testing::HasSubstr(std::string("solver ") + solver + " runs in one process"));
  }
}

TEST(SolvingOnRanks, EndsTheRoundsOfAnAccuracyOnAllWhenOneAsksToStop) {
  std::mutex checking;
  on_ranks(2, [&](const std::shared_ptr<const Ranks>& ranks) {
    SolveOptions options;
    options.ranks = ranks;
    options.accuracy = 0.01;
    options.progress = [&](SolveStage, double) { return ranks->rank() == 0; };
    const SolvedScene stopped = solve_scene(lit_cube(0.5, 0.4, 0.7), {}, options);
    const std::lock_guard lock(checking);
    EXPECT_TRUE(stopped.accuracy->rounds.empty());
    EXPECT_FALSE(stopped.accuracy->reached);
    EXPECT_THAT(stopped.accuracy->why_not, testing::HasSubstr("stopped"));
  });
}

TEST(SolvingOnRanks, EndsOnAllWhenOneAsksToStop) {
  SceneSettings settings;
  settings.patches = PatchSize{0.1};
  std::mutex checking;
  on_ranks(2, [&](const std::shared_ptr<const Ranks>& ranks) {
    SolveOptions options;
    options.ranks = ranks;
    options.progress = [&](SolveStage, double) { return ranks->rank() == 0; };
    const SolvedScene stopped = solve_scene(cube_with_box(), settings, options);
    const std::lock_guard lock(checking);
    EXPECT_FALSE(stopped.form_factors.assembly.completed);
  });
}

}  // namespace
}  // namespace radiosity::test
