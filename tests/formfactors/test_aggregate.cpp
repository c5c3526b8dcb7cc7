// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/aggregate.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/refine.hpp"

namespace radiosity::test {
namespace {

FormFactorMatrix factors(const PatchMesh& mesh, std::string_view method, FormFactorOptions options = {}) {
  const Visibility visibility(mesh);
  return assemble(*find_form_factor_method(method).make(visibility, options), visibility).matrix;
}

// F between unions is what exact factors between the unions themselves are.
TEST(Aggregate, OfExactFactorsIsExact) {
  for (const PatchMesh& mesh : {cube_room(2), opposed_squares(0.5, 2), tetrahedron()}) {
    const Refinement fine = refine(mesh, 3);
    const FormFactorMatrix whole = factors(mesh, "analytic");
    const FormFactorMatrix joined =
        aggregate(factors(fine.mesh, "analytic"), fine.mesh.areas(), fine.coarsening);
    ASSERT_EQ(joined.size(), mesh.patch_count());
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      EXPECT_NEAR(joined.escaped()[i], whole.escaped()[i], 1e-7);
      for (Index j = 0; j < mesh.patch_count(); ++j)
        EXPECT_NEAR(joined(i, j), whole(i, j), 2e-7) << i << ", " << j;
    }
  }
}

TEST(Aggregate, KeepsClosureAndReciprocityOfSampledFactors) {
  for (const Index samples : {16, 4096}) {  // sparse and dense
    const PatchMesh mesh = room_with_floating_box(6, 4);
    const FormFactorMatrix f = factors(mesh, "hemisphere", {.samples = samples});
    std::vector<std::uint8_t> apart(mesh.patch_count(), 0);
    const Coarsening larger = coarsen(mesh, facets(mesh), 2, apart);
    const FormFactorMatrix joined = aggregate(f, mesh.areas(), larger);
    const Eigen::ArrayXd areas =
        restrict_to(larger, Eigen::ArrayXd::Ones(mesh.patch_count()), mesh.areas()).col(0) *
        4;  // of four each
    const Eigen::ArrayXd diagonal = joined.diagonal();
    for (Index i = 0; i < joined.size(); ++i) {
      double sum = diagonal[i] + joined.escaped()[i];
      for (Index j = 0; j < joined.size(); ++j) {
        sum += joined(i, j);
        EXPECT_NEAR(areas[i] * joined(i, j), areas[j] * joined(j, i), 1e-7 * areas[i]);
      }
      EXPECT_NEAR(sum, 1, 1e-12);
      EXPECT_GE(diagonal[i], 0);
    }
  }
}

TEST(Aggregate, OfACurvedSurfaceSeesItself) {
  // A sphere from inside: F_ij = A_j / A, whatever is joined.
  const PatchMesh mesh = MeshBuilder().sphere(Vec3::Zero(), 1, 2, Facing::inward).build();
  Coarsening halves;
  for (Index i = 0; i < mesh.patch_count(); ++i) halves.parent.push_back(mesh.centroid(i).z() < 0 ? 0 : 1);
  halves.count = 2;
  const FormFactorMatrix joined = aggregate(factors(mesh, "analytic"), mesh.areas(), halves);
  Eigen::Array2d area = Eigen::Array2d::Zero();
  for (Index i = 0; i < mesh.patch_count(); ++i) area[halves.parent[i]] += mesh.area(i);
  // Of facets that see each other as good as flatly the sum differs by their curvature, (1/8)².
  for (Index i = 0; i < 2; ++i)
    for (Index j = 0; j < 2; ++j) EXPECT_NEAR(joined(i, j), area[j] / area.sum(), 0.01);
}

TEST(Aggregate, RefusesWhatDoesNotFit) {
  const PatchMesh mesh = cube_room(1);
  const FormFactorMatrix f = factors(mesh, "analytic");
  EXPECT_THROW(aggregate(f, Eigen::ArrayXd::Ones(5), {{0, 0, 0, 1, 1, 1}, 2}), InputError);
  EXPECT_THROW(aggregate(f, mesh.areas(), {{0, 0}, 1}), InputError);
}

}  // namespace
}  // namespace radiosity::test
