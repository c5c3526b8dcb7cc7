// SPDX-License-Identifier: GPL-3.0-or-later
#include "gnuplot.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <memory>
#include <system_error>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// Gone when it is closed.
class TemporaryFile {
 public:
  TemporaryFile() : file_(std::tmpfile(), &std::fclose) {
    if (!file_) throw IoError("gnuplot: no temporary file can be made");
  }
  int descriptor() const { return fileno(file_.get()); }
  void write(const std::string& text) const {
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() || std::fflush(file_.get()) != 0)
      throw IoError("gnuplot: the disk of the temporary files is full");
    std::rewind(file_.get());
  }
  std::string read() const {
    std::rewind(file_.get());
    std::string text;
    std::array<char, 4096> buffer{};
    while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file_.get()))
      text.append(buffer.data(), n);
    return text;
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

}  // namespace

std::string gnuplot(const std::string& script) {
  const TemporaryFile in, out, err;
  in.write(script);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.descriptor(), STDERR_FILENO);
  std::array<char, 8> name{"gnuplot"};
  std::array<char, 3> no_start_up_file{"-d"};
  std::array<char*, 3> arguments{name.data(), no_start_up_file.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, name.data(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (failed == 0)
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  if (failed != 0)
    throw IoError(
        fmt::format("gnuplot, which draws the diagrams, cannot be started: {}; scripts/setup installs it "
                    "(Debian: gnuplot-nox)",
                    std::generic_category().message(failed)));
  if (status != 0) throw IoError(fmt::format("gnuplot: {}", err.read()));
  return out.read();
}

}  // namespace radiosity
