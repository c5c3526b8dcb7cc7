// SPDX-License-Identifier: GPL-3.0-or-later
// `mpiexec -n N radiosity …`: RADIOSITY_PROGRAM is mpiexec here.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "app/program.hpp"
#include "radiosity/io/solution_file.hpp"

namespace radiosity::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::vector<std::string> on_ranks(int count, std::vector<std::string> arguments) {
  std::vector<std::string> all{"-n", std::to_string(count), RADIOSITY_ON_RANKS};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return all;
}

std::size_t count_of(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// The processes that mpiexec started and that have not ended.
std::vector<pid_t> children(pid_t parent) {
  std::vector<pid_t> found;
  std::error_code gone;
  for (const auto& entry : fs::directory_iterator("/proc", gone)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t end = text.rfind(") ");  // of the name; then the state and the parent
    if (end != std::string::npos && text[end + 2] != 'Z' && std::atoi(text.c_str() + end + 4) == parent)
      found.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return found;
}

class OnSeveralRanks : public ProgramTest {
 protected:
  OnSeveralRanks() {
    // As root in containers; more ranks than cores.
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    setenv("OMPI_MCA_rmaps_base_oversubscribe", "1", 1);
    setenv("OMPI_MCA_mpi_yield_when_idle", "1", 1);
    setenv("ASAN_OPTIONS", "detect_leaks=0", 1);  // of MPI and PETSc
    write_cube(0.2, 0.7, 0.5);
  }

  BandArray radiosity(const std::string& file) const {
    return read_solution(folder() / file).patch_radiosity;
  }
};

TEST_F(OnSeveralRanks, ASolveHasTheResultOfOneProcess) {
  const std::vector<std::string> solve{"solve",          "cube.toml",  "--patch-size", "0.1",
                                       "--method",       "hemisphere", "--samples",    "64",
                                       "--element-size", "0.06"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), solve.begin(), solve.end());
    return more;
  };
  ASSERT_EQ(run(on_ranks(1, with({"-o", "one.vtp"}))).status, 0);
  const Outcome several = run(on_ranks(3, with({"-o", "three.vtp", "--report", "three.json"})));
  ASSERT_EQ(several.status, 0) << several.err;
  EXPECT_EQ(count_of("scene ", several.out), 1U) << several.out;  // rank 0 speaks
  EXPECT_TRUE((radiosity("three.vtp") == radiosity("one.vtp")).all());
  const auto report = nlohmann::json::parse(read("three.json"));
  ASSERT_EQ(report["ranks"].size(), 3U);
  double rows = 0, bytes = 0;
  for (const auto& rank : report["ranks"]) {
    rows += rank["rows"].get<double>();
    bytes += rank["form_factor_bytes"].get<double>();
  }
  EXPECT_EQ(rows, report["scene"]["patches"].get<double>());
  EXPECT_EQ(bytes, report["form_factors"]["bytes"].get<double>());

  const Outcome by_petsc =
      run(on_ranks(2, with({"-o", "petsc.vtp", "--petsc", "-ksp_monitor", "--tolerance", "1e-10"})));
  ASSERT_EQ(by_petsc.status, 0) << by_petsc.err;
  EXPECT_THAT(by_petsc.out, HasSubstr("KSP Residual norm"));
  EXPECT_LE((radiosity("petsc.vtp") - radiosity("one.vtp")).abs().maxCoeff(), 1e-4);
}

