// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "radiosity/formfactors/assemble.hpp"
#include "support/brute_force.hpp"
#include "support/method_setup.hpp"
#include "support/scenes.hpp"

namespace radiosity::test {
namespace {

const FormFactorMethodInfo& hemicube() {
  return find_form_factor_method("hemicube");
}

TEST(Hemicube, WithOneViewpointGivesTheFactorFromTheCentre) {
  // An element under the centre of a parallel unit square at distance 1. The border, 100 cells long at 128 cells, moves by at
  // most half a cell of ΔF ≤ 7.8e-5.
  for (const std::uint64_t seed : {1, 2, 3}) {
    const MethodSetup setup(opposed_squares(1, 1), hemicube(),
                            {.samples = 1, .resolution = 128, .seed = seed});
    EXPECT_NEAR(setup.raw().f(0, 1), 0.239456470460774, 4e-3);
  }
}

TEST(Hemicube, FallsToTheFactorOfTheWholePatchAsViewpointsAreAdded) {
  // Squares that share an edge, where the factor from the centre is furthest off.
  const PatchMesh mesh = rectangles_sharing_an_edge(1, 1, 1, std::numbers::pi / 2);
  const double exact = 0.200043776075403;
  const auto error = [&](Index samples) {
    const MethodSetup setup(mesh, hemicube(), {.samples = samples, .resolution = 512});
    return std::abs(setup.raw().f(0, 1) - exact);
  };
  EXPECT_LT(error(4), error(1) / 2);
  EXPECT_LT(error(16), error(4) / 2);
  EXPECT_LT(error(16), 2e-3);
}

TEST(Hemicube, TakesAnyResolutionAndAnyNumberOfViewpoints) {
  // The whole hemisphere is accounted for, also where tiles of 4 × 4 cells stick out over the faces.
  for (const PatchMesh& mesh : {cube_room(2), tetrahedron(), room_with_triangle_soup(1, 4, 3)}) {
    for (const Index resolution : {1, 2, 6, 17, 50}) {
      for (const Index samples : {1, 2, 3, 5, 7, 12, 17}) {
        const MethodSetup setup(mesh, hemicube(), {.samples = samples, .resolution = resolution});
        const RawRows rows = setup.raw();
        for (Index i = 0; i < setup.size(); ++i) {
          EXPECT_NEAR(rows.f.row(i).sum() + rows.escaped[i], 1, 1e-6) << samples << " × " << resolution;
          EXPECT_LE(rows.escaped[i], 1e-6) << samples << " × " << resolution;
        }
      }
    }
  }
}

TEST(Hemicube, LeavesNoGapsBetweenPatchesOfALargeScene) {
  // 1,944 patches × 4 viewpoints × 10⁴ cells: none of them looks between two patches.
  const MethodSetup setup(cube_room(18), hemicube(), {.samples = 4, .resolution = 64});
  const RawRows rows = setup.raw();
  EXPECT_EQ(rows.escaped.maxCoeff(), 0);
}

TEST(Hemicube, LooksThroughNoVertexOfAFineMesh) {
  // Cells near vertices of small patches, where edge lines rounded to different places would leave a hole: one in 10⁸ cells of
  // this scene showed nothing.
  const MethodSetup setup(cube_room(40), hemicube(), {.samples = 1, .resolution = 64});
  double escaped = 0;
  setup.method->rows(1744, 1760, false,
                     [&](Index, std::span<const Index>, std::span<const double>, double e) {
                       escaped = std::max(escaped, e);
                     });
  EXPECT_EQ(escaped, 0);
}

TEST(Hemicube, SeesEachFaceOfTheRoomWhateverItsOwnPlane) {
  // By symmetry: from each wall of a cube F is 0.2 to every other.
  const MethodSetup setup(cube_room(1), hemicube(), {.samples = 64, .resolution = 256});
  const Eigen::MatrixXd f = setup.raw().f;
  for (Index i = 0; i < 6; ++i)
    for (Index j = 0; j < 6; ++j) {
      if (i == j) continue;
      const bool opposite = setup.mesh.normal(i).dot(setup.mesh.normal(j)) < -0.5;
      EXPECT_NEAR(f(i, j), opposite ? 0.199824895698387 : 0.200043776075403, 5e-4) << i << " " << j;
    }
}

}  // namespace
}  // namespace radiosity::test
