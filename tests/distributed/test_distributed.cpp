// SPDX-License-Identifier: GPL-3.0-or-later
// Every rank runs every test: what they assert is true on each of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "cases/limits.hpp"
#include "cases/matrices.hpp"
#include "cases/scenes.hpp"
#include "radiosity/distributed/mpi_run.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "support/same_solution.hpp"

namespace radiosity::test {
namespace {

MpiRun* mpi_run = nullptr;

const std::shared_ptr<const Ranks>& ranks() {
  return mpi_run->ranks();
}

TEST(MpiRun, SumsGathersExchangesAndBroadcasts) {
  const auto r = static_cast<std::uint64_t>(ranks()->rank()),
             count = static_cast<std::uint64_t>(ranks()->count());
  std::uint64_t counted[] = {r + 1, 10};
  ranks()->sum(counted);
  EXPECT_EQ(counted[0], count * (count + 1) / 2);
  EXPECT_EQ(counted[1], 10 * count);

  for (const Index rows : {0, 1, 15, 17, 40, 100}) {  // few of them: some ranks own none
    BandArray x = BandArray::Constant(rows, 2, -1);
    Index owned = 0;
    for (Index i = 0; i < rows; ++i)
      if (ranks()->owns(i)) {
        x.row(i) << i, 0.5 * i;
        ++owned;
      }
    EXPECT_EQ(owned, ranks()->rows_of(ranks()->rank(), rows));
    ranks()->gather(x);
    for (Index i = 0; i < rows; ++i) {
      EXPECT_EQ(x(i, 0), i);
      EXPECT_EQ(x(i, 1), 0.5 * i);
    }
  }

  // Rank r sends rank s r + s bytes of value r.
  std::vector<std::vector<std::byte>> to(count);
  for (std::size_t s = 0; s < count; ++s) to[s].assign(r + s, static_cast<std::byte>(r));
  std::vector<std::vector<std::byte>> received, expected(count);
  ranks()->exchange(std::vector<std::span<const std::byte>>(to.begin(), to.end()), received);
  for (std::size_t s = 0; s < count; ++s)
    if (s != r) expected[s].assign(r + s, static_cast<std::byte>(s));
  EXPECT_EQ(received, expected);

  EXPECT_EQ(mpi_run->broadcast(r == 0 ? "of rank 0" : ""), "of rank 0");
  EXPECT_EQ(mpi_run->broadcast(""), "");
}

TEST(Distributed, SolvesAndGathersToTheBitsOfOneProcess) {
  const SceneSettings settings = patches_and_elements(0.1, 128);
  SolveOptions options;
  options.ranks = ranks();
  const SolvedScene alone = solve_scene(closed_cornell_box(), settings);
  const SolvedScene shared = solve_scene(closed_cornell_box(), settings, options);
  expect_same_solution(shared, alone);
  const auto average = static_cast<double>(shared.form_factors.bytes) / ranks()->count();
  EXPECT_NEAR(static_cast<double>(shared.form_factors.own_bytes), average, 0.35 * average);
}

// F on every rank, applied by rows: as if each had only its own.
SolveResult solve_by_petsc(const RadiositySystem& given, const SolverOptions& options) {
  const DistributedFormFactors f(*given.rows(), ranks());
  const RadiositySystem system(f, given.areas(), given.reflectance(), given.emission(), given.absorptance());
  return mpi_run->make_petsc_solver("")->solve(system, options);
}

FormFactorMatrix form_factors(const PatchMesh& mesh) {
  const Visibility visibility(mesh);
  const auto method = find_form_factor_method("hemisphere").make(visibility, {.samples = 256});
  return assemble(*method, visibility).matrix;
}

// A band for each 1 − ρ: light that is lit at one end.
TEST(PetscSolver, TakesTheProductsOfOurOwnWhateverIsAbsorbed) {
  const PatchMesh mesh = two_rooms(3);  // joined by a door
  const FormFactorMatrix f = form_factors(mesh);
  for (const double absorptance : {0.5, 0.1, 1e-3, 1e-6, 1e-9}) {
    const BandArray alpha = BandArray::Constant(f.size(), 1, absorptance);
    BandArray emission = BandArray::Zero(f.size(), 1);
    for (Index i = 0; i < f.size(); ++i)
      if (mesh.centroid(i).x() < 0.25) emission(i, 0) = 1;
    const RadiositySystem system(f, mesh.cluster_areas(), 1 - alpha, emission, alpha);
    const SolveResult own = find_solver("conjugate-gradient").make()->solve(system);
    const SolveResult petsc = solve_by_petsc(system, {});
    EXPECT_EQ(petsc.report.status, SolveStatus::converged);
    EXPECT_LE(petsc.report.residual, 1e-6);
    EXPECT_NEAR(petsc.report.iterations, own.report.iterations, 2) << "1 − ρ = " << absorptance;
    // One band and one room: the same iterates but for rounding, which the constant mode enlarges by 1/(1 − ρ).
    const double rounding = 1e-12 + 1e-15 / absorptance;
    EXPECT_LE(((petsc.radiosity - own.radiosity) / own.radiosity).abs().maxCoeff(), rounding)
        << "1 − ρ = " << absorptance;
    EXPECT_NEAR(petsc.report.condition(0, 0), own.report.condition(0, 0), 1e-3 * own.report.condition(0, 0));
  }
}

TEST(PetscSolver, SolvesBandsAndRoomsThatExchangeNothingTogether) {
  // Two closed cubes, three bands, ρ from ½ to 1 − 10⁻⁶, black patches among them.
  const PatchMesh cube = cube_room(3);
  const FormFactorMatrix one = form_factors(cube);
  const Index n = one.size();
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      both(i, j) = both(n + i, n + j) = one(i, j) + (i == j ? one.diagonal()[i] : 0);
  const FormFactorMatrix f = dense_matrix(both);
  BandArray alpha(2 * n, 3), emission(2 * n, 3);
  for (Index i = 0; i < 2 * n; ++i) {
    alpha.row(i) << 0.5, i < n ? 1e-6 : 0.3, i % 5 == 0 ? 1 : 0.2;
    emission.row(i) << (i % 7 == 0 ? 1 : 0), i % 3, i < n ? 1 : 0;
  }
  const RadiositySystem system(f, Eigen::ArrayXd::Ones(2 * n), 1 - alpha, emission, alpha);
  SolverOptions options;
  options.tolerance = 1e-9;
  const SolveResult own = find_solver("conjugate-gradient").make()->solve(system, options);
  Index steps = 0;
  options.step = [&](Index iteration, double, const BandArray& b) {
    EXPECT_EQ(iteration, steps++);
    EXPECT_EQ(b.rows(), 2 * n);
    return true;
  };
  const SolveResult petsc = solve_by_petsc(system, options);
  EXPECT_EQ(petsc.report.status, SolveStatus::converged);
  EXPECT_NEAR(petsc.report.iterations, own.report.iterations, 2);
  EXPECT_EQ(steps, petsc.report.iterations + 1);
  EXPECT_LE((petsc.radiosity - own.radiosity).abs().maxCoeff(), 1e-8 * own.radiosity.maxCoeff());
}

TEST(PetscSolver, TakesOptionsAndNamesWhatItRefuses) {
  const FormFactorMatrix f = form_factors(cube_room(2));
  const BandArray half = BandArray::Constant(f.size(), 1, 0.5);
  const DistributedFormFactors shared(f, ranks());
  const RadiositySystem system(shared, Eigen::ArrayXd::Ones(f.size()), half, half, half);
  // R1: B = E / (1 − ρ) = 1.
  const SolveResult by_gmres = mpi_run->make_petsc_solver("-ksp_type gmres")->solve(system);
  EXPECT_LE((by_gmres.radiosity - 1).abs().maxCoeff(), 1e-6);
  EXPECT_THROW(mpi_run->make_petsc_solver("-ksp_type nonesuch")->solve(system), InputError);
  const SolveResult by_cg = mpi_run->make_petsc_solver("-ksp_type cg")->solve(system);  // and from now on
  EXPECT_LE((by_cg.radiosity - 1).abs().maxCoeff(), 1e-6);
  EXPECT_THROW(
      mpi_run->make_petsc_solver("")->solve(RadiositySystem(f, Eigen::ArrayXd::Ones(f.size()), half, half)),
      InputError);
}

TEST(PetscSolver, HoldsTheLimitsOfOurOwn) {
  solve_limits_by(solve_by_petsc);
  int held = 0;
  for (const Limit& limit : limits()) {
    if (limit.tried.find("conjugate-gradient") == std::string::npos) continue;
    const Limit::Outcome outcome = limit.run();
    EXPECT_LE(outcome.error, outcome.allowed) << limit.name << ": " << outcome.came_out;
    ++held;
  }
  EXPECT_GT(held, 4);
  solve_limits_by({});
}

}  // namespace

int run(int argc, char** argv) {
  MpiRun of_all;
  mpi_run = &of_all;
  testing::InitGoogleMock(&argc, argv);
  // Rank 0 tells all, the others what failed on them.
  auto& listeners = testing::UnitTest::GetInstance()->listeners();
  if (ranks()->rank() > 0) delete listeners.Release(listeners.default_result_printer());
  const int failed = RUN_ALL_TESTS();
  std::uint64_t all[] = {failed != 0 ? 1U : 0U};
  ranks()->sum(all);
  if (failed != 0 && ranks()->rank() > 0) std::fprintf(stderr, "rank %d: a test failed\n", ranks()->rank());
  return all[0] > 0 ? 1 : 0;
}

}  // namespace radiosity::test

int main(int argc, char** argv) {
  return radiosity::test::run(argc, argv);
}
