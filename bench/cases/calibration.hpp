// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "radiosity/simulation/traced_reference.hpp"

namespace radiosity::test {

/// A solution whose error is known, and what estimate_error said of it.
struct CalibrationCase {
  std::string scene, method;
  double truth = 0, estimate = 0;  ///< √(Σ A e² / Σ A (B − E)²)
  /// What tracing says of it, where that was wanted; not where faces are kept, as the estimate is not of those there.
  std::optional<TracedError> traced = {};
  /// Estimate over truth; where neither is more than what solvers leave, 1.
  double ratio() const { return truth < 1e-6 && estimate < 1e-6 ? 1 : estimate / truth; }
};

/// Scenes with known answers: lit cubes and `rooms` random rooms, against their own patches cut into sixteen, with patches of one
/// size or also of a smaller one (`smaller_too`); a furnace with a box in it; a ball and a shell kept as they are (there the
/// estimate is of the form factors alone). Each by several methods and settings; `method` leaves out the others. `seen` is called with
/// each case as it is done. With `trace`, that judges too, on 512 patches of each mesh in 32 rounds of 128 paths.
std::vector<CalibrationCase> calibration(int rooms, bool smaller_too,
                                         const std::function<void(const CalibrationCase&)>& seen = {},
                                         std::string_view method = "", const TraceIrradiance& trace = {});

}  // namespace radiosity::test
