// SPDX-License-Identifier: GPL-3.0-or-later
// What every method of form_factor_methods() owes its callers. A new method is covered by its row of the table.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <numbers>
#include <set>

#include "cases/closed_forms.hpp"
#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "support/brute_force.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;
using testing::HasSubstr;

TEST(FormFactorMethodTable, HasTheMethodsThatTheInterfaceNames) {
  std::set<std::string_view> names;
  for (const FormFactorMethodInfo& info : form_factor_methods()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name << " twice";
    EXPECT_FALSE(info.summary.empty()) << info.name;
    EXPECT_FALSE(info.citation.empty()) << info.name;
    EXPECT_GT(info.defaults.*setting_of(info), 0) << info.name;
    EXPECT_EQ(find_form_factor_method(info.name).name, info.name);
  }
  for (const char* name : {"analytic", "hemisphere", "hemicube"}) EXPECT_TRUE(names.contains(name)) << name;
}

TEST(FormFactorMethodTable, ListsTheNamesWhenAskedForAnUnknownOne) {
  try {
    find_form_factor_method("hemicub");
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("hemicub"));
    for (const FormFactorMethodInfo& info : form_factor_methods())
      EXPECT_THAT(error.what(), HasSubstr(std::string(info.name)));
  }
}

class Method : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  const FormFactorMethodInfo& info() const { return *GetParam(); }

  /// Few rays or cells, for tests that are not about accuracy.
  FormFactorOptions coarse() const { return setting_of(info(), 16); }
};

