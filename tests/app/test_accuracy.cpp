// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/program.hpp"
#include "radiosity/simulation/restrict_to.hpp"
#include "support/sanitized.hpp"

namespace radiosity::testing {
namespace {

using nlohmann::json;

class Accuracy : public ProgramTest {
 protected:
  json report() const { return json::parse(read("out.json")); }
  SolvedMesh solved(const std::string& file) const { return read_solution(folder() / file); }
};

/// √(Σ A e² / Σ A (B − E)²) against a finer solution.
double true_error(const SolvedMesh& coarse, const SolvedMesh& fine) {
  const PatchMesh& mesh = coarse.mesh;
  const BandArray exact = restrict_to(mesh, fine.mesh, fine.patch_radiosity);
  const Eigen::ArrayXd error = (coarse.patch_radiosity - exact).col(0);
  const Eigen::ArrayXd reflected = (exact - mesh.emission()).col(0);
  return std::sqrt((mesh.areas() * error.square()).sum() / (mesh.areas() * reflected.square()).sum());
}

TEST_F(Accuracy, IsDeliveredOnTheCube) {
  // Faces of a solved mesh are its patches, so each belongs to the face of the cube that it is a piece of.
  write_cube(0.2, 0.7, 0.5);
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "fine.vtp", "--patch-size",
                 test::kSanitized ? "0.0625" : "0.03125", "--method", "analytic", "--no-error-estimate"})
                .status,
            0);
  const SolvedMesh fine = solved("fine.vtp");
  for (const char* percent : {"5", "2", "1", "0.5"}) {
    if (test::kSanitized && std::stod(percent) < 2) break;
    const Outcome result =
        run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", percent, "--report", "out.json"});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_LE(true_error(solved("out.vtp"), fine), std::stod(percent) / 100);
    const json facts = report();
    EXPECT_LE(facts["error"]["total"], std::stod(percent) / 100);
    EXPECT_TRUE(facts["accuracy"]["reached"]);
    ASSERT_FALSE(facts["accuracy"]["rounds"].empty());
    // No patch hides another: closed forms, and not one ray.
    for (const auto& round : facts["accuracy"]["rounds"]) EXPECT_EQ(round["method"], "analytic");
    EXPECT_EQ(facts["form_factors"]["rays"], 0);
  }
}

TEST_F(Accuracy, TriesOtherMethodsOnlyWhereTheFirstIsDear) {
  std::filesystem::copy(RADIOSITY_SOURCE_DIR "/scenes/cornell-box.obj", folder() / "cornell-box.obj");
  std::ifstream original(RADIOSITY_SOURCE_DIR "/scenes/cornell-box.toml");
  const std::string scene{std::istreambuf_iterator<char>(original), {}};
  write("box.toml",
        scene + "\n[form_factors]\nsamples = 1024\n");  // rays; so many viewpoints would take minutes
  ASSERT_EQ(run({"solve", "box.toml", "-o", "out.vtp", "--accuracy", "10", "--report", "out.json"}).status,
            0);
  const json rounds = report()["accuracy"]["rounds"];
  ASSERT_EQ(rounds.size(), 1U);
  EXPECT_EQ(rounds[0]["method"], "hemicube");
  EXPECT_EQ(rounds[0]["samples"], 4);
  EXPECT_TRUE(report()["modelled"]["occlusion"]);
}

TEST_F(Accuracy, SaysSoWhereItIsOutOfReach) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", "0.001", "--memory-limit",
                              "0.03", "--report", "out.json"});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.out, ::testing::HasSubstr("not reached"));
  EXPECT_FALSE(report()["accuracy"]["reached"]);
  EXPECT_LE(report()["form_factors"]["bytes"], 30'000'000);
  EXPECT_GT(solved("out.vtp").mesh.patch_count(), 6);
}

TEST_F(Accuracy, IsThatOfTheElementsToo) {
  write_cube();
  const Outcome noisy = run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", "1", "--element-size",
                             "0.2", "--element-samples", "1", "--report", "out.json"});
  EXPECT_EQ(noisy.status, 3);
  EXPECT_THAT(noisy.out, ::testing::HasSubstr("the noise of the elements takes more samples"));
  EXPECT_FALSE(report()["accuracy"]["reached"]);
  EXPECT_GT(report()["error"]["total"], 0.01);
  EXPECT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", "1", "--element-size", "0.2",
                 "--element-samples", "4608", "--report", "out.json"})
                .status,
            0);
  EXPECT_LE(report()["error"]["total"], 0.01);
}

// 726 faces are more than the first round aims at, so that no size divides them; joined, they tell their error.
TEST_F(Accuracy, IsDeliveredWhereTheFacesAreManyAndKeptAtFirst) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "fine.vtp", "--patch-size", "0.095", "--quiet"}).status, 0);
  const Outcome result =
      run({"solve", "fine.vtp", "-o", "out.vtp", "--accuracy", "2", "--report", "out.json"});
  EXPECT_EQ(result.status, 0) << result.err;
  const json facts = report();
  EXPECT_GT(facts["accuracy"]["rounds"][0]["error"], 0);
  EXPECT_EQ(facts["accuracy"]["rounds"][0]["patches"], 6 * 11 * 11);
  EXPECT_LE(facts["error"]["total"], 0.02);
}

TEST_F(Accuracy, ChoosesWhatIsNotGivenAndRefusesWhatIs) {
  write_cube();
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", "1", "--patch-size", "0.1"}), 2,
                   "--patch-size");
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--accuracy", "0"}), 2, "above 0");
}

}  // namespace
}  // namespace radiosity::testing
