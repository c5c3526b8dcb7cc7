// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/estimate_seconds.hpp"

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace radiosity {

double estimate_seconds(const FormFactorMethod& method, Index patches, Index rows, double patience) {
  if (patches <= 0) return 0;
  using Clock = std::chrono::steady_clock;
  const FormFactorMethod::Sink ignore = [](auto&&...) {};
  const auto seconds_of = [&](Index row) {
    const auto start = Clock::now();
    method.rows(row, row + 1, method.reciprocal(), ignore);
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  // From the middle on and round: where only entries right of the diagonal are computed, the middle row costs as much as the
  // mean. What is made once is made with the first, which stands for itself only where patience ends with it.
  const Index count = std::clamp<Index>(rows, 1, patches), middle = count / 2;
  const auto row_of = [&](Index k) {
    return static_cast<Index>((2 * static_cast<std::int64_t>(k % count) + 1) * patches / (2 * count));
  };
  double sum = seconds_of(row_of(middle));
  Index done = 1;
  if (sum < patience) {
    sum = done = 0;
    do sum += seconds_of(row_of(middle + done));
    while (++done < count && sum < patience);
  }
  const auto threads =
      std::min(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism),
               static_cast<std::size_t>(tbb::info::default_concurrency()));
  return sum / done * patches / static_cast<double>(threads);
}

}  // namespace radiosity
