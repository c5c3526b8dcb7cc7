// SPDX-License-Identifier: GPL-3.0-or-later
// F that a user writes and nobody stores.
#include "radiosity/formfactors/form_factor_operator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using testing::HasSubstr;

/// What light reaches depends only on its size, as within a sphere: F_ij = A_j / Σ A from any number of elements, of rank one.
class Sphere final : public FormFactorOperator {
 public:
  Sphere(const Eigen::ArrayXd& areas, Index elements) : share_(areas / areas.sum()), elements_(elements) {}
  Index rows() const override { return elements_; }
  Index columns() const override { return static_cast<Index>(share_.size()); }

 private:
  void multiply(const BandArray& x, BandArray& y) const override {
    y = (x.colwise() * share_).colwise().sum().replicate(elements_, 1);
  }
  Eigen::ArrayXd share_;
  Index elements_;
};

/// Areas of 1 to 40 m²; ρ and E are uniform in the first band and not in the second.
struct Problem {
  static constexpr Index n = 40;
  Eigen::ArrayXd areas = Eigen::ArrayXd::LinSpaced(n, 1, n);
  BandArray rho = BandArray::Constant(n, 2, 0.9), e = BandArray::Constant(n, 2, 5);
  Problem() {
    rho.col(1) = Eigen::ArrayXd::LinSpaced(n, 0, 0.8);
    e.col(1) = Eigen::ArrayXd::LinSpaced(n, 3, 0);
  }
};

class OperatorSolver : public testing::TestWithParam<const SolverInfo*> {};
INSTANTIATE_TEST_SUITE_P(All, OperatorSolver, testing::ValuesIn(pointers(solvers())), test_name<SolverInfo>);

TEST_P(OperatorSolver, NeedsNothingButProductsOrSaysThatItReadsRows) {
  const Problem p;
  const Sphere f(p.areas, p.n);
  const RadiositySystem system(f, p.areas, p.rho, p.e);
  const auto solver = GetParam()->make();
  if (solver->reads_rows()) {
    try {
      solver->solve(system);
      FAIL() << "rows of an operator that has none were read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("reads single rows of F"));
    }
    return;
  }
  const SolveResult result = solver->solve(system, {.tolerance = 1e-12});
  EXPECT_EQ(result.report.status, SolveStatus::converged) << result.report.message;
  // H is the same everywhere: with ⟨x⟩ the mean by area, H = ⟨B⟩ = ⟨E⟩ + ⟨ρ⟩ H.
  const auto mean = [&](const BandArray& x) { return (p.areas * x.col(1)).sum() / p.areas.sum(); };
  const double h = mean(p.e) / (1 - mean(p.rho));
  EXPECT_LT((result.radiosity.col(0) - 5 / (1 - 0.9)).abs().maxCoeff(), 1e-9);
  EXPECT_LT((result.radiosity.col(1) - (p.e.col(1) + p.rho.col(1) * h)).abs().maxCoeff(), 1e-9);
  const BandArray irradiance = system.irradiance(result.radiosity);
  EXPECT_LT((irradiance.col(1) - h).abs().maxCoeff(), 1e-9);
  EXPECT_LT(energy_balance(system, result.radiosity, irradiance).imbalance.abs().maxCoeff(), 1e-9);
}

TEST(FormFactorOperator, MayBeRectangularAndIsAppliedToAFieldOfItsColumnsOnly) {
  const Problem p;
  const Sphere f(p.areas, 7);  // elements
  BandArray h;
  f.apply(BandArray::Constant(p.n, 3, 2), h);
  EXPECT_EQ(h.rows(), 7);
  EXPECT_EQ(h.cols(), 3);
  EXPECT_LT((h - 2).abs().maxCoeff(), 1e-14);
  EXPECT_TRUE((f.escaped() == 0).all());
  EXPECT_THROW(f.apply(BandArray::Ones(7, 3), h), InputError);
  EXPECT_THROW(RadiositySystem(f, p.areas, p.rho, p.e), InputError);
}

}  // namespace
}  // namespace radiosity::test
