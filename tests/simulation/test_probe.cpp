// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/probe.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cases/closed_forms.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity::test {
namespace {

const Vec3 kUp = Vec3::UnitZ();

/// Radiosities given for patches, those of vertices reconstructed.
ProbeResult measure(const PatchMesh& mesh, const BandArray& radiosity, const std::vector<Sensor>& sensors,
                    const ProbeOptions& options = {}) {
  const Visibility visibility(mesh);
  return probe(visibility, radiosity, vertex_values(mesh, radiosity), sensors, options);
}

ProbeOptions with_samples(Index samples, std::uint64_t seed = 1) {
  ProbeOptions options;
  options.samples = samples;
  options.seed = seed;
  return options;
}

/// The closed Cornell box with lamps that emit and some radiosity, neither even nor smooth, on all patches.
struct LitBox {
  LitBox()
      : patches(make_patches(closed_cornell_box(), PatchSize{0.11})), radiosity(patches.mesh.emission()) {
    const PatchMesh& mesh = patches.mesh;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      const Vec3& c = mesh.centroid(i);
      for (Index b = 0; b < 3; ++b)
        radiosity(i, b) += (0.2 + 0.1 * b + 0.5 * c.x() + c.y() * c.z() + (c.z() > 0.2 ? 0.1 : 0)) *
                           mesh.material_of(i).reflectance[b];
    }
  }
  static std::vector<Sensor> sensors() {
    return {{{0.2, 0.1, 0}, kUp},           {{0.05, 0.4, 0}, kUp},         {{0.5, 0.5, 0.3}, {-1, -0.3, 0.2}},
            {{0.37, 0.16, 0.165}, kUp},     {{0, 0.2, 0.3}, {1, 0, 0}},    {{0.275, 0.05, 0.5}, {0, 1, -1}},
            {{0.08, 0.5, 0.1}, {1, -1, 0}}, {{0.5, 0.02, 0.02}, {0, 0, 1}}};
  }
  Patches patches;
  BandArray radiosity;
};

TEST(Probe, GoesOnWithSensorsOfAnEarlierRunToTheSameBits) {
  const LitBox box;
  const std::vector<Sensor> sensors = LitBox::sensors();
  ProbeOptions options = with_samples(128);
  const ProbeResult whole = measure(box.patches.mesh, box.radiosity, sensors, options);
  PartialProbe state;
  options.save = [&](Index done, const std::function<PartialProbe()>& copy) {
    EXPECT_EQ(done, 8);
    state = copy();
  };
  measure(box.patches.mesh, box.radiosity, sensors, options);
  options.save = {};
  for (const Index done : {3, 8}) {
    options.partial = std::make_shared<const PartialProbe>(
        PartialProbe{state.irradiance.topRows(done), state.standard_error.topRows(done)});
    const ProbeResult resumed = measure(box.patches.mesh, box.radiosity, sensors, options);
    EXPECT_TRUE((resumed.irradiance == whole.irradiance).all());
    EXPECT_TRUE((resumed.standard_error == whole.standard_error).all());
  }
  options.partial =
      std::make_shared<const PartialProbe>(PartialProbe{BandArray::Zero(9, 3), BandArray::Zero(9, 3)});
  EXPECT_THROW(measure(box.patches.mesh, box.radiosity, sensors, options), InputError);
}

// B = 2 everywhere: H = 2 wherever the sensor stands and whatever emits.
TEST(Probe, InAFurnaceIsExact) {
  const std::vector<Sensor> sensors = {{{0.2, 0.3, 0.1}, {1, 2, 3}},  {{0.7, 0.2, 0}, kUp},
                                       {{0, 0.5, 0.5}, {1, 0, 0}},    {{0, 0.5, 0.5}, {0, 0, 1}},
                                       {{0, 0, 0}, {1, 1, 1}},        {{0.45, 0.5, 0.7}, kUp},
                                       {{0.45, 0.5, 0.2}, {0, 0, 1}}, {{0.9, 0.9, 0.9}, {0, -1, 0.1}}};
  for (const double emission : {0.0, 1.0}) {
    PatchMesh mesh = MeshBuilder()
                         .use_material(grey("walls", 0.5, 1))
                         .box({0, 0, 0}, {1, 1, 1}, 4, Facing::inward)
                         .use_material(grey("box", 0.5, emission))
                         .box({0.3, 0.3, 0.4}, {0.6, 0.65, 0.7}, 2, Facing::outward)
                         .build();
    const ProbeResult h = measure(mesh, BandArray::Constant(mesh.patch_count(), 1, 2), sensors);
    EXPECT_TRUE(h.completed);
    for (Eigen::Index s = 0; s < h.irradiance.rows(); ++s) {
      EXPECT_NEAR(h.irradiance(s, 0), 2, 1e-8) << s;
      EXPECT_LE(h.standard_error(s, 0), 1e-8) << s;
    }
  }
}

