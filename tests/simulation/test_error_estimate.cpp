// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/error_estimate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cases/calibration.hpp"
#include "cases/scenes.hpp"
#include "radiosity/simulation/restrict_to.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::test {
namespace {

struct Estimated {
  ErrorEstimate estimate;
  Patches patches;
  BandArray radiosity;
};

Estimated run(const Scene& scene, const PatchOptions& patch_options, std::string_view method,
              FormFactorOptions options, std::size_t memory_limit_bytes = 0) {
  Patches patches = make_patches(scene, patch_options);
  const Visibility visibility(patches.mesh);
  const FormFactorMethodInfo& info = find_form_factor_method(method);
  const auto [f, assembly] = assemble(*info.make(visibility, options), visibility);
  const auto solver = find_solver("conjugate-gradient").make();
  const RadiositySystem system(f, patches.mesh);
  const Solution solution = solve(*solver, system, patches.mesh);
  AssemblyOptions limited;
  limited.memory_limit_bytes = memory_limit_bytes;
  const auto estimate =
      estimate_error({scene, patches, visibility, info, options, limited, *solver, SolverOptions{}, solution,
                      assembly.lamps, assembly.unrestored(), assembly.unreliable, assembly.pair_rows},
                     std::make_unique<const FormFactorMatrix>(f));
  return {estimate.value(), std::move(patches), solution.radiosity};
}

/// √(Σ A e² / Σ A (B − E)²) of one band against values on a finer mesh.
double true_error(const Estimated& of, const PatchMesh& finer, const BandArray& radiosity) {
  const PatchMesh& mesh = of.patches.mesh;
  const BandArray exact = restrict_to(mesh, finer, radiosity);
  const Eigen::ArrayXd error = (of.radiosity - exact).col(0), reflected = (exact - mesh.emission()).col(0);
  return std::sqrt((mesh.areas() * error.square()).sum() / (mesh.areas() * reflected.square()).sum());
}

TEST(ErrorEstimate, BracketsTheTrueErrorOfCubes) {
  // The reference: exact factors on patches of 1/16, whose own error is about a third of that of patches of 1/8.
  for (const Scene& scene : {lit_cube(0.2, 0.7, 0.5), lit_cube(0.9, 0.1, 0.8)}) {
    const Estimated reference = run(scene, PatchSize{1.0 / 16}, "analytic", {});
    for (const double size : {0.25, 0.125})
      for (const Index samples : {0, 64, 1024}) {
        const Estimated coarse =
            run(scene, PatchSize{size}, samples == 0 ? "analytic" : "hemisphere", {.samples = samples});
        const double truth = true_error(coarse, reference.patches.mesh, reference.radiosity);
        EXPECT_LT(truth, 2 * coarse.estimate.total.value()) << size << ", " << samples;
        EXPECT_GT(truth, coarse.estimate.total.value() / 10) << size << ", " << samples;
      }
  }
}

TEST(ErrorEstimate, BracketsTheTrueErrorOfHemicubesOverOneAndOverSeveralPoints) {
  const Scene scene = lit_cube(0.2, 0.7, 0.5);
  // Exact factors on the same patches: what is left is the error of the form factors.
  const Estimated exact = run(scene, PatchSize{0.25}, "analytic", {});
  for (const Index samples : {1, 4}) {
    for (const Index resolution : {16, 64}) {
      const Estimated cubes =
          run(scene, PatchSize{0.25}, "hemicube", {.samples = samples, .resolution = resolution});
      const double truth = true_error(cubes, exact.patches.mesh, exact.radiosity);
      EXPECT_LT(truth, 3 * cubes.estimate.form_factors.value()) << samples << " × " << resolution;
      EXPECT_GT(truth, cubes.estimate.form_factors.value() / 10) << samples << " × " << resolution;
    }
  }
}

TEST(ErrorEstimate, IsHonestOnScenesWithKnownAnswersAndOnARandomRoom) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes, and runs nothing that other tests do not";
#endif
  std::vector<double> ratios;
  for (const CalibrationCase& h : calibration(1, false)) ratios.push_back(h.ratio());
  std::sort(ratios.begin(), ratios.end());
  // The truth below twice the estimate in 19 of 20 cases, the estimate not above ten times the truth in the median.
  EXPECT_GE(ratios[ratios.size() / 20], 0.5);
  EXPECT_LE(ratios[ratios.size() / 2], 10);
}

SolvedScene solved(const Scene& scene, double size, bool extrapolate) {
  SceneSettings settings;
  settings.patches = PatchSize{size};
  settings.method = "analytic";
  SolveOptions options;
  options.extrapolate = extrapolate;
  return solve_scene(scene, settings, options);
}

