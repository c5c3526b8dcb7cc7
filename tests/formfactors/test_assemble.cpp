// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/assemble.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <thread>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "support/brute_force.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

struct Assembled {
  AssemblyReport report;
  FormFactorMatrix matrix;
  Eigen::MatrixXd f;  ///< with the diagonal remainder
};

Assembled assembled(const MethodSetup& setup, const AssemblyOptions& options = {}) {
  AssembledFormFactors assembled = assemble(*setup.method, setup.visibility, options);
  Eigen::MatrixXd f = as_dense(assembled.matrix);
  return {std::move(assembled.report), std::move(assembled.matrix), std::move(f)};
}

AssemblyOptions unclosed() {
  AssemblyOptions options;
  options.close = false;
  return options;
}

double largest_closure_error(const Assembled& a) {
  double largest = 0;
  for (Index i = 0; i < a.matrix.size(); ++i)
    largest = std::max(largest, std::abs(a.f.row(i).sum() - (1 - a.matrix.escaped()[i])));
  return largest;
}

class Assembly : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  const FormFactorMethodInfo& info() const { return *GetParam(); }
};

INSTANTIATE_TEST_SUITE_P(All, Assembly, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(Assembly, GoesOnWithRowsOfAnEarlierRunToTheSameBits) {
  const MethodSetup setup(room_with_floating_box(14, 3), info(),
                          {.samples = info().name == "hemisphere" ? 64 : 1});
  std::vector<PartialRows> states;
  AssemblyOptions saving;
  saving.save = [&](Index done, const std::function<PartialRows()>& state) {
    states.push_back(state());
    EXPECT_EQ(states.back().done, done);
  };
  const AssembledFormFactors whole = assemble(*setup.method, setup.visibility);
  const auto same = [&](const AssembledFormFactors& other) {
    EXPECT_EQ(other.matrix.arrays().start, whole.matrix.arrays().start);
    EXPECT_EQ(other.matrix.arrays().columns, whole.matrix.arrays().columns);
    EXPECT_EQ(other.matrix.arrays().values, whole.matrix.arrays().values);
    EXPECT_EQ(other.matrix.arrays().diagonal, whole.matrix.arrays().diagonal);
    EXPECT_EQ(other.matrix.arrays().escaped, whole.matrix.arrays().escaped);
    EXPECT_EQ(other.report.rays, whole.report.rays);
    EXPECT_EQ(other.report.pairs.free, whole.report.pairs.free);
    EXPECT_EQ(other.report.pairs.partial, whole.report.pairs.partial);
  };
  const MethodSetup again(room_with_floating_box(14, 3), info(),
                          {.samples = info().name == "hemisphere" ? 64 : 1});
  same(assemble(*again.method, again.visibility, saving));
  ASSERT_EQ(states.size(), 2U);  // after 1,024 rows, and after all 1,230
  for (PartialRows& state : states) {
    const MethodSetup resumed(room_with_floating_box(14, 3), info(),
                              {.samples = info().name == "hemisphere" ? 64 : 1});
    AssemblyOptions options;
    options.partial = std::make_shared<const PartialRows>(state);
    same(assemble(*resumed.method, resumed.visibility, options));
  }
  AssemblyOptions wrong;
  states[0].start.pop_back();
  wrong.partial = std::make_shared<const PartialRows>(states[0]);
  EXPECT_THROW(assemble(*setup.method, setup.visibility, wrong), InputError);
}

TEST_P(Assembly, ClosesClosedScenesWithoutBreakingReciprocity) {
  const MeshBuilder ball = MeshBuilder().sphere(Vec3::Zero(), 1, 1, Facing::inward);
  for (const PatchMesh& mesh :
       {cube_room(4), tetrahedron(), room_with_floating_box(3, 2), two_rooms(1), ball.build(),
        concentric_spheres(0, 1, grey("inner", 0.5, 1), grey("outer", 0.5, 0)),
        room_with_triangle_soup(2, 4, 5)}) {
    const MethodSetup setup(mesh, info());
    const Assembled a = assembled(setup);
    EXPECT_TRUE(a.report.completed);
    EXPECT_TRUE(a.report.closed_scene);
    EXPECT_EQ(a.report.isolated_patches, 0);
    EXPECT_LT((a.f.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-6);
    EXPECT_LT(reciprocity_error(a.f, mesh.areas()), 1e-6);
    EXPECT_GE(a.f.minCoeff(), -1e-6);
    // The diagonal takes what scaling leaves, and that is little.
    for (Index i = 0; i < setup.size(); ++i) {
      EXPECT_LT(std::abs(a.matrix.row(i).diagonal), 1e-3) << "row " << i;
      EXPECT_EQ(a.matrix(i, i), 0) << "row " << i;
    }
    EXPECT_NEAR(a.report.escaped_mean, 0, 1e-6);
  }
}

TEST_P(Assembly, ReportsTheErrorsThatTheMatrixShows) {
  const MethodSetup setup(room_with_floating_box(3, 1), info());
  const Assembled raw = assembled(setup, unclosed()), closed = assembled(setup);
  EXPECT_FALSE(raw.report.closed_rows);
  EXPECT_TRUE(closed.report.closed_rows);
  EXPECT_NEAR(raw.report.before.reciprocity_error_max, reciprocity_error(raw.f, setup.mesh.areas()), 1e-5);
  EXPECT_EQ(raw.report.after.reciprocity_error_max, raw.report.before.reciprocity_error_max);
  EXPECT_EQ(raw.report.after.closure_error_max, raw.report.before.closure_error_max);
  EXPECT_NEAR(closed.report.before.reciprocity_error_max, raw.report.before.reciprocity_error_max, 1e-5);
  EXPECT_NEAR(closed.report.before.closure_error_max, (raw.f.rowwise().sum().array() - 1).abs().maxCoeff(),
              1e-5);
  EXPECT_LE(closed.report.after.reciprocity_error_max, 1e-6);
  EXPECT_LE(closed.report.after.closure_error_max, 1e-6);
  EXPECT_LE(largest_closure_error(closed), 1e-6);
  EXPECT_LE(closed.report.before.closure_error_mean, closed.report.before.closure_error_max);
  // Raw rows of these scenes break one of the two.
  EXPECT_GT(std::max(closed.report.before.reciprocity_error_max, closed.report.before.closure_error_max),
            1e-6);
}

TEST_P(Assembly, GathersSmoothFieldsMoreAccuratelyOnceRowsAreClosed) {
  // What closing is for: Σ_j F_ij B_j for B = 1 + x, 1 + y and 1 + z, against brute force, as a mean over seeds.
  constexpr double kBruteForce = 3e-4;
  const PatchMesh mesh = room_with_floating_box(2, 1);
  const std::array<Index, 3> from{0, 9, 26};
  Eigen::MatrixXd field(mesh.patch_count(), 3), exact(3, mesh.patch_count());
  for (Index j = 0; j < mesh.patch_count(); ++j) {
    field.row(j) = (mesh.centroid(j).array() + 1).matrix().transpose();
    for (Index a = 0; a < 3; ++a) exact(a, j) = brute_force_form_factor(mesh, from[a], j, kBruteForce);
  }
  double raw_error = 0, closed_error = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    FormFactorOptions options;
    options.seed = seed;
    const MethodSetup setup(mesh, info(), options);
    const Eigen::MatrixXd raw = setup.raw().f, closed = assembled(setup).f;
    for (Index a = 0; a < 3; ++a) {
      const Index i = from[a];
      raw_error += ((raw.row(i) - exact.row(a)) * field).squaredNorm();
      closed_error += ((closed.row(i) - exact.row(a)) * field).squaredNorm();
    }
  }
  EXPECT_LT(closed_error, std::max(raw_error, 36 * kBruteForce * kBruteForce));
  EXPECT_LT(std::sqrt(closed_error / 36), 0.05);
}

TEST_P(Assembly, ComputesTheFactorsOfAFewLampsPairByPair) {
  // One lamp in a convex room: what it exchanges with all others is exact, however coarse the method.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder()
                             .use_material(grey("wall", 0.5, 0))
                             .box({0, 0, 0}, {1, 1, 1}, 3, Facing::inward)
                             .use_material(grey("lamp", 0, 10))
                             .grid({0.4, 0.4, 1}, 0.1 * y, 0.1 * x, 1, 1)
                             .build();
  const Index lamp = mesh.patch_count() - 1;
  const MethodSetup setup(mesh, info(), setting_of(info(), 16));
  if (setup.method->reciprocal()) GTEST_SKIP() << "looks at pairs anyway";
  const Assembled a = assembled(setup, unclosed());
  EXPECT_EQ(a.report.lamps, 1);
  const Eigen::MatrixXd exact = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f;
  for (Index i = 0; i < lamp; ++i) {
    EXPECT_NEAR(a.f(i, lamp), exact(i, lamp), 1e-6 * exact(i, lamp)) << "from " << i;
    EXPECT_NEAR(a.f(lamp, i), exact(lamp, i), 1e-6 * exact(lamp, i)) << "to " << i;
  }
}

TEST_P(Assembly, LeavesZerosBetweenPatchesInOnePlane) {
  const MethodSetup setup(room_with_floating_box(2, 1), info());
  const Assembled a = assembled(setup);
  for (Index i = 0; i < setup.size(); ++i)
    for (Index j = 0; j < setup.size(); ++j)
      if (setup.mesh.surface(i) == setup.mesh.surface(j)) {
        EXPECT_EQ(a.matrix(i, j), 0) << "from " << i << " to " << j;
      }
}

TEST_P(Assembly, KeepsWhatEscapesFromOpenScenes) {
  const MethodSetup setup(opposed_squares_with_screen(3, 0.5), info());
  const Assembled a = assembled(setup);
  EXPECT_FALSE(a.report.closed_scene);
  EXPECT_LE(largest_closure_error(a), 1e-6);
  EXPECT_LT(reciprocity_error(a.f, setup.mesh.areas()), 1e-6);
  double mean = 0;
  for (Index i = 0; i < setup.size(); ++i)
    mean += setup.mesh.area(i) * a.matrix.escaped()[i] / setup.mesh.areas().sum();
  EXPECT_NEAR(a.report.escaped_mean, mean, 1e-6);
  // The middle of the lower square: 1 − Σ_j F_ij by brute force, to five standard errors of 1024 rays.
  double exact = 0;
  for (Index j = 0; j < setup.size(); ++j) exact += brute_force_form_factor(setup.mesh, 4, j, 1e-5);
  EXPECT_NEAR(1 - a.matrix.escaped()[4], exact, 5 * std::sqrt(0.25 / 1024));
}

TEST_P(Assembly, LeavesExactFactorsAlone) {
  const MethodSetup setup(cube_room(3), info());
  if (!setup.method->exact()) GTEST_SKIP() << "not exact in any scene";
  const Assembled a = assembled(setup);
  EXPECT_TRUE(setup.visibility.convex());
  EXPECT_EQ(a.report.rays, 0u);
  EXPECT_FALSE(a.report.closed_rows);
  EXPECT_TRUE(a.report.closed_scene);
  EXPECT_EQ(a.report.before.closure_error_max, a.report.after.closure_error_max);
  const Eigen::MatrixXd raw = setup.raw().f;
  EXPECT_LT((a.f - raw).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_P(Assembly, StoresRawRowsWhereClosingIsOff) {
  const MethodSetup setup(two_rooms(1), info());
  const Assembled a = assembled(setup, unclosed());
  const Eigen::MatrixXd raw = setup.raw().f;
  for (Index i = 0; i < setup.size(); ++i)
    for (Index j = 0; j < setup.size(); ++j)
      EXPECT_NEAR(a.matrix(i, j), raw(i, j), 1e-6 * raw(i, j) + 1e-12) << "from " << i << " to " << j;
}

TEST_P(Assembly, GivesTheSameBitsWithAnyNumberOfThreads) {
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    const MethodSetup setup(two_rooms(2), info(), setting_of(info(), 16));
    return assembled(setup);
  };
  const Assembled one = with(1), four = with(4);
  EXPECT_EQ(one.f, four.f);
  EXPECT_EQ(one.report.before.closure_error_mean, four.report.before.closure_error_mean);
  EXPECT_EQ(one.report.after.reciprocity_error_max, four.report.after.reciprocity_error_max);
  EXPECT_EQ(one.report.rays, four.report.rays);
}

TEST_P(Assembly, TellsTheFractionDone) {
  const MethodSetup setup(cube_room(10), info(), setting_of(info(), 16));
  std::vector<double> fractions;
  AssemblyOptions options;
  options.progress = [&](double fraction) {
    fractions.push_back(fraction);
    return true;
  };
  EXPECT_TRUE(assembled(setup, options).report.completed);
  ASSERT_FALSE(fractions.empty());
  EXPECT_GE(fractions.front(), 0);
  EXPECT_LE(fractions.back(), 1);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
}

TEST_P(Assembly, ReportsProgressOnTheCallingThreadWhichMayUseTheToolkit) {
  const MethodSetup setup(cube_room(6), info(), setting_of(info(), 16));
  const Assembled before = assembled(setup);
  BandArray b = BandArray::Ones(setup.size(), 1), gathered = BandArray::Zero(setup.size(), 1);
  std::set<std::thread::id> threads;
  AssemblyOptions options;
  options.progress = [&](double) {
    threads.insert(std::this_thread::get_id());
    before.matrix.apply(b, gathered);
    return true;
  };
  const ThreadLimit several(8);
  EXPECT_TRUE(assembled(setup, options).report.completed);
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

TEST_P(Assembly, StopsWhenAskedTo) {
  const MethodSetup setup(cube_room(10), info(), setting_of(info(), 16));
  int calls = 0;
  AssemblyOptions options;
  options.progress = [&](double) {
    ++calls;
    return false;
  };
  const Assembled a = assembled(setup, options);
  EXPECT_FALSE(a.report.completed);
  EXPECT_EQ(a.matrix.size(), setup.size());
  EXPECT_GE(calls, 1);
  int empty = 0;
  for (Index i = 0; i < setup.size(); ++i) empty += a.f.row(i).cwiseAbs().sum() == 0;
  EXPECT_GT(empty, 0);
}

// 600 patches of a room, and a lamp of 25.
constexpr Index kLamps = 25;
PatchMesh lit_room() {
  return MeshBuilder()
      .use_material(grey("wall", 0.5, 0))
      .box({0, 0, 0}, {1, 1, 1}, 10, Facing::inward)
      .use_material(grey("lamp", 0, 1))
      .grid({0.4, 0.4, 0.9}, 0.2 * Vec3::UnitY(), 0.2 * Vec3::UnitX(), 5, 5)
      .build();
}

TEST_P(Assembly, StopsWhilePairsAreComputed) {
  const MethodSetup setup(lit_room(), info(), setting_of(info(), 16));
  if (setup.method->reciprocal()) GTEST_SKIP() << "looks at pairs anyway";
  int told = 0;  // that all rows are there: by the last of them and at their end, and then with the pairs
  AssemblyOptions options;
  options.progress = [&](double fraction) { return fraction < 1 || ++told < 3; };
  const AssemblyReport report = assembled(setup, options).report;
  EXPECT_FALSE(report.completed);
  EXPECT_EQ(report.pairwise, 0);
}

TEST_P(Assembly, CountsPairsInTheMemoryThatItMayTake) {
  // Of n rows with at most k = 16 entries (directions), 24 n k bytes; the rows and columns of m lamps may add 2 m entries to each.
  const MethodSetup setup(lit_room(), info(), setting_of(info(), 16));
  const Index n = setup.size(), k = setup.method->max_entries_per_row();
  if (k > 16) GTEST_SKIP() << "stores all pairs anyway";
  AssemblyOptions options;
  options.memory_limit_bytes = static_cast<std::size_t>(2 * assembly_bytes(n, k));
  EXPECT_THROW(assembled(setup, options), MemoryLimitError);
  options.memory_limit_bytes = static_cast<std::size_t>(assembly_bytes(n, k + 2 * kLamps));
  EXPECT_EQ(assembled(setup, options).report.lamps, kLamps);
}

TEST_P(Assembly, RefusesToExceedTheMemoryLimitAndSaysWhatWouldFit) {
  const MethodSetup setup(cube_room(6), info(), setting_of(info(), 16));
  AssemblyOptions options;
  options.memory_limit_bytes = 2000;
  try {
    assembled(setup, options);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("216"));
    EXPECT_THAT(error.what(), testing::HasSubstr("patches"));
  }
  options.memory_limit_bytes = 100'000'000;
  EXPECT_TRUE(assembled(setup, options).report.completed);
}

TEST_P(Assembly, GivesRowsOnDemandThatAreTheStoredOnesUnclosed) {
  for (const PatchMesh& mesh : {two_rooms(1), opposed_squares_with_screen(2, 0.5)}) {
    const MethodSetup setup(mesh, info());
    const Assembled stored = assembled(setup, unclosed());
    const RowsOnDemand on_demand(*setup.method, setup.visibility, 0);
    EXPECT_EQ(on_demand.size(), setup.size());
    EXPECT_FALSE(on_demand.stored());
    const Eigen::MatrixXd f = as_dense(on_demand);
    for (Index i = 0; i < setup.size(); ++i) {
      EXPECT_NEAR(f.row(i).sum(), 1 - on_demand.escaped()[i], 1e-6) << "row " << i;
      EXPECT_NEAR(on_demand.escaped()[i], stored.matrix.escaped()[i], 1e-6) << "row " << i;
      EXPECT_LT((f.row(i) - stored.f.row(i)).cwiseAbs().maxCoeff(), 1e-6) << "row " << i;
    }
  }
}

TEST_P(Assembly, ClosesARoomWithABoxOnTheFloor) {
  // The box's bottom and the floor beneath it see nothing; everything else sees a closed room.
  const Patches patches = make_patches(box_on_floor(), PatchSize{0.26});
  const PatchMesh& mesh = patches.mesh;
  const MethodSetup setup(mesh, info());
  const Assembled a = assembled(setup);
  Index blind = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const Vec3& c = mesh.centroid(i);
    const bool covered = c.z() < 1e-9 && std::abs(c.x() - 0.5) < 1.0 / 6 && std::abs(c.y() - 0.5) < 1.0 / 6;
    blind += covered;
    EXPECT_NEAR(a.f.row(i).sum(), covered ? 0 : 1, 1e-6) << "patch at " << c.transpose();
  }
  EXPECT_GT(blind, 0);
  EXPECT_EQ(a.report.isolated_patches, blind);
  EXPECT_LT(reciprocity_error(a.f, mesh.areas()), 1e-6);
}

TEST_P(Assembly, ReportsPatchesThatSeeNothing) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const MethodSetup setup(MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, -1}, y, x, 2, 1).build(),
                          info());
  const Assembled a = assembled(setup);
  EXPECT_EQ(a.report.isolated_patches, 3);
  EXPECT_EQ(a.f.cwiseAbs().maxCoeff(), 0);
  EXPECT_DOUBLE_EQ(a.matrix.escaped()[0], 1);
}

