// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "radiosity/simulation/error_estimate.hpp"

namespace radiosity {

/// A solve on the way to an accuracy: how it was done, how far it was off, what it cost.
struct AccuracyRound {
  const FormFactorMethodInfo* method = nullptr;
  FormFactorOptions options;  ///< in force
  bool exact = false;         ///< factors without error: samples do not matter
  bool reciprocal = false;    ///< pairs, not directions
  double patch_size = 0;      ///< m; 0 where no face had to be divided for its size
  Index patches = 0;
  double seconds = 0;  ///< form factors, solve and error estimate
  ErrorEstimate error;
};

struct AccuracyGoal {
  double error = 0.01;                                       ///< ErrorEstimate::total
  double seconds = std::numeric_limits<double>::infinity();  ///< left for what is to come
  std::size_t bytes = 0;                                     ///< that assembling F may take; 0: no limit
};

/// What to do next.
struct AccuracyPlan {
  const FormFactorMethodInfo* method = nullptr;
  FormFactorOptions options;
  double patch_size = 0;          ///< m; 0 where only the number of patches is known
  double tolerance = 0;           ///< of the solver
  double patches = 0;             ///< expected
  double error = 0;               ///< expected; above the goal where time or memory do not reach further
  double seconds = 0, bytes = 0;  ///< expected
  double seconds_of_goal =
      0;  ///< expected of the solve that reaches the goal: more where this one is a step towards it
};

/// The cheapest solve that should reach the goal, by what the last round of each method showed. With n patches and N samples, the
/// squared errors fall and the costs grow as
///   e_p² = P n^(−p),  e_f² = Q N^(−q),  T = C n^a N^b,
/// p the order measured, q = 1 for directions and 2 for pairs. T is least under e_p² + e_f² = e² where
///   e_p² : e_f² = a/p : b/q.
/// C comes from the rounds, so from this machine; a, b from measurement: (2, ½) for pairs, (1.3, 0.8) for rays, (1.8, 0.6) for
/// hemicubes, whose N are viewpoints. The plan aims a little below the goal, because an estimate wavers; it grows the mesh at most 16-fold at once. Where time or memory do
/// not reach, it is the best that they allow; nothing where they allow no more than has been done, or where no round knows the
/// error of its form factors.
std::optional<AccuracyPlan> plan_accuracy(std::span<const AccuracyRound> rounds, const AccuracyGoal& goal);

}  // namespace radiosity