TEST_F(OnSeveralRanks, FormFactorsAreReadByTheRanksThatOwnThem) {
  const std::vector<std::string> patches{"--patch-size", "0.1"};
  const auto with = [&](std::vector<std::string> first) {
    first.insert(first.end(), patches.begin(), patches.end());
    return first;
  };
  ASSERT_EQ(run(on_ranks(1, with({"factors", "cube.toml", "-o", "F.h5", "--method", "hemisphere"}))).status,
            0);
  const auto solve = [&](const std::string& out) {
    return with(
        {"solve", "cube.toml", "-o", out + ".vtp", "--report", out + ".json", "--form-factors", "F.h5"});
  };
  ASSERT_EQ(run(on_ranks(1, solve("one"))).status, 0);
  const Outcome several = run(on_ranks(3, solve("three")));
  ASSERT_EQ(several.status, 0) << several.err;
  EXPECT_TRUE((radiosity("three.vtp") == radiosity("one.vtp")).all());
  const auto report = nlohmann::json::parse(read("three.json"));
  EXPECT_EQ(report["form_factors"]["nonzeros"],
            nlohmann::json::parse(read("one.json"))["form_factors"]["nonzeros"]);
  const double bytes = report["form_factors"]["bytes"];
  for (const auto& rank : report["ranks"]) EXPECT_LT(rank["form_factor_bytes"].get<double>(), 0.4 * bytes);

  const Outcome other = run(
      on_ranks(2, {"solve", "cube.toml", "-o", "x.vtp", "--form-factors", "F.h5", "--patch-size", "0.2"}));
  EXPECT_EQ(other.status, 1);
  EXPECT_EQ(count_of("radiosity: error: ", other.err), 1U) << other.err;
  EXPECT_THAT(other.err, HasSubstr("are of other patches"));
}

TEST_F(OnSeveralRanks, AnAccuracyHasTheResultOfOneProcess) {
  const auto solve = [&](const std::string& out) {
    return std::vector<std::string>{"solve",    "cube.toml",  "-o",         out,
                                    "--method", "hemisphere", "--accuracy", "3"};
  };
  ASSERT_EQ(run(on_ranks(1, solve("one.vtp"))).status, 0);
  const Outcome several = run(on_ranks(2, solve("two.vtp")));
  ASSERT_EQ(several.status, 0) << several.err;
  EXPECT_TRUE((radiosity("two.vtp") == radiosity("one.vtp")).all());
}

TEST_F(OnSeveralRanks, PiecesAndSensorsAreThoseOfOneProcess) {
  const std::vector<std::string> solve{"solve",      "cube.toml", "--patch-size", "0.1", "--method",
                                       "hemisphere", "--samples", "64",           "-o"};
  const auto with = [](std::vector<std::string> first, const std::vector<std::string>& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
  };
  ASSERT_EQ(run(on_ranks(1, with(solve, {"one.vtp"}))).status, 0);
  const Outcome pieces = run(on_ranks(3, with(solve, {"three.pvtp"})));
  ASSERT_EQ(pieces.status, 0) << pieces.err;
  for (const char* file : {"three.pvtp", "three-1-of-3.vtp", "three-2-of-3.vtp", "three-3-of-3.vtp"})
    EXPECT_TRUE(files().contains(file)) << file;
  EXPECT_TRUE((radiosity("three.pvtp") == radiosity("one.vtp")).all());

  std::string points;
  for (int k = 0; k < 100; ++k) points += "0.5 0.5 0." + std::to_string(100 + k) + " 1 0 1\n";
  write("P.txt", points);
  const auto probe = [&](int count, const std::string& solution, const std::string& out) {
    const Outcome outcome =
        run(on_ranks(count, {"probe", solution, "--points", "P.txt", "-o", out, "--samples", "128"}));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(count_of("sensors ", outcome.out), 1U) << outcome.out;
    return read(out);
  };
  const std::string alone = probe(1, "one.vtp", "one.csv");
  EXPECT_EQ(count_of("\n", alone), 101U);
  EXPECT_EQ(probe(3, "one.vtp", "three.csv"), alone);
  EXPECT_EQ(probe(2, "three.pvtp", "pieces.csv"), alone);
}

