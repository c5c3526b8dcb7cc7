// SPDX-License-Identifier: GPL-3.0-or-later
// What directions cannot tell, sampled methods leave to the pairs: lamps, patches that nearly touch, thin and distant ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cases/closed_forms.hpp"
#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

class Pairwise : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  AssembledFormFactors assembled(const PatchMesh& mesh) const {
    const MethodSetup setup(mesh, *GetParam());
    return assemble(*setup.method, setup.visibility);
  }
  Eigen::MatrixXd factors(const PatchMesh& mesh) const { return as_dense(assembled(mesh).matrix); }
};

INSTANTIATE_TEST_SUITE_P(All, Pairwise, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

/// The same scene with patches that do not emit, so that none is computed pair by pair for that reason.
MeshBuilder unlit() {
  return MeshBuilder().use_material(grey("wall", 0.5, 0));
}

TEST_P(Pairwise, SquaresThatNearlyTouchSeeNothingButEachOther) {
  // What gets out at the border is of the order of the gap.
  for (const double gap : {1e-6, 1e-9}) {
    const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
    for (const Index n : {1, 3}) {
      const Eigen::MatrixXd f =
          factors(unlit().grid({0, 0, 0}, x, y, n, n).grid({0, 0, gap}, y, x, n, n).build());
      for (Index i = 0; i < f.rows(); ++i) EXPECT_NEAR(f.row(i).sum(), 1, 30 * gap * n + 1e-7) << gap;
    }
  }
}

TEST_P(Pairwise, ALidJustAboveTheFloorHidesTheRoom) {
  // Inside a closed room: the plate and the floor below it see each other alone; the plate's upper side sees the room. The gaps
  // are more than a contact, and less and more than what rays can tell.
  for (const double gap : {2.5e-6, 1e-5}) {
    const Vec3 x = Vec3::UnitX() / 3, y = Vec3::UnitY() / 3;
    const Vec3 corner(1.0 / 3, 1.0 / 3, gap);
    const PatchMesh mesh = unlit()
                               .box({0, 0, 0}, {1, 1, 1}, 3, Facing::inward)
                               .grid(corner, y, x, 1, 1)
                               .grid(corner, x, y, 1, 1)
                               .build();
    const Index down = mesh.patch_count() - 2, up = mesh.patch_count() - 1;
    const Eigen::MatrixXd f = factors(mesh);
    Index below = -1;
    for (Index i = 0; i < down; ++i)
      if ((mesh.centroid(i) - mesh.centroid(down)).norm() < 1e-4) below = i;
    ASSERT_GE(below, 0);
    EXPECT_NEAR(f(down, below), 1, 1e-3) << gap;
    EXPECT_NEAR(f(below, down), 1, 1e-3) << gap;
    EXPECT_EQ(f(up, below), 0) << gap;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      EXPECT_NEAR(f.row(i).sum(), 1, 1e-5) << gap << ", row " << i;
  }
}

TEST_P(Pairwise, ThinStripsFarApartExchangeTheLittleTheyDo) {
  // Strips of 1 m × 1 µm, opposed, at a distance of 1 m: between parallel thin lines,
  //   F = w/π ∫∫ ds dt / ((s − t)² + 1)² = w/π · (π/4)   as  2 ∫₀¹ (1 − u) / (1 + u²)² du = π/4.
  const double w = 1e-6;
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY() * w;
  const Eigen::MatrixXd f = factors(unlit().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, 1}, y, x, 1, 1).build());
  EXPECT_NEAR(f(0, 1), w / 4, 1e-3 * w);
  EXPECT_NEAR(f(1, 0), w / 4, 1e-3 * w);
}

TEST_P(Pairwise, LongWallsThatMeetAtTinyAndAtNearlyStraightAnglesAreRight) {
  // Two walls of infinite length and equal width that meet at an angle α: F = 1 − sin(α/2) [Howell, C-16]. The ends of walls a
  // thousand times as long as they are wide take less than a width's share of that.
  for (const double alpha : {0.01 * pi / 180, 179.99 * pi / 180}) {
    const Vec3 x = Vec3::UnitX() * 1000;
    const Vec3 up(0, std::cos(alpha), std::sin(alpha));
    const Eigen::MatrixXd f =
        factors(unlit().grid({0, 0, 0}, x, Vec3::UnitY(), 1, 1).grid({0, 0, 0}, up, x, 1, 1).build());
    const double exact = alpha < 1 ? 1 - std::sin(alpha / 2) : std::pow(std::cos(alpha / 2), 2) / 2;
    EXPECT_NEAR(f(0, 1), exact, 2e-3 * exact) << alpha;
    EXPECT_NEAR(f(1, 0), exact, 2e-3 * exact) << alpha;
  }
}