TEST(Extrapolation, TakesAThirdOffTheErrorOfPatchesAndSaysWhatIsLeft) {
  const Scene scene = lit_cube(0.2, 0.7, 0.5);
  const SolvedScene reference = solved(scene, 1.0 / 16, false);
  for (const double size : {0.25, 0.125}) {
    const SolvedScene as_solved = solved(scene, size, false), corrected = solved(scene, size, true);
    const double before = true_error({*as_solved.error, as_solved.patches, as_solved.solution.radiosity},
                                     reference.patches.mesh, reference.solution.radiosity);
    const double after = true_error({*corrected.error, corrected.patches, corrected.solution.radiosity},
                                    reference.patches.mesh, reference.solution.radiosity);
    EXPECT_LT(after, 0.67 * before) << size;
    EXPECT_LT(*corrected.error->patches, 0.7 * *as_solved.error->patches) << size;
    EXPECT_GT(*corrected.error->patches, after / 2) << size;
  }
}

TEST(Extrapolation, KeepsBAndHAndTheBalanceOfPowerTogether) {
  const SolvedScene as_solved = solved(box_on_floor(), 0.17, false);
  EXPECT_EQ(as_solved.error->correction.size(), 0);
  const SolvedScene out = solved(random_room(3), 0.7, true);
  const PatchMesh& mesh = out.patches.mesh;
  const Solution& s = out.solution;
  EXPECT_GT(out.error->correction.abs().maxCoeff(), 0);
  EXPECT_TRUE((s.irradiance >= 0).all());
  EXPECT_LT((s.radiosity - mesh.emission() - mesh.reflectance() * s.irradiance).abs().maxCoeff(),
            1e-6 * s.radiosity.maxCoeff());  // that of the solver
  EXPECT_TRUE((s.vertex_radiosity == vertex_values(mesh, s.radiosity)).all());
  const double absorbed =
      ((mesh.absorptance() * s.irradiance).colwise() * mesh.areas()).colwise().sum().maxCoeff();
  EXPECT_NEAR(s.energy.absorbed_w.maxCoeff(), absorbed, 1e-12 * absorbed);
  EXPECT_LT(std::abs(s.energy.imbalance[0]), 0.01);
  // What it changes is within half of the light on each patch.
  const BandArray before = s.irradiance - out.error->correction;
  EXPECT_TRUE((out.error->correction.abs() <= 0.5 * before * (1 + 1e-12)).all());
}

TEST(Extrapolation, LeavesAFurnaceAlone) {
  const SolvedScene furnace = solved(box_on_floor(), 0.17, true);
  const BandArray& b = furnace.solution.radiosity;
  for (Index i = 0; i < b.rows(); ++i)  // E/(1 − ρ), or E where the box stands
    EXPECT_LT(std::min(std::abs(b(i, 0) - 2), std::abs(b(i, 0) - 1)), 1e-6) << i;
}

TEST(ErrorEstimate, FindsNoErrorOfFormFactorsThatAreExact) {
  const Estimated exact = run(lit_cube(0.5, 0.5, 0.5), PatchSize{0.25}, "analytic", {});
  EXPECT_EQ(exact.estimate.form_factors, 0);
  ASSERT_TRUE(exact.estimate.patches.has_value());
  EXPECT_GE(exact.estimate.order.value(), 1.14);
  EXPECT_LE(exact.estimate.order.value(), 2);
  EXPECT_EQ(exact.estimate.per_patch.rows(), exact.patches.mesh.patch_count());
}

TEST(ErrorEstimate, IsRelativeHoweverMuchOrLittleIsEmitted) {
  // Powers of two change no bits, so that each part is equal and each error per patch proportional; the squares of 2^1000 and
  // of 2^-1000 are beyond what a double holds.
  const Scene scene = lit_cube(0.2, 0.7, 0.5);
  const Estimated one = run(scene, PatchSize{0.25}, "hemisphere", {.samples = 64});
  ASSERT_GT(one.estimate.largest.value(), 0);
  for (const double emission : {0x1p1000, 0x1p-1000}) {
    std::vector<Material> materials = scene.materials();
    for (Material& material : materials) material.emission *= emission;
    const Estimated other =
        run(scene.with_materials(materials), PatchSize{0.25}, "hemisphere", {.samples = 64});
    EXPECT_EQ(other.estimate.form_factors, one.estimate.form_factors) << emission;
    EXPECT_EQ(other.estimate.patches, one.estimate.patches) << emission;
    EXPECT_EQ(other.estimate.largest, one.estimate.largest) << emission;
    EXPECT_EQ(other.estimate.total, one.estimate.total) << emission;
    EXPECT_TRUE((other.estimate.per_patch == emission * one.estimate.per_patch).all()) << emission;
  }
}

TEST(ErrorEstimate, KnowsNoTotalWherePatchesCannotBeJoined) {
  const ErrorEstimate kept = run(lit_cube(0.5, 0.5, 0.5), KeepFaces{}, "analytic", {}).estimate;
  EXPECT_EQ(kept.form_factors, 0);
  EXPECT_EQ(kept.patches, std::nullopt);
  EXPECT_EQ(kept.total, std::nullopt);
  EXPECT_EQ(kept.largest, std::nullopt);
  EXPECT_EQ(kept.known, kept.solver);  // √(0² + solver²)
  EXPECT_EQ(kept.notes.size(), 1u);
}

