// SPDX-License-Identifier: GPL-3.0-or-later
// One cell of a symmetric scene, solved, against the whole of it.
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>

#include "cases/scenes.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "support/parameters.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

Scene with_symmetry(const PatchMesh& faces, const Symmetry& symmetry) {
  Scene::Arrays arrays;
  arrays.vertices = faces.vertices();
  arrays.materials = faces.materials();
  for (Index i = 0; i < faces.patch_count(); ++i) arrays.add_face(faces.corners(i), faces.material(i));
  arrays.symmetry = symmetry;
  return Scene(std::move(arrays));
}

/// Half of a room of 4 × 3 × 2.5 m, cut through its lamp and through a box in mid-air; `ball`: with a ball of small faces beside that.
Scene half_room(bool ball = false) {
  MeshBuilder builder;
  const auto quad = [&](const Vec3& origin, const Vec3& u, const Vec3& v) {
    builder.grid(origin, u, v, 1, 1);
  };
  const Vec3 x(2, 0, 0), y(0, 3, 0), z(0, 0, 2.5);
  builder.use_material(grey("room", 0.6, 0));
  quad({0, 0, 0}, x, y);
  quad(x, z, y);
  quad({0, 0, 0}, z, x);
  quad(y, x, z);
  quad(z, y, x);
  builder.use_material(grey("box", 0.3, 0));
  const Vec3 a(0.5, 0, 0), b(0, 1, 0), c(0, 0, 0.6), at(0, 0.6, 0.7);
  quad(at, b, a);
  quad(at + a, b, c);
  quad(at, a, c);
  quad(at + b, c, a);
  quad(at + c, a, b);
  if (ball) builder.use_material(grey("ball", 0.8, 0)).sphere({1.2, 2.2, 0.6}, 0.3, 1, Facing::outward);
  builder.use_material(grey("lamp", 0, 10));
  quad({0, 1.2, 2.4}, {0, 0.6, 0}, {0.3, 0, 0});
  return with_symmetry(builder.build(), {.planes = {{0, 0}}});
}

/// Images are faces like all others; those of the cell come first.
Scene whole_of(const Scene& cell) {
  return scene_of(make_patches(cell, KeepFaces{}).mesh.unfolded());
}

SceneSettings settings_of(std::string_view method, double size) {
  SceneSettings settings;
  settings.method = std::string(method);
  settings.patches = PatchSize{size};
  settings.tolerance = 1e-8;
  return settings;
}

/// √(Σ A (B − B')² / Σ A (B' − E)²) over the patches of the cell, which are the first of the whole.
double difference(const PatchMesh& cell, const BandArray& radiosity, const BandArray& whole) {
  const BandArray other = whole.topRows(cell.patch_count());
  return std::sqrt(((radiosity - other).square().colwise() * cell.areas()).sum() /
                   ((other - cell.emission()).square().colwise() * cell.areas()).sum());
}

class SymmetricRoom : public testing::TestWithParam<const FormFactorMethodInfo*> {};

