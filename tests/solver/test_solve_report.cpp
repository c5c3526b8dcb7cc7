// SPDX-License-Identifier: GPL-3.0-or-later
// What a solve says of itself, and what it does not do twice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solver.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// A sphere without facets: I − ρF has the eigenvalues 1 and, with ρ the same everywhere, 1 − ρ.
struct Sphere {
  Sphere() : areas(40) {
    std::mt19937_64 random(3);
    for (double& a : areas) a = 0.5 + uniform(random);
    f = std::make_unique<FormFactorMatrix>(
        dense_matrix((areas / areas.sum()).matrix().transpose().replicate(areas.size(), 1)));
  }
  Index n() const { return f->size(); }
  RadiositySystem system(double rho) const {
    BandArray e = BandArray::Zero(n(), 1);
    e(3, 0) = 1;
    return {*f, areas, BandArray::Constant(n(), 1, rho), e};
  }
  Eigen::ArrayXd areas;
  std::unique_ptr<FormFactorMatrix> f;
};

/// 60 patches of two bands in which everything is random.
struct TwoBands {
  TwoBands() {
    std::mt19937_64 random(8);
    for (double& value : rho.reshaped()) value = 0.8 * uniform(random);
    for (double& value : e.reshaped()) value = uniform(random);
  }
  RadiositySystem system() const { return {f, enclosure.areas, rho, e}; }
  RandomEnclosure enclosure = random_enclosure(60, 3);
  FormFactorMatrix f = dense_matrix(enclosure.f);
  BandArray rho{60, 2}, e{60, 2};
};

BandArray exact(const FormFactorMatrix& f, const RadiositySystem& system) {
  SolverOptions options;
  options.tolerance = 1e-14;
  const RadiositySystem same(f, system.areas(), system.reflectance(), system.emission());
  return find_solver("conjugate-gradient").make()->solve(same, options).radiosity;
}

class EverySolver : public testing::TestWithParam<const SolverInfo*> {};
INSTANTIATE_TEST_SUITE_P(All, EverySolver, testing::ValuesIn(pointers(solvers())), test_name<SolverInfo>);

TEST_P(EverySolver, StaysWithinItsErrorBound) {
  const TwoBands two;
  const RadiositySystem system = two.system();
  const BandArray answer = exact(two.f, system);
  for (const double tolerance : {1e-1, 1e-3}) {
    SolverOptions options;
    options.tolerance = tolerance;
    const SolveResult result = GetParam()->make()->solve(system, options);
    for (Index b = 0; b < 2; ++b) {
      const double error = (result.radiosity.col(b) - answer.col(b)).abs().maxCoeff();
      EXPECT_LE(error, result.report.error_bound(0, b) + 1e-6);
      EXPECT_GT(error, result.report.error_bound(0, b) / 100);
    }
  }
}

TEST_P(EverySolver, KnowsTheConditionOfASphere) {
  const Sphere sphere;
  const SolveReport report = GetParam()->make()->solve(sphere.system(0.9)).report;
  EXPECT_NEAR(report.condition(0, 0), 10, 0.01);
  EXPECT_THAT(report.warning, IsEmpty());
}

TEST_P(EverySolver, WarnsWhereTheBoundSaysNothing) {
  // One patch loses nothing: the bound is infinite, the answer is as good as any.
  const Sphere sphere;
  BandArray rho = BandArray::Constant(sphere.n(), 1, 0.5);
  rho(7, 0) = 1;
  const RadiositySystem system(*sphere.f, sphere.areas, rho, BandArray::Ones(sphere.n(), 1));
  const SolveReport report = GetParam()->make()->solve(system).report;
  EXPECT_EQ(report.status, SolveStatus::converged);
  EXPECT_TRUE(std::isinf(report.error_bound(0, 0)));
  EXPECT_THAT(report.warning, HasSubstr("absorbs nothing"));
}

/// Counts how often rows of F are read.
class Counted final : public FormFactorRows {
 public:
  explicit Counted(const FormFactorMatrix& f) : f_(f) {}
  Index size() const override { return f_.size(); }
  FormFactorRow row(Index i, RowBuffer&) const override {
    ++reads;
    return f_.row(i);
  }
  bool stored() const override { return true; }
  Eigen::ArrayXd escaped() const override { return f_.escaped(); }
  mutable std::atomic<Index> reads = 0;

 private:
  const FormFactorMatrix& f_;
};

