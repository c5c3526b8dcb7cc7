// SPDX-License-Identifier: GPL-3.0-or-later
// What no form factor may ever do, on random scenes and where scenes are hard; and what the methods promise in rooms as people
// build them.
#include <gtest/gtest.h>

#include <cmath>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "support/parameters.hpp"
#include "support/sanitized.hpp"

namespace radiosity::test {
namespace {

const FormFactorMethodInfo& analytic() {
  return find_form_factor_method("analytic");
}

/// F as it is stored, with the diagonal.
Eigen::MatrixXd stored(const MethodSetup& setup) {
  return as_dense(assemble(*setup.method, setup.visibility).matrix);
}

/// Triangles, some of them slivers, at random in a closed room of unit size.
PatchMesh random_room(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  MeshBuilder room;
  room.box({0, 0, 0}, {1, 1, 1}, 2, Facing::inward);
  const auto point = [&](double low, double high) {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    return Vec3((Vec3(a, b, c) * (high - low)).array() + low);
  };
  for (int k = 0; k < 6; ++k) {
    const Vec3 a = point(0.1, 0.9), b = point(0.1, 0.9);
    const Vec3 c = (a + b) / 2 + point(-0.3, 0.3) * std::pow(10, -4 * uniform(random));
    if ((b - a).cross(c - a).norm() < 1e-8) continue;
    room.polygon({a, b, c}).polygon({a, c, b});
  }
  return room.build();
}

class Bounds : public testing::TestWithParam<const FormFactorMethodInfo*> {};

INSTANTIATE_TEST_SUITE_P(All, Bounds, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(Bounds, HoldOnRandomScenes) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const MethodSetup setup(random_room(seed), *GetParam());
    const Eigen::MatrixXd f = stored(setup);
    EXPECT_GE(f.minCoeff(), 0) << "seed " << seed;
    EXPECT_LE(f.maxCoeff(), 1) << "seed " << seed;
    EXPECT_LE(f.rowwise().sum().maxCoeff(), 1 + 1e-12) << "seed " << seed;
    for (Index i = 0; i < setup.size(); ++i)
      for (Index j = 0; j < setup.size(); ++j) {
        const double ai = setup.mesh.area(i), aj = setup.mesh.area(j);
        EXPECT_LE(i == j ? 0 : ai * f(i, j), std::min(ai, aj) * (1 + 1e-6)) << "seed " << seed;
      }
  }
}

TEST(AnalyticBounds, NoOccluderAddsToAFactor) {
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 12); ++seed) {
    const PatchMesh room = random_room(seed);
    const Eigen::MatrixXd occluded = MethodSetup(room, analytic()).raw().f;
    // The same two patches alone in space; parts behind each other's plane are the same.
    for (Index i = 0; i < room.patch_count(); i += 3)
      for (Index j = i + 1; j < room.patch_count(); j += 2) {
        std::vector<Vec3> a, b;
        for (const Index v : room.corners(i)) a.push_back(room.vertex(v));
        for (const Index v : room.corners(j)) b.push_back(room.vertex(v));
        const double alone =
            MethodSetup(MeshBuilder().polygon(a).polygon(b).build(), analytic()).raw().f(0, 1);
        // The contour form of slivers is a difference of terms of some 0.1 m².
        const double rounding = 1e-13 + 1e-17 / room.area(i);
        EXPECT_LE(occluded(i, j), alone * (1 + 1e-7) + rounding) << "seed " << seed << ": " << i << ", " << j;
      }
  }
}

TEST(AnalyticBounds, AScreenTakesWhatItHidesAtTheDefaultSetting) {
  for (const Index n : {1, 2, 4}) {
    const MethodSetup setup(opposed_squares_with_screen(n, 0.5), analytic());
    const RawRows rows = setup.raw();
    double sum = 0;
    for (Index i = 0; i < n * n; ++i) sum += rows.f.row(i).segment(n * n, n * n).sum() / (n * n);
    EXPECT_NEAR(sum, 0.0995062945990, 1e-4) << n << " × " << n;
  }
}

TEST(AnalyticBounds, NearlyTouchingSquaresCloseTheirRows) {
  for (const double gap : {1e-3, 1e-6, 1e-9}) {
    const MethodSetup setup(opposed_squares(gap, 3), analytic());
    const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
    const Eigen::MatrixXd dense = as_dense(f);
    EXPECT_GE(dense.minCoeff(), 0);
    EXPECT_LE(dense.maxCoeff(), 1);
    for (Index i = 0; i < f.size(); ++i) {
      EXPECT_NEAR(dense.row(i).sum() + f.escaped()[i], 1, 1e-12) << "gap " << gap;
      // A strip of the width of the gap round the border is all that looks out.
      EXPECT_NEAR(dense.row(i).sum(), 1, 4 * 3 * gap + 1e-6) << "gap " << gap;
    }
  }
}

