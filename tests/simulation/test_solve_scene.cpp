// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/solve_scene.hpp"

#include <gmock/gmock.h>
#include <tbb/task_arena.h>

#include <thread>
#include <utility>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SceneSettings coarse() {
  SceneSettings settings;
  settings.patches = PatchSize{0.25};
  return settings;
}

/// A grey scene whose materials have the same value in three bands.
Scene in_three_bands(const Scene& scene) {
  std::vector<Material> materials = scene.materials();
  for (Material& material : materials) {
    material.reflectance = BandValues::Constant(3, material.reflectance[0]);
    material.emission = BandValues::Constant(3, material.emission[0]);
  }
  return scene.with_materials(std::move(materials));
}

TEST(SolveScene, TellsEachStageOnTheCallersThread) {
  std::vector<SolveStage> ended, progressed;
  const auto caller = std::this_thread::get_id();
  double last = 0;
  SolveOptions options;
  options.ended = [&](SolveStage stage, const SolvedScene& scene) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    ended.push_back(stage);
    EXPECT_EQ(scene.patches.mesh.patch_count(), 96);
    EXPECT_EQ(!scene.form_factors.method.empty(), stage != SolveStage::patches);
    EXPECT_EQ(scene.solution.radiosity.rows() > 0, stage == SolveStage::solve || stage == SolveStage::error);
  };
  options.progress = [&](SolveStage stage, double fraction) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    if (progressed.empty() || progressed.back() != stage)
      progressed.push_back(stage);
    else
      EXPECT_GE(fraction, last);
    last = fraction;
    return true;
  };
  const SolvedScene solved = solve_scene(lit_cube(0.5, 0.5, 0.5), coarse(), options);
  using enum SolveStage;
  EXPECT_THAT(ended, ElementsAre(patches, method, form_factors, solve, error));
  EXPECT_THAT(progressed, ElementsAre(form_factors, solve, error));
  EXPECT_TRUE(solved.converged());
  EXPECT_TRUE(solved.error && solved.error->total);
  EXPECT_THAT(solved.warnings, IsEmpty());
  EXPECT_EQ(solved.form_factors.method, "analytic");
  EXPECT_FALSE(solved.modelled.occlusion);
}

TEST(SolveScene, ReachesAnAccuracyInRounds) {
  SolveOptions options;
  options.accuracy = 0.02;
  std::vector<double> errors;
  options.round_ended = [&](const AccuracyRound& round) { errors.push_back(round.error.known); };
  options.ended = [](SolveStage, const SolvedScene&) { FAIL() << "a round is told as a whole"; };
  const SolvedScene solved = solve_scene(cube_with_box(), {}, options);
  ASSERT_TRUE(solved.accuracy.has_value());
  EXPECT_TRUE(solved.accuracy->reached);
  EXPECT_THAT(solved.accuracy->why_not, IsEmpty());
  EXPECT_EQ(errors.size(), solved.accuracy->rounds.size());
  EXPECT_EQ(*solved.error->total, errors.back());
  EXPECT_LE(errors.back(), 0.02);
}

TEST(SolveScene, KeepsWhatItHasWhenItIsStopped) {
  for (const SolveStage at : {SolveStage::form_factors, SolveStage::solve, SolveStage::error}) {
    SolveOptions options;
    options.progress = [at](SolveStage stage, double) { return stage != at; };
    const SolvedScene solved = solve_scene(lit_cube(0.5, 0.5, 0.5), coarse(), options);
    EXPECT_FALSE(solved.error.has_value());
    EXPECT_EQ(solved.solution.report.status,
              at == SolveStage::error ? SolveStatus::converged : SolveStatus::stopped);
    EXPECT_EQ(solved.form_factors.assembly.completed, at != SolveStage::form_factors);
    const double sum = solved.solution.radiosity.sum();
    EXPECT_EQ(sum == 16, at == SolveStage::form_factors);  // B = E
  }
}

TEST(SolveScene, StopsWhenItsTimeIsUp) {
  SolveOptions options;
  options.seconds = 0;
  EXPECT_EQ(solve_scene(lit_cube(0.5, 0.5, 0.5), coarse(), options).solution.report.status,
            SolveStatus::stopped);
  options.accuracy = 0.001;
  const SolvedScene solved = solve_scene(lit_cube(0.5, 0.5, 0.5), {}, options);
  EXPECT_FALSE(solved.accuracy->reached);
  EXPECT_THAT(solved.accuracy->why_not, HasSubstr("time"));
}

TEST(SolveScene, SolvesEqualBandsOnceAndSetupsTogether) {
  const Scene scene = in_three_bands(lit_cube(0.5, 0.5, 0.5));
  const std::vector<LightingSetup> setups{{"dim", std::vector<double>(scene.materials().size(), 0.25)}};
  const SolvedScene solved = solve_scene(scene, coarse(), {}, setups);
  EXPECT_EQ(solved.bands, 1);
  EXPECT_EQ(solved.solution.radiosity.cols(), 2);
  EXPECT_EQ(solved.modelled.saved.radiosity_bytes, 8U * 96 * 4);
  const Solution full = solved.solution_of_setup(0), dim = solved.solution_of_setup(1);
  EXPECT_TRUE(dim.radiosity.isApprox(0.25 * full.radiosity, 1e-5));
  EXPECT_TRUE(solved.mesh_of_setup(1).emission().isApprox(0.25 * solved.mesh_of_setup(0).emission()));
  EXPECT_EQ(solved.error_of_setup(1)->cols(), 1);
}

