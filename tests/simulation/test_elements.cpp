// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/elements.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/refine.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::test {
namespace {

SolvedScene solved(const Scene& scene, double patches, std::optional<double> elements, Index samples = 128,
                   std::string_view method = "analytic", std::uint64_t seed = 1) {
  SceneSettings settings;
  settings.patches = PatchSize{patches};
  settings.method = std::string(method);
  settings.tolerance = 1e-9;
  settings.seed = seed;
  if (elements) settings.elements = ElementSize{*elements};
  settings.element_samples = samples;
  return solve_scene(scene, settings);
}

/// √(Σ A e² / Σ A (B − E)²), first band.
double relative(const PatchMesh& mesh, const BandArray& b, const BandArray& exact) {
  const Eigen::ArrayXd error = (b - exact).col(0), reflected = (exact - mesh.emission()).col(0);
  return std::sqrt((mesh.areas() * error.square()).sum() / (mesh.areas() * reflected.square()).sum());
}

TEST(Elements, OfAFurnaceAreAllAlike) {
  // Closed, E = 1, ρ = ½: B = E / (1 − ρ) = 2, H = 2, but where the box stands on the floor: B = 1, H = 0.
  const SolvedScene furnace = solved(box_on_floor(), 0.34, 0.06);
  ASSERT_TRUE(furnace.elements);
  const Elements& e = *furnace.elements;
  const Visibility visibility(furnace.patches.mesh);
  Index covered = 0;
  for (Index i = 0; i < e.mesh.patch_count(); ++i) {
    const bool dark = visibility.covered(e.patch[i]);
    covered += dark ? 1 : 0;
    EXPECT_NEAR(e.radiosity(i, 0), dark ? 1 : 2, 1e-6);
    EXPECT_NEAR(e.irradiance(i, 0), dark ? 0 : 2, 1e-6);
  }
  EXPECT_GT(covered, 0);
}

TEST(Elements, AreNestedInTheirPatchesAndNoLongerThanAsked) {
  const SolvedScene room = solved(random_room(3), 0.8, 0.15, 32, "hemisphere");
  const Elements& e = *room.elements;
  const PatchMesh& patches = room.patches.mesh;
  ASSERT_EQ(static_cast<Index>(e.patch.size()), e.mesh.patch_count());
  Eigen::ArrayXd area = Eigen::ArrayXd::Zero(patches.patch_count());
  for (Index i = 0; i < e.mesh.patch_count(); ++i) {
    const Index p = e.patch[i];
    area[p] += e.mesh.area(i);
    EXPECT_EQ(e.mesh.material(i), patches.material(p));
    const auto c = e.mesh.corners(i);
    if ((patches.material_of(p).emission > 0).any()) {
      EXPECT_EQ(e.mesh.area(i), patches.area(p));
      continue;
    }
    for (std::size_t k = 0; k < c.size(); ++k)
      EXPECT_LE((e.mesh.vertex(c[(k + 1) % c.size()]) - e.mesh.vertex(c[k])).norm(), 0.15 * 1.0001);
  }
  EXPECT_LT((area / patches.areas() - 1).abs().maxCoeff(), 1e-12);
}

// Against exact factors between patches as small as the elements: a solve that shares nothing with the gather but the scene.
TEST(Elements, ComeCloserToAFineSolveThanTheirPatches) {
  const Scene scene = lit_cube(0.2, 0.7, 0.5);
  const SolvedScene coarse = solved(scene, 0.25, 1.0 / 16, 512);
  const Elements& e = *coarse.elements;
  const Refinement fine = refine(coarse.patches.mesh, 4);
  const SolvedScene reference = [&] {
    SceneSettings settings;
    settings.patches = KeepFaces{};
    settings.method = "analytic";
    settings.tolerance = 1e-9;
    return solve_scene(scene_of(fine.mesh), settings);
  }();
  // The lamp is one element a patch; of all others the order is that of refine().
  double of_elements = 0, of_patches = 0, below = 0;
  Index r = 0;
  for (Index i = 0; i < e.mesh.patch_count(); ++i) {
    const Index p = e.patch[i];
    if (coarse.patches.mesh.material_of(p).emission[0] > 0) {
      r += 16;
      continue;
    }
    ASSERT_LT((e.mesh.centroid(i) - fine.mesh.centroid(r)).norm(), 1e-12);
    const double exact = reference.solution.radiosity(r, 0);
    const auto square = [&](double b) { return e.mesh.area(i) * (b - exact) * (b - exact); };
    of_elements += square(e.radiosity(i, 0));
    of_patches += square(coarse.solution.radiosity(p, 0));
    below += square(0);
    ++r;
  }
  const double elements = std::sqrt(of_elements / below), patches = std::sqrt(of_patches / below);
  EXPECT_LT(elements, 0.015);
  EXPECT_LT(elements, patches / 8);
}

TEST(Elements, TellTheirNoise) {
  const SolvedScene a = solved(random_room(3), 0.8, 0.3, 128, "analytic", 1);
  const SolvedScene b = solved(random_room(3), 0.8, 0.3, 128, "analytic", 2);
  const PatchMesh& mesh = a.elements->mesh;
  // Both have it, and differ in nothing else.
  const double difference = relative(mesh, a.elements->radiosity, b.elements->radiosity) / std::sqrt(2.0);
  EXPECT_NEAR(a.elements->noise() / difference, 1, 0.15);
  ASSERT_TRUE(a.error && a.error->gather);
  EXPECT_EQ(*a.error->gather, a.elements->noise());
  EXPECT_NEAR(*a.error->total,
              std::sqrt(std::pow(*a.error->form_factors, 2) + std::pow(*a.error->patches, 2) +
                        std::pow(a.error->solver, 2) + std::pow(*a.error->gather, 2)),
              1e-12);
  // Four times the rays: half the noise, or less.
  const SolvedScene more = solved(random_room(3), 0.8, 0.3, 512, "analytic", 1);
  EXPECT_LT(more.elements->noise(), 0.6 * a.elements->noise());
}

TEST(Elements, AreTheSameBitsOnAnyNumberOfThreads) {
  const Scene scene = random_room(2);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return solved(scene, 0.9, 0.3, 32, "hemisphere").elements->radiosity;
  };
  const BandArray one = run(1);
  EXPECT_TRUE((one == run(4)).all());
}