TEST_P(EverySolver, SolvesEqualBandsOnceAndDarkOnesNever) {
  const RandomEnclosure enclosure = random_enclosure(50, 3);
  const FormFactorMatrix f = dense_matrix(enclosure.f);
  const auto reads = [&](const BandArray& e, SolveResult& result) {
    const Counted counted(f);
    const RadiositySystem system(counted, enclosure.areas, BandArray::Constant(50, e.cols(), 0.6), e);
    counted.reads = 0;
    result = GetParam()->make()->solve(system);
    return counted.reads.load();
  };
  BandArray one = BandArray::Zero(50, 1);
  one(4, 0) = 3;
  BandArray four = BandArray::Zero(50, 4);
  four.col(1) = four.col(3) = one.col(0);
  SolveResult alone, together;
  EXPECT_EQ(reads(one, alone), reads(four, together));
  EXPECT_TRUE((together.radiosity.col(1) == alone.radiosity.col(0)).all());
  EXPECT_TRUE((together.radiosity.col(3) == alone.radiosity.col(0)).all());
  EXPECT_TRUE((together.radiosity.col(0) == 0).all() && (together.radiosity.col(2) == 0).all());
}

TEST(ConjugateGradients, ReadFOnceForAllBands) {
  const RandomEnclosure enclosure = random_enclosure(50, 3);
  const FormFactorMatrix f = dense_matrix(enclosure.f);
  const auto reads_per_iteration = [&](Index bands) {
    const Counted counted(f);
    std::mt19937_64 random(2);
    BandArray e(50, bands);
    for (double& value : e.reshaped()) value = uniform(random);
    const RadiositySystem system(counted, enclosure.areas, BandArray::Constant(50, bands, 0.6), e);
    counted.reads = 0;
    const Index iterations = find_solver("conjugate-gradient").make()->solve(system).report.iterations;
    return counted.reads / (iterations + 2);  // one product for the first residual, one for the last
  };
  EXPECT_EQ(reads_per_iteration(1), 50);
  EXPECT_EQ(reads_per_iteration(64), 50);
}

TEST(ConjugateGradients, GoOnWhereTheResidualHasDriftedBelowWhatBLeaves) {
  // A row of patches that see their neighbours alone; the light of the first reaches the last in no less than n steps. Rounding in
  // each of them adds up to more than the tolerance, and to 20 times what a few steps from the residual itself leave.
  constexpr Index n = 1000;
  FormFactorMatrix::Rows rows;
  rows.n = n;
  rows.start = {0};
  for (Index i = 0; i < n; ++i) {
    for (const Index j : {i - 1, i + 1}) {
      if (j < 0 || j >= n) continue;
      rows.columns.push_back(j);
      rows.values.push_back(0.5F);
    }
    rows.start.push_back(rows.values.size());
    rows.diagonal.push_back(i == 0 || i == n - 1 ? 0.5 : 0);
    rows.escaped.push_back(0);
  }
  const FormFactorMatrix f(rows);
  BandArray e = BandArray::Zero(n, 1);
  e(0, 0) = 1;
  const RadiositySystem system(f, Eigen::ArrayXd::Ones(n), BandArray::Constant(n, 1, 1 - 1e-4), e);
  const SolveReport report = find_solver("conjugate-gradient")
                                 .make()
                                 ->solve(system, {.tolerance = 1e-12, .max_iterations = 2 * n})
                                 .report;
  EXPECT_EQ(report.status, SolveStatus::converged) << report.message;
  // Σ A B / Σ A E = 1 / (1 − ρ) = 10⁴, of which rounding may leave 4 ε.
  EXPECT_LE(report.residual, 1e-12 + 1e4 * 4 * std::numeric_limits<double>::epsilon());
}

TEST_P(EverySolver, TakesARelaxationOnlyWhereItRelaxes) {
  const Sphere sphere;
  SolverOptions options;
  for (const double wrong : {0.0, 2.0, -1.0, std::nan("")}) {
    options.relaxation = wrong;
    EXPECT_THROW(GetParam()->make()->solve(sphere.system(0.5), options), InputError) << wrong;
  }
  options.relaxation = 1.3;
  const auto solver = GetParam()->make();
  if (!solver->relaxes()) {
    EXPECT_THROW(solver->solve(sphere.system(0.5), options), InputError);
    return;
  }
  const RadiositySystem system = sphere.system(0.9);
  const SolveResult relaxed = solver->solve(system, options), plain = solver->solve(system);
  EXPECT_LT((relaxed.radiosity - exact(*sphere.f, system)).abs().maxCoeff(), 1e-4);
  EXPECT_LT(relaxed.report.iterations, plain.report.iterations);
}

