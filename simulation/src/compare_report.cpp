// SPDX-License-Identifier: GPL-3.0-or-later
// What a comparison tells.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "radiosity/simulation/compare.hpp"

namespace radiosity {

std::vector<std::size_t> pareto_front(std::span<const CostAndError> points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(points[a].cost, points[a].error) < std::pair(points[b].cost, points[b].error);
  });
  std::vector<std::size_t> front;
  for (const std::size_t k : order)
    if (front.empty() || points[k].error < points[front.back()].error) front.push_back(k);
  return front;
}

std::optional<std::size_t> cheapest(std::span<const CostAndError> points, double error) {
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (points[k].error <= error && (!best || points[k].cost < points[*best].cost)) best = k;
  return best;
}

double ComparedReference::own_error() const {
  return std::hypot(noise, patch_error.value_or(0));
}

std::optional<double> error_at_most(const Comparison& comparison, const ComparedRun& run) {
  if (run.total)
    return run.total->rms +
           std::hypot(comparison.meshes[run.mesh].own_noise, comparison.finer->patch_error.value_or(0));
  if (run.traced) return run.traced->rms + run.traced->standard_error;
  if (run.factors) return run.factors->rms + comparison.factors.noise;
  return std::nullopt;
}

Measured measured(const Comparison& comparison) {
  Measured out;
  for (std::size_t r = 0; r < comparison.runs.size(); ++r) {
    const ComparedRun& run = comparison.runs[r];
    const auto error = error_at_most(comparison, run);
    if (!error) continue;
    out.index.push_back(r);
    out.by_seconds.push_back({run.seconds, *error});
    out.by_bytes.push_back({run.bytes, *error});
  }
  return out;
}

}  // namespace radiosity