TEST(Elements, AreToldWhereThePatchesWere) {
  const SolvedScene with = solved(lit_cube(0.5, 0.5, 0.5), 0.5, 0.25),
                    without = solved(lit_cube(0.5, 0.5, 0.5), 0.5, {});
  const SolvedScene::Told elements = with.told_of_setup(0), patches = without.told_of_setup(0);
  EXPECT_EQ(elements.mesh.patch_count(), 20 * 4 + 4);  // the lamp stays whole
  EXPECT_EQ(elements.patch, with.elements->patch);
  EXPECT_EQ(elements.solution.radiosity.rows(), elements.mesh.patch_count());
  EXPECT_EQ(elements.solution.vertex_radiosity.rows(), elements.mesh.vertex_count());
  ASSERT_TRUE(elements.error && patches.error);
  for (Index i = 0; i < elements.mesh.patch_count(); ++i)
    EXPECT_GE((*elements.error)(i, 0), (*patches.error)(elements.patch[i], 0));
  EXPECT_EQ(patches.mesh.patch_count(), 24);
  EXPECT_TRUE(patches.patch.empty());
}

TEST(Elements, LeaveThePatchesWhereTheWorkIsStopped) {
  SceneSettings settings;
  settings.patches = PatchSize{0.5};
  settings.elements = ElementSize{0.1};
  SolveOptions options;
  bool told = false;
  options.progress = [](SolveStage stage, double) { return stage != SolveStage::elements; };
  options.ended = [&](SolveStage stage, const SolvedScene& scene) {
    if (stage == SolveStage::elements) told = !scene.elements;
  };
  const SolvedScene stopped = solve_scene(lit_cube(0.5, 0.5, 0.5), settings, options);
  EXPECT_FALSE(stopped.elements);
  EXPECT_TRUE(told);
  EXPECT_TRUE(stopped.converged());
  EXPECT_EQ(stopped.told_of_setup(0).mesh.patch_count(), 24);
}