TEST_P(Pairwise, ClosingLeavesTheFactorsToASmallLampAlone) {
  // A lamp of 1 mm² before the middle of a wall of a room with 150 patches, and the same lamp in a room of six.
  for (const Index n : {5, 1}) {
    const double size = 1e-3;
    const PatchMesh mesh = MeshBuilder()
                               .use_material(grey("wall", 0.5, 0))
                               .box({0, 0, 0}, {1, 1, 1}, n, Facing::inward)
                               .use_material(grey("lamp", 0, 10))
                               .grid({0.47, 0.41, 1}, size * Vec3::UnitY(), size * Vec3::UnitX(), 1, 1)
                               .build();
    const Index lamp = mesh.patch_count() - 1;
    const Eigen::MatrixXd f = factors(mesh);
    const Eigen::MatrixXd exact = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f;
    for (Index i = 0; i < lamp; ++i) {
      EXPECT_NEAR(f(i, lamp), exact(i, lamp), 1e-5 * exact(i, lamp)) << "from " << i;
      EXPECT_NEAR(f(lamp, i), exact(lamp, i), 1e-5 * exact(lamp, i)) << "to " << i;
      EXPECT_NEAR(f.row(i).sum(), 1, 1e-5) << "row " << i;
    }
  }
}

TEST_P(Pairwise, LampsKnowBetterThanCellsWhatLeavesThroughANarrowGap) {
  // Four viewpoints see nothing of the gap: had they the last word, the rows would sum to 1.
  const Eigen::MatrixXd f = factors(opposed_squares(1e-3));
  EXPECT_NEAR(f(0, 1), 0.998005631908, 1e-7);
  EXPECT_NEAR(f(1, 0), 0.998005631908, 1e-7);
}

TEST_P(Pairwise, SaysSoWherePatchesThatNearlyTouchAreTooMany) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = unlit().grid({0, 0, 0}, x, y, 12, 12).grid({0, 0, 1e-9}, y, x, 12, 12).build();
  const auto [matrix, report] = assembled(mesh);
  const Eigen::MatrixXd f = as_dense(matrix);
  const bool right = (f.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-6;
  EXPECT_TRUE(right || !report.warnings.empty());
}

TEST(Pairwise, HemispheresStartNoRaysWhereSomethingFacesThePatchThatNear) {
  // A plate above a quarter of the floor of a closed room, each in so many patches that they are not computed pair by pair: what the
  // plate faces sees nothing, what it does not sees the room, and nothing sees through it.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const Vec3 corner(0.25, 0.25, 2.5e-6);
  const PatchMesh mesh = unlit()
                             .box({0, 0, 0}, {1, 1, 1}, 2, Facing::inward)
                             .grid(corner, y / 2, x / 2, 16, 16)
                             .grid(corner, x / 2, y / 2, 16, 16)
                             .build();
  const MethodSetup setup(mesh, find_form_factor_method("hemisphere"));
  const auto [matrix, report] = assemble(*setup.method, setup.visibility);
  EXPECT_TRUE(report.unreliable.empty());
  const Eigen::MatrixXd f = as_dense(matrix);
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const bool floor = mesh.centroid(i).z() < 1e-6,
               down = mesh.normal(i).z() < -0.5 && mesh.centroid(i).z() < 0.5;
    EXPECT_NEAR(f.row(i).sum(), down ? 0 : floor ? 0.75 : 1, 0.03) << i;
  }
}

/// A room with a grid of n × n lamps of side `size` under its ceiling, each a surface of its own.
PatchMesh room_with_lamps(Index n, double size) {
  MeshBuilder room = unlit().box({0, 0, 0}, {1, 1, 1}, 5, Facing::inward).use_material(grey("lamp", 0, 10));
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b)
      room.grid({(a + 0.3) / n, (b + 0.3) / n, 0.9}, size * Vec3::UnitY(), size * Vec3::UnitX(), 1, 1);
  return room.build();
}

TEST_P(Pairwise, SaysSoWhereSmallLampsAreTooMany) {
  FormFactorOptions coarse = setting_of(*GetParam(), 16);
  const auto warnings = [&](const PatchMesh& mesh) {
    const MethodSetup setup(mesh, *GetParam(), coarse);
    const auto [f, report] = assemble(*setup.method, setup.visibility);
    return std::count_if(report.warnings.begin(), report.warnings.end(), [](const std::string& warning) {
      return warning.find("surfaces that emit") != std::string::npos;
    });
  };
  // 64 of 214 patches send 16 rays each: five arrive at each patch. Of the 768 cells of four viewpoints there are enough.
  EXPECT_EQ(warnings(room_with_lamps(8, 1e-3)), GetParam()->name == "hemisphere" ? 1 : 0);
  EXPECT_EQ(warnings(room_with_lamps(7, 1e-3)), 0);  // computed pair by pair
  coarse = setting_of(*GetParam(), 256);
  EXPECT_EQ(warnings(cube_room(4)), 0);  // all of it emits
}

