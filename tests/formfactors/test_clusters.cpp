// SPDX-License-Identifier: GPL-3.0-or-later
// What every method owes its callers where patches are joined to clusters.
#include <gtest/gtest.h>

#include <cmath>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/aggregate.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

/// A room of 24 patches by themselves and 10 two-sided triangles of which each five, and each five backs, are a cluster.
PatchMesh room_with_clusters() {
  const PatchMesh mesh = room_with_triangle_soup(2, 10, 5);
  std::vector<Index> cluster;
  for (Index i = 0; i < mesh.patch_count(); ++i) cluster.push_back(i < 24 ? i : 24 + i / 5);
  return mesh.with_clusters(cluster);
}

/// A cube whose floor (surface 4) and first wall (0) are one cluster, the others patches by themselves.
PatchMesh cube_with_corner(Index n) {
  const PatchMesh mesh = cube_room(n);
  std::vector<Index> cluster;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    cluster.push_back(mesh.surface(i) == 0 || mesh.surface(i) == 4 ? 0 : 1 + i);
  return mesh.with_clusters(cluster);
}

class Clusters : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  const FormFactorMethodInfo& info() const { return *GetParam(); }
  /// Hemicubes over many viewpoints: few are few of a cluster's members.
  FormFactorOptions fine(std::uint64_t seed = 1) const {
    FormFactorOptions options;
    options.samples = info().defaults.has_resolution() ? 64 : std::max<Index>(info().defaults.samples, 144);
    options.seed = seed;
    return options;
  }
  AssembledFormFactors assembled(const PatchMesh& mesh, Index times = 1) const {
    const Visibility visibility(mesh);
    FormFactorOptions options = fine();
    options.samples *= times;
    return assemble(*info().make(visibility, options), visibility);
  }
};