TEST(ErrorEstimate, IsTheSameForFacesThatAreThePatches) {
  const Scene scene = lit_cube(0.2, 0.7, 0.5);
  const Estimated cut = run(scene, PatchSize{0.25}, "analytic", {});
  const Estimated kept = run(scene_of(cut.patches.mesh), KeepFaces{}, "analytic", {});
  EXPECT_EQ(kept.estimate.total, cut.estimate.total);
  EXPECT_TRUE((kept.estimate.per_patch == cut.estimate.per_patch).all());
}

// One viewpoint of 8 cells has at most 192 entries a row, four have 768: on 600 patches 24 · 600 · 192 = 2.8 MB, but 24 · 600² = 8.6 MB.
TEST(ErrorEstimate, SaysWhichPartItHasNoMemoryFor) {
  const ErrorEstimate cramped =
      run(scene_of(cube_room(10)), KeepFaces{}, "hemicube", {.samples = 1, .resolution = 8}, 5'000'000)
          .estimate;
  EXPECT_EQ(cramped.form_factors, std::nullopt);
  EXPECT_EQ(cramped.total, std::nullopt);
  EXPECT_THAT(cramped.notes, ::testing::Contains(::testing::AllOf(
                                 ::testing::StartsWith("error of the form factors: not estimated"),
                                 ::testing::HasSubstr("memory limit"))));
}

// A sheet of 36 patches at 1.7e-6 of the diagonal over a floor, half a patch beside its grid: it covers 25 patches and parts of 24,
// more than the 32 that are computed pair by pair.
TEST(ErrorEstimate, CountsWhatNearlyTouchesOthersAsWrong) {
  MeshBuilder room;
  room.box(Vec3::Zero(), Vec3::Ones(), 10, Facing::inward);
  room.grid(Vec3(0.25, 0.25, 1.7e-6 * std::sqrt(3.0)), Vec3(0, 0.6, 0), Vec3(0.6, 0, 0), 6, 6);
  const ErrorEstimate wrong =
      run(scene_of(room.build()), KeepFaces{}, "hemicube", {.samples = 4, .resolution = 8}).estimate;
  // A quarter or a half of each: of 600 patches alike, √(20 · ¼ + 4 · 1/16) / √600 = 9 % and more.
  ASSERT_TRUE(wrong.form_factors);
  EXPECT_GT(*wrong.form_factors, 0.08);
  EXPECT_GT(wrong.unsampled, 0.08);
  EXPECT_LE(wrong.unsampled, *wrong.form_factors);
  EXPECT_THAT(wrong.notes, ::testing::Contains(::testing::HasSubstr("nearly touches others of 24 patches")));
}

TEST(ErrorEstimate, StopsWhenAskedTo) {
  const Scene scene = lit_cube(0.5, 0.5, 0.5);
  const Patches patches = make_patches(scene, PatchSize{0.25});
  const Visibility visibility(patches.mesh);
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  const FormFactorMatrix f = assemble(*info.make(visibility), visibility).matrix;
  const auto solver = find_solver("conjugate-gradient").make();
  const Solution solution = solve(*solver, RadiositySystem(f, patches.mesh), patches.mesh);
  AssemblyOptions stopping;
  stopping.progress = [](double) { return false; };
  EXPECT_FALSE(
      estimate_error({scene, patches, visibility, info, {}, stopping, *solver, SolverOptions{}, solution},
                     std::make_unique<const FormFactorMatrix>(f)));
}

TEST(RestrictTo, KeepsLinearFieldsOnNestedAndUnnestedGrids) {
  // Means of x + 2y over patches are its values at their centroids.
  const Scene scene = lit_cube(0.5, 0.5, 0.5);
  const PatchMesh coarse = make_patches(scene, PatchSize{1.0 / 3}).mesh;
  for (const double size : {1.0 / 6, 1.0 / 7}) {
    const PatchMesh fine = make_patches(scene, PatchSize{size}).mesh;
    const auto field = [](const PatchMesh& mesh) {
      BandArray values(mesh.patch_count(), 1);
      for (Index i = 0; i < mesh.patch_count(); ++i) values(i, 0) = mesh.centroid(i).dot(Vec3(1, 2, 0));
      return values;
    };
    const BandArray restricted = restrict_to(coarse, fine, field(fine));
    // The means at vertices on the outer border are half a patch off.
    const double allowed = size == 1.0 / 6 ? 1e-12 : 0.015;
    EXPECT_LT((restricted - field(coarse)).abs().maxCoeff(), allowed);
  }
}

}  // namespace
}  // namespace radiosity::test
