// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "options.hpp"

namespace radiosity {
class MpiRun;
}

namespace radiosity::app {

/// The processes that mpiexec started, this being one of them; where the program was started by itself, or built without MPI, this one
/// alone. Of several, rank 0 alone writes to stdout.
class Processes {
 public:
  Processes();
  ~Processes();

  /// Lets a command take part in the work of all. Throws UsageError where it cannot be shared.
  void share(Options& options);

  /// Before an error is told: what all meet at the same time is told by rank 0, and ends the others meanwhile.
  void wait_to_tell() const;
  /// After that, ends all of them.
  void end_all(int status) const;

 private:
  std::unique_ptr<MpiRun> run_;
};

}  // namespace radiosity::app
