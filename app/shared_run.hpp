// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity::app {

/// What this process, one of several, has from the run that it is a part of.
struct SharedRun {
  std::shared_ptr<const Ranks> ranks;
  /// What rank 0 has of it.
  std::function<std::string(const std::string&)> broadcast;
  /// Where another solver than our own was asked for.
  std::function<std::unique_ptr<Solver>()> make_solver;
  /// Bytes received from others so far, and seconds of exchanging them.
  std::function<std::pair<std::uint64_t, double>()> traffic;
};

}  // namespace radiosity::app