/// A closed room of 2 × 2 × 2 m, its ceiling the lamp, with a screen of 40 × 40 small faces, which look up and down in turns.
Scene room_with_scales() {
  MeshBuilder builder;
  builder.use_material(grey("wall", 0.5, 0));
  const Vec3 x = 2 * Vec3::UnitX(), y = 2 * Vec3::UnitY(), z = 2 * Vec3::UnitZ();
  builder.grid(Vec3::Zero(), x, y, 1, 1).grid(Vec3::Zero(), y, z, 1, 1).grid(Vec3::Zero(), z, x, 1, 1);
  builder.grid(x, z, y, 1, 1).grid(y, x, z, 1, 1);
  for (int a = 0; a < 40; ++a)
    for (int b = 0; b < 40; ++b) {
      const Vec3 corner(0.5 + 0.025 * a, 0.5 + 0.025 * b, 1);
      if ((a + b) % 2 == 0)
        builder.grid(corner, 0.02 * Vec3::UnitX(), 0.02 * Vec3::UnitY(), 1, 1);
      else
        builder.grid(corner, 0.02 * Vec3::UnitY(), 0.02 * Vec3::UnitX(), 1, 1);
    }
  builder.use_material(grey("lamp", 0, 1)).grid(z, y, x, 1, 1);
  return scene_of(builder.build());
}

/// Patches of a solve, its light, and what a gather to elements of chosen sizes needs.
struct Gathered {
  SolvedScene scene;
  Visibility visibility;
  explicit Gathered(const Scene& of, double patches = 0.8)
      : scene(solved(of, patches, {})), visibility(scene.patches.mesh) {}
  std::optional<Elements> with(const ElementGather& gather) const {
    return gather_elements(visibility, scene.solution, gather);
  }
};

/// Reflected light of elements, constant in each, against 1,152 rays each at places spread over the patches by area: relative L2.
double error_at_places(const Gathered& gathered, const Elements& elements) {
  std::vector<Sensor> places;
  std::vector<Index> on;
  std::vector<double> b;
  std::mt19937_64 random(4);
  const Eigen::ArrayXd areas = elements.mesh.areas();
  std::discrete_distribution<Index> by_area(areas.data(), areas.data() + areas.size());
  while (places.size() < 500) {
    const Index e = by_area(random);
    if ((elements.mesh.material_of(e).emission > 0).any() || gathered.visibility.covered(elements.patch[e]))
      continue;
    const auto triangles = elements.mesh.triangles(e);
    std::vector<double> share;
    for (const auto& t : triangles)
      share.push_back((elements.mesh.vertex(t[1]) - elements.mesh.vertex(t[0]))
                          .cross(elements.mesh.vertex(t[2]) - elements.mesh.vertex(t[0]))
                          .norm());
    const auto& t = triangles[std::discrete_distribution<std::size_t>(share.begin(), share.end())(random)];
    const double s = std::sqrt(uniform(random)), u = uniform(random);
    places.push_back({(1 - s) * elements.mesh.vertex(t[0]) +
                          s * ((1 - u) * elements.mesh.vertex(t[1]) + u * elements.mesh.vertex(t[2])),
                      elements.mesh.normal(e)});
    on.push_back(elements.patch[e]);
    b.push_back(elements.radiosity(e, 0));
  }
  const SolvedScene& scene = gathered.scene;
  const BandArray h = probe(gathered.visibility, scene.solution.radiosity, scene.solution.vertex_radiosity,
                            places, {.samples = 1152, .seed = 99, .patch = on})
                          .irradiance;
  double error = 0, all = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double exact = scene.patches.mesh.material_of(on[k]).reflectance[0] * h(static_cast<Index>(k), 0);
    error += std::pow(b[k] - exact, 2);
    all += exact * exact;
  }
  return std::sqrt(error / all);
}

TEST(ElementsOfChosenSize, AreWholeWhereTheyEmit) {
  const Gathered furnace(box_on_floor(), 0.5);
  const auto e = furnace.with({});
  ASSERT_TRUE(e);
  EXPECT_EQ(e->mesh.patch_count(), furnace.scene.patches.mesh.patch_count());
  for (Index i = 0; i < e->mesh.patch_count(); ++i)
    EXPECT_NEAR(e->irradiance(i, 0), furnace.visibility.covered(i) ? 0 : 2, 1e-6);
}

TEST(ElementsOfChosenSize, AreSmallAtShadowsAndBetterThanAsManyAlike) {
  const Gathered room(random_room(3));
  const auto chosen = room.with({.variation = 0.03});
  ASSERT_TRUE(chosen);
  EXPECT_TRUE(chosen->adaptive);
  EXPECT_LT(chosen->mesh.areas().minCoeff(), 0.01 * chosen->mesh.areas().maxCoeff());
  Elements alike = *room.with({.size = 0.4});
  for (double size = 0.2; alike.mesh.patch_count() < chosen->mesh.patch_count(); size /= 1.4)
    alike = *room.with({.size = size});
  const double error = error_at_places(room, *chosen);
  EXPECT_LT(error, 0.9 * error_at_places(room, alike));
  EXPECT_LT(error, 0.05);
}