TEST(AnalyticBounds, EveryFactorOutlivesMotionAndScale) {
  const PatchMesh mesh = random_room(3);
  const Eigen::MatrixXd expected = MethodSetup(mesh, analytic()).raw().f;
  const Eigen::Affine3d turned(Eigen::AngleAxisd(0.7, Vec3(1, 2, -3).normalized()));
  for (const Eigen::Affine3d& transform :
       {turned, Eigen::Affine3d(Eigen::Scaling(1e-6)), Eigen::Affine3d(Eigen::Scaling(1e6)),
        Eigen::Affine3d(Eigen::Translation3d(1e6, 1e6, -1e6))}) {
    const PatchMesh moved = transformed(mesh, transform);
    const Eigen::MatrixXd f = MethodSetup(moved, analytic()).raw().f;
    // Coordinates of 1e6 are rounded by 1e-10, and a sliver of that width is all rounding: weigh by area.
    const Eigen::ArrayXd area = mesh.areas();
    for (Index i = 0; i < mesh.patch_count(); ++i)
      for (Index j = 0; j < mesh.patch_count(); ++j)
        EXPECT_NEAR(area[i] * f(i, j), area[i] * expected(i, j), 1e-5 * std::min(area[i], area[j]) + 1e-9)
            << i << ", " << j;
  }
}

TEST_P(Bounds, AFurnishedRoomIsClosed) {
  // Furniture covers patches of walls and floor, and they it: those see nothing, and nothing escapes elsewhere.
  // Rows are closed however rough the factors of pairs that see each other in part are.
  const FormFactorOptions options{.samples = GetParam() == &analytic() ? 4 : 0};
  const MethodSetup setup(make_patches(two_furnished_rooms(), PatchSize{2}).mesh.with_clusters({}),
                          *GetParam(), options);
  const auto [matrix, report] = assemble(*setup.method, setup.visibility);
  const Eigen::MatrixXd f = as_dense(matrix);
  EXPECT_TRUE(report.closed_scene);
  Index covered = 0;
  for (Index i = 0; i < setup.size(); ++i) {
    covered += setup.visibility.covered(i);
    EXPECT_NEAR(f.row(i).sum(), setup.visibility.covered(i) ? 0 : 1, 1e-6) << "row " << i;
  }
  EXPECT_GT(covered, 0);
  EXPECT_EQ(report.isolated_patches, covered);
}

TEST(Covered, AreNotTheTwoSidesOfAWall) {
  // In the open, in a room, and a wall without thickness between two rooms.
  for (const PatchMesh& mesh : {opposed_squares_with_screen(2, 3), opposed_squares_with_screen(2, 0.5, 3),
                                two_rooms(2), room_with_triangle_soup(2, 5, 1)}) {
    const Visibility visibility(mesh);
    for (Index i = 0; i < mesh.patch_count(); ++i) EXPECT_FALSE(visibility.covered(i)) << "patch " << i;
  }
}

TEST(SampledRows, SayHowMuchNoiseTheyHoldAndGiveALampItsFactorsWithinOneAndAHalfPercent) {
  const PatchMesh mesh = make_patches(two_furnished_rooms(), PatchSize{2}).mesh.with_clusters({});
  // To some 1e-3, a tenth of the noise that it is compared with.
  const Eigen::MatrixXd exact = MethodSetup(mesh, analytic(), {.samples = 4}).raw().f;
  for (const Index samples : {256, 4096}) {
    const MethodSetup setup(mesh, find_form_factor_method("hemisphere"), {.samples = samples});
    const auto [f, report] = assemble(*setup.method, setup.visibility);
    const Eigen::ArrayXd row_errors = (as_dense(f) - exact).cwiseAbs().rowwise().sum().array();
    const double error = (row_errors * mesh.areas()).sum() / mesh.areas().sum();
    EXPECT_LT(error, 1.5 * report.before.reciprocity_error_mean);
    EXPECT_GT(error, 0.6 * report.before.reciprocity_error_mean);
    if (samples < 4096) continue;
    ASSERT_GT(report.lamps, 0);
    double of_lamps = 0, sum = 0;
    for (Index lamp = 0; lamp < mesh.patch_count(); ++lamp) {
      if (!(mesh.material_of(lamp).emission > 0).any() || mesh.normal(lamp).z() > -0.5) continue;
      of_lamps += row_errors[lamp];
      sum += exact.row(lamp).sum();
    }
    EXPECT_LT(of_lamps, 0.015 * sum);
  }
}

TEST(AnalyticPairs, AreCountedOnceEach) {
  const MethodSetup setup(make_patches(two_furnished_rooms(), PatchSize{2}).mesh.with_clusters({}),
                          analytic(), {.samples = 1});
  const PairCounts p = assemble(*setup.method, setup.visibility).report.pairs;
  const auto n = static_cast<std::uint64_t>(setup.size());
  // Patches of one group lie in one plane, and pairs of a patch with itself are not asked for.
  EXPECT_EQ(p.behind + p.hidden + p.free + p.partial + p.by_rays, n * (n - 1) / 2);
  EXPECT_GT(p.hidden, 0u);
  EXPECT_GT(p.partial, 0u);
}

}  // namespace
}  // namespace radiosity::test
