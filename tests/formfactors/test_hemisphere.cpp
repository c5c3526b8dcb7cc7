// SPDX-License-Identifier: GPL-3.0-or-later
// What the random choices of the hemisphere are for: errors of neighbours, and of positions and directions, are independent.
#include <gtest/gtest.h>

#include <cmath>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"

namespace radiosity::test {
namespace {

TEST(Hemisphere, ErrsIndependentlyOnNeighboursOfOneWall) {
  // 400 patches of a wall, so small that all see the same of a lid: their mean errs with σ²/400. The few sets of directions that
  // they share would leave it σ²/16, if each did not turn them by an angle of its own.
  constexpr Index kSide = 20, kPatches = kSide * kSide;
  constexpr int kRuns = 32;
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh =
      MeshBuilder().grid({0, 0, 0}, 1e-3 * x, 1e-3 * y, kSide, kSide).grid({0.2, 0.1, 1}, y, x, 1, 1).build();
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  const double exact = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f(0, kPatches);
  const MethodSetup setup(mesh, info);
  double of_mean = 0, of_one = 0;  // Σ of squares over the runs
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const auto method = info.make(setup.visibility, {.samples = 16, .seed = seed});
    const Eigen::ArrayXd f = raw_rows(*method, mesh.patch_count()).f.col(kPatches).head(kPatches);
    of_mean += std::pow(f.mean() - exact, 2);
    of_one += (f - f.mean()).square().sum() / (kPatches - 1);
  }
  // Over 32 runs the ratio is known to ± 1/4: 1 where all is independent, 400/16 = 25 and more where the sets are not turned.
  // Turned, they still share the angles from the normal.
  EXPECT_LT(of_mean, 8 * of_one / kPatches);
}

TEST(Hemisphere, ErrsNoMoreThanIndependentRaysHoweverManyShareAPoint) {
  // Opposed squares at a twentieth of their side: whether a ray meets the other depends on where it starts and whither it goes.
  // Of K independent rays F has the variance F (1 − F) / K. 4,096 rays start at 512 points; points in the order of the directions
  // would be 1.6 times as far off.
  constexpr Index kRays = 4096;
  constexpr int kRuns = 200;
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, 0.05}, y, x, 1, 1).build();
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  const double exact = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f(0, 1);
  const MethodSetup setup(mesh, info);
  double square = 0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const auto method = info.make(setup.visibility, {.samples = kRays, .seed = seed});
    square += std::pow(raw_rows(*method, 2).f(0, 1) - exact, 2) / kRuns;
  }
  // The square of the rms of 200 runs is off by 10 %.
  EXPECT_LT(square, 1.5 * exact * (1 - exact) / kRays);
}

}  // namespace
}  // namespace radiosity::test