INSTANTIATE_TEST_SUITE_P(All, Clusters, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(Clusters, HaveTheFactorsOfTheirMembersTogether) {
  // By exact pairs of the members, put together by their areas.
  const PatchMesh mesh = room_with_clusters();
  const PatchMesh apart = mesh.with_clusters({});
  const Visibility visibility(apart);
  const FormFactorMatrix pairs =
      assemble(*find_form_factor_method("analytic").make(visibility, {.samples = 576}), visibility).matrix;
  Coarsening of_members;
  of_members.count = mesh.cluster_count();
  for (Index i = 0; i < mesh.patch_count(); ++i) of_members.parent.push_back(mesh.cluster(i));
  const Eigen::MatrixXd exact = as_dense(aggregate(pairs, mesh.areas(), of_members));
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(exact.rows(), exact.cols());
  const MethodSetup setup(mesh, info(), fine());
  const int runs = setup.method->reciprocal() ? 1 : 8;
  for (int run = 0; run < runs; ++run)
    mean += raw_rows(*info().make(setup.visibility, fine(static_cast<std::uint64_t>(run + 1))),
                     mesh.cluster_count())
                .f /
            runs;
  EXPECT_GT(exact.diagonal().tail(4).maxCoeff(), 1e-3);  // they see themselves
  for (Index i = 0; i < exact.rows(); ++i) {
    // 8 · 1024 directions at F = 1/4: five standard errors are 0.024; pairs are sampled more finely.
    EXPECT_LT((mean.row(i) - exact.row(i)).cwiseAbs().maxCoeff(), setup.method->reciprocal() ? 2e-3 : 0.025)
        << "row " << i;
    EXPECT_LT((mean.row(i) - exact.row(i)).cwiseAbs().sum(), setup.method->reciprocal() ? 0.02 : 0.15)
        << "row " << i;
  }
}

TEST_P(Clusters, SeeThemselvesAsMuchAsTheirMembersSeeEachOther) {
  // Squares at a right angle: F = 0.2000437761 each way [Howell, C-14], and so it is of both together.
  const Eigen::MatrixXd f =
      as_dense(assembled(cube_with_corner(6), info().defaults.has_resolution() ? 1 : 16).matrix);
  // 16 · 1024 directions, or 64 viewpoints: three standard errors.
  EXPECT_NEAR(f(0, 0), 0.2000437761, info().name == "analytic" ? 1e-6 : 0.01);
}

TEST_P(Clusters, AreClosedAndReciprocal) {
  for (const PatchMesh& mesh : {room_with_clusters(), cube_with_corner(3)}) {
    const auto [matrix, report] = assembled(mesh);
    const Eigen::MatrixXd f = as_dense(matrix);
    ASSERT_EQ(f.rows(), mesh.cluster_count());
    EXPECT_GE(f.minCoeff(), 0);
    const Eigen::ArrayXd missing = 1 - f.rowwise().sum().array() - matrix.escaped();
    EXPECT_LT(missing.abs().maxCoeff(), 1e-6);
    const Eigen::MatrixXd s = mesh.cluster_areas().matrix().asDiagonal() * f;
    EXPECT_LT((s - s.transpose()).cwiseAbs().maxCoeff(), 1e-6);
    // Single cells of a hemicube may show a back or a seam.
    EXPECT_LT(report.escaped_mean, info().defaults.has_resolution() ? 1e-3 : 1e-9);
  }
}

TEST_P(Clusters, OfAFurnaceAreAllAlikeWithEverySolver) {
  // Closed, E = 1, ρ = ½: B = E / (1 − ρ) = 2.
  const PatchMesh mesh = room_with_clusters();
  const FormFactorMatrix f = assembled(mesh).matrix;
  const RadiositySystem system(f, mesh);
  for (const SolverInfo& solver : solvers()) {
    SolverOptions options;
    options.tolerance = 1e-7;
    const Solution solution = solve(*solver.make(), system, mesh, options);
    ASSERT_EQ(solution.radiosity.rows(), mesh.patch_count());
    EXPECT_LT((solution.radiosity - 2).abs().maxCoeff(), 1e-4) << solver.name;
    EXPECT_NEAR(solution.energy.imbalance[0], 0, 1e-5) << solver.name;
  }
}

TEST_P(Clusters, ComeOutTheSameWithAnyNumberOfThreads) {
  const PatchMesh mesh = room_with_clusters();
  const Visibility visibility(mesh);
  const auto rows = [&](int threads) {
    const ThreadLimit limit(threads);
    return as_dense(assemble(*info().make(visibility), visibility).matrix);
  };
  EXPECT_EQ(rows(1), rows(4));
}

TEST(ClusterRows, OnDemandKeepTheEnergyOfASolveThatShoots) {
  const PatchMesh mesh = room_with_clusters();
  const Visibility visibility(mesh);
  const auto method = find_form_factor_method("hemisphere").make(visibility);
  const RowsOnDemand rows(*method, visibility, 1 << 20);
  const RadiositySystem system(rows, mesh);
  SolverOptions options;
  options.tolerance = 1e-3;
  const Solution solution = solve(*find_solver("progressive").make(), system, mesh, options);
  EXPECT_EQ(rows.size(), mesh.cluster_count());
  EXPECT_NEAR(solution.energy.imbalance[0], 0, 0.05);
  EXPECT_NEAR(solution.radiosity.mean(), 2, 0.1);
}

TEST(ClustersApart, HoldWhatSeesNothingByItself) {
  // A box of 3 × 3 patches a face stands on the floor of a room: its bottom and what it covers see nothing.
  const PatchMesh plain = MeshBuilder()
                              .box({0, 0, 0}, {1, 1, 1}, 3, Facing::inward)
                              .box({1.0 / 3, 1.0 / 3, 0}, {2.0 / 3, 2.0 / 3, 0.4}, 1, Facing::outward)
                              .build();
  const PatchMesh mesh =
      plain.with_clusters(std::vector<Index>(static_cast<std::size_t>(plain.patch_count()), 0));
  const Visibility visibility(mesh);
  const PatchMesh apart = mesh.with_clusters(clusters_apart(visibility));
  EXPECT_EQ(apart.cluster_count(), 2);
  for (Index i = 0; i < apart.patch_count(); ++i)
    for (const Index j : apart.members(apart.cluster(i)))
      EXPECT_EQ(visibility.covered(i), visibility.covered(j));
}

}  // namespace
}  // namespace radiosity::test