// Element parallel to a unit square at distance 1 [Howell, B-3].
TEST(Probe, UnderARectangularLampIsTheClosedForm) {
  const PatchMesh mesh = MeshBuilder()
                             .use_material(grey("lamp", 0, 3))
                             .grid({0, 0, 1}, Vec3::UnitY(), Vec3::UnitX(), 3, 2)
                             .build();
  const ProbeResult h = measure(mesh, mesh.emission(), {{{0, 0, 0}, kUp}, {{0.5, 0.5, 0}, 7 * kUp}});
  EXPECT_NEAR(h.irradiance(0, 0), 3 * 0.138531605994893, 1e-12);
  EXPECT_NEAR(h.irradiance(1, 0), 3 * 0.239456470460774, 1e-12);
  EXPECT_EQ(h.standard_error.maxCoeff(), 0);
}

// A black screen at half the height that ends above the sensor hides half of the lamp; a wider one all of it.
TEST(Probe, OfAHalfHiddenLampIsTheVisiblePart) {
  const auto screened = [](double x, double width) {
    return MeshBuilder()
        .use_material(grey("lamp", 0, 1))
        .grid({0, 0, 1}, Vec3::UnitY(), Vec3::UnitX(), 3, 3)
        .use_material(grey("screen", 0, 0))
        .grid({x, -1, 0.5}, 3 * Vec3::UnitY(), width * Vec3::UnitX(), 2, 2)
        .build();
  };
  const PatchMesh half = screened(-1, 1.5);
  EXPECT_NEAR(measure(half, half.emission(), {{{0.5, 0.5, 0}, kUp}}).irradiance(0, 0), 0.239456470460774 / 2,
              1e-12);
  const PatchMesh all = screened(-1, 3);
  EXPECT_EQ(measure(all, all.emission(), {{{0.5, 0.5, 0}, kUp}}).irradiance(0, 0), 0);
}

// One patch sends what 40 × 40 patches send in the same linear field, and not what its mean alone would.
TEST(Probe, ReconstructsALinearFieldInsideOfPatches) {
  const auto field = [](const Vec3& x) { return 2 + x.x() - 0.5 * x.y(); };
  const auto wall = [&](Index n, BandArray& patch, BandArray& vertex) {
    PatchMesh mesh = MeshBuilder()
                         .use_material(grey("wall", 0.5, 0))
                         .grid({0, 0, 1}, Vec3::UnitY(), Vec3::UnitX(), n, n)
                         .build();
    patch.resize(mesh.patch_count(), 1);
    vertex.resize(mesh.vertex_count(), 1);
    for (Index i = 0; i < mesh.patch_count(); ++i) patch(i, 0) = field(mesh.centroid(i));
    for (Index v = 0; v < mesh.vertex_count(); ++v) vertex(v, 0) = field(mesh.vertex(v));
    return mesh;
  };
  const std::vector<Sensor> sensors = {{{0.2, 0.3, 0.4}, kUp}};
  std::array<double, 2> h{}, error{};
  for (std::size_t k = 0; k < 2; ++k) {
    BandArray patch, vertex;
    const PatchMesh mesh = wall(k == 0 ? 1 : 40, patch, vertex);
    const Visibility visibility(mesh);
    const ProbeResult result = probe(visibility, patch, vertex, sensors, with_samples(1 << 17));
    h[k] = result.irradiance(0, 0);
    error[k] = result.standard_error(0, 0);
  }
  const double c = 0.6;  // the height of the wall over the sensor; four rectangles meet above it
  const double factor = element_under_corner(0.2, 0.3, c) + element_under_corner(0.8, 0.3, c) +
                        element_under_corner(0.2, 0.7, c) + element_under_corner(0.8, 0.7, c);
  EXPECT_GT(std::abs(h[0] - field({0.5, 0.5, 1}) * factor), 20 * error[0]);
  EXPECT_NEAR(h[0], h[1], 5 * std::hypot(error[0], error[1]));
}

