// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "app/program.hpp"
#include "radiosity/io/solution_file.hpp"

namespace radiosity::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class EarlierWork : public ProgramTest {
 protected:
  void expect_same(const std::string& a, const std::string& b, const std::vector<std::string>& arrays) const {
    for (const std::string& array : arrays) {
      const SolvedMesh one = read_solution(folder() / a, array), other = read_solution(folder() / b, array);
      EXPECT_TRUE((one.patch_radiosity == other.patch_radiosity).all());
      EXPECT_TRUE((one.vertex_radiosity == other.vertex_radiosity).all());
      EXPECT_TRUE((one.array->values == other.array->values).all()) << array;
    }
  }

  // However often and wherever it is killed, `arguments` to a.vtp with b.vtp in its place. When it is does not matter to what is asserted.
  void expect_same_when_killed(std::vector<std::string> arguments, const std::vector<std::string>& arrays) {
    ASSERT_EQ(run(arguments).status, 0);
    *std::ranges::find(arguments, "a.vtp") = "b.vtp";
    for (const char* more : {"--checkpoint", "0.01", "--resume"}) arguments.emplace_back(more);
    std::mt19937 random(static_cast<unsigned>(std::random_device()()));
    bool ended = false;
    for (int k = 0; k < 5 && !ended; ++k) {
      const auto milliseconds = static_cast<unsigned>(100 + random() % 900);
      ended = run_program_and_kill(folder(), arguments, milliseconds);
      RecordProperty("killed_after_ms_" + std::to_string(k), static_cast<int>(milliseconds));
    }
    if (!ended) {
      const Outcome last = run(arguments);
      EXPECT_EQ(last.status, 0) << last.err;
    }
    expect_same("a.vtp", "b.vtp", arrays);
    for (const std::string& file : files()) EXPECT_THAT(file, Not(HasSubstr("b.checkpoint")));
  }
};

TEST_F(EarlierWork, SolvesWithFormFactorsOfAFileAsWithThoseThatItComputes) {
  write_cube();
  const std::vector<std::string> patches{"--patch-size", "0.2"};
  const auto with = [&](std::vector<std::string> arguments, const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  const std::vector<std::string> method{"--method", "hemisphere", "--samples", "64", "--patch-size", "0.2"};
  ASSERT_EQ(with({"solve", "cube.toml", "-o", "a.vtp"}, method).status, 0);
  const Outcome made = with({"factors", "cube.toml", "-o", "F.h5"}, method);
  EXPECT_EQ(made.status, 0) << made.err;
  const Outcome solved = with({"solve", "cube.toml", "-o", "b.vtp", "--form-factors", "F.h5"}, patches);
  EXPECT_EQ(solved.status, 0) << solved.err;
  EXPECT_THAT(solved.out, HasSubstr("read from F.h5"));
  expect_same("a.vtp", "b.vtp", {"irradiance", "radiosity_error"});

  expect_one_error(
      run({"solve", "cube.toml", "-o", "c.vtp", "--form-factors", "F.h5", "--patch-size", "0.3"}), 1,
      "F.h5: its form factors are of other patches (150) than these (96)");
  expect_one_error(run({"solve", "cube.toml", "-o", "c.vtp", "--form-factors", "cube.obj"}), 1,
                   "cube.obj: does not hold form factors");
  expect_one_error(run({"solve", "cube.toml", "-o", "c.vtp", "--form-factors", "none.h5"}), 1, "none.h5");
  expect_one_error(run({"solve", "cube.toml", "-o", "c.vtp", "--form-factors", "F.h5", "--samples", "9"}), 2,
                   "--form-factors");
  expect_one_error(run({"factors", "cube.toml", "-o", "F.csv"}), 1, ".mtx or .h5");
}

TEST_F(EarlierWork, GoesOnAfterItWasKilledToTheSameBits) {
  write_cube();
  expect_same_when_killed(
      {"solve", "cube.toml", "-o", "a.vtp", "--quiet", "--patch-size", "0.03", "--method", "hemisphere",
       "--samples", "256", "--element-size", "0.012", "--element-samples", "32"},
      {"irradiance", "radiosity_error"});
}

TEST_F(EarlierWork, GoesOnShootingAfterItWasKilledToTheSameBits) {
  write_cube();
  expect_same_when_killed(
      {"solve", "cube.toml", "-o", "a.vtp", "--quiet", "--patch-size", "0.05", "--method", "hemisphere",
       "--samples", "256", "--solver", "progressive", "--tolerance", "0.01", "--no-error-estimate"},
      {"irradiance"});
}

TEST_F(EarlierWork, LeavesNothingHalfWrittenOnceItIsDone) {
  write_cube();
  write(".b.checkpoint-1-of-2.20700-2.h5", "what a run had of a checkpoint when it was killed");
  write(".c.checkpoint.20700-2.h5", "that of another result");
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "b.vtp", "--resume"}).status, 0);
  EXPECT_FALSE(files().contains(".b.checkpoint-1-of-2.20700-2.h5"));
  EXPECT_TRUE(files().contains(".c.checkpoint.20700-2.h5"));
}

TEST_F(EarlierWork, IsNotTakenForOtherWork) {
  write_cube();
  const std::vector<std::string> solve{
      "solve",    "cube.toml",  "-o",        "b.vtp", "--patch-size",        "0.02",
      "--method", "hemisphere", "--samples", "1024",  "--no-error-estimate", "--checkpoint",
      "0.01"};
  bool ended = false;
  for (unsigned ms = 200; !ended && files().count("b.checkpoint.h5") == 0; ms += 200)
    ended = run_program_and_kill(folder(), solve, ms);
  if (ended) GTEST_SKIP() << "it was done before it was killed";
  std::filesystem::copy(folder() / "b.checkpoint.h5", folder() / "kept.h5");
  EXPECT_THAT(run({"solve", "cube.toml", "-o", "b.vtp", "--patch-size", "0.5"}).out,
              HasSubstr("an earlier run left its state beside b.vtp"));
  std::filesystem::copy(folder() / "kept.h5", folder() / "b.checkpoint.h5");
  std::vector<std::string> other = solve;
  other.emplace_back("--resume");
  other[9] = "512";
  expect_one_error(run(other), 1, "b.checkpoint.h5: is of other work than this");
  expect_one_error(run({"solve", "cube.toml", "-o", "b.vtp", "--resume", "--accuracy", "1"}), 2,
                   "--accuracy");
}

}  // namespace
}  // namespace radiosity::testing
