// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

namespace radiosity {

/// Wall time in seconds.
class Stopwatch {
 public:
  /// Since construction or the last lap.
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double lap() {
    const double seconds = elapsed();
    start_ = Clock::now();
    return seconds;
  }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point start_ = Clock::now();
};

}  // namespace radiosity
