// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "radiosity/solver/solver.hpp"

namespace radiosity {

void begin_petsc(const std::string& options);
void add_petsc_options(const std::string& options);
void end_petsc();

/// See MpiRun::make_petsc_solver.
std::unique_ptr<Solver> petsc_conjugate_gradient();

}  // namespace radiosity
