// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/sensors.hpp"

#include <gmock/gmock.h>

#include "io/files.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

TEST(ReadSensors, GivesPositionsAsTheyAreAndDirectionsOfLengthOne) {
  const TemporaryDirectory directory;
  const auto file = directory.write("P.txt", "1e-3 -2 300.25 0 3 -4 # first\n\n \t\n#\n+5 6 7 1e-200 0 0");
  const std::vector<Sensor> sensors = read_sensors(file);
  ASSERT_EQ(sensors.size(), 2U);
  EXPECT_EQ(sensors[0].position, Vec3(1e-3, -2, 300.25));
  EXPECT_TRUE(sensors[0].normal.isApprox(Vec3(0, 0.6, -0.8), 1e-15));
  EXPECT_EQ(sensors[1].position, Vec3(5, 6, 7));
  EXPECT_EQ(sensors[1].normal, Vec3(1, 0, 0));
}

TEST(WriteIrradiance, HasAColumnPairPerBandAndPositionsToTheLastDigit) {
  const TemporaryDirectory directory;
  const auto file = directory / "H.csv";
  ProbeResult result;
  result.irradiance.resize(1, 2);
  result.irradiance << 1.5, 2;
  result.standard_error.resize(1, 2);
  result.standard_error << 0.25, 0;
  const std::vector<Sensor> sensors = {{{0.1, 1.0 / 3, -2}, {0, 0, 1}}};
  write_irradiance(file, sensors, result);
  EXPECT_EQ(read_text(file),
            "x,y,z,nx,ny,nz,irradiance_0,irradiance_1,standard_error_0,standard_error_1\n"
            "0.1,0.3333333333333333,-2,0,0,1,1.5,2,0.25,0\n");
  EXPECT_THROW(write_irradiance(file, {}, result), InputError);
}

}  // namespace
}  // namespace radiosity::test