TEST_F(OnSeveralRanks, AnErrorIsToldOnceAndEndsAll) {
  const auto refused = [&](const std::vector<std::string>& arguments, int status, const std::string& part) {
    const Outcome outcome = run(on_ranks(2, arguments));
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(count_of("radiosity: error: ", outcome.err), 1U) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(part));
  };
  refused({"solve", "nowhere.toml", "-o", "x.vtp"}, 1, "nowhere.toml");
  refused({"solve", "cube.toml", "-o", "x.vtp", "--solver", "gauss-seidel"}, 1, "runs in one process");
  refused({"solve", "cube.toml", "-o", "x.vtp", "--memory-limit", "0.00001"}, 1, "ranks would fit");
  refused({"solve", "cube.toml", "-o", "x.vtp", "--petsc", "-ksp_type nonesuch"}, 1, "PETSc");
  refused({"inspect", "cube.toml"}, 2, "runs in one process");
  refused({"probe", "nowhere.vtp", "--points", "P.txt", "-o", "H.csv"}, 1, "P.txt");
  EXPECT_FALSE(files().contains("x.vtp"));
}

// Kills one of its processes after a while. Fails where the others go on. Where they have ended and mpiexec has not, the
// fault is its own (that of Open MPI 4.1 may wait for a lock of its own for ever).
void run_and_kill_a_rank(const fs::path& folder, const std::vector<std::string>& arguments,
                         std::chrono::milliseconds after, std::size_t which) {
  const pid_t mpiexec = fork();
  if (mpiexec == 0) {
    std::vector<std::string> copies = arguments;
    std::string program = RADIOSITY_PROGRAM;
    std::vector<char*> argv{program.data()};
    for (std::string& argument : copies) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (chdir(folder.c_str()) != 0 || std::freopen("/dev/null", "w", stdout) == nullptr ||
        std::freopen("/dev/null", "w", stderr) == nullptr)
      _exit(126);
    execv(argv[0], argv.data());
    _exit(127);
  }
  std::this_thread::sleep_for(after);
  const std::vector<pid_t> ranks = children(mpiexec);
  if (!ranks.empty()) kill(ranks[which % ranks.size()], SIGKILL);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (waitpid(mpiexec, nullptr, WNOHANG) != mpiexec) {
    if (std::chrono::steady_clock::now() > until) {
      for (const pid_t rank : children(mpiexec)) {
        ADD_FAILURE() << "a rank goes on";
        kill(rank, SIGKILL);
      }
      kill(mpiexec, SIGKILL);
      waitpid(mpiexec, nullptr, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

TEST_F(OnSeveralRanks, AKilledRankEndsTheRunAndAnyNumberOfThemGoesOn) {
  const auto solve = [&](const std::string& out) {
    return std::vector<std::string>{"solve",
                                    "cube.toml",
                                    "-o",
                                    out,
                                    "--patch-size",
                                    "0.025",
                                    "--method",
                                    "hemisphere",
                                    "--samples",
                                    "512",
                                    "--checkpoint",
                                    "0.01",
                                    "--no-error-estimate",
                                    "--resume"};
  };
  ASSERT_EQ(run(on_ranks(2, solve("whole.vtp"))).status, 0);
  std::mt19937 random(5);
  const char* const asked = std::getenv("RADIOSITY_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 3;
  for (int k = 0; k < kills; ++k) {
    const auto after = std::chrono::milliseconds(300 + random() % 1200);
    run_and_kill_a_rank(folder(), on_ranks(2 + k % 2, solve("killed.vtp")), after, random());
    for (const std::string& file : files()) {
      if (!file.starts_with("killed") || file == "killed.vtp") continue;
      EXPECT_TRUE(file.starts_with("killed.checkpoint") && file.ends_with(".h5")) << file;
    }
    if (files().contains("killed.vtp")) {
      EXPECT_TRUE((radiosity("killed.vtp") == radiosity("whole.vtp")).all());
    }
  }
  const Outcome resumed = run(on_ranks(3, solve("killed.vtp")));
  ASSERT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_TRUE((radiosity("killed.vtp") == radiosity("whole.vtp")).all());
  for (const std::string& file : files()) EXPECT_THAT(file, ::testing::Not(HasSubstr("checkpoint")));
}

}  // namespace
}  // namespace radiosity::testing
