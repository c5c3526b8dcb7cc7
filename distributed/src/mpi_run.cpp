// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/distributed/mpi_run.hpp"

#include <mpi.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numeric>

#include "petsc_solver.hpp"
#include "radiosity/simulation/stopwatch.hpp"

namespace radiosity {
namespace {

// An error in MPI ends the run: MPI_ERRORS_ARE_FATAL, the default.
class MpiRanks final : public Ranks {
 public:
  MpiRanks() {
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  }
  int count() const override { return count_; }
  int rank() const override { return rank_; }

  void sum(std::span<std::uint64_t> values) const override {
    const Exchange exchange(*this, count_ > 1 ? values.size_bytes() : 0);
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_UINT64_T, MPI_SUM,
                  MPI_COMM_WORLD);
  }
  void all_gather(std::span<const double> own, std::span<const int> counts,
                  std::span<double> all) const override {
    std::vector<int> places(counts.size(), 0);
    std::partial_sum(counts.begin(), counts.end() - 1, places.begin() + 1);
    const std::size_t received = std::reduce(counts.begin(), counts.end(), std::size_t{0}) - own.size();
    const Exchange exchange(*this, received * sizeof(double));
    MPI_Allgatherv(own.data(), static_cast<int>(own.size()), MPI_DOUBLE, all.data(), counts.data(),
                   places.data(), MPI_DOUBLE, MPI_COMM_WORLD);
  }
  void exchange(std::span<const std::span<const std::byte>> to,
                std::vector<std::vector<std::byte>>& from) const override {
    const auto all = static_cast<std::size_t>(count_);
    std::vector<int> sent(all), received(all);
    std::ranges::transform(to, sent.begin(),
                           [](const auto& bytes) { return static_cast<int>(bytes.size()); });
    Exchange exchange(*this, 0);
    MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, MPI_COMM_WORLD);
    from.resize(all);
    std::vector<MPI_Request> requests;
    for (int k = 1; k < count_; ++k) {  // beginning with the next, so that not all send to one at a time
      const int other = (rank_ + k) % count_;
      const auto r = static_cast<std::size_t>(other);
      from[r].resize(static_cast<std::size_t>(received[r]));
      exchange.bytes += from[r].size();
      MPI_Irecv(from[r].data(), received[r], MPI_BYTE, other, 0, MPI_COMM_WORLD, &requests.emplace_back());
      MPI_Isend(to[r].data(), sent[r], MPI_BYTE, other, 0, MPI_COMM_WORLD, &requests.emplace_back());
    }
    MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  }

  MpiRun::Traffic traffic() const { return traffic_; }

 private:
  struct Exchange {
    Exchange(const MpiRanks& of, std::size_t received) : bytes(received), ranks(of) {}
    ~Exchange() {
      ranks.traffic_.bytes += bytes;
      ranks.traffic_.seconds += watch.elapsed();
    }
    Exchange(const Exchange&) = delete;
    Exchange& operator=(const Exchange&) = delete;
    std::size_t bytes;
    const MpiRanks& ranks;
    Stopwatch watch;
  };

  int count_ = 1, rank_ = 0;
  mutable MpiRun::Traffic traffic_;
};

}  // namespace

bool MpiRun::launched() {
  constexpr std::array kSetByLaunchers = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "PMI_RANK"};
  return std::ranges::any_of(kSetByLaunchers, [](const char* name) { return std::getenv(name) != nullptr; });
}

MpiRun::MpiRun() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  ranks_ = std::make_shared<const MpiRanks>();
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, &local_);
  MPI_Comm_free(&machine);
}

MpiRun::~MpiRun() {
  if (petsc_) end_petsc();
  MPI_Finalize();
}

int MpiRun::threads() const {
  cpu_set_t bound;
  CPU_ZERO(&bound);
  const auto cores = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  if (sched_getaffinity(0, sizeof bound, &bound) == 0 && CPU_COUNT(&bound) < cores) return 0;
  return std::max(1, cores / local_);
}

std::string MpiRun::broadcast(const std::string& text) const {
  std::string all = text;
  std::uint64_t size = all.size();
  MPI_Bcast(&size, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
  all.resize(size);
  constexpr std::size_t kAtOnce = 1 << 30;
  for (std::size_t from = 0; from < size; from += kAtOnce)
    MPI_Bcast(all.data() + from, static_cast<int>(std::min(kAtOnce, size - from)), MPI_BYTE, 0,
              MPI_COMM_WORLD);
  return all;
}

MpiRun::Traffic MpiRun::traffic() const {
  return static_cast<const MpiRanks&>(*ranks_).traffic();
}

void MpiRun::abort(int status) const {
  MPI_Abort(MPI_COMM_WORLD, status);
  std::_Exit(status);
}

std::unique_ptr<Solver> MpiRun::make_petsc_solver(const std::string& options) {
  if (petsc_)
    add_petsc_options(options);
  else
    begin_petsc(options);
  petsc_ = true;
  return petsc_conjugate_gradient();
}

}  // namespace radiosity
