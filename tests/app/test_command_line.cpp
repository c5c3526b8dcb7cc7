// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <sstream>

#include "app/program.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class CommandLine : public ProgramTest {
 protected:
  // A usage error comes before any work, so nothing needs to exist.
  void expect_usage_error(const std::vector<std::string>& arguments, const std::string& part) const {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    const Outcome result = run(arguments);
    expect_one_error(result, 2, part);
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(files().empty());
  }
};

TEST_F(CommandLine, PrintsItsVersion) {
  const Outcome result = run({"--version"});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, StartsWith("radiosity "));
  EXPECT_EQ(result.err, "");
}

TEST_F(CommandLine, HelpListsEveryCommand) {
  const Outcome result = run({"--help"});
  EXPECT_EQ(result.status, 0);
  for (const char* command : {"solve", "factors", "inspect", "view", "probe", "compare", "--version"})
    EXPECT_THAT(result.out, HasSubstr(command));
}

TEST_F(CommandLine, HelpOfEachCommandListsEveryOption) {
  const std::vector<std::string> factors = {"--patch-size",       "--method", "--samples", "--resolution",
                                            "--factor-tolerance", "--seed",   "--output",  "--report",
                                            "--threads",          "--quiet",  "--help",    "--no-closure",
                                            "--memory-limit"};
  std::vector<std::string> solve = factors;
  solve.insert(solve.end(), {"--solver", "--tolerance", "--max-iterations", "--series", "--paraview"});
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"solve", solve},
      {"factors", factors},
      {"inspect",
       {"--patch-size", "--samples", "--resolution", "--seed", "--report", "--threads", "--quiet"}},
      {"view",
       {"--output", "--scene", "--position", "--target", "--up", "--fov-deg", "--width", "--height",
        "--exposure", "--threads", "--quiet"}},
      {"probe", {"--output", "--points", "--samples", "--seed", "--threads", "--quiet"}},
      {"compare",
       {"--output", "--budget", "--patch-size", "--seed", "--memory-limit", "--threads", "--quiet"}}};
  for (const auto& [command, options] : commands) {
    const Outcome result = run({command, "--help"});
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.err, "");
    for (const std::string& option : options) EXPECT_THAT(result.out, HasSubstr(option)) << command;
  }
}

// The help breaks lines between words.
std::string one_line(const std::string& text) {
  std::istringstream words(text);
  std::string result;
  for (std::string word; words >> word;) result += word + " ";
  return result;
}

TEST_F(CommandLine, HelpTakesMethodsAndSolversFromTheirTables) {
  const std::string help = one_line(run({"solve", "--help"}).out);
  for (const auto& method : form_factor_methods()) {
    EXPECT_THAT(help, HasSubstr(std::string(method.summary)));
    for (const Index standard : {method.defaults.samples, method.defaults.resolution}) {
      if (standard == 0) continue;

      EXPECT_THAT(help, HasSubstr(std::string(method.name) + " " + std::to_string(standard)));
    }
  }
  for (const auto& solver : solvers()) EXPECT_THAT(help, HasSubstr(std::string(solver.summary)));
}

TEST_F(CommandLine, NamesTheNearestOptionToAnUnknownOne) {
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--patchsize", "1"}, "did you mean '--patch-size'?");
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--tolerence=1"}, "did you mean '--tolerance'?");
  expect_usage_error({"solve", "a.obj", "--ouput", "b.vtp"}, "did you mean '--output'?");
  expect_usage_error({"view", "a.vtp", "-o", "b.png", "--fov", "30"}, "did you mean '--fov-deg'?");
  expect_usage_error({"--versoin"}, "did you mean '--version'?");
}

TEST_F(CommandLine, NamesTheNearestCommandToAnUnknownOne) {
  expect_usage_error({"slove", "a.obj", "-o", "b.vtp"}, "did you mean 'solve'?");
  expect_usage_error({"factor"}, "did you mean 'factors'?");
}

TEST_F(CommandLine, NamesTheNearestMethodAndSolverToAnUnknownOne) {
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--method", "hemisfere"},
                     "did you mean 'hemisphere'?");
  expect_usage_error({"factors", "a.obj", "-o", "b.mtx", "--method", "atuo"}, "did you mean 'auto'?");
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--solver", "gauss"}, "did you mean 'gauss-seidel'?");
}

TEST_F(CommandLine, AsksForWhatIsMissing) {
  expect_usage_error({}, "solve, factors, inspect, view, probe, compare");
  expect_usage_error({"solve"}, "SCENE");
  expect_usage_error({"solve", "a.obj"}, "--output");
  expect_usage_error({"solve", "a.obj", "-o"}, "--output");
  expect_usage_error({"probe", "a.vtp", "-o", "b.csv"}, "--points");
}

TEST_F(CommandLine, RefusesASecondScene) {
  expect_usage_error({"solve", "a.obj", "b.obj", "-o", "c.vtp"}, "'b.obj'");
}

TEST_F(CommandLine, NamesOptionValueAndRuleOfABadNumber) {
  const auto refused = [&](const std::string& option, const std::string& value) {
    expect_usage_error({"solve", "a.obj", "-o", "b.vtp", option, value}, option + ": '" + value + "' is n");
  };
  refused("--patch-size", "0");
  refused("--patch-size", "-1");
  refused("--patch-size", "nan");
  refused("--patch-size", "small");
  refused("--samples", "0");
  refused("--samples", "1.5");
  refused("--samples", "99999999999");
  refused("--resolution", "x");
  refused("--factor-tolerance", "0");
  refused("--seed", "-1");
  refused("--tolerance", "0");
  refused("--tolerance", "inf");
  refused("--max-iterations", "0");
  refused("--threads", "-1");
  for (const char* limit : {"0", "1e-10", "1e300", "nan"}) refused("--memory-limit", limit);
  expect_usage_error({"view", "a.vtp", "-o", "b.png", "--fov-deg", "180"}, "--fov-deg: '180' is n");
  expect_usage_error({"view", "a.vtp", "-o", "b.png", "--width", "0"}, "--width: '0' is n");
  expect_usage_error({"view", "a.vtp", "-o", "b.png", "--exposure", "-2"}, "--exposure: '-2' is n");
  expect_usage_error({"view", "a.vtp", "-o", "b.png", "--up", "0", "x", "1"}, "--up: 'x' is n");
}

TEST_F(CommandLine, RefusesASettingThatTheMethodDoesNotUse) {
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--method", "hemisphere", "--resolution", "64"},
                     "--resolution has no effect with --method hemisphere");
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--method", "analytic", "--resolution", "64"},
                     "--resolution has no effect with --method analytic");
  expect_usage_error({"solve", "a.obj", "-o", "b.vtp", "--method", "hemicube", "--factor-tolerance", "1e-4"},
                     "--factor-tolerance has no effect with --method hemicube; it belongs to analytic");
}

}  // namespace
}  // namespace radiosity::testing
