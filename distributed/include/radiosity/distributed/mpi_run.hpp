// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity {

/// This process as one of those that mpiexec started, from MPI_Init to MPI_Finalize. One at a time, and one in the life of a process.
/// All calls to MPI and PETSc come from the thread that made it.
class MpiRun {
 public:
  /// Whether a launcher of MPI programs (Open MPI, MPICH, Slurm) says that it started this process.
  static bool launched();

  MpiRun();
  ~MpiRun();
  MpiRun(const MpiRun&) = delete;
  MpiRun& operator=(const MpiRun&) = delete;

  /// All processes of the run. Must not be used after the run.
  const std::shared_ptr<const Ranks>& ranks() const { return ranks_; }
  /// Threads for this one, so that those on one machine share its cores: 0, as many as there are, where it is bound to some of them.
  int threads() const;
  /// Processes on this machine.
  int on_this_machine() const { return local_; }

  /// What rank 0 has of it, on all ranks.
  std::string broadcast(const std::string& text) const;

  /// Bytes that reached this process from others so far, and the seconds that it spent in exchanging them.
  struct Traffic {
    std::uint64_t bytes = 0;
    double seconds = 0;
  };
  Traffic traffic() const;

  /// Ends all processes with this exit status.
  [[noreturn]] void abort(int status) const;

  /// Conjugate gradients of PETSc's KSP, on the symmetric form of a system whose F is a DistributedFormFactors, even light deflated, to
  /// the same residual as our own. `options` is added to PETSc's options database, such as "-ksp_monitor -ksp_view". Bands and components
  /// share α and β, so that the iterates differ from our own within the tolerance. Throws InputError where PETSc refuses the options.
  std::unique_ptr<Solver> make_petsc_solver(const std::string& options);

 private:
  int local_ = 1;
  bool petsc_ = false;
  std::shared_ptr<const Ranks> ranks_;
};

}  // namespace radiosity