INSTANTIATE_TEST_SUITE_P(All, Method, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

std::vector<PatchMesh> assorted_scenes() {
  return {cube_room(3),
          room_with_floating_box(2, 1),
          opposed_squares_with_screen(2, 0.5),
          two_rooms(1),
          opposed_squares(0.01, 2),
          room_with_triangle_soup(1, 4, 3),
          tetrahedron(),
          rectangles_sharing_an_edge(1, 1, 1, 2 * pi / 3),
          concentric_spheres(0, 1, grey("inner", 0.5, 1), grey("outer", 0.5, 0))};
}

TEST_P(Method, GivesFractionsAndNothingFromAPlanarPatchToItself) {
  for (const PatchMesh& mesh : assorted_scenes()) {
    const MethodSetup setup(mesh, info());
    const RawRows rows = setup.raw();
    EXPECT_GE(rows.f.minCoeff(), 0);
    EXPECT_LE(rows.f.maxCoeff(), 1 + 1e-12);
    EXPECT_EQ(rows.f.diagonal().cwiseAbs().maxCoeff(), 0);
    for (Index i = 0; i < setup.size(); ++i) {
      EXPECT_LE(rows.f.row(i).sum(), 1 + setup.row_tolerance(rows, i)) << "row " << i;
      EXPECT_LE(rows.escaped(i).value_or(0), 1 + 1e-12) << "row " << i;
    }
  }
}

TEST_P(Method, AccountsForAllOfTheHemisphereInClosedRooms) {
  const MeshBuilder ball = MeshBuilder().sphere(Vec3::Zero(), 1, 1, Facing::inward);
  for (const PatchMesh& mesh : {cube_room(4), tetrahedron(), room_with_floating_box(3, 2), two_rooms(1),
                                ball.build(), room_with_triangle_soup(2, 6, 5)}) {
    const MethodSetup setup(mesh, info());
    const RawRows rows = setup.raw();
    for (Index i = 0; i < setup.size(); ++i) {
      EXPECT_NEAR(rows.f.row(i).sum(), 1, setup.row_tolerance(rows, i)) << "row " << i;
      EXPECT_LE(rows.escaped(i).value_or(0), 1e-6) << "row " << i << " leaks";
    }
  }
}

TEST_P(Method, AccountsForWhatLeavesThroughOpenSides) {
  const MethodSetup setup(opposed_squares_with_screen(3, 0.5), info());
  const RawRows rows = setup.raw();
  for (Index i = 0; i < setup.size(); ++i)
    if (const auto escaped = rows.escaped(i)) {
      EXPECT_NEAR(rows.f.row(i).sum() + *escaped, 1, 1e-6) << "row " << i;
    }
}

TEST_P(Method, IsReciprocal) {
  for (const PatchMesh& mesh : {room_with_floating_box(2, 1), opposed_squares_with_screen(3, 0.5)}) {
    const MethodSetup setup(mesh, info());
    if (setup.method->reciprocal()) {  // by construction
      const Eigen::MatrixXd s = mesh.areas().matrix().asDiagonal() * setup.raw().f;
      EXPECT_LT((s - s.transpose()).cwiseAbs().maxCoeff(), 1e-12);
      continue;
    }
    const SeedMeans rows(mesh, info());
    for (Index i = 0; i < mesh.patch_count(); ++i)
      for (Index j = 0; j < i; ++j) {
        const double ai = mesh.area(i), aj = mesh.area(j);
        EXPECT_NEAR(ai * rows.mean(i, j), aj * rows.mean(j, i),
                    ai * rows.tolerance(i, j) + aj * rows.tolerance(j, i))
            << "patches " << i << " and " << j;
      }
  }
}

TEST_P(Method, AgreesOnTheMeanWithBruteForceWhereAScreenHidesPart) {
  const PatchMesh mesh = opposed_squares_with_screen(3, 0.5);
  const SeedMeans rows(mesh, info());
  // By symmetry patches 0 (corner), 1 (edge) and 4 (middle) stand for the whole lower square; 18 is the
  // screen's upper side, 19 its lower one.
  for (const Index i : {0, 1, 4, 18, 19})
    for (Index j = 0; j < mesh.patch_count(); ++j)
      EXPECT_NEAR(rows.mean(i, j), brute_force_form_factor(mesh, i, j, 1e-5), rows.tolerance(i, j) + 1e-5)
          << "from " << i << " to " << j;
}

TEST_P(Method, AgreesOnTheMeanWithBruteForceInARoomWithABox) {
  const PatchMesh mesh = room_with_floating_box(2, 1);
  const SeedMeans rows(mesh, info());
  for (const Index i : {0, 17, 24, 29})
    for (Index j = 0; j < mesh.patch_count(); ++j)
      EXPECT_NEAR(rows.mean(i, j), brute_force_form_factor(mesh, i, j, 3e-4), rows.tolerance(i, j) + 1e-4)
          << "from " << i << " to " << j;
}

/// From all of surface 0 to all of surface 1.
double between_surfaces(const MethodSetup& setup) {
  const RawRows rows = setup.raw();
  double power = 0, area = 0;
  for (Index i = 0; i < setup.size(); ++i) {
    if (setup.mesh.surface(i) != 0) continue;
    area += setup.mesh.area(i);
    for (Index j = 0; j < setup.size(); ++j)
      if (setup.mesh.surface(j) == 1) power += setup.mesh.area(i) * rows.f(i, j);
  }
  return power / area;
}

/// Allowed error of between_surfaces for squares cut n × n at distance 1: five standard errors of the samples of
/// n² patches together; for a hemicube, 5 %, which is a handful of viewpoints on each.
double surface_tolerance(const MethodSetup& setup, int n, double f) {
  if (setup.method->exact()) return 1e-6 * f;
  if (!setup.method->options().has_resolution())
    return 5 * std::sqrt(f / (setup.method->options().samples * n * n));
  return 0.05 * f;
}

TEST_P(Method, GivesTheExactFactorOfOpposedSquares) {
  const MethodSetup setup(opposed_squares(1, 5), info());
  EXPECT_NEAR(between_surfaces(setup), 0.199824895698387, surface_tolerance(setup, 5, 0.2));
}

TEST_P(Method, TakesAwayExactlyWhatAScreenHalfTheSizeHides) {
  const MethodSetup setup(opposed_squares_with_screen(5, 0.5), info());
  EXPECT_NEAR(between_surfaces(setup), 0.0995062945990, surface_tolerance(setup, 5, 0.2));
}

TEST_P(Method, SeesNothingThroughAWall) {
  const MethodSetup setup(opposed_squares_with_screen(2, 3), info());
  const RawRows rows = setup.raw();
  EXPECT_EQ(rows.f.block(0, 4, 4, 4).maxCoeff(), 0);
  EXPECT_EQ(rows.f.block(4, 0, 4, 4).maxCoeff(), 0);
}

TEST_P(Method, SeesOnlyThroughTheDoor) {
  // Patches of the two end walls above the door's lintel see each other only through the wall.
  const MethodSetup setup(two_rooms(1), info());
  const RawRows rows = setup.raw();
  double through = 0;
  for (Index i = 0; i < setup.size(); ++i)
    for (Index j = 0; j < setup.size(); ++j) {
      const Vec3 &a = setup.mesh.centroid(i), &b = setup.mesh.centroid(j);
      if (a.x() < 1 && b.x() > 1 && a.z() > 0.67 && b.z() > 0.67) {
        EXPECT_EQ(rows.f(i, j), 0) << i << " " << j;
      }
      if (a.x() < 1 && b.x() > 1) through += rows.f(i, j);
    }
  EXPECT_GT(through, 0.1);
}

TEST_P(Method, GivesABackNothing) {
  // Both squares look up: the lower one meets the back of the upper, the upper one sees nothing.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const MethodSetup setup(MeshBuilder().grid({0, 0, 0}, x, y, 2, 2).grid({0, 0, 1}, x, y, 2, 2).build(),
                          info());
  EXPECT_EQ(setup.raw().f.cwiseAbs().maxCoeff(), 0);
}