TEST(Probe, StatesItsStandardErrorHonestly) {
  const LitBox box;
  const Visibility visibility(box.patches.mesh);
  const BandArray vertex = vertex_values(box.patches.mesh, box.radiosity);
  const std::vector<Sensor> sensors = LitBox::sensors();
  const BandArray exact =
      probe(visibility, box.radiosity, vertex, sensors, with_samples(1 << 18, 99)).irradiance;
  constexpr int kRuns = 100;
  BandArray bias = BandArray::Zero(exact.rows(), exact.cols()), squares = bias, stated = bias;
  for (int run = 0; run < kRuns; ++run) {
    const ProbeResult h =
        probe(visibility, box.radiosity, vertex, sensors, with_samples(288, static_cast<std::uint64_t>(run)));
    bias += (h.irradiance - exact) / kRuns;
    squares += (h.irradiance - exact).square() / kRuns;
    stated += h.standard_error.square() / kRuns;
  }
  for (Eigen::Index s = 0; s < exact.rows(); ++s)
    for (Eigen::Index b = 0; b < exact.cols(); ++b) {
      EXPECT_LT(std::abs(bias(s, b)), 4.5 * std::sqrt(stated(s, b) / kRuns)) << s;
      // A variance from 100 values: relative standard error √(2/100).
      EXPECT_NEAR(squares(s, b) / stated(s, b), 1, 4.5 * std::sqrt(2.0 / kRuns)) << s;
    }
  EXPECT_NEAR((squares / stated).col(0).mean(), 1, 4.5 * std::sqrt(2.0 / kRuns / 8));
}

TEST(Probe, GivesTheSameBitsForAnyNumberOfThreads) {
  const LitBox box;
  std::vector<Sensor> sensors;
  for (int k = 0; k < 20; ++k)
    for (const Sensor& sensor : LitBox::sensors()) sensors.push_back(sensor);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return measure(box.patches.mesh, box.radiosity, sensors, with_samples(128));
  };
  const ProbeResult one = run(1), four = run(4);
  EXPECT_TRUE((one.irradiance == four.irradiance).all());
  EXPECT_TRUE((one.standard_error == four.standard_error).all());
  // Every sensor has a stream of its own.
  EXPECT_NE(one.irradiance(0, 0), one.irradiance(8, 0));
}

TEST(Probe, DependsNeitherOnPlaceNorOnDirectionNorOnUnits) {
  const LitBox box;
  const std::vector<Sensor> sensors = LitBox::sensors();
  const ProbeOptions options = with_samples(8192);
  const ProbeResult here = measure(box.patches.mesh, box.radiosity, sensors, options);
  const Eigen::Affine3d turned(Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()));
  for (const Eigen::Affine3d& motion :
       {Eigen::Affine3d(Eigen::Translation3d(1e6, -2e6, 1e6)), turned, Eigen::Affine3d(Eigen::Scaling(1e3)),
        Eigen::Affine3d(Eigen::Scaling(1e-3))}) {
    std::vector<Sensor> moved;
    for (const Sensor& s : sensors) moved.push_back({motion * s.position, motion.linear() * s.normal});
    const ProbeResult there = measure(transformed(box.patches.mesh, motion), box.radiosity, moved, options);
    const BandArray error = (here.standard_error.square() + there.standard_error.square()).sqrt();
    EXPECT_LT(((here.irradiance - there.irradiance).abs() / error).maxCoeff(), 4.5)
        << here.irradiance << "\n\n"
        << there.irradiance << "\n\n"
        << error << "\n"
        << motion.matrix();
    // Without what rays find, nothing but rounding is left: positions of 1e6 m carry 1e-10 m.
    const auto lamps_alone = [&](const PatchMesh& mesh, const std::vector<Sensor>& at) {
      return measure(mesh, mesh.emission(), at, options).irradiance;
    };
    const BandArray a = lamps_alone(box.patches.mesh, sensors),
                    b = lamps_alone(transformed(box.patches.mesh, motion), moved);
    EXPECT_LT((a - b).abs().maxCoeff(), 1e-7 * a.maxCoeff());
  }
}

TEST(Probe, IsProportionalHoweverMuchOrLittleIsEmitted) {
  // Powers of two change no bits; the squares of 2^1000 and of 2^-900 are beyond what a double holds.
  const LitBox box;
  const ProbeResult one = measure(box.patches.mesh, box.radiosity, LitBox::sensors(), with_samples(128));
  ASSERT_GT(one.standard_error.maxCoeff(), 0);
  for (const double unit : {0x1p1000, 0x1p-900}) {
    const ProbeResult other =
        measure(box.patches.mesh, unit * box.radiosity, LitBox::sensors(), with_samples(128));
    EXPECT_TRUE((other.irradiance == unit * one.irradiance).all()) << unit;
    EXPECT_TRUE((other.standard_error == unit * one.standard_error).all()) << unit;
  }
}

