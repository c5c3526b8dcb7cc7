// SPDX-License-Identifier: GPL-3.0-or-later
#include "solvers.hpp"

namespace radiosity {
namespace {

/// B ← E + ρ F B. The step taken is the residual of the values before it. Converges when max_i ρ_i Σ_j F_ij < 1, at
/// that rate at worst.
class Jacobi final : public Solver {
  void iterate(const RadiositySystem& system, const SolverOptions&, State& state,
               const Step& step) const override {
    BandArray r = residual(system, state.radiosity);
    while (step(power_share(system, r))) {
      state.radiosity += r;
      r = residual(system, state.radiosity);
    }
  }
  Index default_max_iterations(Index) const override { return 10000; }
};

}  // namespace

std::unique_ptr<Solver> make_jacobi() {
  return std::make_unique<Jacobi>();
}

}  // namespace radiosity