TEST(ElementsOfChosenSize, AreMoreAndBetterTheLessMayDiffer) {
  const Gathered room(random_room(2));
  double error = 1;
  Index count = 0;
  for (const double variation : {0.1, 0.03}) {
    const auto e = room.with({.variation = variation});
    ASSERT_TRUE(e);
    EXPECT_GT(e->mesh.patch_count(), count);
    count = e->mesh.patch_count();
    const double before = std::exchange(error, error_at_places(room, *e));
    EXPECT_LT(error, 0.7 * before);
  }
}

TEST(ElementsOfChosenSize, AreTheSameBitsOnAnyNumberOfThreadsAndWhenResumed) {
  const Gathered room(random_room(2));
  std::vector<PartialProbe> saved;
  ElementGather gather{.variation = 0.03, .samples = 32};
  gather.save = [&](Index done, const std::function<PartialProbe()>& state) {
    saved.push_back(state());
    EXPECT_EQ(saved.back().irradiance.rows(), done);
  };
  const Elements one = [&] {
    const ThreadLimit limit(1);
    return *room.with(gather);
  }();
  ASSERT_GT(saved.size(), 3u);
  gather.save = {};
  for (const std::size_t k : {std::size_t{0}, saved.size() / 2, saved.size() - 1}) {
    gather.partial = std::make_shared<const PartialProbe>(saved[k]);
    const ThreadLimit limit(4);
    const Elements again = *room.with(gather);
    ASSERT_EQ(again.mesh.patch_count(), one.mesh.patch_count());
    EXPECT_TRUE((again.radiosity == one.radiosity).all());
    EXPECT_TRUE((again.standard_error == one.standard_error).all());
  }
}

TEST(ElementsOfChosenSize, AreTheSameHoweverDimTheLight) {
  const PatchMesh mesh = make_patches(lit_cube(0.5, 0.5, 0.5), PatchSize{0.5}).mesh;
  const auto lit_by = [&](double watts) {
    std::vector<Material> materials = mesh.materials();
    for (Material& m : materials) m.emission *= watts;
    const Gathered room(scene_of(mesh.with_materials(materials)));
    return *room.with({.samples = 32});
  };
  const Elements bright = lit_by(1);
  ASSERT_GT(bright.mesh.patch_count(), 5 * mesh.patch_count());
  ASSERT_GT(bright.noise(), 0);
  for (const double watts : {std::exp2(-700), std::exp2(600)}) {
    const Elements e = lit_by(watts);
    ASSERT_EQ(e.mesh.patch_count(), bright.mesh.patch_count());
    EXPECT_TRUE((e.radiosity == watts * bright.radiosity).all());
    EXPECT_DOUBLE_EQ(e.noise(), bright.noise());
  }
}

TEST(ElementsOfChosenSize, AreThoseOfTheRoundsThatWereFinished) {
  const Gathered room(random_room(2));
  ElementGather gather{.variation = 0.05, .samples = 32};
  gather.progress = [](double fraction) { return fraction < 0.6; };
  const auto early = room.with(gather);
  ASSERT_TRUE(early);
  gather.progress = {};
  EXPECT_LT(early->mesh.patch_count(), room.with(gather)->mesh.patch_count());
  for (Index i = 0; i < early->mesh.patch_count(); ++i)
    EXPECT_EQ(early->irradiance(i, 0) > 0, !room.visibility.covered(early->patch[i]));
  gather.progress = [](double) { return false; };
  EXPECT_FALSE(room.with(gather));
}

TEST(ElementsOfChosenSize, LeaveTheMembersOfClustersWholeWhereTheirLightIsAlike) {
  SceneSettings settings;
  settings.patches = PatchSize{0.5};
  settings.elements = AutoElements{};
  const SolvedScene joined = solve_scene(room_with_scales(), settings);
  ASSERT_TRUE(joined.patches.mesh.clustered() && joined.elements && joined.elements->adaptive);
  std::map<Index, int> pieces;
  for (const Index patch : joined.elements->patch) ++pieces[patch];
  Index whole = 0, all = 0;
  for (Index i = 0; i < joined.patches.mesh.patch_count(); ++i)
    if (joined.patches.mesh.area(i) < 0.00041) {
      ++all;
      whole += pieces[i] == 1 ? 1 : 0;
    }
  EXPECT_EQ(all, 1600);
  EXPECT_GT(whole, 1500);
}