TEST_P(Method, LetsABackBlock) {
  // Surface 2, one-sided and looking up, stands between the lower square 0 and the upper square 1.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const MethodSetup setup(MeshBuilder()
                              .grid({0, 0, 0}, x, y, 2, 2)
                              .grid({0, 0, 1}, y, x, 2, 2)
                              .grid({-1, -1, 0.5}, 3 * x, 3 * y, 1, 1)
                              .build(),
                          info());
  const RawRows rows = setup.raw();
  EXPECT_EQ(rows.f.topRows(4).maxCoeff(), 0);
  EXPECT_GT(rows.f(4, 8), 0.5);
}

TEST_P(Method, IsBlindToWhereHowLargeAndWhichWayRoundTheSceneIs) {
  const PatchMesh mesh = room_with_floating_box(1, 1);
  const SeedMeans expected(mesh, info());
  const Eigen::Affine3d turned(Eigen::AngleAxisd(1.1, Vec3(3, -1, 2).normalized()));
  const Eigen::Affine3d moved(Eigen::Translation3d(1e6, -3e6, 2e6));
  const Eigen::Affine3d small(Eigen::Scaling(1e-6)), large(Eigen::Scaling(1e6));
  for (const Eigen::Affine3d& transform : {small * turned, moved * turned * large}) {
    const SeedMeans rows(transformed(mesh, transform), info());
    for (Index i = 0; i < mesh.patch_count(); ++i)
      for (Index j = 0; j < mesh.patch_count(); ++j)
        EXPECT_NEAR(rows.mean(i, j), expected.mean(i, j), rows.tolerance(i, j) + expected.tolerance(i, j))
            << "from " << i << " to " << j;
  }
}

TEST_P(Method, KeepsExactValuesFarFromTheOriginAndAtAnySize) {
  for (const double size : {1e-6, 1.0, 1e6}) {
    const Eigen::Affine3d transform = Eigen::Translation3d(1e6 * size, 1e6 * size, 0) * Eigen::Scaling(size);
    const MethodSetup setup(transformed(opposed_squares(1, 4), transform), info());
    EXPECT_NEAR(between_surfaces(setup), 0.199824895698387, surface_tolerance(setup, 4, 0.2))
        << "size " << size;
  }
}

TEST_P(Method, HandsOverEachRowOnceInAscendingColumnsWithoutZeros) {
  const MethodSetup setup(two_rooms(1), info(), coarse());
  std::vector<int> calls(setup.size(), 0);
  std::mutex mutex;
  setup.method->rows(3, 20, false,
                     [&](Index i, std::span<const Index> columns, std::span<const double> values, auto) {
                       const std::lock_guard lock(mutex);
                       ++calls[i];
                       ASSERT_EQ(columns.size(), values.size());
                       for (std::size_t k = 0; k < columns.size(); ++k) {
                         EXPECT_TRUE(columns[k] >= 0 && columns[k] < setup.size());
                         if (k > 0) {
                           EXPECT_LT(columns[k - 1], columns[k]);
                         }
                         EXPECT_GT(values[k], 0);
                       }
                     });
  for (Index i = 0; i < setup.size(); ++i) EXPECT_EQ(calls[i], i >= 3 && i < 20 ? 1 : 0) << "row " << i;
}

TEST_P(Method, GivesARowTheSameBitsWhateverElseIsAsked) {
  const MethodSetup setup(room_with_floating_box(2, 1), info());
  const RawRows all = setup.raw();
  Eigen::VectorXd alone = Eigen::VectorXd::Zero(setup.size());
  setup.method->rows(11, 12, false,
                     [&](Index, std::span<const Index> columns, std::span<const double> values, auto) {
                       for (std::size_t k = 0; k < columns.size(); ++k) alone[columns[k]] = values[k];
                     });
  EXPECT_EQ(alone.transpose(), all.f.row(11));
}

