// SPDX-License-Identifier: GPL-3.0-or-later
#include "child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <limits>
#include <optional>
#include <system_error>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

using Clock = std::chrono::steady_clock;

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

[[noreturn]] void fail(const char* what) {
  throw IoError(fmt::format("{}: {}", what, std::generic_category().message(errno)));
}

/// Memory in use by a process, bytes; 0 where there is no telling.
std::uint64_t resident_bytes(pid_t process) {
  unsigned long long pages = 0;
  if (std::FILE* const file = std::fopen(fmt::format("/proc/{}/statm", process).c_str(), "r")) {
    if (std::fscanf(file, "%*u %llu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

bool write_all(int descriptor, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(descriptor, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) at += static_cast<std::size_t>(written);
  }
  return true;
}

constexpr int kDone = 0, kFailed = 3, kOutOfMemory = 4;

[[noreturn]] void be_child(const std::function<std::string()>& work, int result, pid_t parent) {
  // Ends with its parent, at Ctrl-C, without a core file, and without a word from libraries.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kFailed);
  for (const int caught : {SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS})
    std::signal(caught, SIG_DFL);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  const int silence = ::open("/dev/null", O_WRONLY);
  if (silence < 0 || dup2(silence, STDOUT_FILENO) < 0 || dup2(silence, STDERR_FILENO) < 0) _exit(kFailed);
  try {
    _exit(write_all(result, work()) ? kDone : kFailed);
  } catch (const std::bad_alloc&) {
    _exit(kOutOfMemory);
  } catch (...) {
    _exit(kFailed);
  }
}

/// CPU time of a process, seconds; 0 where there is no telling.
double cpu_seconds(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Waits for a child and takes what it writes.
class Parent {
 public:
  Parent(pid_t child, int pipe, const ChildLimits& limits) : child_(child), pipe_(pipe), limits_(limits) {}
  ~Parent() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    wait();
  }
  Parent(const Parent&) = delete;
  Parent& operator=(const Parent&) = delete;

  /// Absent where the child does nothing at all for that many seconds.
  std::optional<ChildResult> result(double patience) {
    ChildResult result{ChildEnd::done, {}};
    while (result.end == ChildEnd::done && !read_some(result.bytes)) {
      result.end = within_limits();
      if (idle() > patience) return {};
    }
    if (result.end != ChildEnd::done) return result;
    const int status = wait();
    if (WIFEXITED(status) && WEXITSTATUS(status) == kOutOfMemory)
      result.end = ChildEnd::out_of_memory;
    else if (!WIFEXITED(status) || WEXITSTATUS(status) != kDone)
      result.end = ChildEnd::crashed;
    return result;
  }

 private:
  /// True at the end.
  bool read_some(std::string& bytes) {
    // A process cannot take more than about 100 MB in that time.
    constexpr int kMilliseconds = 20;
    pollfd waiting{pipe_, POLLIN, 0};
    if (poll(&waiting, 1, kMilliseconds) <= 0) return false;
    const ssize_t count = ::read(pipe_, chunk_.data(), chunk_.size());
    if (count > 0) bytes.append(chunk_.data(), static_cast<std::size_t>(count));
    return count == 0 || (count < 0 && errno != EINTR);
  }

  ChildEnd within_limits() const {
    if (std::chrono::duration<double>(Clock::now() - start_).count() > limits_.seconds)
      return ChildEnd::out_of_time;
    return resident_bytes(child_) > before_ + limits_.bytes ? ChildEnd::out_of_memory : ChildEnd::done;
  }

  /// Seconds since the child was last seen to work.
  double idle() {
    const auto now = Clock::now();
    if (const double cpu = cpu_seconds(child_); cpu > cpu_) {
      cpu_ = cpu;
      worked_ = now;
    }
    return std::chrono::duration<double>(now - worked_).count();
  }

  int wait() {
    int status = 0;  // and so it stays where the program ignores SIGCHLD, and the system does not keep it
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return status;
  }

  pid_t child_;
  int pipe_;
  ChildLimits limits_;
  std::array<char, 65536> chunk_{};
  std::uint64_t before_ = resident_bytes(getpid());  // the child shares these pages
  Clock::time_point start_ = Clock::now(), worked_ = start_;
  double cpu_ = 0;
};

// Memory is watched rather than limited by setrlimit: the sanitizers reserve terabytes of addresses, and a library
// that is refused memory may go on with half a result.
std::optional<ChildResult> attempt(const std::function<std::string()>& work, const ChildLimits& limits,
                                   double patience) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("no pipe to a child process");
  Descriptor out(ends[0]), in(ends[1]);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) fail("no child process");
  if (child == 0) be_child(work, in.number(), parent);
  in.close();
  return Parent(child, out.number(), limits).result(patience);
}

}  // namespace

// A lock that another thread holds at the fork is never released in the child, which then sleeps: allocators other than
// glibc's have such locks, those of the sanitizers among them. The next child finds the lock free.
ChildResult run_in_child(const std::function<std::string()>& work, const ChildLimits& limits) {
  constexpr int kAttempts = 4;
  constexpr double kPatience = 1;
  for (int k = 1; k < kAttempts; ++k)
    if (auto result = attempt(work, limits, kPatience)) return std::move(*result);
  return *attempt(work, limits, std::numeric_limits<double>::infinity());
}

// Meshes take below 100 bytes for each byte of their file, and walls with openings in IFC below 20 s a megabyte;
// a damaged file of 10 KB was seen to take 6 GB and 38 s.
ChildLimits limits_for(std::uint64_t bytes) {
  return {1'000'000'000 + 100 * bytes, 10 + 20e-6 * static_cast<double>(bytes)};
}

std::string run_isolated(const std::filesystem::path& file, const std::string& library,
                         const std::function<std::string()>& work) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  const ChildLimits limits = limits_for(error ? 0 : bytes);
  ChildResult result = run_in_child(work, limits);
  const auto refuse = [&](const std::string& what) {
    throw IoError(fmt::format("{}: the reader ({}) {}", file.string(), library, what));
  };
  switch (result.end) {
    case ChildEnd::crashed:
      refuse("crashed on this file");
      break;
    case ChildEnd::out_of_memory:
      refuse(fmt::format("needs more than {:.1f} GB for this file", static_cast<double>(limits.bytes) / 1e9));
      break;
    case ChildEnd::out_of_time:
      refuse(fmt::format("took longer than {:.0f} s over this file", limits.seconds));
      break;
    case ChildEnd::done:
      break;
  }
  return std::move(result.bytes);
}

}  // namespace radiosity
