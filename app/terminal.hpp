// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>

namespace radiosity::app {

/// From now on Ctrl-C sets a flag; a second Ctrl-C kills.
void catch_interrupts();
bool interrupted();

/// Plain lines on stdout: a label in a column of its own, then text. Silent when quiet.
class Console {
 public:
  explicit Console(bool quiet) : quiet_(quiet) {}

  bool quiet() const { return quiet_; }

  template <class... Args>
  void line(std::string_view label, fmt::format_string<Args...> format, Args&&... args) const {
    if (quiet_) return;
    fmt::print("{:<15}{}\n", label, fmt::format(format, std::forward<Args>(args)...));
    std::fflush(stdout);  // a reader of a log sees each stage as it ends
  }

 private:
  bool quiet_;
};

/// A bar with percentage and time left on stderr where that is a terminal, nothing elsewhere; gone when it is
/// destroyed.
class ProgressBar {
 public:
  ProgressBar(const Console& console, std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Shows the fraction done. False once Ctrl-C was pressed: the caller should stop.
  bool operator()(double fraction);

 private:
  using Clock = std::chrono::steady_clock;

  bool visible_, drawn_ = false;
  std::string label_;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

/// "1.23 GB", in powers of ten.
std::string bytes_text(double bytes);

/// "1.2 ms", "3.4 s", "5 min 10 s", "2 h 5 min".
std::string seconds_text(double seconds);

}  // namespace radiosity::app
