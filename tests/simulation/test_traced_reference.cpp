// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/traced_reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/simulation/compare.hpp"
#include "radiosity/simulation/probe.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::test {
namespace {

const TraceIrradiance kPaths = [](const auto& mesh, std::span<const Place> places, Index paths,
                                  std::uint64_t seed) {
  return path_traced(mesh, places, paths, seed).irradiance;
};

TracedReference traced(const PatchMesh& mesh, const TraceIrradiance& trace, Index rounds, Index paths,
                       Index patches = 200) {
  const Visibility visibility(mesh);
  TracedReference out(visibility, trace, patches);
  for (Index k = 0; k < rounds; ++k) out.add_round(paths);
  return out;
}

// Irradiances 3 and 5, in turn, are 4 ± 1 in the mean: s² = 1/(n − 1). With ρ = 1/2 and E = 1, B = 1 + 2 has no error, and B = 3.2 errs
// by a tenth of the light, 2.
TEST(TracedReference, TakesNoiseOutOfTheErrorAndTellsItsOwn) {
  MeshBuilder builder;
  const PatchMesh mesh = builder.box({0, 0, 0}, {1, 1, 1}, 2, Facing::inward).build();
  Index calls = 0;
  const TraceIrradiance alternating = [&](const auto&, std::span<const Place> places, Index, std::uint64_t) {
    return BandArray(BandArray::Constant(static_cast<Eigen::Index>(places.size()), 1, ++calls % 2 ? 3 : 5));
  };
  const TracedReference reference = traced(mesh, alternating, 10, 1);
  EXPECT_EQ(reference.patches(), 200);
  EXPECT_NEAR(reference.noise(), std::sqrt(1.0 / 9) / 4, 1e-12);
  BandArray b = BandArray::Constant(mesh.patch_count(), 1, 3);
  EXPECT_EQ(reference.error(b).rms, 0);
  b.setConstant(3.4);  // d² − s² = 0.16 − 0.25/9, over 4 − 0.25/9
  EXPECT_NEAR(reference.error(b).rms, std::sqrt((0.16 - 0.25 / 9) / (4 - 0.25 / 9)), 1e-12);
  EXPECT_NEAR(reference.error(b).mean, 0.2, 1e-12);
  EXPECT_NEAR(reference.error(b).mean_standard_error, 0, 1e-12);
  EXPECT_THROW(reference.error(BandArray::Zero(3, 1)), InputError);
  EXPECT_THROW(traced(mesh, alternating, 1, 1).error(b), InputError);
  EXPECT_THROW(traced(mesh, alternating, 2, 1, 1), InputError);
}

// Irradiance of each member its height, over clusters of the faces of a ball: means by area.
TEST(TracedReference, TakesMeansOverClusters) {
  MeshBuilder builder;
  const PatchMesh faces =
      builder.use_material(grey("ball", 0.5, 0)).sphere({0, 0, 3}, 1, 2, Facing::inward).build();
  std::vector<Index> octants;
  for (Index i = 0; i < faces.patch_count(); ++i) {
    const Vec3 side = faces.centroid(i) - Vec3(0, 0, 3);
    octants.push_back((side.x() > 0 ? 1 : 0) + (side.y() > 0 ? 2 : 0) + (side.z() > 0 ? 4 : 0));
  }
  const PatchMesh mesh = faces.with_clusters(octants);
  ASSERT_EQ(mesh.cluster_count(), 8);
  BandArray b(mesh.patch_count(), 1);  // ρ = 1/2
  for (Index c = 0; c < 8; ++c) {
    double sum = 0;
    for (const Index i : mesh.members(c)) sum += mesh.area(i) * mesh.centroid(i).z();
    for (const Index i : mesh.members(c)) b(i, 0) = sum / mesh.cluster_areas()[c] / 2;
  }
  const TraceIrradiance height = [](const auto& on, std::span<const Place> places, Index, std::uint64_t) {
    BandArray out(static_cast<Eigen::Index>(places.size()), 1);
    for (std::size_t k = 0; k < places.size(); ++k)
      out(static_cast<Eigen::Index>(k), 0) = on->centroid(places[k].patch).z();
    return out;
  };
  const TracedReference reference = traced(mesh, height, 16, 1024, 8);
  EXPECT_EQ(reference.patches(), 8);
  EXPECT_GT(reference.noise(), 1e-4);
  EXPECT_NEAR(reference.error(b).mean, 0, 4 * reference.noise());
  EXPECT_LT(reference.error(b).rms, 4 * reference.noise());
  EXPECT_NEAR(reference.error(1.1 * b).rms, 0.1, 4 * reference.noise());
}

// B = E/(1 − ρ) = 2: paths find it, and find what was added.
TEST(TracedReference, FindsTheFurnaceExactAndWhatWasAddedToIt) {
  const PatchMesh mesh = cube_room(4);
  const TracedReference reference = traced(mesh, kPaths, 16, 64);
  BandArray b = BandArray::Constant(mesh.patch_count(), 1, 2);
  const TracedError none = reference.error(b);
  EXPECT_LE(none.rms, 3 * none.standard_error);
  EXPECT_LE(std::abs(none.mean), 4 * none.mean_standard_error);
  b += 0.1;  // a tenth of what is reflected
  const TracedError added = reference.error(b);
  EXPECT_NEAR(added.rms, 0.1, 4 * added.standard_error);
  EXPECT_NEAR(added.mean, 0.1, 4 * added.mean_standard_error);
}

TEST(TracedReference, AgreesWithWhatComparisonsSayOfTheirReferences) {
  for (const bool cornell : {false, true}) {
    CompareOptions options;
    options.budget_s = cornell ? 4 : 2;
    options.trace = kPaths;
    const Comparison all = cornell ? compare(closed_cornell_box(), PatchSize{0.12}, options)
                                   : compare(lit_cube(0.2, 0.7, 0.5), PatchSize{0.25}, options);
    EXPECT_EQ(all.tracing.has_value(), all.factors.traced.has_value());
    if (!all.tracing) continue;  // a slow machine leaves out what the budget does not hold
    if (all.finer) {
      const TracedError& finest = *all.finer->traced;
      EXPECT_LE(finest.rms, 2 * all.finer->own_error() + 3 * finest.standard_error);
      EXPECT_LE(std::abs(finest.mean), 2 * all.finer->own_error() + 4 * finest.mean_standard_error);
    }
    for (const ComparedRun& run : all.runs) {
      EXPECT_EQ(run.traced.has_value(), run.factors.has_value());
      const auto most = error_at_most(all, run);
      if (!run.traced || !run.total) continue;
      EXPECT_LE(run.traced->rms, *most + 4 * run.traced->standard_error) << run.method;
      EXPECT_GE(run.traced->rms, 2 * run.total->rms - *most - 4 * run.traced->standard_error) << run.method;
    }
    for (const SolverRun& run : all.solvers) EXPECT_EQ(run.traced.has_value(), run.left_out.empty());
  }
}

/// Half of the places on surfaces, evenly by area, half in the room, facing anywhere; none inside of a block.
std::vector<Place> places_in(const Visibility& visibility, Index count) {
  const PatchMesh& mesh = visibility.mesh();
  std::mt19937_64 random(5);
  const auto draw = [&] { return uniform(random); };
  std::vector<Place> places;
  while (static_cast<Index>(places.size()) < count) {
    if (places.size() % 2 == 0) {
      double where = draw() * mesh.areas().sum();
      Index j = 0;
      while (j + 1 < mesh.patch_count() && where >= mesh.area(j)) where -= mesh.area(j++);
      const Vec3 x = PatchSampler(mesh, j).at({draw(), draw()});
      if (visibility.first_hit(x + 1e-4 * mesh.normal(j), mesh.normal(j)).front)
        places.push_back({x, mesh.normal(j), j});
    } else {
      const Vec3 x = mesh.lower() + Vec3(draw(), draw(), draw()).cwiseProduct(mesh.upper() - mesh.lower());
      const double z = 2 * draw() - 1, angle = 2 * std::numbers::pi * draw(), r = std::sqrt(1 - z * z);
      if (visibility.first_hit(x, Vec3::UnitZ()).front)
        places.push_back({x, {r * std::cos(angle), r * std::sin(angle), z}, Visibility::kNothing});
    }
  }
  return places;
}

TEST(PathTracing, AgreesWithProbesOfASolutionAtTwoHundredPointsOfTheClosedCornellBox) {
  const Scene scene = closed_cornell_box();
  const auto faces = std::make_shared<const PatchMesh>(make_patches(scene, KeepFaces{}).mesh);
  const std::vector<Place> places = places_in(Visibility(*faces), 200);
  std::vector<Sensor> sensors;
  for (const Place& place : places) sensors.push_back({place.position, place.normal});

  SceneSettings settings;
  settings.patches = PatchSize{0.04};
  SolveOptions options;
  options.estimate_error = false;
  const SolvedScene solved = solve_scene(scene, settings, options);
  const PatchMesh& mesh = solved.patches.mesh;
  ProbeOptions rays;
  rays.samples = 4608;
  const ProbeResult probed =
      probe(Visibility(mesh), solved.solution.radiosity, solved.solution.vertex_radiosity, sensors, rays);
  const PathTraced traced = path_traced(faces, places, 4000);

  for (Eigen::Index b = 0; b < 3; ++b) {
    const double mean = traced.irradiance.col(b).mean();
    const double noise = std::sqrt(traced.standard_error.col(b).square().sum()) / 200;
    EXPECT_NEAR(probed.irradiance.col(b).mean(), mean, 2 * noise + 0.001 * mean);
    // Each of 200: none beyond four standard errors, and they are as large as they are said to be.
    const Eigen::ArrayXd error = (probed.irradiance.col(b) - traced.irradiance.col(b)).abs();
    const Eigen::ArrayXd stated =
        (traced.standard_error.col(b).square() + probed.standard_error.col(b).square()).sqrt();
    EXPECT_LE((error - 4 * stated).maxCoeff(), 0.001 * mean);
    EXPECT_LE((error / stated).square().mean(), 1.4);
  }
}

}  // namespace
}  // namespace radiosity::test
