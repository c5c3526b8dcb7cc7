// SPDX-License-Identifier: GPL-3.0-or-later
// F goes to Eigen's own solvers without a copy: the example of docs/solvers.md.
#include <gtest/gtest.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/LU>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity::test {
namespace {

BandArray solved(const FormFactorMatrix& f, const PatchMesh& mesh) {
  return find_solver(kDefaultSolver).make()->solve(RadiositySystem(f, mesh), {.tolerance = 1e-12}).radiosity;
}

TEST(EigenSolvers, SolveTheSparseSystem) {
  // 16 rays a patch: most pairs are not met.
  const MethodSetup setup(two_rooms(2), find_form_factor_method("hemisphere"), {.samples = 16});
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  const PatchMesh& mesh = setup.mesh;
  ASSERT_TRUE(f.sparse());
  EXPECT_THROW(f.as_dense(), InputError);

  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  Matrix system = -(mesh.reflectance().col(0).matrix().asDiagonal() * f.as_sparse().cast<double>());
  for (Index i = 0; i < f.size(); ++i)
    system.coeffRef(i, i) += 1 - mesh.reflectance()(i, 0) * f.diagonal()[i];
  Eigen::BiCGSTAB<Matrix> solver(system);
  solver.setTolerance(1e-12);
  const Eigen::VectorXd b = solver.solve(mesh.emission().col(0).matrix());
  ASSERT_EQ(solver.info(), Eigen::Success);
  EXPECT_TRUE(b.isApprox(solved(f, mesh).col(0).matrix(), 1e-9));
}

TEST(EigenSolvers, SolveTheDenseSystem) {
  const MethodSetup setup(cube_room(3), find_form_factor_method("analytic"), {});
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  const PatchMesh& mesh = setup.mesh;
  ASSERT_FALSE(f.sparse());
  EXPECT_THROW(f.as_sparse(), InputError);

  Eigen::MatrixXd factors = f.as_dense().cast<double>();
  factors += f.diagonal().matrix().asDiagonal();
  const Eigen::MatrixXd system = Eigen::MatrixXd::Identity(f.size(), f.size()) -
                                 mesh.reflectance().col(0).matrix().asDiagonal() * factors;
  const Eigen::VectorXd b = system.partialPivLu().solve(mesh.emission().col(0).matrix());
  EXPECT_TRUE(b.isApprox(solved(f, mesh).col(0).matrix(), 1e-9));
}

}  // namespace
}  // namespace radiosity::test
