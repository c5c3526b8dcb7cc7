// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "radiosity/meshing/progress.hpp"
#include "radiosity/simulation/solve_scene.hpp"
#include "radiosity/simulation/stopwatch.hpp"

namespace radiosity {

/// Tells the caller how far the work is, and remembers that it is to stop: because the caller said so, or the time is up.
class Watch {
 public:
  explicit Watch(const SolveOptions& options) : options_(options) {}

  Progress of(SolveStage stage) {
    return [this, stage](double fraction) {
      if (options_.progress && !options_.progress(stage, fraction)) stopped_ = true;
      return !stopped();
    };
  }
  bool stopped() const { return stopped_ || left() <= 0; }
  double left() const { return options_.seconds - clock_.elapsed(); }

 private:
  const SolveOptions& options_;
  Stopwatch clock_;
  bool stopped_ = false;
};

}  // namespace radiosity
