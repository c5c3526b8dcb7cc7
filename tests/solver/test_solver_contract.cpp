// SPDX-License-Identifier: GPL-3.0-or-later
// What every solver of solvers() owes its callers. A new solver is covered by its row of the table.
#include "radiosity/solver/solver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <set>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

TEST(SolverTable, HasTheSolversThatTheInterfaceNames) {
  std::set<std::string_view> names;
  for (const SolverInfo& info : solvers()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name << " twice";
    EXPECT_FALSE(info.summary.empty()) << info.name;
    EXPECT_FALSE(info.citation.empty()) << info.name;
    EXPECT_EQ(find_solver(info.name).name, info.name);
  }
  for (const char* name : {"gauss-seidel", "jacobi", "progressive", "conjugate-gradient"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_FALSE(find_solver("progressive").gathers);
}

TEST(SolverTable, ListsTheNamesWhenAskedForAnUnknownOne) {
  try {
    find_solver("gauss");
    FAIL() << "no error";
  } catch (const InputError& error) {
    for (const SolverInfo& info : solvers()) EXPECT_THAT(error.what(), HasSubstr(std::string(info.name)));
  }
}

/// A system with its own F.
struct Problem {
  Problem(FormFactorMatrix f, Eigen::ArrayXd areas, BandArray reflectance, BandArray emission)
      : matrix(std::move(f)), system(matrix, std::move(areas), std::move(reflectance), std::move(emission)) {}
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  /// Each band by dense LU of I − ρF.
  BandArray exact() const {
    const Eigen::MatrixXd f = as_dense(matrix);
    BandArray b(system.size(), system.bands());
    for (Index k = 0; k < system.bands(); ++k) {
      const Eigen::MatrixXd rho = system.reflectance().col(k).matrix().asDiagonal();
      const Eigen::MatrixXd m = Eigen::MatrixXd::Identity(f.rows(), f.cols()) - rho * f;
      const Eigen::VectorXd e = system.emission().col(k).matrix();
      const Eigen::VectorXd x = m.partialPivLu().solve(e);
      b.col(k) = x.array();
    }
    return b;
  }

  /// max over bands of Σ A |E − B + ρFB| / Σ A E.
  double residual(const BandArray& b) const {
    const Eigen::ArrayXXd h = (as_dense(matrix) * b.matrix()).array();
    double largest = 0;
    for (Index k = 0; k < system.bands(); ++k) {
      const double power = (system.areas() * system.emission().col(k)).sum();
      const auto r = system.emission().col(k) - b.col(k) + system.reflectance().col(k) * h.col(k);
      if (power > 0) largest = std::max(largest, (system.areas() * r.abs()).sum() / power);
    }
    return largest;
  }

  /// Energy norm of what separates two fields, as a share of the emitted power, largest over bands.
  double distance(const BandArray& a, const BandArray& b) const {
    double largest = 0;
    for (Index k = 0; k < system.bands(); ++k) {
      const double power = (system.areas() * system.emission().col(k)).sum();
      largest = std::max(largest, (system.areas() * (a.col(k) - b.col(k)).abs()).sum() / power);
    }
    return largest;
  }

  FormFactorMatrix matrix;
  RadiositySystem system;
};

/// Three bands: ρ random up to 0.9 with every fifth patch black; ρ = 0.8 everywhere; ρ small. Lamps differ.
std::unique_ptr<Problem> random_problem(Index n, std::uint64_t seed, bool sparse = false) {
  const RandomEnclosure enclosure = random_enclosure(n, seed);
  std::mt19937_64 random(seed + 100);
  BandArray rho(n, 3), e = BandArray::Zero(n, 3);
  for (Index i = 0; i < n; ++i) {
    rho(i, 0) = i % 5 == 0 ? 0 : 0.9 * uniform(random);
    rho(i, 1) = 0.8;
    rho(i, 2) = 0.1 * uniform(random);
    if (i % 7 == 2) e(i, 0) = 5 * uniform(random);
    if (i == 3) e(i, 1) = 40;
    e(i, 2) = uniform(random);
  }
  return std::make_unique<Problem>(sparse ? sparse_matrix(enclosure.f) : dense_matrix(enclosure.f),
                                   enclosure.areas, rho, e);
}

/// One band; n patches of the random enclosure.
std::unique_ptr<Problem> uniform_problem(Index n, double reflectance, double emission) {
  const RandomEnclosure enclosure = random_enclosure(n, 17);
  return std::make_unique<Problem>(dense_matrix(enclosure.f), enclosure.areas,
                                   BandArray::Constant(n, 1, reflectance),
                                   BandArray::Constant(n, 1, emission));
}

BandArray column(std::initializer_list<double> values) {
  BandArray a(static_cast<Eigen::Index>(values.size()), 1);
  std::copy(values.begin(), values.end(), a.data());
  return a;
}

class AnySolver : public testing::TestWithParam<const SolverInfo*> {
 protected:
  SolveResult solve(const Problem& problem, const SolverOptions& options = {}) const {
    return solver_->solve(problem.system, options);
  }
  SolveResult solve_to(const Problem& problem, double tolerance) const {
    SolverOptions options;
    options.tolerance = tolerance;
    return solve(problem, options);
  }
  std::string refusal(const Problem& problem, const SolverOptions& options = {}) const {
    try {
      solve(problem, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no InputError";
  }

  const std::unique_ptr<Solver> solver_ = GetParam()->make();
};

INSTANTIATE_TEST_SUITE_P(All, AnySolver, testing::ValuesIn(pointers(solvers())), test_name<SolverInfo>);

TEST_P(AnySolver, AgreesWithDenseLuInAllBands) {
  // F is reciprocal and closed, so ‖F‖ = 1 in the norm Σ A|·| and the error is at most the residual divided
  // by 1 − ρ_max = 0.1. Rows are stored to 6e-8, which a shooter, reading F_ij A_i/A_j for F_ji, sees twice.
  for (const bool sparse : {false, true}) {
    const auto problem = random_problem(70, 3, sparse);
    const SolveResult result = solve(*problem);
    EXPECT_EQ(result.report.status, SolveStatus::converged) << result.report.message;
    EXPECT_LE(problem->distance(result.radiosity, problem->exact()), (1e-6 + 2 * 6e-8 / 0.1) / 0.1);
  }
}

TEST_P(AnySolver, TakesLightFromOutside) {
  // B = E + ρ (H₀ + F B) is B of the emission E + ρ H₀; and what comes in is absorbed or escapes.
  const auto problem = random_problem(60, 5);
  const BandArray outside = problem->system.emission().colwise().reverse() + 0.5;
  const RadiositySystem system = problem->system.with_external_irradiance(outside);
  const SolverOptions options{.tolerance = 1e-9, .max_iterations = 1'000'000};
  const BandArray b = solver_->solve(system, options).radiosity;
  const RadiositySystem emitting(problem->matrix, system.areas(), system.reflectance(),
                                 system.emission() + system.reflectance() * outside);
  EXPECT_TRUE(b.isApprox(solver_->solve(emitting, options).radiosity, 1e-12));
  const EnergyBalance energy = energy_balance(system, b, system.irradiance(b));
  for (Index k = 0; k < system.bands(); ++k) {
    EXPECT_DOUBLE_EQ(energy.external_w[k], (system.areas() * outside.col(k)).sum());
    EXPECT_NEAR(energy.imbalance[k], 0, 1e-6);
  }
}

TEST_P(AnySolver, ReportsTheTrueResidual) {
  const auto problem = random_problem(50, 8);
  for (const double tolerance : {1e-2, 1e-5}) {
    const SolveResult result = solve_to(*problem, tolerance);
    const double residual = problem->residual(result.radiosity);
    EXPECT_NEAR(result.report.residual, residual, 1e-3 * residual + 1e-12);
    // The estimates that stop the solve may miss what storage in single precision costs: 6e-8 of Σ A B.
    EXPECT_LE(residual, tolerance + 6e-8 / 0.1);
  }
}

TEST_P(AnySolver, KeepsAHistoryThatEndsBelowTheTolerance) {
  const auto problem = random_problem(50, 8);
  const SolveReport report = solve(*problem).report;
  EXPECT_GT(report.iterations, 0);
  ASSERT_EQ(report.history.size(), static_cast<std::size_t>(report.iterations) + 1);
  EXPECT_GT(report.history.front(), 1e-6);
  EXPECT_LE(report.history.back(), 1e-6);
  EXPECT_THAT(report.message, ContainsRegex("[0-9]"));
}

TEST_P(AnySolver, SolvesTwoPatchesAsByHand) {
  // A = (1, 2): F12 = 1, F21 = 1/2, F22 = 1/2. ρ = (1/2, 1/4), E = (1, 0):
  //   B1 = 1 + B2/2,  B2 = (B1 + B2)/8  ⇒  B2 = B1/7,  B1 = 14/13.
  Eigen::MatrixXd f(2, 2);
  f << 0, 1, 0.5, 0.5;
  const Problem problem(dense_matrix(f), Eigen::Array2d(1, 2), column({0.5, 0.25}), column({1, 0}));
  const SolveResult result = solve_to(problem, 1e-9);
  EXPECT_NEAR(result.radiosity(0, 0), 14.0 / 13, 1e-8);
  EXPECT_NEAR(result.radiosity(1, 0), 2.0 / 13, 1e-8);
}

TEST_P(AnySolver, SolvesThreePatchesInTheOpenAsByHand) {
  // Equal areas, every F_ij = 1/4. ρ = (1/2, 1/4, 0), E = (0, 0, 1): B3 = 1,
  //   B1 = (B2 + 1)/8,  B2 = (B1 + 1)/16  ⇒  B1 = 17/127,  B2 = 9/127.
  Eigen::MatrixXd f = Eigen::MatrixXd::Constant(3, 3, 0.25);
  f.diagonal().setZero();
  const Problem problem(dense_matrix(f), Eigen::Array3d(2, 2, 2), column({0.5, 0.25, 0}), column({0, 0, 1}));
  const SolveResult result = solve_to(problem, 1e-9);
  EXPECT_NEAR(result.radiosity(0, 0), 17.0 / 127, 1e-8);
  EXPECT_NEAR(result.radiosity(1, 0), 9.0 / 127, 1e-8);
  EXPECT_NEAR(result.radiosity(2, 0), 1, 1e-8);
}

TEST_P(AnySolver, FillsAFurnaceEvenly) {
  // R1: E and ρ the same everywhere, closed: B = E/(1 − ρ).
  for (const double rho : {0.1, 0.5, 0.9}) {
    const auto problem = uniform_problem(40, rho, 3);
    const SolveResult result = solve_to(*problem, 1e-8);
    EXPECT_LT((result.radiosity - 3 / (1 - rho)).abs().maxCoeff(), 1e-6 * 3 / (1 - rho)) << "ρ = " << rho;
  }
}

TEST_P(AnySolver, ShowsNothingInAWhiteFurnace) {
  // E = 1 − ρ, closed: B = 1 whatever ρ_i, black patches included.
  const RandomEnclosure enclosure = random_enclosure(40, 23);
  std::mt19937_64 random(1);
  BandArray rho(40, 2);
  for (double& value : rho.reshaped()) value = 0.95 * uniform(random);
  rho(4, 0) = rho(7, 1) = 0;
  const Problem problem(dense_matrix(enclosure.f), enclosure.areas, rho, 1 - rho);
  EXPECT_LT((solve_to(problem, 1e-8).radiosity - 1).abs().maxCoeff(), 1e-5);
}

TEST_P(AnySolver, ConservesEnergy) {
  // Σ A (emitted − absorbed − escaped) is Σ A times the signed residual plus what rounding of F breaks of
  // reciprocity, so the imbalance is no larger than the two.
  const auto problem = random_problem(60, 12);
  const BandArray b = solve(*problem).radiosity;
  const EnergyBalance energy = energy_balance(problem->system, b, problem->system.irradiance(b));
  for (Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(energy.emitted_w[k], (problem->system.areas() * problem->system.emission().col(k)).sum(),
                1e-12 * energy.emitted_w[k]);
    EXPECT_LT(std::abs(energy.imbalance[k]), 1e-6 + 2 * 6e-8 / 0.1);
    EXPECT_NEAR(energy.escaped_w[k], 0, 1e-9 * energy.emitted_w[k]);
  }
}

TEST_P(AnySolver, CountsWhatEscapesAsEnergyToo) {
  // Half of what leaves each of two equal patches is lost. B = E + ρ/2 B': B = 1/(1 − 1/4) = 4/3, of which
  // half escapes and a half of a half is absorbed: 2/3 + 1/3 = 1.
  Eigen::MatrixXd f(2, 2);
  f << 0, 0.5, 0.5, 0;
  const Problem problem(dense_matrix(f), Eigen::Array2d(1, 1), column({0.5, 0.5}), column({1, 1}));
  const BandArray b = solve_to(problem, 1e-9).radiosity;
  const EnergyBalance energy = energy_balance(problem.system, b, problem.system.irradiance(b));
  EXPECT_NEAR(energy.escaped_w[0], 2 * 2.0 / 3, 1e-7);
  EXPECT_NEAR(energy.absorbed_w[0], 2 * 1.0 / 3, 1e-7);
  EXPECT_NEAR(energy.imbalance[0], 0, 1e-7);
}

TEST_P(AnySolver, TakesEmissionAsTheAnswerWhereAllIsBlack) {
  const RandomEnclosure enclosure = random_enclosure(30, 2);
  std::mt19937_64 random(2);
  BandArray e(30, 2);
  for (double& value : e.reshaped()) value = uniform(random);
  const Problem problem(dense_matrix(enclosure.f), enclosure.areas, BandArray::Zero(30, 2), e);
  const SolveResult result = solve(problem);
  EXPECT_TRUE((result.radiosity == e).all());
  EXPECT_EQ(result.report.status, SolveStatus::converged);
  EXPECT_EQ(result.report.iterations, 0);
  EXPECT_EQ(result.report.residual, 0);
}

TEST_P(AnySolver, GivesDarknessWithoutEmission) {
  const auto problem = uniform_problem(20, 0.5, 0);
  const SolveResult result = solve(*problem);
  EXPECT_EQ(result.report.status, SolveStatus::converged);
  EXPECT_EQ(result.report.residual, 0);
  EXPECT_EQ(result.radiosity.abs().maxCoeff(), 0);
}

TEST_P(AnySolver, KeepsADarkBandDarkBesideALitOne) {
  const RandomEnclosure enclosure = random_enclosure(20, 2);
  BandArray e = BandArray::Zero(20, 2);
  e.col(1) = 2;
  const Problem problem(dense_matrix(enclosure.f), enclosure.areas, BandArray::Constant(20, 2, 0.5), e);
  const SolveResult result = solve(problem);
  EXPECT_EQ(result.report.status, SolveStatus::converged);
  EXPECT_EQ(result.radiosity.col(0).abs().maxCoeff(), 0);
  EXPECT_LT((result.radiosity.col(1) - 4).abs().maxCoeff(), 1e-5);
}

TEST_P(AnySolver, RefusesPerfectMirrorsOfDiffuseLightOnAllOfAClosedScene) {
  EXPECT_THAT(refusal(*uniform_problem(20, 1, 1)), HasSubstr("1"));
  // One band of two is enough.
  const RandomEnclosure enclosure = random_enclosure(20, 2);
  BandArray rho = BandArray::Constant(20, 2, 0.5);
  rho.col(1) = 1;
  const Problem problem(dense_matrix(enclosure.f), enclosure.areas, rho, BandArray::Ones(20, 2));
  EXPECT_THROW(solve(problem), InputError);
}

TEST_P(AnySolver, SolvesReflectanceOneWhereEnergyCanLeave) {
  // Open: B1 = 1 + B2/2, B2 = B1/2  ⇒  4/3, 2/3.
  Eigen::MatrixXd f(2, 2);
  f << 0, 0.5, 0.5, 0;
  const Problem open(dense_matrix(f), Eigen::Array2d(1, 1), column({1, 1}), column({1, 0}));
  const SolveResult result = solve_to(open, 1e-9);
  EXPECT_NEAR(result.radiosity(0, 0), 4.0 / 3, 1e-7);
  EXPECT_NEAR(result.radiosity(1, 0), 2.0 / 3, 1e-7);
  // Closed, but one patch absorbs: F12 = F21 = 1, B1 = 1 + B2, B2 = B1/2  ⇒  2, 1.
  f << 0, 1, 1, 0;
  const Problem closed(dense_matrix(f), Eigen::Array2d(1, 1), column({1, 0.5}), column({1, 0}));
  const SolveResult other = solve_to(closed, 1e-9);
  EXPECT_NEAR(other.radiosity(0, 0), 2, 1e-7);
  EXPECT_NEAR(other.radiosity(1, 0), 1, 1e-7);
}

TEST_P(AnySolver, RefusesTolerancesAndLimitsThatMeanNothing) {
  const auto problem = uniform_problem(10, 0.5, 1);
  SolverOptions options;
  options.tolerance = -0.25;
  EXPECT_THAT(refusal(*problem, options), HasSubstr("-0.25"));
  options.tolerance = 0;
  EXPECT_THAT(refusal(*problem, options), HasSubstr("tolerance"));
  options.tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(solve(*problem, options), InputError);
  options = {};
  options.max_iterations = -7;
  EXPECT_THAT(refusal(*problem, options), HasSubstr("-7"));
}

TEST_P(AnySolver, ReportsTheIterationLimitAndKeepsWhatWasReached) {
  const auto problem = random_problem(60, 4);
  SolverOptions options;
  options.max_iterations = 2;
  options.tolerance = 1e-9;
  const SolveResult result = solve(*problem, options);
  EXPECT_EQ(result.report.status, SolveStatus::iteration_limit);
  EXPECT_EQ(result.report.iterations, 2);
  EXPECT_NEAR(result.report.residual, problem->residual(result.radiosity), 1e-3 * result.report.residual);
  EXPECT_GT(result.report.residual, 1e-9);
  EXPECT_THAT(result.report.message, HasSubstr("2"));
  // Two iterations have moved away from B = E, and towards the answer.
  const BandArray exact = problem->exact();
  EXPECT_LT(problem->distance(result.radiosity, exact), problem->distance(problem->system.emission(), exact));
}

TEST_P(AnySolver, LimitsIterationsByDefaultHoweverManyPatchesThereAre) {
  const auto solver = GetParam()->make();
  const Index few = solver->default_max_iterations(1000);
  EXPECT_GT(few, 0);
  EXPECT_GE(solver->default_max_iterations(std::numeric_limits<Index>::max()), few);
}

TEST_P(AnySolver, StopsWhenTheCallerHasSeenEnough) {
  const auto problem = random_problem(60, 4);
  std::vector<Index> seen;
  std::vector<double> residuals;
  BandArray last;
  SolverOptions options;
  options.step = [&](Index iteration, double residual, const BandArray& radiosity) {
    seen.push_back(iteration);
    residuals.push_back(residual);
    last = radiosity;
    return iteration < 3;
  };
  const SolveResult result = solve(*problem, options);
  EXPECT_EQ(result.report.status, SolveStatus::stopped);
  EXPECT_EQ(seen, (std::vector<Index>{0, 1, 2, 3}));
  EXPECT_EQ(result.report.iterations, 3);
  ASSERT_EQ(last.rows(), problem->system.size());
  ASSERT_EQ(last.cols(), problem->system.bands());
  EXPECT_LT((result.radiosity - last).abs().maxCoeff(), 1e-12);
  ASSERT_EQ(result.report.history.size(), 4u);
  EXPECT_EQ(result.report.history, residuals);
}

TEST_P(AnySolver, TellsProgressWithoutRadiositiesAndStopsForIt) {
  const auto problem = random_problem(60, 4);
  std::vector<double> residuals;
  SolverOptions options;
  options.progress = [&](Index iteration, double residual) {
    EXPECT_EQ(iteration, static_cast<Index>(residuals.size()));
    residuals.push_back(residual);
    return iteration < 3;
  };
  const SolveResult result = solve(*problem, options);
  EXPECT_EQ(result.report.status, SolveStatus::stopped);
  EXPECT_EQ(result.report.iterations, 3);
  EXPECT_EQ(result.report.history, residuals);
  const auto after_three = [](Index iteration, double, const BandArray&) { return iteration < 3; };
  const SolveResult watched = solve(*problem, {.step = after_three});
  EXPECT_TRUE((result.radiosity == watched.radiosity).all());
}

TEST_P(AnySolver, GivesTheSameBitsWithAnyNumberOfThreads) {
  const auto problem = random_problem(150, 6);
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return solve(*problem).radiosity;
  };
  EXPECT_TRUE((with(1) == with(4)).all());
}

TEST_P(AnySolver, ScalesWithTheLamps) {
  // B is linear in E, 12 orders of magnitude apart.
  const auto weak = uniform_problem(20, 0.5, 1e-6), strong = uniform_problem(20, 0.5, 1e6);
  const BandArray a = solve_to(*weak, 1e-8).radiosity * 1e12, b = solve_to(*strong, 1e-8).radiosity;
  EXPECT_LT(((a - b) / b).abs().maxCoeff(), 1e-6);
}

TEST_P(AnySolver, ReconstructsVerticesAndEnergyWithTheSolution) {
  const MethodSetup setup(cube_room(2), find_form_factor_method("analytic"));
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  const RadiositySystem system(f, setup.mesh);
  const Solution solution = radiosity::solve(*solver_, system, setup.mesh);
  EXPECT_EQ(solution.report.status, SolveStatus::converged);
  EXPECT_TRUE((solution.irradiance == system.irradiance(solution.radiosity)).all());
  EXPECT_TRUE((solution.vertex_radiosity == vertex_values(setup.mesh, solution.radiosity)).all());
  EXPECT_LT(std::abs(solution.energy.imbalance[0]), 1e-5);
}

TEST_P(AnySolver, NeedsNoStoredRowsWhereItSaysSo) {
  if (GetParam()->gathers) GTEST_SKIP() << "reads F many times";
  // Exact factors, so that stored and computed rows differ by rounding to single precision only.
  const MethodSetup setup(cube_room(2), find_form_factor_method("analytic"));
  const FormFactorMatrix stored = assemble(*setup.method, setup.visibility).matrix;
  const RowsOnDemand on_demand(*setup.method, setup.visibility, 0);
  const Index n = setup.size();
  BandArray e = BandArray::Zero(n, 1);
  e(5, 0) = 10;
  const BandArray rho = BandArray::Constant(n, 1, 0.6);
  const SolveResult expected = solver_->solve(RadiositySystem(stored, setup.mesh.areas(), rho, e));
  const SolveResult result = solver_->solve(RadiositySystem(on_demand, setup.mesh.areas(), rho, e));
  EXPECT_EQ(result.report.status, SolveStatus::converged) << result.report.message;
  EXPECT_LE(result.report.residual, 1e-6);
  EXPECT_LT((result.radiosity - expected.radiosity).abs().maxCoeff(), 1e-5 * expected.radiosity.maxCoeff());
}

}  // namespace
}  // namespace radiosity::test