TEST(PairRows, OfAnEarlierAssemblyAreTakenAsTheyAreAndNoOthersComputed) {
  // With 16 directions hardly any row is told by 32 of them, and the pairs would take over more rows than with 4,096.
  const PatchMesh mesh = unlit()
                             .box({0, 0, 0}, {1, 1, 1}, 2, Facing::inward)
                             .use_material(grey("lamp", 0, 1))
                             .grid({0.4, 0.4, 0.99}, 0.2 * Vec3::UnitY(), 0.2 * Vec3::UnitX(), 1, 1)
                             .build();
  const Index lamp = mesh.patch_count() - 1;
  const FormFactorMethodInfo& info = find_form_factor_method("hemisphere");
  const MethodSetup many(mesh, info, {.samples = 4096}), few(mesh, info, {.samples = 16});
  AssemblyOptions options;
  options.close = false;
  const auto [f_of_many, of_many] = assemble(*many.method, many.visibility, options);
  const AssemblyReport of_few_alone = assemble(*few.method, few.visibility, options).report;
  options.pair_rows = of_many.pair_rows;
  const auto [f_of_few, of_few] = assemble(*few.method, few.visibility, options);
  const Eigen::MatrixXd a = as_dense(f_of_many), b = as_dense(f_of_few);
  EXPECT_GT(of_few_alone.pairwise, of_many.pairwise);
  EXPECT_EQ(of_few.pairwise, of_many.pairwise);
  EXPECT_EQ(of_few.lamps, 1);
  EXPECT_EQ(a.row(lamp), b.row(lamp));
  EXPECT_EQ(a.col(lamp), b.col(lamp));
  EXPECT_NE(a.row(0), b.row(0));
}

// A table under a lamp: seen from the floor, it hides the lamp in part. With some hundred specks more, there are too many polygons for
// shadows to be clipped.
TEST(PairRows, ErrOnTheFloorAsMuchAsIsSaid) {
  for (const int specks : {0, 2100}) {
    MeshBuilder room = unlit();
    room.box({0, 0, 0}, {4, 4, 3}, 8, Facing::inward)
        .box({1.5, 1.5, 0.7}, {2.5, 2.5, 0.75}, 1, Facing::outward)
        .use_material(grey("lamp", 0, 1))
        .grid({1.6, 1.7, 2.9}, 0.6 * Vec3::UnitY(), 0.8 * Vec3::UnitX(), 1, 1);
    room.use_material(grey("speck", 0.5, 0));
    for (int k = 0; k < specks; ++k)
      room.grid({0.001 * k, 0.01, 0.01 + 0.001 * k}, 1e-4 * Vec3::UnitX(), 1e-4 * Vec3::UnitY(), 1, 1);
    const PatchMesh mesh = room.build();
    constexpr Index kFloor = 64;
    Index lamp = 0;
    while (mesh.material_of(lamp).name != "lamp") ++lamp;
    const MethodSetup rays(mesh, find_form_factor_method("hemisphere"), {.samples = 64});
    AssemblyOptions options;
    options.close = false;
    const auto [f, report] = assemble(*rays.method, rays.visibility, options);

    const MethodSetup exact(mesh, find_form_factor_method("analytic"), {.samples = specks == 0 ? 900 : 4096});
    Eigen::ArrayXd truth = Eigen::ArrayXd::Zero(mesh.patch_count());
    exact.method->rows(lamp, lamp + 1, false, [&](Index, auto columns, auto values, auto) {
      for (std::size_t k = 0; k < columns.size(); ++k)
        truth[columns[k]] = values[k] * mesh.area(lamp) / mesh.area(columns[k]);
    });

    std::vector<Index> floor;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (mesh.normal(i).z() > 0.5 && mesh.centroid(i).z() == 0) floor.push_back(i);
    ASSERT_EQ(floor.size(), std::size_t{kFloor});
    BandArray radiosity = BandArray::Zero(mesh.patch_count(), 1);
    radiosity(lamp, 0) = 2;
    const BandArray said = pair_errors(*report.pair_rows, rays.visibility, radiosity, floor);
    double said_square = 0, true_square = 0, light_square = 0;
    for (const Index i : floor) {
      said_square += std::pow(said(i, 0), 2);
      true_square += std::pow(2 * (f(i, lamp) - truth[i]), 2);
      light_square += std::pow(2 * truth[i], 2);
    }
    EXPECT_GT(true_square, std::pow(1e-3, 2) * light_square) << specks;
    EXPECT_GT(said_square, std::pow(0.6, 2) * true_square) << specks;
    EXPECT_LT(said_square, std::pow(1.6, 2) * true_square) << specks;
    EXPECT_EQ(said.col(0).isNaN().count(), mesh.patch_count() - kFloor);
  }
}

}  // namespace
}  // namespace radiosity::test