/// Rows as given, that claim to be sampled.
class GivenRows final : public FormFactorMethod {
 public:
  explicit GivenRows(Eigen::MatrixXd f) : f_(std::move(f)) {}
  void rows(Index first, Index last, bool, const Sink& sink) const override {
    std::vector<Index> columns;
    std::vector<double> values;
    for (Index i = first; i < last; ++i) {
      columns.clear();
      values.clear();
      for (Index j = 0; j < f_.cols(); ++j) {
        if (f_(i, j) == 0) continue;
        columns.push_back(j);
        values.push_back(f_(i, j));
      }
      sink(i, columns, values, 0);
    }
  }
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  std::uint64_t rays() const override { return 0; }
  FormFactorOptions options() const override { return {}; }
  std::optional<double> direction_share() const override { return 1e-6; }
  Index max_entries_per_row() const override { return static_cast<Index>(f_.cols()); }

 private:
  Eigen::MatrixXd f_;
};

TEST(Restoring, DoesNotBendTheOtherRowsToFitOneThatContradictsThem) {
  // Patches 0 and 1 claim to see nothing but each other; the others say what is true. The mean of both claims takes half of what
  // they send to these two, s, from their rows, and to restore those takes factors of 1/(1 − s/2) from either end.
  const MethodSetup setup(cube_room(3), find_form_factor_method("analytic"));
  const Eigen::MatrixXd exact = setup.raw().f;
  Eigen::MatrixXd f = exact;
  f.topRows(2).setZero();
  f(0, 1) = f(1, 0) = 1;
  const auto [matrix, report] = assemble(GivenRows(f), setup.visibility);
  const Eigen::MatrixXd restored = as_dense(matrix);
  const Index others = setup.size() - 2;
  const double kept = 1 - exact.bottomLeftCorner(others, 2).rowwise().sum().maxCoeff() / 2;
  const Eigen::ArrayXXd before = exact.bottomRightCorner(others, others);
  const Eigen::ArrayXXd after = restored.bottomRightCorner(others, others);
  EXPECT_LT((before > 0).select(after / before.max(1e-300), 0.0).maxCoeff(), 1.05 / (kept * kept));
  EXPECT_GT((before > 0).select(after / before.max(1e-300), 1.0).minCoeff(), 1 / 1.5);
  EXPECT_LT((restored.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-6);
  EXPECT_GT(report.unrestored(), 0);
  EXPECT_LT(report.unrestored(), 3.0 / static_cast<double>(setup.size()));
}

TEST(Restoring, RefusesFactorsThatAreNoNumbers) {
  const MethodSetup setup(cube_room(1), find_form_factor_method("analytic"));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -0.1}) {
    Eigen::MatrixXd f = setup.raw().f;
    f(2, 4) = bad;
    try {
      assemble(GivenRows(f), setup.visibility);
      FAIL() << bad << " was taken for a form factor";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("from patch 2 to patch 4"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace radiosity::test