// What lies on a surface sees what a place just in front of it sees.
TEST(Probe, OnASurfaceIsThatJustInFrontOfIt) {
  const LitBox box;
  const BandArray lamps = box.patches.mesh.emission();
  for (const auto& [x, n, front] :
       {std::tuple{Vec3(0.2, 0.1, 0), kUp, kUp}, std::tuple{Vec3(0.37, 0.16, 0.165), kUp, kUp},
        std::tuple{Vec3(0, 0.2, 0.3), Vec3(1, 0, 0), Vec3(1, 0, 0)},
        std::tuple{Vec3(0, 0.2, 0.3), kUp, Vec3(1, 0, 0)},
        std::tuple{Vec3(0.2, 0.1, 0), Vec3(0.8, 0, 0.6), kUp}}) {
    const double h = measure(box.patches.mesh, lamps, {{x, n}}).irradiance(0, 0);
    EXPECT_GT(h, 0.1);
    EXPECT_NEAR(measure(box.patches.mesh, lamps, {{x + 1e-5 * front, n}}).irradiance(0, 0), h, 1e-3 * h);
  }
}

TEST(Probe, RefusesWhatIsNoSensor) {
  const PatchMesh mesh = cube_room(1);
  const BandArray b = mesh.emission();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](const Sensor& sensor, const ProbeOptions& options = {}) {
    EXPECT_THROW(measure(mesh, b, {{{0.5, 0.5, 0.5}, kUp}, sensor}, options), InputError);
  };
  refused({{0.5, nan, 0.5}, kUp});
  refused({{0.5, 0.5, 0.5}, {0, 0, 0}});
  refused({{0.5, 0.5, 0.5}, {0, nan, 1}});
  refused({{0.5, 0.5, 0.5}, kUp}, with_samples(0));
  const Visibility visibility(mesh);
  EXPECT_THROW(probe(visibility, b, b, {}), InputError);  // as many vertices as patches
}

TEST(Probe, StopsWhenAskedTo) {
  ProbeOptions options;
  options.progress = [](double) { return false; };
  const PatchMesh mesh = cube_room(1);
  const std::vector<Sensor> sensors(1000, {{0.5, 0.5, 0.5}, kUp});
  EXPECT_FALSE(measure(mesh, mesh.emission(), sensors, options).completed);
}

/// Means over the floor of the unit cube (cases R10) of something measured at places that are spread evenly.
template <class F>
std::pair<double, double> floor_mean(F&& f, int places) {
  std::mt19937_64 random(3);
  double sum = 0, squares = 0;
  for (int k = 0; k < places; ++k) {
    const double h = f(Sensor{{uniform(random), uniform(random), 0}, kUp});
    sum += h / places;
    squares += h * h / places;
  }
  return {sum, std::sqrt((squares - sum * sum) / places)};
}

// Ceiling E = 1, ρ = 0.5 everywhere: mean B of the floor 0.17121605, so H = 0.3424321.
constexpr double kFloorIrradiance = 0.17121605 / 0.5;

PatchMesh patched_cube(Index n) {
  return MeshBuilder()
      .use_material(grey("wall", 0.5, 0))
      .grid({0, 0, 0}, Vec3::UnitX(), Vec3::UnitY(), n, n)
      .grid({0, 0, 0}, Vec3::UnitY(), kUp, n, n)
      .grid({1, 0, 0}, kUp, Vec3::UnitY(), n, n)
      .grid({0, 0, 0}, kUp, Vec3::UnitX(), n, n)
      .grid({0, 1, 0}, Vec3::UnitX(), kUp, n, n)
      .use_material(grey("ceiling", 0.5, 1))
      .grid({0, 0, 1}, Vec3::UnitY(), Vec3::UnitX(), n, n)
      .build();
}

TEST(Probe, InALitCubeFindsTheExactMean) {
  const PatchMesh mesh = patched_cube(8);
  const Visibility visibility(mesh);
  const auto method = find_form_factor_method("analytic").make(visibility);
  const FormFactorMatrix f = assemble(*method, visibility).matrix;
  const Solution solution = solve(*find_solver("conjugate-gradient").make(), RadiositySystem(f, mesh), mesh);
  const auto [mean, error] = floor_mean(
      [&](const Sensor& sensor) {
        return probe(visibility, solution.radiosity, solution.vertex_radiosity, std::span(&sensor, 1))
            .irradiance(0, 0);
      },
      2000);
  EXPECT_NEAR(mean, kFloorIrradiance, 4 * error);
}

}  // namespace
}  // namespace radiosity::test
