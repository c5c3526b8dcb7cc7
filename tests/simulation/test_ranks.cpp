// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

// On two and on three ranks; each of them gets all of it.
void expect_the_solution_of_one_process(const Scene& scene, const SceneSettings& settings) {
  const SolvedScene alone = solve_scene(scene, settings);
  ASSERT_TRUE(alone.converged());
  for (const int count : {2, 3}) {
    std::mutex checking;
    on_ranks(count, [&](const std::shared_ptr<const Ranks>& ranks) {
      SolveOptions options;
      options.ranks = ranks;
      const SolvedScene shared = solve_scene(scene, settings, options);
      const std::lock_guard lock(checking);
      EXPECT_TRUE((shared.solution.radiosity == alone.solution.radiosity).all());
      EXPECT_TRUE((shared.solution.irradiance == alone.solution.irradiance).all());
      EXPECT_EQ(shared.solution.report.history, alone.solution.report.history);
      EXPECT_EQ(shared.form_factors.nonzeros, alone.form_factors.nonzeros);
      EXPECT_EQ(shared.form_factors.assembly.rays, alone.form_factors.assembly.rays);
      ASSERT_EQ(shared.elements.has_value(), alone.elements.has_value());
      if (alone.elements) {
        EXPECT_TRUE((shared.elements->radiosity == alone.elements->radiosity).all());
        EXPECT_TRUE((shared.elements->standard_error == alone.elements->standard_error).all());
      }
      ASSERT_TRUE(shared.error && alone.error);
      EXPECT_EQ(shared.error->notes, alone.error->notes);
      // Larger patches have factors in single precision on the way.
      EXPECT_NEAR(*shared.error->form_factors, *alone.error->form_factors, 1e-12);
      EXPECT_NEAR(*shared.error->patches, *alone.error->patches, 1e-5 * *alone.error->patches);
    });
  }
}

TEST(SolvingOnRanks, GivesTheBitsOfOneProcess) {
  SceneSettings settings;
  settings.patches = PatchSize{0.07};
  settings.method = "hemisphere";
  settings.samples = 256;
  settings.elements = ElementSize{0.04};
  settings.element_samples = 32;
  expect_the_solution_of_one_process(closed_cornell_box(), settings);
}

TEST(SolvingOnRanks, GivesTheBitsOfOneProcessToElementsThatAreSmallWhereLightChanges) {
  SceneSettings settings;
  settings.patches = PatchSize{0.4};
  settings.method = "analytic";
  settings.elements = AutoElements{};
  expect_the_solution_of_one_process(cube_with_box(), settings);
}

TEST(SolvingOnRanks, RefusesWhatOneProcessDoes) {
  const auto refused = [](const SceneSettings& settings, std::optional<double> accuracy) {
    std::string message;
    on_ranks(1, [&](const std::shared_ptr<const Ranks>& ranks) {
      SolveOptions options;
      options.ranks = ranks;
      options.accuracy = accuracy;
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
    EXPECT_THAT(refused(settings, {}),
                testing::HasSubstr(std::string("solver ") + solver + " runs in one process"));
  }
  EXPECT_THAT(refused({}, 0.01), testing::HasSubstr("in one process"));
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