TEST_P(Method, GivesTheUpperHalfAloneWhereTheOtherFollowsByReciprocity) {
  const MethodSetup setup(room_with_floating_box(2, 1), info());
  if (!setup.method->reciprocal()) GTEST_SKIP() << "not reciprocal by construction";
  const RawRows full = setup.raw(), upper = raw_rows(*setup.method, setup.size(), true);
  for (Index i = 0; i < setup.size(); ++i)
    for (Index j = 0; j < setup.size(); ++j) {
      const double expected = j > i ? full.f(i, j) : 0;
      EXPECT_NEAR(upper.f(i, j), expected, 1e-12 * expected) << "from " << i << " to " << j;
    }
}

TEST_P(Method, RepeatsItselfToTheBit) {
  const PatchMesh mesh = room_with_floating_box(2, 1);
  const MethodSetup once(mesh, info()), again(mesh, info());
  EXPECT_EQ(once.raw().f, again.raw().f);
}

TEST_P(Method, DrawsOtherSamplesForAnotherSeed) {
  const PatchMesh mesh = room_with_floating_box(2, 1);
  FormFactorOptions other;
  other.seed = 2;
  if (info().name == "analytic") {  // draws nothing where the polygons are few
    EXPECT_EQ(MethodSetup(mesh, info()).raw().f, MethodSetup(mesh, info(), other).raw().f);
    return;
  }
  EXPECT_NE(MethodSetup(mesh, info()).raw().f, MethodSetup(mesh, info(), other).raw().f);
}

TEST_P(Method, ComesCloserTheMoreIsSpent) {
  // Ideal gain over 16 times the samples: 4 or more; over 4 times the resolution: 4 or more, as long as the cells are
  // coarse: the noise of the hemicube's few viewpoints stays. Half of that is asked for. Finely cut so that the error is a
  // mean over many pairs.
  const bool cells = info().defaults.has_resolution();
  const PatchMesh mesh = cells ? opposed_squares(1, 4) : opposed_squares_with_screen(4, 0.5);
  Eigen::MatrixXd exact = Eigen::MatrixXd::Zero(4, 16);
  const std::array<Index, 4> from{0, 1, 5, 7};
  for (Index a = 0; a < 4; ++a)
    for (Index j = 0; j < 16; ++j) exact(a, j) = brute_force_form_factor(mesh, from[a], 16 + j, 1e-6);
  const auto error = [&](Index setting) {
    double sum = 0;
    for (const std::uint64_t seed : {1, 2, 3}) {
      FormFactorOptions options = setting_of(info(), setting);
      options.seed = seed;
      const RawRows rows = MethodSetup(mesh, info(), options).raw();
      for (Index a = 0; a < 4; ++a)
        sum += (rows.f.row(from[a]).segment(16, 16) - exact.row(a)).cwiseAbs().sum();
    }
    return sum;
  };
  EXPECT_LT(error(cells ? 32 : 1024), 0.5 * error(cells ? 8 : 64));
}

TEST_P(Method, CountsItsRays) {
  const MethodSetup setup(room_with_floating_box(2, 1), info());
  EXPECT_EQ(setup.method->rays(), 0u);
  setup.raw();
  if (info().name == "hemisphere") {
    EXPECT_EQ(setup.method->rays(), static_cast<std::uint64_t>(info().defaults.samples * setup.size()));
  }
  if (info().name == "analytic") {
    EXPECT_EQ(setup.method->rays(), 0u);  // exact shadows of the room's few polygons
    // Rays where the scene has too many polygons, and where too many stand between one pair.
    for (const Index count : {2100, 200}) {
      const MethodSetup crowded(room_with_triangle_soup(1, count, 3), info());
      crowded.method->rows(0, 1, false, [](Index, auto, auto, auto) {});
      EXPECT_GT(crowded.method->rays(), 0u) << count;
    }
  }
}

TEST_P(Method, NeedsNoRaysWhereItIsExact) {
  const MethodSetup setup(cube_room(3), info());
  if (!setup.method->exact()) GTEST_SKIP() << "not exact in any scene";
  setup.raw();
  EXPECT_EQ(setup.method->rays(), 0u);
  EXPECT_FALSE(MethodSetup(room_with_floating_box(1, 1), info()).method->exact());
}

TEST_P(Method, RefusesANegativeSetting) {
  const PatchMesh mesh = cube_room(1);
  const Visibility visibility(mesh);
  try {
    info().make(visibility, setting_of(info(), -3));
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("-3"));
    EXPECT_THAT(error.what(), HasSubstr(info().defaults.has_resolution() ? "resolution" : "samples"));
  }
}

}  // namespace
}  // namespace radiosity::test