TEST(SolveScene, ShootsOnRowsThatItAsksForWhereNoErrorIsToBeToldOrFDoesNotFit) {
  SceneSettings settings = coarse();
  settings.solver = "progressive";
  settings.method = "hemisphere";
  settings.samples = 1024;
  SolveOptions options;
  options.estimate_error = false;
  const auto expect_rows = [&] {
    const SolvedScene solved = solve_scene(lit_cube(0.5, 0.5, 0.5), settings, options);
    EXPECT_EQ(solved.form_factors.storage, FormFactorStorage::rows);
    EXPECT_EQ(solved.form_factors.bytes, 0U);
    EXPECT_TRUE(solved.converged());
    EXPECT_FALSE(solved.error.has_value());
    return solved;
  };
  const SolvedScene solved = expect_rows();
  EXPECT_GT(solved.solution.report.iterations, 96);  // shots of as many patches, and yet
  EXPECT_LE(solved.form_factors.assembly.rays, std::uint64_t{96} * 1024);  // each row was computed once
  options.estimate_error = true;
  options.memory_limit_bytes = 100'000;
  expect_rows();
}

TEST(SolveScene, ShootingHasAnErrorLikeTheRest) {
  SceneSettings settings = coarse();
  const SolvedScene gathered = solve_scene(lit_cube(0.5, 0.5, 0.5), settings);
  settings.solver = "progressive";
  const SolvedScene shot = solve_scene(lit_cube(0.5, 0.5, 0.5), settings);
  EXPECT_EQ(shot.form_factors.storage, FormFactorStorage::dense);
  ASSERT_TRUE(shot.error && shot.error->total && gathered.error && gathered.error->total);
  EXPECT_NEAR(*shot.error->total, *gathered.error->total, 0.01 * *gathered.error->total);
}

TEST(SolveScene, ShootsOnMoreThreadsThanThereAreCores) {
  // What lamps are computed pair by pair from is built when the first row asks for it, while other threads shoot.
  SceneSettings settings;
  settings.patches = PatchSize{0.5};
  settings.method = "hemisphere";
  settings.samples = 64;
  settings.solver = "progressive";
  settings.max_iterations = 20;
  SolveOptions options;
  options.estimate_error = false;
  const auto radiosity = [&](int threads) {
    const ThreadLimit limit(threads);
    tbb::task_arena arena(threads);  // the limit alone gives no more threads than there are cores
    return arena.execute(
        [&] { return solve_scene(two_furnished_rooms(), settings, options).solution.radiosity; });
  };
  const BandArray alone = radiosity(1);
  for (int run = 0; run < 3; ++run) EXPECT_TRUE((radiosity(16) == alone).all());
}

TEST(SolveScene, GivesSheetsTheirBacks) {
  // A sheet in mid-air, one-sided but for what the scene decides: from behind it would be black.
  const Scene cube = lit_cube(0.5, 0.5, 0.5);
  Scene::Arrays arrays;
  arrays.vertices = cube.vertices();
  arrays.materials = cube.materials();
  for (Index f = 0; f < cube.face_count(); ++f) arrays.add_face(cube.corners(f), cube.material(f));
  Material sheet{"sheet", BandValues::Constant(1, 0.5), BandValues::Zero(1)};
  sheet.sides = Sides::automatic;
  arrays.materials.push_back(sheet);
  const auto first = static_cast<Index>(arrays.vertices.size());
  for (const auto& [x, y] : {std::pair{0.3, 0.3}, {0.7, 0.3}, {0.7, 0.7}, {0.3, 0.7}})
    arrays.vertices.push_back({x, y, 0.5});
  arrays.add_face(std::vector<Index>{first, first + 1, first + 2, first + 3},
                  static_cast<Index>(arrays.materials.size() - 1));
  const SolvedScene solved = solve_scene(Scene(arrays), {.patches = KeepFaces{}});
  EXPECT_EQ(solved.patches.mesh.patch_count(), 8);  // two of the sheet
}

TEST(SolveScene, RefusesWhatHasNoEffect) {
  const Scene cube = lit_cube(0.5, 0.5, 0.5);
  EXPECT_THROW(solve_scene(cube, {.solver = "jacobi", .relaxation = 1.5}), InputError);
  EXPECT_THROW(solve_scene(cube, {.ambient = true}), InputError);
  SolveOptions accurate;
  accurate.accuracy = 0;
  EXPECT_THROW(solve_scene(cube, {}, accurate), InputError);
  std::vector<Material> dark = cube.materials();
  for (Material& material : dark) material.emission.setZero();
  EXPECT_THROW(solve_scene(cube.with_materials(dark)), InputError);
  SolveOptions small;
  small.memory_limit_bytes = 1;
  EXPECT_THROW(solve_scene(cube, {}, small), MemoryLimitError);
}

TEST(SceneFormFactors, AreThoseOfTheSceneAlone) {
  const SceneFormFactors f = scene_form_factors(lit_cube(0.5, 0.5, 0.5), {.patches = KeepFaces{}});
  EXPECT_EQ(f.matrix.size(), 6);
  EXPECT_TRUE(f.scene.form_factors.assembly.completed);
  EXPECT_TRUE(f.scene.solver.empty());
  BandArray sums(6, 1);
  f.matrix.apply(BandArray::Ones(6, 1), sums);
  EXPECT_TRUE(sums.isApproxToConstant(1, 1e-6));
}

}  // namespace
}  // namespace radiosity::test