TEST(ElementsOfChosenSize, RefuseAVariationThatIsNone) {
  const Gathered cube(lit_cube(0.5, 0.5, 0.5), 0.5);
  for (const double variation : {0.0, -1.0, std::nan("")})
    EXPECT_THROW(cube.with({.variation = variation}), InputError) << variation;
}

TEST(Elements, RefuseSizesThatAreNone) {
  for (const double size : {0.0, -1.0, std::nan(""), 1e-7})
    EXPECT_THROW(solved(lit_cube(0.5, 0.5, 0.5), 0.5, size), InputError) << size;
}

TEST(Elements, OfClustersAreTheirMembersWithTheMeanOfTheSolution) {
  SceneSettings settings;
  settings.patches = PatchSize{0.5};
  const SolvedScene solved = solve_scene(room_with_scales(), settings);
  const PatchMesh& mesh = solved.patches.mesh;
  ASSERT_TRUE(mesh.clustered());
  ASSERT_TRUE(solved.elements);
  const Elements& e = *solved.elements;
  ASSERT_EQ(e.mesh.patch_count(), mesh.patch_count());
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    double mean = 0;
    for (const Index i : mesh.members(c)) mean += mesh.area(i) * e.irradiance(i, 0) / mesh.cluster_areas()[c];
    EXPECT_NEAR(mean, solved.solution.irradiance(mesh.members(c)[0], 0), 1e-9);
  }
  EXPECT_NEAR(solved.solution.energy.imbalance[0], 0, 1e-5);
  ASSERT_TRUE(solved.error && solved.error->total);
  EXPECT_GE(*solved.error->total, e.noise());
  const SolvedScene::Told told = solved.told_of_setup(0);
  ASSERT_EQ(static_cast<Index>(told.patch.size()), mesh.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i)
    EXPECT_EQ(told.patch[static_cast<std::size_t>(i)], mesh.cluster(i));

  settings.elements = NoElements{};
  const SolvedScene bare = solve_scene(room_with_scales(), settings);
  EXPECT_FALSE(bare.elements);
  EXPECT_EQ(bare.told_of_setup(0).patch.size(), told.patch.size());
}

TEST(Elements, OfClustersComeNearWhatEachMemberReceives) {
  // Against exact pairs of all faces by themselves, no patch larger than 10 cm.
  SceneSettings settings;
  settings.patches = PatchSize{0.5};
  settings.element_samples = 512;
  const SolvedScene joined = solve_scene(room_with_scales(), settings);
  settings.elements = NoElements{};
  const SolvedScene bare = solve_scene(room_with_scales(), settings);
  const PatchMesh fine = make_patches(room_with_scales(), PatchSize{0.1}).mesh.with_clusters({});
  const Visibility visibility(fine);
  const FormFactorMatrix f =
      assemble(*find_form_factor_method("hemisphere").make(visibility, {.samples = 1024}), visibility).matrix;
  const Solution reference =
      solve(*find_solver("conjugate-gradient").make(), RadiositySystem(f, fine), fine, SolverOptions{});
  // Faces of the screen are patches in each; the same number, the same face.
  const auto of_screen = [](const PatchMesh& mesh, const BandArray& b, std::map<Index, double>& out) {
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (mesh.area(i) < 0.00041) out[mesh.surface(i)] = b(i, 0);
  };
  std::map<Index, double> exact, gathered, constant;
  of_screen(fine, reference.radiosity, exact);
  of_screen(joined.elements->mesh, joined.elements->radiosity, gathered);
  of_screen(bare.patches.mesh, bare.solution.radiosity, constant);
  ASSERT_EQ(exact.size(), 1600u);
  ASSERT_EQ(gathered.size(), 1600u);
  double square = 0, of_gathered = 0, of_constant = 0;
  for (const auto& [face, b] : exact) {
    square += b * b;
    of_gathered += std::pow(gathered[face] - b, 2);
    of_constant += std::pow(constant[face] - b, 2);
  }
  EXPECT_LT(std::sqrt(of_gathered / square), 0.1);
  EXPECT_LT(of_gathered, of_constant);
}

}  // namespace
}  // namespace radiosity::test
