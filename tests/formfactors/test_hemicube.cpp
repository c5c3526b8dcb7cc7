// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "cases/closed_forms.hpp"
#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "item_buffer.hpp"
#include "methods.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "support/brute_force.hpp"
#include "support/sanitized.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

const FormFactorMethodInfo& hemicube() {
  return find_form_factor_method("hemicube");
}

/// Whole cells along the border of what is seen go to one side or the other: at worst the border, l half-widths of the cube
/// long, is moved by half a cell, 1/N half-widths, where ΔF/ΔA ≤ 1/π.
double border(double length, Index resolution) {
  return length / (pi * resolution);
}

/// From the unit square z = 0, at (x, y), to the unit square above it at z = 1: four rectangles that meet over the element.
double from_point(double x, double y) {
  return element_under_corner(x, y, 1) + element_under_corner(1 - x, y, 1) +
         element_under_corner(x, 1 - y, 1) + element_under_corner(1 - x, 1 - y, 1);
}

TEST(Hemicube, WithOneViewpointGivesTheFactorFromTheCentre) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const MethodSetup setup(opposed_squares(1, 1), hemicube(),
                            {.samples = 1, .resolution = 128, .seed = seed});
    EXPECT_NEAR(setup.raw().f(0, 1), from_point(0.5, 0.5), border(4, 128));
  }
}

TEST(Hemicube, GivesTheGaussSumOfTheFactorsFromItsViewpoints) {
  // From the centre 0.0396 too much; from 4, 9 and 16 Gauss points the exact factor but for 1.4e-3, 2e-5 and 2e-6.
  const double exact = opposed_rectangles(1, 1, 1);
  const std::array<std::vector<std::array<double, 2>>, 3> rules{{
      {{0.5, 1}},
      {{0.5 - std::sqrt(1.0 / 12), 0.5}, {0.5 + std::sqrt(1.0 / 12), 0.5}},
      {{0.5 - std::sqrt(0.15), 5.0 / 18}, {0.5, 8.0 / 18}, {0.5 + std::sqrt(0.15), 5.0 / 18}},
  }};
  constexpr std::array<double, 3> kOff{0.03963, 1.449e-3, 1.94e-5};
  for (std::size_t k = 0; k < rules.size(); ++k) {
    double sum = 0;
    for (const auto& [x, wx] : rules[k])
      for (const auto& [y, wy] : rules[k]) sum += wx * wy * from_point(x, y);
    EXPECT_NEAR(std::abs(sum - exact), kOff[k], 0.01 * kOff[k]);
    const auto points = static_cast<Index>(rules[k].size() * rules[k].size());
    const MethodSetup setup(opposed_squares(1, 1), hemicube(), {.samples = points, .resolution = 1024});
    EXPECT_NEAR(setup.raw().f(0, 1), sum, border(4, 1024)) << points;
  }
}

TEST(Hemicube, AtItsDefaultErrsOnTheMeanByWhatFourGaussPointsDo) {
  // Patches no nearer than their size, or at right angles: nowhere more than the 1.45e-3 of opposed squares at a distance of
  // their own edge. Eight standard errors of 15 degrees of freedom: one entry in a million is further off.
  const PatchMesh mesh = cube_room(2);
  const SeedMeans rows(mesh, hemicube(), hemicube().defaults);
  for (Index i = 0; i < 4; ++i)  // the other walls are the same by symmetry
    for (Index j = 4; j < mesh.patch_count(); ++j)
      EXPECT_NEAR(rows.mean(i, j), brute_force_form_factor(mesh, i, j, 1e-6),
                  1.45e-3 + 8 * rows.standard_error(i, j))
          << "from " << i << " to " << j;
}

TEST(Hemicube, TakesAnyResolutionAndAnyNumberOfViewpoints) {
  // The whole hemisphere is accounted for, also where tiles of 4 × 4 cells stick out over the faces.
  for (const PatchMesh& mesh : {cube_room(2), tetrahedron(), room_with_triangle_soup(1, 4, 3)}) {
    for (const Index resolution : {1, 2, 6, 17, 50}) {
      for (const Index samples : {1, 2, 3, 5, 7, 12, 17}) {
        const MethodSetup setup(mesh, hemicube(), {.samples = samples, .resolution = resolution});
        const RawRows rows = setup.raw();
        for (Index i = 0; i < setup.size(); ++i) {
          EXPECT_NEAR(rows.f.row(i).sum() + rows.escaped(i).value(), 1, 1e-6)
              << samples << " × " << resolution;
          EXPECT_LE(rows.escaped(i).value(), 1e-6) << samples << " × " << resolution;
        }
      }
    }
  }
}

TEST(Hemicube, LeavesNoGapsBetweenPatchesOfALargeScene) {
  // 1,944 patches × 4 viewpoints × 10⁴ cells: none of them looks between two patches.
  const MethodSetup setup(cube_room(kSanitized ? 6 : 18), hemicube(), {.samples = 4, .resolution = 64});
  const RawRows rows = setup.raw();
  for (Index i = 0; i < setup.size(); ++i) ASSERT_EQ(rows.escaped(i), 0) << "row " << i;
}

TEST(Hemicube, LooksThroughNoVertexOfAFineMesh) {
  // Cells near vertices of small patches, where edge lines rounded to different places would leave a hole: one in 10⁸ cells of
  // this scene showed nothing.
  const MethodSetup setup(cube_room(40), hemicube(), {.samples = 1, .resolution = 64});
  double escaped = 0;
  setup.method->rows(1744, 1760, false,
                     [&](Index, std::span<const Index>, std::span<const double>, std::optional<double> e) {
                       escaped = std::max(escaped, e.value());
                     });
  EXPECT_EQ(escaped, 0);
}

TEST(Hemicube, GivesTheSameBitsOnEveryLevelOfProcessors) {
  const PatchMesh mesh = room_with_floating_box(6, 4);
  const Visibility visibility(mesh);
  const auto factors = [&](const item_buffer::Kernel& kernel) {
    std::vector<double> all;
    make_hemicube(visibility, {.samples = 2, .resolution = 50}, kernel)
        ->rows(0, mesh.patch_count(), false,
               [&](Index, std::span<const Index> columns, std::span<const double> values,
                   std::optional<double> escaped) {
                 all.insert(all.end(), columns.begin(), columns.end());
                 all.insert(all.end(), values.begin(), values.end());
                 all.push_back(escaped.value());
               });
    return all;
  };
  const auto kernels = item_buffer::kernels();
  const std::vector<double> plain = factors(kernels.front());
  EXPECT_GT(plain.size(), 1000U);
  for (const item_buffer::Kernel& kernel : kernels) EXPECT_EQ(factors(kernel), plain) << kernel.level;
}

TEST(Hemicube, SeesEachFaceOfTheRoomWhateverItsOwnPlane) {
  // By symmetry: from each wall of a cube F is 0.2 to every other. Their borders are at most the rim of the cube.
  const MethodSetup setup(cube_room(1), hemicube(), {.samples = 64, .resolution = 256});
  const Eigen::MatrixXd f = setup.raw().f;
  for (Index i = 0; i < 6; ++i)
    for (Index j = 0; j < 6; ++j) {
      if (i == j) continue;
      const bool opposite = setup.mesh.normal(i).dot(setup.mesh.normal(j)) < -0.5;
      EXPECT_NEAR(f(i, j), opposite ? 0.199824895698387 : 0.200043776075403, border(8, 256)) << i << " " << j;
    }
}

}  // namespace
}  // namespace radiosity::test
