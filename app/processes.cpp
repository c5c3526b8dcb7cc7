// SPDX-License-Identifier: GPL-3.0-or-later
#include "processes.hpp"

#ifdef RADIOSITY_MPI

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "radiosity/distributed/session.hpp"

namespace radiosity::app {

Processes::Processes() {
  if (!Session::launched()) return;
  session_ = std::make_unique<Session>();
  if (session_->ranks()->rank() > 0 && std::freopen("/dev/null", "w", stdout) == nullptr) std::fclose(stdout);
}

Processes::~Processes() = default;

void Processes::share(Options& options) {
  if (!session_ && !options.petsc) return;
  if (!session_) session_ = std::make_unique<Session>();
  Session& session = *session_;
  if (options.command != "solve") {
    if (session.ranks()->count() > 1)
      throw UsageError(fmt::format("radiosity {} runs in one process; several can share radiosity solve",
                                   options.command));
    return;
  }
  SharedRun& shared = options.shared.emplace();
  shared.ranks = session.ranks();
  shared.broadcast = [&](const std::string& text) { return session.broadcast(text); };
  shared.traffic = [&] {
    const Session::Traffic traffic = session.traffic();
    return std::pair(traffic.bytes, traffic.seconds);
  };
  if (options.petsc)
    shared.make_solver = [&, petsc = *options.petsc] { return session.make_petsc_solver(petsc); };
  if (options.threads == 0) options.threads = session.threads();
  if (options.memory_limit_bytes == 0)
    options.memory_limit_bytes = static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) *
                                 static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) /
                                 static_cast<std::size_t>(session.on_this_machine());
}

void Processes::wait_to_tell() const {
  using namespace std::chrono_literals;
  if (!session_) return;
  const int rank = session_->ranks()->rank();
  if (rank > 0) std::this_thread::sleep_for(1s + std::min(rank, 50) * 100ms);
}

void Processes::end_all(int status) const {
  if (session_) session_->abort(status);
}

}  // namespace radiosity::app

#else

namespace radiosity {
class Session {};
}  // namespace radiosity

namespace radiosity::app {

Processes::Processes() = default;
Processes::~Processes() = default;
void Processes::share(Options&) {}
void Processes::wait_to_tell() const {}
void Processes::end_all(int) const {}

}  // namespace radiosity::app

#endif
