// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/compare.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ParetoFront, HoldsWhatNothingElseBeatsByRisingCost) {
  // 1 and 3 are beaten by 2; 4 costs as much as 0 and errs more; 5 equals 0 and comes later.
  const std::vector<CostAndError> points{{1, 10}, {5, 4}, {4, 3}, {9, 3}, {1, 11}, {1, 10}, {20, 1}};
  EXPECT_THAT(pareto_front(points), ElementsAre(0, 2, 6));
  EXPECT_THAT(pareto_front({}), IsEmpty());
}

TEST(Cheapest, IsTheLeastCostThatMeetsTheError) {
  const std::vector<CostAndError> points{{3, 0.01}, {2, 0.02}, {1, 0.5}, {2, 0.01}};
  EXPECT_EQ(cheapest(points, 0.5), 2U);
  EXPECT_EQ(cheapest(points, 0.1), 1U);
  EXPECT_EQ(cheapest(points, 0.01), 3U);
  EXPECT_EQ(cheapest(points, 0.001), std::nullopt);
}

TEST(RelativeError, IsRelativeToReflectedLightAndTakesTheWorstBand) {
  // Two unit squares that emit 1; the reference reflects 3 and 4, the errors are 0.3 and 0:
  //   rms = √(0.3² / (3² + 4²)) = 0.06, largest = 0.3 / 3.
  const PatchMesh mesh = opposed_squares(1);
  BandArray reference(2, 1), radiosity(2, 1);
  reference << 4, 5;
  radiosity << 4.3, 5;
  const RelativeError error = relative_error(mesh, radiosity, reference);
  EXPECT_NEAR(error.rms, 0.06, 1e-12);
  EXPECT_NEAR(error.largest, 0.1, 1e-12);
}

TEST(RelativeError, LeavesDarkAndUnknownPatchesOutOfTheLargest) {
  // The second patch reflects 0.001, less than 1 % of the mean (10 + 0.001) / 2.
  const PatchMesh mesh = opposed_squares(1);
  BandArray reference(2, 1), radiosity(2, 1);
  reference << 11, 1.001;
  radiosity << 11, 1.002;
  EXPECT_EQ(relative_error(mesh, radiosity, reference).largest, 0);
  reference(1, 0) = std::nan("");
  EXPECT_EQ(relative_error(mesh, radiosity, reference).rms, 0);
  EXPECT_THROW(relative_error(mesh, BandArray::Zero(3, 1), reference), InputError);
}

TEST(Ladder, HoldsTheDefaultAndRisesByFactorsOfFour) {
  for (const FormFactorMethodInfo& info : form_factor_methods()) {
    const auto steps = ladder(info);
    int standard = 0;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      standard +=
          steps[k].samples == info.defaults.samples && steps[k].resolution == info.defaults.resolution;
      for (std::size_t m = 0; m < k; ++m)
        EXPECT_TRUE(steps[k].samples != steps[m].samples || steps[k].resolution != steps[m].resolution);
      EXPECT_EQ(steps[k].has_resolution(), info.defaults.has_resolution());
    }
    EXPECT_EQ(standard, 1) << info.name;
    EXPECT_GE(steps.size(), 5U) << info.name;
  }
}

