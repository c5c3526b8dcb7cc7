// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <limits>

#include "assembly_steps.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Rows whose sums are scaled to their targets, and how far.
struct Scaled {
  Eigen::ArrayXd factor;
  std::vector<std::uint8_t> frozen;  // rows that do not agree with the others, left as they are
  explicit Scaled(Index n) : factor(Eigen::ArrayXd::Ones(n)), frozen(n, 0) {}
  // Multiplies factor i; a row that would need more than sampling could have missed is frozen.
  void multiply(Index i, double by) {
    if (frozen[i] != 0) return;
    factor[i] *= by;
    if (factor[i] >= 1 / tolerance::kMostScaling && factor[i] <= tolerance::kMostScaling) return;
    factor[i] = 1;
    frozen[i] = 1;
  }
};

// c by Sinkhorn's iteration [Knight2008], each replaced row as a whole: they are few.
Eigen::ArrayXd scale_replaced(const RowList& rows, const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas,
                              const std::vector<Index>& replaced, const Ranks* ranks) {
  constexpr int kSteps = 30;
  const auto n = static_cast<Index>(rows.size());
  Scaled whole(n);
  for (int step = 0; step < kSteps; ++step) {
    Eigen::ArrayXd by = Eigen::ArrayXd::Ones(n);
    for (const Index i : replaced) {
      double reached = 0;
      for (const Entry& e : rows[i]) reached += static_cast<double>(e.value) * whole.factor[e.column];
      if (reached > 0) by[i] = std::sqrt(target[i] * areas[i] / (whole.factor[i] * reached));
    }
    gather(ranks, by);
    for (const Index i : replaced) whole.multiply(i, by[i]);
  }
  return whole.factor;
}

}  // namespace

// D diagonal such that Σ_j D_i S_ij D_j = A_i t_i, by Newton's method in log D: with R_i the row sums of the scaled F,
//   (diag(A R) + D S D) δ = A (t − R),   D ← D exp(δ),
// where each step is solved by conjugate gradients preconditioned with diag(A R). (The symmetric Sinkhorn iteration
// D_i ← D_i √(t_i / R_i) [Knight2008] takes 100 products where this takes 30.) Patches that nearly only see each other may
// not agree on what they exchange: then there is no such D. Rows that would need more than kMostScaling are left out, so that
// the others are not bent to fit them; of all iterates the one with the least error is taken; and no row is left above its
// target. Rows of patches computed pair by pair are scaled first.
RowScaling scaling_to_row_sums(const RowList& rows, const Eigen::ArrayXd& row_target,
                               const Eigen::ArrayXd& areas, ReplacedRows replaced_rows, const Ranks* ranks) {
  constexpr int kSteps = 20;
  constexpr int kInner = 30;
  constexpr double kInnerTolerance = 1e-2;
  constexpr double kEnough = 1e-6;  // what is left goes to the diagonal
  const auto n = static_cast<Index>(rows.size());
  // Where all that see anything were computed pair by pair there is nothing to scale them against.
  Index seeing = 0;
  for (Index i = 0; i < n; ++i) seeing += row_target[i] > 0 && !replaced_rows.has(i) ? 1 : 0;
  if (seeing == 0) replaced_rows = ReplacedRows(n);
  const Eigen::ArrayXd one = Eigen::ArrayXd::Ones(n);
  RowScaling out{one, one, one, std::move(replaced_rows)};
  const ReplacedRows& replaced = out.replaced;
  Eigen::ArrayXd target = row_target;
  if (!replaced.patches.empty()) {
    out.c = scale_replaced(rows, row_target, areas, replaced.patches, ranks);
    for_each_row(n, [&](Index i) {
      for (const Entry& e : rows[i])
        if (replaced.has(i) || replaced.has(e.column))
          target[i] -= out.c[i] * out.c[e.column] * static_cast<double>(e.value) / areas[i];
    });
    gather(ranks, target);
  }
  Scaled sampled(n);
  Eigen::ArrayXd& d = sampled.factor;
  for (const Index i : replaced.patches) {
    d[i] = 0;
    sampled.frozen[i] = 1;
  }
  const auto product = [&](const Eigen::ArrayXd& x) {  // of the scaled F
    Eigen::ArrayXd y(n);
    const Eigen::ArrayXd dx = d * x;
    for_each_row(n, [&](Index i) {
      y[i] = d[i] / areas[i] *
             sum(rows[i], [&](const Entry& e) { return static_cast<double>(e.value) * dx[e.column]; });
    });
    gather(ranks, y);
    return y;
  };
  Eigen::ArrayXd reached, best_reached;
  double before = kInfinity, least = kInfinity;
  for (int step = 0;; ++step) {
    reached = product(one);
    const Eigen::ArrayXd missing = (reached > 0).select(target - reached, 0.0);
    if (const double error = (missing.abs() * areas).sum(); error < least) {
      least = error;
      out.d = d;
      best_reached = reached;
    }
    Eigen::ArrayXd free(n);
    for (Index i = 0; i < n; ++i) free[i] = sampled.frozen[i] == 0 ? 1 : 0;
    const double error = (free * missing.abs()).mean();
    if ((free * missing.abs()).maxCoeff() <= kEnough || !(error <= 0.5 * before) || step == kSteps) break;
    before = error;
    // In the unknown δ, with the rows divided by A R:  δ + F'δ / R = (t − R) / R.
    const Eigen::ArrayXd weight = areas * reached;
    const Eigen::ArrayXd inverse = (reached > 0).select(free / reached.max(1e-300), 0.0);
    Eigen::ArrayXd delta = Eigen::ArrayXd::Zero(n);
    Eigen::ArrayXd r = missing * inverse;
    Eigen::ArrayXd p = r;
    double rr = (weight * r * r).sum();
    const double enough = kInnerTolerance * kInnerTolerance * rr;
    for (int k = 0; k < kInner && rr > enough; ++k) {
      const Eigen::ArrayXd q = p + product(p) * inverse;
      const double curvature = (weight * p * q).sum();
      if (!(curvature > 0)) break;
      delta += rr / curvature * p;
      r -= rr / curvature * q;
      const double next = (weight * r * r).sum();
      p = r + next / rr * p;
      rr = next;
    }
    for (Index i = 0; i < n; ++i) {
      if (sampled.frozen[i] != 0) continue;
      sampled.multiply(i, std::exp(std::clamp(delta[i], -1.0, 1.0)));
      if (sampled.frozen[i] != 0) before = kInfinity;  // another problem
    }
  }
  reached = best_reached + (row_target - target);
  out.s = (reached > row_target).select(row_target / reached.max(1e-300), 1.0);
  return out;
}

RowScaling scaling_to_at_most_one(const Eigen::ArrayXd& row_sums, ReplacedRows replaced) {
  const Eigen::ArrayXd one = Eigen::ArrayXd::Ones(row_sums.size());
  return {one, row_sums.max(1.0).inverse(), one, std::move(replaced)};
}

}  // namespace radiosity
