// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes whose radiosity is known, through methods, assembly and solvers together.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

SolverOptions tolerance(double value) {
  SolverOptions options;
  options.tolerance = value;
  return options;
}

BandArray radiosity_of(const MethodSetup& setup, const SolverInfo& solver, double residual = 1e-8) {
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  return solver.make()->solve(RadiositySystem(f, setup.mesh), tolerance(residual)).radiosity;
}

/// Area mean of B over patches for which `chosen` is true.
double mean(const PatchMesh& mesh, const BandArray& b, const auto& chosen) {
  double power = 0, area = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (chosen(i)) {
      power += mesh.area(i) * b(i, 0);
      area += mesh.area(i);
    }
  return power / area;
}

class EveryPair : public testing::TestWithParam<std::tuple<const FormFactorMethodInfo*, const SolverInfo*>> {
 protected:
  const FormFactorMethodInfo& method() const { return *std::get<0>(GetParam()); }
  const SolverInfo& solver() const { return *std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(All, EveryPair,
                         testing::Combine(testing::ValuesIn(pointers(form_factor_methods())),
                                          testing::ValuesIn(pointers(solvers()))),
                         [](const auto& pair) {
                           std::string name(std::get<0>(pair.param)->name);
                           name += '_';
                           name += std::get<1>(pair.param)->name;
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(EveryPair, FillsAFurnaceWithOccludersEvenly) {
  // R1: B = E/(1 − ρ) = 2 in any closed scene with E = 1, ρ = 1/2.
  for (const PatchMesh& mesh :
       {room_with_floating_box(3, 1), two_rooms(1), room_with_triangle_soup(1, 4, 5)}) {
    const MethodSetup setup(mesh, method());
    EXPECT_LT((radiosity_of(setup, solver()) - 2).abs().maxCoeff(), 2e-6);
  }
}

class EveryMethod : public testing::TestWithParam<const FormFactorMethodInfo*> {};
INSTANTIATE_TEST_SUITE_P(All, EveryMethod, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(EveryMethod, FillsAFurnaceWithABoxOnTheFloorEvenly) {
  const MethodSetup setup(make_patches(box_on_floor(), PatchSize{0.26}).mesh, *GetParam());
  const BandArray b = radiosity_of(setup, find_solver("gauss-seidel"));
  for (Index i = 0; i < setup.size(); ++i) {
    const Vec3& c = setup.mesh.centroid(i);
    const bool covered = c.z() < 1e-9 && std::abs(c.x() - 0.5) < 1.0 / 6 && std::abs(c.y() - 0.5) < 1.0 / 6;
    EXPECT_NEAR(b(i, 0), covered ? 1 : 2, 2e-6) << "patch at " << c.transpose();
  }
}

TEST_P(EveryMethod, LightsABallAsTheSphereFormulaSays) {
  // R2: a cap within 60° of the pole (a quarter of the area) with E = 1, ρ = 0.8 everywhere: on a sphere B = E
  // + ρ⟨E⟩/(1 − ⟨ρ⟩), 2 on the cap and 1 elsewhere. With facets the cap's share q of the area is not quite a
  // quarter, and the facets next to each other see less than a sphere would show.
  const Material lamp = grey("cap", 0.8, 1), wall = grey("ball", 0.8, 0);
  PatchMesh ball = MeshBuilder().use_material(lamp).sphere(Vec3::Zero(), 1, 2, Facing::inward).build();
  const auto in_cap = [&](Index i) { return ball.centroid(i).normalized().z() > 0.5; };
  const MethodSetup setup(ball, *GetParam());
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  BandArray e(ball.patch_count(), 1);
  double q = 0;
  for (Index i = 0; i < ball.patch_count(); ++i) {
    e(i, 0) = in_cap(i) ? 1 : 0;
    q += e(i, 0) * ball.area(i) / ball.areas().sum();
  }
  EXPECT_NEAR(q, 0.25, 0.02);
  const RadiositySystem system(f, ball.areas(), BandArray::Constant(ball.patch_count(), 1, 0.8), e);
  const BandArray b = find_solver("gauss-seidel").make()->solve(system).radiosity;
  const double indirect = 0.8 * q / 0.2;
  EXPECT_NEAR(mean(ball, b, in_cap), 1 + indirect, 0.02);
  EXPECT_NEAR(mean(ball, b, [&](Index i) { return !in_cap(i); }), indirect, 0.02);
}

TEST_P(EveryMethod, LightsConcentricBallsAsTheShellFormulaSays) {
  // R4: F12 = 1, F21 = A1/A2, F22 = 1 − A1/A2, with the areas of the polyhedra; on spheres of radius 1 and 2
  // B1 = 38/31 and B2 = 14/31.
  const auto shell = [](double ratio) {
    Eigen::Matrix2d m;
    m << 1, -0.5 * 1, -0.7 * ratio, 1 - 0.7 * (1 - ratio);
    return Eigen::Vector2d(m.partialPivLu().solve(Eigen::Vector2d(1, 0)));
  };
  EXPECT_NEAR(shell(0.25)[0], 38.0 / 31, 1e-12);
  EXPECT_NEAR(shell(0.25)[1], 14.0 / 31, 1e-12);
  const PatchMesh mesh = concentric_spheres(1, 1, grey("inner", 0.5, 1), grey("outer", 0.7, 0));
  const MethodSetup setup(mesh, *GetParam());
  const BandArray b = radiosity_of(setup, find_solver("gauss-seidel"));
  const auto inner = [&](Index i) { return mesh.material(i) == 0; };
  const auto outer = [&](Index i) { return mesh.material(i) == 1; };
  double a1 = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) a1 += inner(i) ? mesh.area(i) : 0;
  const Eigen::Vector2d expected = shell(a1 / (mesh.areas().sum() - a1));
  EXPECT_NEAR(mean(mesh, b, inner), expected[0], 0.01);
  EXPECT_NEAR(mean(mesh, b, outer), expected[1], 0.01);
}

TEST(ExactSolutions, TheSphereFormulaHoldsForAnyEmissionAndReflectance) {
  // R2 with F_ij = A_j / Σ A, a sphere without facets: B_i = E_i + ρ_i ⟨E⟩/(1 − ⟨ρ⟩).
  const Index n = 50;
  std::mt19937_64 random(4);
  Eigen::ArrayXd areas(n);
  BandArray rho(n, 1), e(n, 1);
  for (Index i = 0; i < n; ++i) {
    areas[i] = 0.5 + uniform(random);
    rho(i, 0) = 0.95 * uniform(random);
    e(i, 0) = uniform(random);
  }
  const Eigen::ArrayXd share = areas / areas.sum();
  const FormFactorMatrix f = dense_matrix(share.matrix().transpose().replicate(n, 1));
  const double mean_e = (share * e.col(0)).sum(), mean_rho = (share * rho.col(0)).sum();
  const BandArray expected = e + rho * (mean_e / (1 - mean_rho));
  for (const SolverInfo& solver : solvers()) {
    const BandArray b = solver.make()->solve(RadiositySystem(f, areas, rho, e), tolerance(1e-8)).radiosity;
    EXPECT_LT((b - expected).abs().maxCoeff(), 1e-5) << solver.name;
  }
}

/// R10: unit cube, ceiling E = 1; ρ of floor, ceiling and walls. Mean B of floor, ceiling and walls.
Eigen::Array3d cube_means(const FormFactorRows& f, const PatchMesh& mesh, double floor, double ceiling,
                          double walls) {
  BandArray rho(mesh.patch_count(), 1), e(mesh.patch_count(), 1);
  const auto is_floor = [&](Index i) { return mesh.surface(i) == 4; };
  const auto is_ceiling = [&](Index i) { return mesh.surface(i) == 5; };
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    rho(i, 0) = is_floor(i) ? floor : is_ceiling(i) ? ceiling : walls;
    e(i, 0) = is_ceiling(i) ? 1 : 0;
  }
  const RadiositySystem system(f, mesh.areas(), rho, e);
  const BandArray b = find_solver("gauss-seidel").make()->solve(system, tolerance(1e-9)).radiosity;
  return {mean(mesh, b, is_floor), mean(mesh, b, is_ceiling),
          mean(mesh, b, [&](Index i) { return mesh.surface(i) < 4; })};
}

Eigen::Array3d cube_means(const FormFactorMethodInfo& method, Index n, double floor, double ceiling,
                          double walls) {
  const MethodSetup setup(cube_room(n), method);
  return cube_means(assemble(*setup.method, setup.visibility).matrix, setup.mesh, floor, ceiling, walls);
}

TEST(ExactSolutions, AnalyticFactorsGiveTheTabulatedMeansOfACubeWithALitCeiling) {
  const auto& analytic = find_form_factor_method("analytic");
  // Exact factors on the same grid: what is left is rounding of F, 6e-8, and the adaptive contour integral.
  const auto eight = cube_means(analytic, 8, 0.5, 0.5, 0.5);
  EXPECT_NEAR(eight[0], 0.1713732235, 2e-7);
  EXPECT_NEAR(eight[1], 1.1038446817, 2e-7);
  EXPECT_NEAR(eight[2], 0.1811955237, 2e-7);
  const auto sixteen = cube_means(analytic, 16, 0.5, 0.5, 0.5);
  EXPECT_NEAR(sixteen[0], 0.1712556941, 2e-7);
  EXPECT_NEAR(sixteen[1], 1.1042108210, 2e-7);
  EXPECT_NEAR(sixteen[2], 0.1811333712, 2e-7);
  // The continuous solution differs by what constant elements cost: 4e-5, 1.5e-4 and 3e-5 at N = 16 by the
  // table itself.
  EXPECT_NEAR(sixteen[0], 0.17121605, 1e-4);
  EXPECT_NEAR(sixteen[1], 1.1043616, 2e-4);
  EXPECT_NEAR(sixteen[2], 0.1811056, 1e-4);
}

TEST(ExactSolutions, AnalyticFactorsApproachTheTabulatedMeansOfACubeOfMixedReflectance) {
  // At N = 8 and 16 the table above is 5e-4 and 1.5e-4 from the continuous value of the ceiling, 1.6e-4 and 4e-5
  // from that of the floor; N = 12 lies between. The ceiling reflects 0.7 / 0.5 times as much here.
  const auto means = cube_means(find_form_factor_method("analytic"), 12, 0.2, 0.7, 0.5);
  EXPECT_NEAR(means[0], 0.06680166, 1.6e-4);
  EXPECT_NEAR(means[1], 1.1272218, 5e-4 * 0.7 / 0.5);
  EXPECT_NEAR(means[2], 0.1695674, 2e-4);
}

TEST_P(EveryMethod, GivesTheMeansOfACubeButForTheNoiseOfItsSeed) {
  // Means over 16 seeds, within 5 standard errors (of 15 degrees of freedom: one in 6,000 is further off) and
  // - ρ² Σ_j Var F_ij: light that goes there and back on the same noise, F_ij F_ji, is too much by its variance;
  // - 1e-5 for the four viewpoints of a hemicube, which stay where they are whatever the seed.
  constexpr int kRuns = 16;
  constexpr double kRho = 0.5;
  const MethodSetup setup(cube_room(8), *GetParam());
  const Index n = setup.size();
  Eigen::MatrixXd f_sum = Eigen::MatrixXd::Zero(n, n), f_squares = f_sum;
  Eigen::Array3d sum = Eigen::Array3d::Zero(), squares = sum;
  const Eigen::Array3d exact(0.1713732235, 1.1038446817, 0.1811955237);
  for (int run = 0; run < kRuns; ++run) {
    const auto method = GetParam()->make(setup.visibility, {.seed = static_cast<std::uint64_t>(100 + run)});
    const FormFactorMatrix f = assemble(*method, setup.visibility).matrix;
    const Eigen::Array3d off = cube_means(f, setup.mesh, kRho, kRho, kRho) - exact;
    sum += off;
    squares += off.square();
    const Eigen::MatrixXd dense = as_dense(f);
    f_sum += dense;
    f_squares += dense.cwiseAbs2();
  }
  const Eigen::Array3d mean = sum / kRuns;
  const Eigen::Array3d standard_error = ((squares / kRuns - mean.square()).max(0) / (kRuns - 1)).sqrt();
  const double variance =
      (f_squares - f_sum.cwiseAbs2() / kRuns).sum() / (kRuns - 1) / static_cast<double>(n);
  const double always = GetParam()->name == "hemicube" ? 1e-5 : 2e-7;
  for (Index k = 0; k < 3; ++k)
    EXPECT_NEAR(mean[k], 0, 5 * standard_error[k] + kRho * kRho * std::abs(variance) + always)
        << (k == 0   ? "floor"
            : k == 1 ? "ceiling"
                     : "walls");
}

}  // namespace
}  // namespace radiosity::test