INSTANTIATE_TEST_SUITE_P(All, SymmetricRoom, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(SymmetricRoom, HasTheLightOfTheWhole) {
  const std::string_view method = GetParam()->name;
  const SolvedScene cell = solve_scene(half_room(), settings_of(method, 0.3)),
                    whole = solve_scene(whole_of(half_room()), settings_of(method, 0.3));
  const PatchMesh &mesh = cell.patches.mesh, &all = whole.patches.mesh;
  const Index n = mesh.patch_count();
  ASSERT_EQ(all.patch_count(), 2 * n);
  for (Index i = 0; i < n; ++i) ASSERT_LT((mesh.centroid(i) - all.centroid(i)).norm(), 1e-9);
  // Both are as exact as the method.
  const double error =
      method == "analytic" ? 1e-4 : 2 * std::max(*cell.error->form_factors, *whole.error->form_factors);
  EXPECT_LT(difference(mesh, cell.solution.radiosity, whole.solution.radiosity), error);
  EXPECT_LT(error, 0.03);
  EXPECT_NEAR(cell.solution.energy.emitted_w[0] * 2, whole.solution.energy.emitted_w[0], 1e-9);
  EXPECT_NEAR(cell.solution.energy.absorbed_w[0] * 2, whole.solution.energy.absorbed_w[0], 1e-3);
  EXPECT_EQ(cell.form_factors.assembly.closed_scene, whole.form_factors.assembly.closed_scene);
  // It says of itself what it knows of the whole: but for their noise the same.
  ASSERT_TRUE(cell.error->total && whole.error->total);
  EXPECT_NEAR(*cell.error->patches, *whole.error->patches, 0.2 * *whole.error->patches);
  // At the corners of the patches, those in the mirror included.
  double most = 0;
  for (Index i = 0; i < n; ++i)
    for (std::size_t k = 0; k < mesh.corners(i).size(); ++k)
      most = std::max(most, std::abs(cell.solution.vertex_radiosity(mesh.corners(i)[k], 0) -
                                     whole.solution.vertex_radiosity(all.corners(i)[k], 0)));
  EXPECT_LT(most, method == "analytic" ? 1e-4 : 5e-3);
}

TEST(SymmetricRooms, HaveTheSameLightOnClustersTheirMembersAndElements) {
  SceneSettings settings = settings_of("analytic", 0.5);
  settings.element_samples = 512;
  const Scene half = half_room(true);
  for (const bool elements : {false, true}) {
    if (elements) settings.elements = ElementSize{0.25};
    const SolvedScene cell = solve_scene(half, settings), whole = solve_scene(whole_of(half), settings);
    ASSERT_TRUE(cell.patches.mesh.clustered());
    EXPECT_EQ(2 * cell.patches.mesh.cluster_count(), whole.patches.mesh.cluster_count());
    EXPECT_LT(difference(cell.patches.mesh, cell.solution.radiosity, whole.solution.radiosity), 5e-4);
    ASSERT_TRUE(cell.elements && whole.elements);
    const double noise = std::hypot(cell.elements->noise(), whole.elements->noise());
    EXPECT_EQ(2 * cell.elements->mesh.patch_count(), whole.elements->mesh.patch_count());
    EXPECT_LT(difference(cell.elements->mesh, cell.elements->radiosity, whole.elements->radiosity),
              1.3 * noise);
    EXPECT_LT(noise, 0.05);
  }
}

TEST(SymmetricRooms, AreProbedOnEitherSideOfTheMirror) {
  const SolvedScene solved = solve_scene(half_room(), settings_of("analytic", 0.3));
  const PatchMesh& mesh = solved.patches.mesh;
  const PatchMesh all = mesh.unfolded();
  const std::vector<Sensor> sensors{{{0.8, 1, 0.7}, {0, 0, 1}},
                                    {{-0.8, 1, 0.7}, {0, 0, 1}},
                                    {{0, 0.3, 0.9}, {0, 0, 1}},
                                    {{1.2, 2, 0}, {0, 0, 1}}};
  ProbeOptions options;
  options.samples = 2048;
  const Visibility of_cell(mesh), of_all(all);
  const ProbeResult cell =
      probe(of_cell, solved.solution.radiosity, solved.solution.vertex_radiosity, sensors, options);
  const ProbeResult whole = probe(of_all, all.unfolded(mesh.unfolded(solved.solution.radiosity)),
                                  mesh.unfolded(solved.solution.vertex_radiosity), sensors, options);
  // The same rays.
  EXPECT_LT((cell.irradiance - whole.irradiance).abs().maxCoeff(), 1e-9);
  EXPECT_NEAR(cell.irradiance(0, 0), cell.irradiance(1, 0),
              5 * std::hypot(cell.standard_error(0, 0), cell.standard_error(1, 0)));
}

TEST(SymmetricRooms, AreSolvedToAnAccuracy) {
  SolveOptions options;
  options.accuracy = 0.04;
  const SolvedScene cell = solve_scene(half_room(), {}, options);
  ASSERT_TRUE(cell.accuracy && cell.accuracy->reached);
  const SolvedScene fine = solve_scene(whole_of(half_room()), settings_of("analytic", 0.25));
  // The mean light on the room, which patches err less of.
  const auto mean = [](const SolvedScene& solved) {
    const PatchMesh& mesh = solved.patches.mesh;
    double light = 0, area = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      if (mesh.material(i) != 0) continue;
      light += mesh.area(i) * solved.solution.radiosity(i, 0);
      area += mesh.area(i);
    }
    return light / area;
  };
  EXPECT_NEAR(mean(cell), mean(fine), 0.02 * mean(fine));
}

TEST(SymmetricRooms, HaveTheSameBitsOnSeveralRanks) {
  SceneSettings settings = settings_of("hemisphere", 0.4);
  settings.elements = ElementSize{0.3};
  settings.element_samples = 32;
  const SolvedScene alone = solve_scene(half_room(), settings);
  std::mutex checking;
  on_ranks(2, [&](const std::shared_ptr<const Ranks>& ranks) {
    SolveOptions options;
    options.ranks = ranks;
    const SolvedScene shared = solve_scene(half_room(), settings, options);
    const std::lock_guard lock(checking);
    EXPECT_TRUE((shared.solution.radiosity == alone.solution.radiosity).all());
    EXPECT_TRUE((shared.elements->radiosity == alone.elements->radiosity).all());
  });
}

TEST(SymmetricRooms, AreSolvedByEverySolver) {
  const SceneSettings gathering = settings_of("analytic", 0.5);
  const SolvedScene given = solve_scene(half_room(), gathering);
  for (const SolverInfo& info : solvers()) {
    SceneSettings settings = gathering;
    settings.solver = std::string(info.name);
    settings.tolerance = 1e-6;
    const SolvedScene solved = solve_scene(half_room(), settings);
    EXPECT_LT(difference(given.patches.mesh, solved.solution.radiosity, given.solution.radiosity), 1e-4)
        << info.name;
  }
}

TEST(SymmetricRooms, OfOneBayOfACorridorAreAsBrightAsTheMiddleOfTwentyOne) {
  // A lamp in every bay of 2 m, 10 steps either way, against the whole of them.
  const Vec3 x(1, 0, 0), y(0, 2, 0), z(0, 0, 1.2);
  const PatchMesh bay = MeshBuilder()
                            .use_material(grey("walls", 0.5, 0))
                            .grid({0, 0, 0}, x, y, 1, 1)
                            .grid(x, z, y, 1, 1)
                            .grid(z, y, x, 1, 1)
                            .use_material(grey("lamp", 0, 5))
                            .grid({0, 0.8, 1.15}, {0, 0.4, 0}, {0.2, 0, 0}, 1, 1)
                            .build();
  const Scene cell = with_symmetry(bay, {.planes = {{0, 0}}, .period = y, .steps = 10});
  const SolvedScene solved = solve_scene(cell, settings_of("analytic", 0.5));
  EXPECT_EQ(images(solved.modelled.symmetry).size(), 41U);
  const SolvedScene whole = solve_scene(whole_of(cell), settings_of("hemisphere", 0.5));
  ASSERT_EQ(whole.patches.mesh.patch_count(), 42 * solved.patches.mesh.patch_count());
  // Bays near the ends of the whole are darker: those beside the middle see them from far off. Rays tell 1 % or so.
  EXPECT_LT(difference(solved.patches.mesh, solved.solution.radiosity, whole.solution.radiosity), 0.01);
}

}  // namespace
}  // namespace radiosity::test
