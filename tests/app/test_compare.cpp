// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/program.hpp"

namespace radiosity::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Compare : public ProgramTest {
 protected:
  /// All of the budget is spent.
  Outcome compare(const std::string& scene, const std::string& out, const std::string& budget = "5") const {
    return run({"compare", scene, "-o", out, "--budget", budget, "--patch-size", "0.25"});
  }
};

// Fields of a CSV line (RFC 4180).
std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> result(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      result.emplace_back();
    else
      result.back() += c;
  }
  return result;
}

TEST_F(Compare, WritesATableAReportAndAPageOfItsOwn) {
  write_cube();
  const Outcome result = compare("cube.toml", "out", "12");
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(files(), ::testing::IsSupersetOf({"out/index.html", "out/trade.csv", "out/trade.json"}));

  std::istringstream lines(read("out/trade.csv"));
  std::string line;
  std::getline(lines, line);
  const auto names = fields(line);
  std::size_t rows = 0;
  for (; std::getline(lines, line); ++rows) EXPECT_EQ(fields(line).size(), names.size()) << line;

  const auto trade = nlohmann::json::parse(read("out/trade.json"));
  EXPECT_EQ(rows, trade["runs"].size() + trade["solvers"].size());
  EXPECT_TRUE(trade["completed"]);
  const auto own = trade["own_mesh"];
  EXPECT_EQ(trade["meshes"][own.get<std::size_t>()]["patches"], 96);
  const double noise = trade["reference"]["noise"];
  [[maybe_unused]] bool exact = false;
  for (const auto& one : trade["runs"]) {
    if (one.contains("left_out")) {
      EXPECT_NE(one["left_out"], "");
      continue;
    }
    if (one["mesh"] != own) continue;
    const double error = one["error_factors"]["rms"];
    if (one["method"] == "analytic") {
      exact = true;  // a convex room: closed forms, solved to 1e-6
      EXPECT_LT(error, 2e-6);
    } else {
      EXPECT_LT(noise, error);
    }
  }
#ifndef __SANITIZE_ADDRESS__  // many times slower, it leaves out what the budget does not hold
  EXPECT_TRUE(exact);
#endif

  EXPECT_NE(read("out/index.html").find(read("out/trade.json")), std::string::npos);
}

TEST_F(Compare, RecommendsACommandThatRuns) {
  write_cube();
  // All of it fits: what is advised must not hang on what the machine has time for.
  ASSERT_EQ(run({"compare", "cube.toml", "-o", "out", "--budget", "60", "--patch-size", "0.25"}).status, 0);
  const auto trade = nlohmann::json::parse(read("out/trade.json"));
  ASSERT_EQ(trade["advice"].size(), 4U);
  const auto& five = trade["advice"][0];
  ASSERT_TRUE(five.contains("command"));
  EXPECT_LE(five["error_at_most"], 0.05);
  std::istringstream command(five["command"].get<std::string>());
  std::vector<std::string> words;
  for (std::string word; command >> word;) words.push_back(word);
  ASSERT_EQ(words[0], "radiosity");
  EXPECT_EQ(run({words.begin() + 1, words.end()}).status, 0);
}

TEST_F(Compare, EscapesTheNamesOfFiles) {
  write_cube();
  const std::string name = "a <b> & 'c'.toml";
  write(name, read("cube.toml"));
  ASSERT_EQ(compare(name, "out").status, 0);
  EXPECT_THAT(read("out/index.html"), Not(HasSubstr("<b> & ")));
  const auto trade = nlohmann::json::parse(read("out/trade.json"));
  EXPECT_EQ(trade["scene"], R"('a <b> & '\''c'\''.toml')");
}

TEST_F(Compare, RefusesADirectoryThatHoldsOtherFilesAndReplacesItsOwn) {
  write_cube();
  std::filesystem::create_directory(folder() / "mine");
  write("mine/notes.txt", "do not lose");
  expect_one_error(compare("cube.toml", "mine"), 1, "mine: holds 'notes.txt'");
  EXPECT_EQ(read("mine/notes.txt"), "do not lose");

  std::filesystem::create_directory(folder() / "out");
  write("out/index.html", "old");
  ASSERT_EQ(compare("cube.toml", "out").status, 0);
  EXPECT_NE(read("out/index.html"), "old");
}

TEST_F(Compare, MarksWhatWasInterrupted) {
  write_cube();
  const Outcome result = run({"compare", "cube.toml", "-o", "out", "--budget", "20"}, "patches");
  EXPECT_EQ(result.status, 3);
  EXPECT_EQ(result.err, "");
  if (files().count("out/trade.json") == 1) {
    EXPECT_FALSE(nlohmann::json::parse(read("out/trade.json"))["completed"]);
  }
}

TEST_F(Compare, RefusesWhatCannotBeWrittenOrCompared) {
  write_cube();
  write("file", "");
  const auto before = files();
  expect_one_error(compare("cube.toml", "nowhere/out"), 1, "nowhere");
  expect_one_error(compare("cube.toml", "file"), 1, "file: is not a directory");
  expect_one_error(compare("cube.toml", "/proc/out"), 1, "/proc/out");
  expect_one_error(compare("cube.obj", "out"), 1, "cube.obj");
  expect_one_error(compare("nowhere.toml", "out"), 1, "nowhere.toml");
  expect_one_error(run({"compare", "cube.toml"}), 2, "--output");
  expect_one_error(run({"compare", "cube.toml", "-o", "out", "--budget", "0"}), 2, "--budget: '0' is n");
  EXPECT_EQ(files(), before);
}

}  // namespace
}  // namespace radiosity::testing
