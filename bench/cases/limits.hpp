// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "radiosity/solver/solver.hpp"

namespace radiosity::test {

/// An extreme case with a known answer. Tests require each to hold, bench_limits prints them as the table of docs/limits.md.
struct Limit {
  struct Outcome {
    double error =
        0;  ///< largest over all that was tried; not-a-number where the answer should have been a refusal
    double allowed = 0;  ///< the case holds when error ≤ allowed
    std::string came_out;
  };
  std::string name;   ///< of the test: one word
  std::string asked;  ///< what is extreme about it
  std::string exact;  ///< the right answer
  std::string tried;  ///< methods and solvers
  std::function<Outcome()> run;
};

std::vector<Limit> limits();

/// What solves in place of our own conjugate gradients from now on; nothing: they do.
using LimitSolve = std::function<SolveResult(const RadiositySystem& system, const SolverOptions& options)>;
void solve_limits_by(LimitSolve solve);

}  // namespace radiosity::test
