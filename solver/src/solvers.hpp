// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "radiosity/solver/solver.hpp"

namespace radiosity {

std::unique_ptr<Solver> make_conjugate_gradient();
std::unique_ptr<Solver> make_gauss_seidel();
std::unique_ptr<Solver> make_jacobi();
std::unique_ptr<Solver> make_progressive();

/// The largest over bands of Σ_i A_i |r_i| / Σ_i A_i E_i; bands without emission do not count.
double power_share(const RadiositySystem& system, const BandArray& residual);

/// r = E − B + ρ F B.
BandArray residual(const RadiositySystem& system, const BandArray& radiosity);

}  // namespace radiosity
