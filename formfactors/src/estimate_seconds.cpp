// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/estimate_seconds.hpp"

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>

namespace radiosity {

double estimate_seconds(const FormFactorMethod& method, Index patches, Index rows, double patience) {
  using Clock = std::chrono::steady_clock;
  const FormFactorMethod::Sink ignore = [](Index, std::span<const Index>, std::span<const double>, double) {};
  const Index stride = std::max<Index>(1, patches / std::max<Index>(1, rows));
  if (patches > 0) method.rows(0, 1, method.reciprocal(), ignore);  // what is made once is made now
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  Index done = 0;
  for (Index i = stride / 2; i < patches && (done == 0 || elapsed() < patience); i += stride, ++done)
    method.rows(i, i + 1, method.reciprocal(), ignore);
  const auto threads =
      std::min(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism),
               static_cast<std::size_t>(tbb::info::default_concurrency()));
  return done == 0 ? 0 : elapsed() / done * patches / static_cast<double>(threads);
}

}  // namespace radiosity
