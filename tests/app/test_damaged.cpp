// SPDX-License-Identifier: GPL-3.0-or-later
// Files as modelling programs write them, in tests/data/damaged: what comes out is what was meant.
#include <string>

#include "app/program.hpp"

namespace radiosity::testing {
namespace {

class Damaged : public ProgramTest, public ::testing::WithParamInterface<std::string> {
 protected:
  SolvedMesh solved(const std::string& name, const std::string& size) const {
    const std::string file = std::string(RADIOSITY_SOURCE_DIR) + "/tests/data/damaged/" + name;
    const Outcome outcome = run({"solve", file, "-o", "out.vtp", "--patch-size", size, "--method", GetParam(),
                                 "--no-error-estimate"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return read_solution(folder() / "out.vtp");
  }
  // How far sampled methods may be off on so few patches.
  static double noise() { return GetParam() == "analytic" ? 1e-3 : 1e-2; }
  static void expect_mean(const SolvedMesh& solved, const std::string& material, double value, double share) {
    EXPECT_NEAR(mean_radiosity(solved, material), value, share * value) << material;
  }
};
INSTANTIATE_TEST_SUITE_P(All, Damaged, ::testing::Values("analytic", "hemisphere", "hemicube"),
                         [](const auto& method) { return method.param; });

TEST_P(Damaged, ATiltedLampOfSixDecimalsShines) {
  const SolvedMesh exact = solved("lamp-quad/exact.obj", "1"), rounded = solved("lamp-quad/rounded.obj", "1");
  for (const std::string material : {"w", "floor", "ceil"})
    expect_mean(rounded, material, mean_radiosity(exact, material), noise());
}

TEST_P(Damaged, AFloorWithACornerAMicrometreUpIsLit) {
  const SolvedMesh plain = solved("polygons/plain.obj", "0.5"), up = solved("polygons/corner-up.obj", "0.5");
  expect_mean(plain, "floor", 1.402, noise());
  for (const std::string material : {"w", "floor", "ceil"})
    expect_mean(up, material, mean_radiosity(plain, material), noise());
}

TEST_P(Damaged, ARoomOfSixDecimalsHasTheLightOfTheExactOne) {
  const SolvedMesh exact = solved("rounded-room/exact.obj", "1"),
                   rounded = solved("rounded-room/rounded.obj", "1");
  expect_mean(exact, "ceil", 13.6, noise());
  for (const std::string material : {"w", "floor", "ceil"})
    expect_mean(rounded, material, mean_radiosity(exact, material), noise());
}

TEST_P(Damaged, ABoxAMicrometreOverTheFloorGivesTheLightOfContact) {
  const SolvedMesh above = solved("near-contact/above.obj", "0.4");
  expect_mean(above, "ceil", 11.57, 1e-2);
  expect_mean(above, "floor", 1.136, 1e-2);
  expect_mean(above, "w", 2.10, 1e-2);
}

TEST_P(Damaged, ABoxSunkATenthOfAMicrometreInTheFloorOfAnOpenRoomGivesTheLightOfContact) {
  for (const std::string name : {"open", "open-sunk"}) {
    const SolvedMesh sunk = solved("near-contact/" + name + ".obj", "0.4");
    expect_mean(sunk, "floor", 0.964, 1e-2);
    expect_mean(sunk, "ceil", 11.05, 1e-2);
  }
}

}  // namespace
}  // namespace radiosity::testing
