// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/radiosity_system.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "cases/matrices.hpp"
#include "cases/scenes.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity::test {
namespace {

using testing::HasSubstr;

FormFactorMatrix facing_pair() {
  Eigen::MatrixXd f(2, 2);
  f << 0, 0.5, 0.25, 0;  // A = 1, 2
  return dense_matrix(f);
}
const Eigen::ArrayXd kAreas = Eigen::Array2d(1, 2);

BandArray column(double first, double second) {
  BandArray a(2, 1);
  a << first, second;
  return a;
}

std::string message_of(const auto& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

TEST(RadiositySystem, RefusesReflectancesOutsideZeroToOneAndNamesThem) {
  const FormFactorMatrix f = facing_pair();
  EXPECT_THAT(message_of([&] { RadiositySystem(f, kAreas, column(0.5, 1.2), column(1, 0)); }),
              HasSubstr("1.2"));
  EXPECT_THAT(message_of([&] { RadiositySystem(f, kAreas, column(-0.25, 1), column(1, 0)); }),
              HasSubstr("-0.25"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(RadiositySystem(f, kAreas, column(nan, 1), column(1, 0)), InputError);
}

TEST(RadiositySystem, RefusesEmissionsThatAreNegativeOrNotFinite) {
  const FormFactorMatrix f = facing_pair();
  EXPECT_THAT(message_of([&] { RadiositySystem(f, kAreas, column(0.5, 0.5), column(1, -3)); }),
              HasSubstr("-3"));
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_THROW(RadiositySystem(f, kAreas, column(0.5, 0.5), column(infinity, 0)), InputError);
  EXPECT_THROW(RadiositySystem(f, kAreas, column(0.5, 0.5), column(0, infinity - infinity)), InputError);
}

TEST(RadiositySystem, RefusesAreasThatAreNotPositive) {
  const FormFactorMatrix f = facing_pair();
  EXPECT_THROW(RadiositySystem(f, Eigen::Array2d(1, 0), column(0.5, 0.5), column(1, 0)), InputError);
  EXPECT_THROW(RadiositySystem(f, Eigen::Array2d(-1, 2), column(0.5, 0.5), column(1, 0)), InputError);
}

TEST(RadiositySystem, RefusesShapesThatDoNotFit) {
  const FormFactorMatrix f = facing_pair();
  EXPECT_THROW(RadiositySystem(f, Eigen::Array3d(1, 1, 1), column(0.5, 0.5), column(1, 0)), InputError);
  EXPECT_THROW(RadiositySystem(f, kAreas, BandArray::Ones(3, 1), column(1, 0)), InputError);
  EXPECT_THROW(RadiositySystem(f, kAreas, column(0.5, 0.5), BandArray::Ones(2, 3)), InputError);
  EXPECT_THROW(RadiositySystem(f, cube_room(1)), InputError) << "six patches, two rows of F";
}

TEST(RadiositySystem, TakesReflectanceEmissionAndAreasFromTheMesh) {
  const Material lamp{"lamp", Eigen::Array2d(0.25, 0.5), Eigen::Array2d(3, 4)};
  const Material wall{"wall", Eigen::Array2d(0.75, 0.125), Eigen::Array2d(0, 0)};
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder()
                             .use_material(lamp)
                             .grid({0, 0, 0}, x, y, 1, 1)
                             .use_material(wall)
                             .grid({0, 0, 1}, 2 * y, x, 1, 1)
                             .build();
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, mesh);
  EXPECT_EQ(system.size(), 2);
  EXPECT_EQ(system.bands(), 2);
  EXPECT_DOUBLE_EQ(system.areas()[1], 2);
  EXPECT_EQ(system.reflectance()(0, 1), 0.5);
  EXPECT_EQ(system.reflectance()(1, 0), 0.75);
  EXPECT_EQ(system.emission()(0, 0), 3);
  EXPECT_EQ(system.emission()(1, 1), 0);
}

TEST(RadiositySystem, GathersIrradianceFromAllPatches) {
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0.5, 0.5), column(1, 0));
  const BandArray h = system.irradiance(column(8, 4));
  EXPECT_EQ(h(0, 0), 2);  // 0.5 · 4
  EXPECT_EQ(h(1, 0), 2);  // 0.25 · 8
}

TEST(RadiositySystem, RefusesAnExternalIrradianceThatIsNone) {
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0.5, 0.25), column(7, 3.5));
  EXPECT_EQ(system.with_external_irradiance(column(2, 4)).source()(1, 0), 3.5 + 0.25 * 4);
  EXPECT_EQ(system.with_external_irradiance(column(2, 4)).irradiance(column(0, 0))(0, 0), 2);
  EXPECT_THAT(message_of([&] { (void)system.with_external_irradiance(column(0, -1)); }),
              HasSubstr("patch 1, band 0: external irradiance -1"));
  EXPECT_THAT(message_of([&] { (void)system.with_external_irradiance(BandArray::Zero(3, 1)); }),
              HasSubstr("3 × 1 values for 2 patches and 1 bands"));
}

TEST(EnergyBalance, SplitsWhatIsEmittedIntoAbsorbedAndEscaped) {
  // B = (8, 4), H = (2, 2), A = (1, 2), ρ = (0.5, 0.25), escaped fractions 0.5 and 0.75.
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0.5, 0.25), column(7, 3.5));
  const BandArray b = column(8, 4);
  const EnergyBalance energy = energy_balance(system, b, system.irradiance(b));
  EXPECT_DOUBLE_EQ(energy.emitted_w[0], 1 * 7 + 2 * 3.5);
  EXPECT_DOUBLE_EQ(energy.absorbed_w[0], 1 * 0.5 * 2 + 2 * 0.75 * 2);
  EXPECT_DOUBLE_EQ(energy.escaped_w[0], 1 * 8 * 0.5 + 2 * 4 * 0.75);
  // B = E + ρH holds here (7 + 1 and 3.5 + 0.5), so nothing is missing.
  EXPECT_NEAR(energy.imbalance[0], 0, 1e-15);
}

TEST(EnergyBalance, ShowsWhatIsMissing) {
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0.5, 0.25), column(7, 3.5));
  const BandArray none = column(0, 0);
  EXPECT_DOUBLE_EQ(energy_balance(system, none, none).imbalance[0], 1);
}

TEST(EnergyBalance, RefusesPowersThatNoDoubleHolds) {
  // 1e308 W/m² from 2 m² are 2e308 W; the largest double is 1.8e308.
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0, 0), column(0, 1e308));
  const BandArray b = system.emission();
  EXPECT_THAT(message_of([&] { energy_balance(system, b, system.irradiance(b)); }),
              HasSubstr("the power exceeds what a double holds"));
}

TEST(EnergyBalance, IsZeroWhereNothingIsEmitted) {
  const FormFactorMatrix f = facing_pair();
  const RadiositySystem system(f, kAreas, column(0.5, 0.25), column(0, 0));
  EXPECT_EQ(energy_balance(system, column(0, 0), column(0, 0)).imbalance[0], 0);
}

}  // namespace
}  // namespace radiosity::test
