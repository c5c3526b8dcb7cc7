// SPDX-License-Identifier: GPL-3.0-or-later
#include "processes.hpp"

#ifdef RADIOSITY_MPI

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "radiosity/distributed/mpi_run.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::app {

Processes::Processes() {
  if (!MpiRun::launched()) return;
  run_ = std::make_unique<MpiRun>();
  if (run_->ranks()->rank() > 0 && std::freopen("/dev/null", "w", stdout) == nullptr) std::fclose(stdout);
}

Processes::~Processes() = default;

void Processes::share(Options& options) {
  if (!run_ && !options.petsc) return;
  if (!run_) run_ = std::make_unique<MpiRun>();
  MpiRun& mpi_run = *run_;
  if (options.command != "solve" && options.command != "probe") {
    if (mpi_run.ranks()->count() > 1)
      throw UsageError(fmt::format(
          "radiosity {} runs in one process; several can share radiosity solve and probe", options.command));
    return;
  }
  SharedRun& shared = options.shared.emplace();
  shared.ranks = mpi_run.ranks();
  shared.broadcast = [&](const std::string& text) { return mpi_run.broadcast(text); };
  shared.traffic = [&] {
    const MpiRun::Traffic traffic = mpi_run.traffic();
    return std::pair(traffic.bytes, traffic.seconds);
  };
  if (options.petsc)
    shared.make_solver = [&, petsc = *options.petsc] { return mpi_run.make_petsc_solver(petsc); };
  if (options.threads == 0) options.threads = mpi_run.threads();
  if (options.memory_limit_bytes == 0)
    options.memory_limit_bytes = memory_limit(0) / static_cast<std::size_t>(mpi_run.on_this_machine());
}

void Processes::wait_to_tell() const {
  using namespace std::chrono_literals;
  if (!run_) return;
  const int rank = run_->ranks()->rank();
  if (rank > 0) std::this_thread::sleep_for(1s + std::min(rank, 50) * 100ms);
}

void Processes::end_all(int status) const {
  if (run_) run_->abort(status);
}

}  // namespace radiosity::app

#else

namespace radiosity {
class MpiRun {};
}  // namespace radiosity

namespace radiosity::app {

Processes::Processes() = default;
Processes::~Processes() = default;
void Processes::share(Options&) {}
void Processes::wait_to_tell() const {}
void Processes::end_all(int) const {}

}  // namespace radiosity::app

#endif
