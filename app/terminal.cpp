// SPDX-License-Identifier: GPL-3.0-or-later
#include "terminal.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>

namespace radiosity::app {
namespace {

std::atomic<bool> interrupt_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "needed in a signal handler");

}  // namespace

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = [](int) { interrupt_flag.store(true); };
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;  // the second one finds the default: kill
  sigaction(SIGINT, &action, nullptr);
}

bool interrupted() {
  return interrupt_flag.load();
}

ProgressBar::ProgressBar(const Console& console, std::string label)
    : visible_(!console.quiet() && isatty(STDERR_FILENO) == 1), label_(std::move(label)) {}

ProgressBar::~ProgressBar() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");  // erases the line
}

bool ProgressBar::operator()(double fraction) {
  using namespace std::chrono_literals;
  const auto now = Clock::now();
  // Work that ends at once needs no bar, and ten pictures a second are enough.
  if (visible_ && now - start_ > 300ms && now - last_ > 100ms) {
    last_ = now;
    drawn_ = true;
    constexpr int kWidth = 30;
    const double done = std::clamp(fraction, 0.0, 1.0);
    const std::chrono::duration<double> elapsed = now - start_;
    const std::string left =
        done > 0 ? seconds_text(elapsed.count() * (1 - done) / done) + " left" : std::string();
    const auto filled = static_cast<int>(done * kWidth);
    fmt::print(stderr, "\r{:<15}[{:#<{}}{:.<{}}] {:3.0f} %  {}\x1b[K", label_, "", filled, "",
               kWidth - filled, 100 * done, interrupted() ? "stopping" : left);
    std::fflush(stderr);
  }
  return !interrupted();
}

std::string bytes_text(double bytes) {
  constexpr std::array kUnits = {"bytes", "kB", "MB", "GB", "TB", "PB"};
  std::size_t unit = 0;
  for (; bytes >= 1000 && unit + 1 < kUnits.size(); ++unit) bytes /= 1000;
  return unit == 0 ? fmt::format("{:.0f} {}", bytes, kUnits[unit])
                   : fmt::format("{:.3g} {}", bytes, kUnits[unit]);
}

std::string seconds_text(double seconds) {
  if (seconds < 0.0995) return fmt::format("{:.2g} ms", 1e3 * seconds);
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = std::llround(std::min(seconds, 1e12));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

}  // namespace radiosity::app