// The closed cube with a ceiling that shines; convex, so the analytic method is exact.
Scene cube() {
  Scene::Arrays arrays;
  arrays.materials = {grey("walls", 0.5, 0), grey("ceiling", 0.5, 1)};
  for (int c = 0; c < 8; ++c) arrays.vertices.emplace_back(c & 1, (c >> 1) & 1, c >> 2);
  const Index faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                             {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  for (int f = 0; f < 6; ++f) arrays.add_face(faces[f], f == 1 ? 1 : 0);
  return Scene(std::move(arrays));
}

TEST(Compare, FindsNoErrorOfExactFactorsAndSaysWhyRunsAreMissing) {
  CompareOptions options;
  options.budget_s = 10;
  std::vector<Index> meshed;
  options.meshed = [&](const Patches& patches) { meshed.push_back(patches.mesh.patch_count()); };
  const Comparison all = compare(cube(), PatchSize{0.25}, options);
  EXPECT_THAT(meshed, ElementsAre(96));
  EXPECT_TRUE(all.completed);
  ASSERT_EQ(all.meshes[all.own].patches, 96);
  EXPECT_EQ(all.factors.method, "analytic");
  ASSERT_TRUE(all.finer.has_value());
  EXPECT_EQ(all.finer->method, "analytic");
  EXPECT_GT(all.finer->patches, 96);
  [[maybe_unused]] bool exact_ran = false;
  for (const ComparedRun& run : all.runs) {
    if (!run.left_out.empty()) {
      EXPECT_FALSE(run.total || run.factors);
      continue;
    }
    EXPECT_GT(run.bytes, 0);
    ASSERT_TRUE(run.total.has_value());
    EXPECT_GE(*error_at_most(all, run), run.total->rms);
    EXPECT_EQ(run.factors.has_value(), run.mesh == all.own);
    if (run.mesh == all.own && run.method == "analytic") {
      exact_ran = true;
      EXPECT_LT(run.factors->rms, 2e-6);  // the tolerance of the solver is 1e-6
    } else if (run.factors) {             // nothing is judged that the reference cannot tell
      EXPECT_GT(run.factors->rms, (run.method == "hemicube" ? 1 : 10) * all.factors.noise);
    }
  }
  // One map per method that ran on the user's patches, of the default where that did.
  for (const FormFactorMethodInfo& method : form_factor_methods()) {
    int ran = 0, shown = 0, defaults = 0, shown_defaults = 0;
    for (const ComparedRun& run : all.runs) {
      if (run.method != method.name || run.mesh != all.own || !run.left_out.empty()) continue;
      ++ran;
      defaults += run.standard;
      if (run.where.size() == 0) continue;
      ++shown;
      shown_defaults += run.standard;
      EXPECT_EQ(run.where.size(), 96);
    }
    EXPECT_EQ(shown, ran > 0 ? 1 : 0) << method.name;
    EXPECT_EQ(shown_defaults, defaults) << method.name;
  }
#ifndef __SANITIZE_ADDRESS__  // many times slower, it leaves out what the budget does not hold
  EXPECT_TRUE(exact_ran);
#endif
}

// A ball of 1,280 faces in a room, joined to clusters of half a metre.
TEST(Compare, TellsTheErrorsOfClusters) {
  MeshBuilder room;
  room.box({0, 0, 0}, {2, 2, 2}, 1, Facing::inward)
      .use_material(grey("ball", 0.7, 0))
      .sphere({1, 1.1, 0.8}, 0.3, 3, Facing::outward);
  CompareOptions options;
  options.budget_s = 5;
  const Comparison all = compare(scene_of(room.build()), PatchSize{0.5}, options);
  ASSERT_TRUE(all.mesh->clustered());
  const ComparedMesh& own = all.meshes[all.own];
  EXPECT_EQ(own.patches, all.mesh->cluster_count());
  EXPECT_LT(own.patches, 200);
  EXPECT_GT(all.mesh->patch_count(), 1280);
  for (Index c = 0; c < all.mesh->cluster_count(); ++c)
    for (const Index i : all.mesh->members(c))
      EXPECT_EQ(all.radiosity(i, 0), all.radiosity(all.mesh->members(c)[0], 0));
  for (const ComparedMesh& mesh : all.meshes) EXPECT_LT(mesh.patches, all.mesh->patch_count());
  for (const ComparedRun& run : all.runs) {
    if (!run.left_out.empty()) continue;
    EXPECT_TRUE(std::isfinite(run.total ? run.total->rms : 0)) << run.method;
    // Walls that shine and reflect half of it: what the ball hides of them is no more than a tenth.
    if (run.total && run.standard) {
      EXPECT_LT(run.total->rms, 0.1) << run.method << " " << run.mesh;
    }
  }
#ifndef __SANITIZE_ADDRESS__
  ASSERT_TRUE(all.finer.has_value());
  EXPECT_GE(all.finer->patches, 1.5 * own.patches);
#endif
}

TEST(Compare, MeasuresEverySolverAtEveryToleranceOnTheSameF) {
  CompareOptions options;
  options.budget_s = 10;
  const Comparison all = compare(cube(), PatchSize{0.5}, options);
  ASSERT_EQ(all.solvers.size(), 8 * solvers().size());
  for (std::size_t k = 0; k < all.solvers.size(); ++k) {
    const SolverRun& run = all.solvers[k];
    EXPECT_EQ(run.left_out, "");
    EXPECT_LE(run.residual, run.tolerance);
    EXPECT_NEAR(run.tolerance, std::pow(10.0, -1 - static_cast<double>(k % 8)), 1e-12);
    // A reflectance of a half doubles what is unaccounted for at most, and much of the power is emitted, not reflected.
    EXPECT_LE(run.error, 20 * run.residual);
    if (k % 8 > 0) {
      EXPECT_GE(run.products, all.solvers[k - 1].products);
    }
  }
}

TEST(Compare, StopsWhenAskedTo) {
  CompareOptions options;
  options.progress = [](double) { return false; };
  const Comparison all = compare(cube(), PatchSize{0.25}, options);
  EXPECT_FALSE(all.completed);
  EXPECT_THAT(all.runs, IsEmpty());
}

TEST(Compare, RefusesABudgetThatIsNoneOrTooSmall) {
  CompareOptions options;
  options.budget_s = 0;
  EXPECT_THROW(compare(cube(), PatchSize{0.25}, options), InputError);
  options.budget_s = 1e-9;
  EXPECT_THROW(compare(cube(), PatchSize{0.05}, options), InputError);
}

}  // namespace
}  // namespace radiosity::test
