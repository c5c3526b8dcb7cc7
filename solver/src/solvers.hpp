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

/// The largest over bands and components of Σ A_i |r_i| / Σ A_i E_i; components without emission do not count.
double power_share(const RadiositySystem& system, const BandArray& residual);

/// r = E − B + ρ F B. With B = m + w, m the mean of the component, the terms are those of
///   r = E − (1 − ρ + ρ·escaped) m − (w − ρ F w),
/// which do not cancel where ρ is near 1 and w small beside m.
BandArray residual(const RadiositySystem& system, const BandArray& radiosity);

/// a/b where b > 0, elsewhere 0; divides by nothing else.
BandArray divide_or_zero(const BandArray& a, const BandArray& b);

}  // namespace radiosity
