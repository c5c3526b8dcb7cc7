// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "radiosity/solver/solver.hpp"

namespace radiosity {

std::unique_ptr<Solver> make_conjugate_gradient();
std::unique_ptr<Solver> make_gauss_seidel();
std::unique_ptr<Solver> make_jacobi();
std::unique_ptr<Solver> make_progressive();
std::unique_ptr<Solver> make_progressive_overshoot();

/// r = E − B + ρ F B. With B = m + w, m the mean of the component, the terms are those of
///   r = E − (1 − ρ + ρ·escaped) m − (w − ρ F w),
/// which do not cancel where ρ is near 1 and w small beside m.
BandArray residual(const RadiositySystem& system, const BandArray& radiosity);

}  // namespace radiosity
