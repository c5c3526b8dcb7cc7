// SPDX-License-Identifier: GPL-3.0-or-later
// One cell of a symmetric scene against the whole of it, whatever the method.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/sides.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

PatchMesh cell_of(const PatchMesh& mesh, Symmetry symmetry) {
  PatchMesh::Arrays arrays = arrays_of(mesh);
  arrays.symmetry = std::move(symmetry);
  return PatchMesh(std::move(arrays));
}

/// The part of [0, 1]³ from the inside that lies beyond the planes ½ of the first `axes` axes, and with `thing` an eighth, at most, of
/// a box [0.35, 0.65]³ in its middle.
PatchMesh part_of_cube(int axes, bool thing) {
  Symmetry symmetry;
  for (int axis = 0; axis < axes; ++axis) symmetry.planes.push_back({axis, 0.5});
  MeshBuilder builder;
  const auto add = [&](double low, double high, Index n, bool inward) {
    Vec3 lower = Vec3::Constant(low);
    lower.head(axes).setConstant(0.5);
    const Vec3 size = Vec3::Constant(high) - lower;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 u = Vec3::Unit((axis + 1) % 3) * size[(axis + 1) % 3];
      const Vec3 v = Vec3::Unit((axis + 2) % 3) * size[(axis + 2) % 3];
      const Vec3 far = lower + Vec3::Unit(axis) * size[axis];
      builder.grid(far, inward ? v : u, inward ? u : v, n, n);
      if (axis >= axes) builder.grid(lower, inward ? u : v, inward ? v : u, n, n);
    }
  };
  add(0, 1, 3, true);
  if (thing) add(0.35, 0.65, 1, false);
  return cell_of(builder.build(), std::move(symmetry));
}

/// Rows of the whole, of patches of the cell, with the columns of images added to those of their originals.
Eigen::MatrixXd folded(const Eigen::MatrixXd& f, Index n) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  for (Index k = 0; k < f.cols(); k += n) out += f.block(0, k, n, n);
  return out;
}

class Symmetric : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  const FormFactorMethodInfo& info() const { return *GetParam(); }
};

