// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/program.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace radiosity::testing {
namespace fs = std::filesystem;

namespace {

std::string read_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// `prepare` is called in the child, before it goes to the folder and becomes the program.
template <class Prepare>
pid_t start_program(const fs::path& folder, const std::vector<std::string>& arguments,
                    const Prepare& prepare) {
  std::vector<char*> argv;
  std::string program = RADIOSITY_PROGRAM;
  std::vector<std::string> copies = arguments;
  argv.push_back(program.data());
  for (std::string& argument : copies) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork");
  if (child == 0) {
    prepare();
    if (chdir(folder.c_str()) != 0) _exit(126);
    execv(argv[0], argv.data());
    _exit(127);
  }
  return child;
}

}  // namespace

Outcome run_program(const fs::path& folder, const std::vector<std::string>& arguments,
                    const std::string& interrupt_at) {
  std::array<int, 2> out{};
  const fs::path err_file = folder.string() + ".stderr";  // beside the folder: files() must not see it
  if (pipe(out.data()) != 0) throw std::runtime_error("pipe");

  const pid_t child = start_program(folder, arguments, [&] {
    const int err = open(err_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (err < 0) _exit(126);
    dup2(out[1], STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    close(out[0]);
    close(out[1]);
  });
  close(out[1]);

  Outcome run;
  bool sent = interrupt_at.empty();
  std::array<char, 4096> buffer{};
  for (ssize_t n = 0; (n = read(out[0], buffer.data(), buffer.size())) > 0;) {
    run.out.append(buffer.data(), static_cast<std::size_t>(n));
    if (!sent && run.out.find(interrupt_at) != std::string::npos) {
      usleep(100'000);  // lets the stage begin that the text announces; nothing depends on it
      kill(child, SIGINT);
      sent = true;
    }
  }
  close(out[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) run.status = WEXITSTATUS(status);
  run.err = read_file(err_file);
  fs::remove(err_file);
  return run;
}

bool run_program_and_kill(const fs::path& folder, const std::vector<std::string>& arguments,
                          unsigned milliseconds) {
  const pid_t child = start_program(folder, arguments, [] {});
  usleep(1000 * milliseconds);
  int status = 0;
  const bool ended = waitpid(child, &status, WNOHANG) == child;
  if (!ended) {
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
  }
  return ended;
}

ProgramTest::ProgramTest() {
  std::string name = (fs::temp_directory_path() / "radiosity-app-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
  folder_ = name;
}

ProgramTest::~ProgramTest() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::string ProgramTest::read(const std::string& file) const {
  return read_file(folder_ / file);
}

void ProgramTest::write(const std::string& file, const std::string& text) const {
  std::ofstream(folder_ / file, std::ios::binary) << text;
}

std::set<std::string> ProgramTest::files() const {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    names.insert(fs::relative(entry.path(), folder_).string());
  return names;
}

void ProgramTest::write_cube(double floor, double ceiling, double wall) const {
  write("cube.obj", R"(v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
usemtl floor
f 1 2 3 4
usemtl ceiling
f 5 8 7 6
usemtl wall
f 1 5 6 2
f 2 6 7 3
f 3 7 8 4
f 4 8 5 1
)");
  std::ostringstream toml;
  toml << "mesh = \"cube.obj\"\n[materials.floor]\nreflectance = " << floor
       << "\n[materials.ceiling]\nreflectance = " << ceiling
       << "\nemission = 1.0\n[materials.wall]\nreflectance = " << wall << "\n";
  write("cube.toml", toml.str());
}

double mean_radiosity(const SolvedMesh& solved, const std::string& material) {
  double power = 0, area = 0;
  for (Index i = 0; i < solved.mesh.patch_count(); ++i) {
    if (solved.mesh.material_of(i).name != material) continue;
    power += solved.mesh.area(i) * solved.patch_radiosity(i, 0);
    area += solved.mesh.area(i);
  }
  return power / area;
}

void expect_one_error(const Outcome& run, int status, const std::string& part) {
  EXPECT_EQ(run.status, status);
  EXPECT_THAT(run.err, ::testing::StartsWith("radiosity: error: "));
  EXPECT_THAT(run.err, ::testing::HasSubstr(part));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_THAT(run.err, ::testing::EndsWith("\n"));
}

}  // namespace radiosity::testing