TEST_P(EverySolver, KeepsTheAnswerWhereATolerancePassesAllRounding) {
  const Sphere sphere;
  SolverOptions options;
  options.tolerance = 1e-18;
  options.max_iterations = 5000;
  const SolveResult result = GetParam()->make()->solve(sphere.system(0.9), options);
  EXPECT_LE(result.report.iterations, 5000);
  EXPECT_LT((result.radiosity - exact(*sphere.f, sphere.system(0.9))).abs().maxCoeff(), 1e-6);
}

double relative_error(const RadiositySystem& system, const BandArray& b, const BandArray& answer) {
  return std::sqrt((system.areas() * (b - answer).col(0).square()).sum() /
                   (system.areas() * answer.col(0).square()).sum());
}

struct FurnishedRooms {
  FurnishedRooms()
      : setup(make_patches(two_furnished_rooms(), PatchSize{2}).mesh.with_clusters({}),
              find_form_factor_method("hemisphere")),
        f(assemble(*setup.method, setup.visibility).matrix),
        rho(setup.size(), 1) {
    std::mt19937_64 random(5);
    std::vector<double> of_surface;
    for (Index i = 0; i < setup.size(); ++i) {
      while (static_cast<Index>(of_surface.size()) <= setup.mesh.surface(i))
        of_surface.push_back(0.2 + 0.7 * uniform(random));
      rho(i, 0) = of_surface[setup.mesh.surface(i)];
    }
  }
  RadiositySystem system() const { return {f, setup.mesh.areas(), rho, setup.mesh.emission()}; }
  MethodSetup setup;
  FormFactorMatrix f;
  BandArray rho;  ///< 0.2 … 0.9, by surface
};

TEST(Shooting, WithOvershootNeedsFewerShotsThanPatchesForAThousandth) {
  const FurnishedRooms rooms;
  const RadiositySystem system = rooms.system();
  const BandArray answer = exact(rooms.f, system);
  Index enough = -1;
  SolverOptions options;
  options.step = [&](Index shots, double, const BandArray& b) {
    if (relative_error(system, b, answer) <= 1e-3) enough = shots;
    return enough < 0;
  };
  find_solver("progressive-overshoot").make()->solve(system, options);
  EXPECT_GT(enough, 0);
  EXPECT_LT(enough, system.size());
}

TEST(Shooting, ShowsTheLightUnderWayAsAmbient) {
  const FurnishedRooms rooms;
  const RadiositySystem system = rooms.system();
  const BandArray answer = exact(rooms.f, system);
  SolverOptions options;
  options.max_iterations = system.size() / 4;
  const auto error = [&](bool ambient) {
    options.ambient = ambient;
    return relative_error(system, find_solver("progressive").make()->solve(system, options).radiosity,
                          answer);
  };
  EXPECT_LT(error(true), error(false) / 2);
}

TEST(Shooting, GoesOnFromASavedStateToTheSameBits) {
  const TwoBands two;
  const RadiositySystem system = two.system();
  for (const SolverInfo& info : solvers()) {
    if (info.gathers) continue;
    for (const bool ambient : {false, true}) {
      SCOPED_TRACE(info.name);
      std::vector<ShootingState> states;
      SolverOptions options;
      options.ambient = ambient;
      options.save = [&](Index, const std::function<ShootingState()>& state) { states.push_back(state()); };
      const SolveResult whole = info.make()->solve(system, options);
      ASSERT_EQ(whole.report.status, SolveStatus::converged);
      ASSERT_GT(states.size(), 10U);
      options.save = {};
      for (const std::size_t k : {std::size_t{0}, states.size() / 2, states.size() - 1}) {
        options.partial = std::make_shared<const ShootingState>(states[k]);
        const SolveResult resumed = info.make()->solve(system, options);
        EXPECT_TRUE((resumed.radiosity == whole.radiosity).all());
        EXPECT_EQ(resumed.report.history, whole.report.history);
        EXPECT_EQ(resumed.report.iterations, whole.report.iterations);
      }
      options.partial = std::make_shared<const ShootingState>();
      EXPECT_THROW(info.make()->solve(system, options), InputError);
    }
  }
}

}  // namespace
}  // namespace radiosity::test