INSTANTIATE_TEST_SUITE_P(All, Symmetric, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(Symmetric, RowsAreThoseOfTheWholeWithItsImagesAddedUp) {
  for (const int axes : {1, 2, 3})
    for (const bool thing : {false, true}) {
      const MethodSetup cell(part_of_cube(axes, thing), info());
      const MethodSetup whole(cell.mesh.unfolded(), info());
      const Index n = cell.mesh.patch_count();
      ASSERT_EQ(whole.mesh.patch_count(), n << axes);
      ASSERT_EQ(cell.mesh.cluster_count(), n);
      const Eigen::MatrixXd f = raw_rows(*cell.method, n).f;
      // The first patches of the whole are those of the cell, and take the same rays and cells.
      const Eigen::MatrixXd sum = folded(whole.raw().f.topRows(n), n);
      EXPECT_LT((f - sum).cwiseAbs().maxCoeff(), 1e-12) << axes << " planes, thing " << thing;
    }
}

TEST_P(Symmetric, CellsAreClosedAndReciprocal) {
  for (const int axes : {1, 2, 3})
    for (const bool thing : {false, true}) {
      const MethodSetup cell(part_of_cube(axes, thing), info());
      const auto [matrix, report] = assemble(*cell.method, cell.visibility);
      const Eigen::MatrixXd f = as_dense(matrix);
      EXPECT_LT((f.rowwise().sum().array() + matrix.escaped() - 1).abs().maxCoeff(), 1e-6)
          << axes << ' ' << thing;
      EXPECT_LT(reciprocity_error(f, cell.mesh.cluster_areas()), 1e-6) << axes << ' ' << thing;
      EXPECT_GE(f.minCoeff(), 0);
      // Single cells of a hemicube may show a seam.
      EXPECT_LT(report.escaped_mean, info().defaults.has_resolution() ? 1e-3 : 1e-6) << axes << ' ' << thing;
    }
}

TEST_P(Symmetric, FurnaceIsAsBrightAsTheWhole) {
  // Closed, E = 1, ρ = ½: B = E / (1 − ρ) = 2.
  const MethodSetup cell(part_of_cube(3, false), info());
  const FormFactorMatrix f = assemble(*cell.method, cell.visibility).matrix;
  const RadiositySystem system(f, cell.mesh);
  SolverOptions options;
  options.tolerance = 1e-7;
  const Solution solution = solve(*find_solver(kDefaultSolver).make(), system, cell.mesh, options);
  EXPECT_LT((solution.radiosity - 2).abs().maxCoeff(), 1e-5);
  EXPECT_LT((solution.vertex_radiosity - 2).abs().maxCoeff(), 1e-5);
  // An eighth of 6 m² · 1 W/m².
  EXPECT_NEAR(solution.energy.emitted_w[0], 0.75, 1e-9);
  EXPECT_NEAR(solution.energy.absorbed_w[0], 0.75, 1e-5);
}

TEST_P(Symmetric, ClustersHaveTheirImagesToo) {
  // The three walls of an eighth of a cube as one cluster: all that leaves the cube's walls reaches them again.
  const FormFactorOptions options{.samples = info().defaults.has_resolution() ? 64
                                             : info().name == "analytic"      ? 0
                                                                              : 16384};
  const PatchMesh mesh = part_of_cube(3, false);
  const PatchMesh one =
      mesh.with_clusters(std::vector<Index>(static_cast<std::size_t>(mesh.patch_count()), 0));
  const Visibility of_one(one);
  EXPECT_NEAR(as_dense(assemble(*info().make(of_one, options), of_one).matrix)(0, 0), 1, 1e-6);
  // Two of them as one, and the third: F of the union from F of the parts.
  std::vector<Index> two;
  for (Index i = 0; i < mesh.patch_count(); ++i) two.push_back(mesh.surface(i) == 2 ? 1 : 0);
  const PatchMesh both = mesh.with_clusters(two);
  const Visibility of_two(both);
  const Eigen::MatrixXd f = as_dense(assemble(*info().make(of_two, options), of_two).matrix);
  // Of a whole face 0.1998248957 reaches the opposite one, and as much each of the four beside it [Howell, C-11, C-14]:
  // the third pair of faces sends that to its own image, the rest to the other two pairs.
  const double noise = info().name == "analytic" ? 1e-5 : 0.015;  // √(0.16 / 16384) = 0.003
  EXPECT_NEAR(f(1, 1), 0.1998248957, noise);
  EXPECT_NEAR(f(1, 0), 1 - 0.1998248957, noise);
  EXPECT_NEAR(f(0, 1), f(1, 0) / 2, 1e-6);
}

TEST_P(Symmetric, LampsThatAreFewAreComputedOverAllTheirImages) {
  // A lamp of 0.1 × 0.1 on the ceiling across the middle, and its half in half of the room.
  MeshBuilder builder;
  builder.use_material(grey("room", 0.5, 0))
      .grid({0.5, 0, 0}, {0.5, 0, 0}, {0, 1, 0}, 3, 4)
      .grid({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, 4, 4)
      .grid({0.5, 0, 0}, {0, 0, 1}, {0.5, 0, 0}, 4, 3)
      .grid({0.5, 1, 0}, {0.5, 0, 0}, {0, 0, 1}, 3, 4)
      .grid({0.5, 0, 1}, {0, 1, 0}, {0.5, 0, 0}, 4, 3)
      .use_material(grey("lamp", 0, 10))
      .grid({0.5, 0.45, 0.99}, {0, 0.1, 0}, {0.05, 0, 0}, 1, 1);
  const PatchMesh mesh = cell_of(builder.build(), {.planes = {{0, 0.5}}});
  const MethodSetup cell(mesh, info()), whole(mesh.unfolded(), info());
  const auto half = assemble(*cell.method, cell.visibility), full = assemble(*whole.method, whole.visibility);
  const Index n = mesh.patch_count(), lamp = n - 1;
  EXPECT_EQ(full.report.lamps, 2 * half.report.lamps);
  const Eigen::MatrixXd sum = folded(as_dense(full.matrix).topRows(n), n), f = as_dense(half.matrix);
  // Pairs, in single precision; what the box of the lamp hides is partly in shadow.
  EXPECT_LT((f.col(lamp) - sum.col(lamp)).cwiseAbs().maxCoeff(), 2e-5);
}

TEST_P(Symmetric, HalfOfARoomIsHalfTheWork) {
  const MethodSetup cell(part_of_cube(1, true), info()), whole(cell.mesh.unfolded(), info());
  const auto half = assemble(*cell.method, cell.visibility), full = assemble(*whole.method, whole.visibility);
  EXPECT_EQ(half.report.rays * 2, full.report.rays);
  const auto count = [](const PairCounts& pairs) {
    return pairs.behind + pairs.hidden + pairs.free + pairs.partial + pairs.by_rays;
  };
  // n (n − 1) / 2 pairs of the cell and n (n + 1) / 2 with its image, of 2 n (2 n − 1) / 2 of the whole.
  const auto n = static_cast<std::uint64_t>(cell.mesh.patch_count());
  if (cell.method->reciprocal()) {
    EXPECT_EQ(count(half.report.pairs), n * n);
    EXPECT_EQ(count(full.report.pairs), n * (2 * n - 1));
  }
}

TEST(Period, SeesStripsWithoutEnd) {
  // Two strips of width 1 at distance 1, without end: F = √2 − 1 by crossed strings. K steps of 2 either way leave out what is more
  // than 2 K away along them: ∫∫ dx dz / (π r⁴) < ∫ dz / (π z⁴) = 1 / (3 π (2 K)³) each way. It falls as K⁻³.
  double last = 1;
  for (const Index steps : {1, 2, 4, 8}) {
    const PatchMesh mesh = cell_of(MeshBuilder()
                                       .grid({0, 0, 0}, {0, 0, 2}, {1, 0, 0}, 8, 4)
                                       .grid({0, 1, 0}, {1, 0, 0}, {0, 0, 2}, 4, 8)
                                       .build(),
                                   {.period = {0, 0, 2}, .steps = steps});
    const Visibility visibility(mesh);
    const Eigen::MatrixXd f =
        as_dense(assemble(*find_form_factor_method("analytic").make(visibility, {}), visibility).matrix);
    // All patches have the same area: the mean over one strip of what reaches the other.
    const Index n = mesh.patch_count() / 2;
    const double reached = f.block(0, n, n, n).sum() / n;
    const double lacking = std::sqrt(2.0) - 1 - reached;
    EXPECT_GT(lacking, 0);
    EXPECT_LT(lacking, 2 / (3 * std::numbers::pi * std::pow(2.0 * steps, 3)));
    EXPECT_LT(lacking, last / 4);
    last = lacking;
  }
}

TEST(Period, TakesTheStepsThatItsRuleAsksFor) {
  // A square tube of side 1: 2 · 1 · √2 / (π s³) = 10⁻³ at s = 9.655.
  const Vec3 lower(0, 0, 0), upper(1, 1, 2);
  EXPECT_EQ(steps_of_period({.period = {0, 0, 2}}, lower, upper), 5);
  EXPECT_EQ(steps_of_period({.period = {0, 0, 1}}, lower, upper), 10);
  // Half of it.
  EXPECT_EQ(steps_of_period({.planes = {{0, 1}}, .period = {0, 0, 1}}, {0.5, 0, 0}, upper), 10);
}

TEST(Sides, OfASheetWithAnImageOfALampBehindItAreTwo) {
  // A sheet at x = 1 that faces +x, and beyond it a lamp that faces −x; in the mirror, a lamp behind it.
  Material sheet = grey("sheet", 0.5, 0);
  sheet.sides = Sides::automatic;
  const PatchMesh mesh = MeshBuilder()
                             .use_material(sheet)
                             .grid({1, -0.5, -0.5}, {0, 1, 0}, {0, 0, 1}, 1, 1)
                             .use_material(grey("lamp", 0, 1))
                             .grid({3, -4, -4}, {0, 0, 8}, {0, 8, 0}, 1, 1)
                             .build();
  Scene::Arrays arrays;
  arrays.vertices = mesh.vertices();
  arrays.materials = mesh.materials();
  for (Index i = 0; i < mesh.patch_count(); ++i) arrays.add_face(mesh.corners(i), mesh.material(i));
  EXPECT_EQ(decide_sides(Scene(arrays)).faces, 0);
  arrays.symmetry.planes = {{0, 0}};
  EXPECT_EQ(decide_sides(Scene(arrays)).faces, 1);
}

}  // namespace
}  // namespace radiosity::test
