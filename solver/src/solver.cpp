// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/find_named.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "solvers.hpp"

namespace radiosity {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

constexpr std::array<SolverInfo, 5> kSolvers{{
    {"conjugate-gradient", "conjugate gradients on the symmetric form, even light deflated",
     "HestenesStiefel1952", true, make_conjugate_gradient},
    {"gauss-seidel", "gathering, with the values of the sweep under way", "Goral1984", true,
     make_gauss_seidel},
    {"jacobi", "gathering, one bounce of light an iteration", "Goral1984", true, make_jacobi},
    {"progressive", "shooting from the patch with most unshot power; reads a row of F at a time", "Cohen1988",
     false, make_progressive},
    {"progressive-overshoot", "shooting, with what the patch will still receive; reads a row of F at a time",
     "Feda1992", false, make_progressive_overshoot},
}};

// What is lost at a reflection, area-weighted mean over each component: components × bands.
struct MeanLoss {
  BandArray absorbed, escaped;

  explicit MeanLoss(const RadiositySystem& system) {
    const BandArray area = system.areas().replicate(1, system.bands());
    const BandArray total = system.sums(area);
    absorbed = system.sums(area * system.absorptance()) / total;
    escaped = system.sums(area * (system.reflectance().colwise() * system.escaped())) / total;
  }
};

Index first_patch(const RadiositySystem& system, Index component) {
  const auto& all = system.component();
  return static_cast<Index>(std::find(all.begin(), all.end(), component) - all.begin());
}

std::string where(const RadiositySystem& system, Index component) {
  if (system.components() == 1) return "the scene";
  return fmt::format("the part of the scene that patch {} sees", first_patch(system, component));
}

// A component in which nothing absorbs and nothing escapes has no solution when it emits, and no unique one when it does not.
void require_sink(const RadiositySystem& system, const MeanLoss& loss) {
  if (system.on_demand()) return;
  const BandArray emitted = system.sums(system.source());
  for (Index c = 0; c < system.components(); ++c)
    for (Index b = 0; b < system.bands(); ++b) {
      if (loss.absorbed(c, b) > 0 || loss.escaped(c, b) > tolerance::kNoEscape) continue;
      throw InputError(fmt::format(
          "band {}: reflectance is 1 everywhere in {}, which is closed: {}; lower a reflectance or open the "
          "scene",
          b, where(system, c),
          emitted(c, b) > 0
              ? "power is emitted but can neither be absorbed nor escape, so there is no steady state"
              : "nothing is emitted and nothing absorbed, so any constant is a solution"));
    }
}

// Bands to be solved: those that receive light and reflect, equal ones once.
struct DistinctBands {
  std::vector<Index> solved;  // bands of the system
  std::vector<Index> column;  // for each band of the system its place among them; −1: B = E + ρ H₀

  explicit DistinctBands(const RadiositySystem& system)
      : column(static_cast<std::size_t>(system.bands()), -1) {
    const BandArray source = system.source();
    const auto equal = [](const BandArray& x, Index a, Index b) { return (x.col(a) == x.col(b)).all(); };
    for (Index b = 0; b < system.bands(); ++b) {
      if ((source.col(b) == 0).all() || (system.reflectance().col(b) == 0).all()) continue;
      const auto same = std::find_if(solved.begin(), solved.end(), [&](Index a) {
        return equal(source, a, b) && equal(system.reflectance(), a, b) && equal(system.absorptance(), a, b);
      });
      column[b] = static_cast<Index>(same - solved.begin());
      if (same == solved.end()) solved.push_back(b);
    }
  }

  BandArray reduced(const BandArray& all) const {
    BandArray x(all.rows(), static_cast<Eigen::Index>(solved.size()));
    for (std::size_t k = 0; k < solved.size(); ++k) x.col(static_cast<Eigen::Index>(k)) = all.col(solved[k]);
    return x;
  }
  /// Values of the bands that were solved in place of what `all` holds for them and their equals.
  void restore(const BandArray& values, BandArray& all) const {
    for (std::size_t b = 0; b < column.size(); ++b)
      if (column[b] >= 0) all.col(static_cast<Eigen::Index>(b)) = values.col(column[b]);
  }
};

// Each band scaled by the power of two that brings its brightest patch to [1, 2): exact, and squares neither overflow nor vanish.
struct BandScaling {
  std::vector<int> exponent;

  explicit BandScaling(const BandArray& emission) {
    for (Eigen::Index b = 0; b < emission.cols(); ++b)
      exponent.push_back(std::ilogb(emission.col(b).maxCoeff()));
  }
  BandArray apply(const BandArray& x, int direction) const {
    BandArray y = x;
    for (Eigen::Index b = 0; b < x.cols(); ++b) {
      const int e = direction * exponent[b];
      y.col(b) = x.col(b).unaryExpr([e](double value) { return std::ldexp(value, e); });
    }
    return y;
  }
};

// What the residual r says of the error, for each band of a system whose bands all emit.
struct Bounds {
  BandArray error, condition;  // 1 × bands
  std::string warning;

  Bounds(const RadiositySystem& system, const BandValues& least, const BandValues& largest,
         const BandArray& radiosity, const BandArray& r, const std::vector<Index>& names)
      : error(1, system.bands()), condition(1, system.bands()) {
    const MeanLoss mean(system);
    const BandArray lit = (system.sums(system.emission()) > 0).cast<double>();
    const BandArray exchanging = system.spread(lit);
    for (Index b = 0; b < system.bands(); ++b) {
      const Eigen::ArrayXd loss =
          system.absorptance().col(b) + system.reflectance().col(b) * system.escaped();
      const double gap = (exchanging.col(b) > 0).select(loss, 1.0).minCoeff();
      const double worst = r.col(b).abs().maxCoeff();
      error(0, b) = worst == 0 ? 0 : gap > 0 ? worst / gap : kInfinity;
      const Eigen::ArrayXd mean_loss = mean.absorbed.col(b) + mean.escaped.col(b);
      const double low = std::min(least[b], (lit.col(b) > 0).select(mean_loss, 1.0).minCoeff());
      condition(0, b) = largest[b] / low;
      const double brightest = radiosity.col(b).maxCoeff();
      if (!warning.empty() || error(0, b) <= 0.1 * brightest) continue;
      warning = fmt::format(
          "band {}: the error bound {}: {}. The condition is about {:.1e}, so a relative error of 1e-7 in F "
          "changes the "
          "radiosity by about {:.0e}; judge by the energy balance",
          names[b],
          gap > 0
              ? fmt::format("is {:.1e} times the largest radiosity and says nothing", error(0, b) / brightest)
              : std::string("is infinite"),
          gap > 0 ? fmt::format("there is a patch that loses only {:.1e} of what reaches it", gap)
                  : std::string("there is a patch that absorbs nothing and from which nothing escapes"),
          condition(0, b), 1e-7 * condition(0, b));
    }
  }
};

std::string describe(const SolveReport& report, const SolverOptions& options) {
  switch (report.status) {
    case SolveStatus::converged:
      if (report.residual > options.tolerance)
        return fmt::format(
            "converged after {} iterations; B is so much larger than E that rounding leaves a residual of "
            "{:.2e}",
            report.iterations, report.residual);
      return fmt::format("converged after {} iterations: residual {:.2e} ≤ tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::iteration_limit:
      return fmt::format("stopped at the limit of {} iterations: residual {:.2e} > tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::stopped:
      return fmt::format("stopped on request after {} iterations: residual {:.2e}, tolerance {:.2e}",
                         report.iterations, report.residual, options.tolerance);
    case SolveStatus::failed:
      break;
  }
  return fmt::format(
      "no further progress after {} iterations: residual {:.2e} > tolerance {:.2e}; F is too far from "
      "reciprocal or closed for this solver",
      report.iterations, report.residual, options.tolerance);
}

}  // namespace

BandArray divide_or_zero(const BandArray& a, const BandArray& b) {
  return (b > 0).select(a / (b > 0).select(b, 1.0), 0.0);
}

double power_share(const RadiositySystem& system, const BandArray& r) {
  const BandArray area = system.areas().replicate(1, system.bands());
  const BandArray shares = divide_or_zero(system.sums(area * r.abs()), system.sums(area * system.emission()));
  return shares.size() > 0 ? shares.maxCoeff() : 0;
}

BandArray residual(const RadiositySystem& system, const BandArray& radiosity) {
  const BandArray area = system.areas().replicate(1, system.bands());
  const BandArray mean = system.spread(system.sums(area * radiosity) / system.sums(area));
  const BandArray w = radiosity - mean;
  BandArray gathered;
  system.form_factors().apply(w, gathered);
  const BandArray loss = system.absorptance() + system.reflectance().colwise() * system.escaped();
  return system.emission() - loss * mean - (w - system.reflectance() * gathered);
}

SolveResult Solver::solve(const RadiositySystem& given, const SolverOptions& options) const {
  if (!(options.tolerance > 0 && std::isfinite(options.tolerance))) {
    throw InputError(fmt::format("tolerance: {} is not positive", options.tolerance));
  }
  if (options.max_iterations < 0) {
    throw InputError(fmt::format("max_iterations: {} is negative; 0 takes the solver's own limit",
                                 options.max_iterations));
  }
  if (!(options.relaxation > 0 && options.relaxation < 2)) {
    throw InputError(fmt::format("relaxation: {} is not between 0 and 2", options.relaxation));
  }
  if (options.relaxation != 1 && !relaxes()) {
    throw InputError(fmt::format("relaxation: {}, but only Gauss–Seidel takes steps of a chosen length",
                                 options.relaxation));
  }
  if (reads_rows() && given.rows() == nullptr)
    throw InputError(
        "this solver reads single rows of F, but F is an operator that can only be applied: take a solver "
        "that "
        "needs no more, such as conjugate-gradient, or derive F from FormFactorRows");

  SolveResult result;
  SolveReport& report = result.report;
  result.radiosity = given.source();
  const bool cheap = !given.on_demand();  // F may be applied once more
  report.error_bound = BandArray::Constant(1, given.bands(), cheap ? 0 : kNan);
  report.condition = BandArray::Constant(1, given.bands(), cheap ? 1 : kNan);
  const DistinctBands bands(given);
  const MeanLoss loss(given);
  require_sink(given, loss);
  if (bands.solved.empty()) {
    report.status = SolveStatus::converged;
    report.history = {0};
    report.message = (result.radiosity == 0).all()      ? "nothing is emitted: B = 0"
                     : (given.reflectance() == 0).all() ? "nothing reflects: B = E"
                                                        : "no band both emits and reflects: B = E";
    return result;
  }

  const BandArray source = bands.reduced(result.radiosity);
  const BandScaling scaling(source);
  const RadiositySystem system = given.with_bands(
      bands.reduced(given.reflectance()), scaling.apply(source, -1), bands.reduced(given.absorptance()));
  State state{system.emission(), BandValues::Ones(system.bands()), BandValues::Ones(system.bands())};
  const Index limit =
      options.max_iterations > 0 ? options.max_iterations : default_max_iterations(system.size());
  report.status = SolveStatus::failed;
  SolverOptions own = options;
  if (options.save)
    own.save = [&](Index shots, const std::function<ShootingState()>& saved) {
      options.save(shots, [&] {
        ShootingState with_history = saved();
        with_history.history = report.history;
        return with_history;
      });
    };
  if (options.partial) {
    const ShootingState& partial = *options.partial;
    for (const BandArray* part : {&partial.received, &partial.unshot})
      if (part->rows() != system.size() || part->cols() != system.bands())
        throw InputError(
            fmt::format("{} × {} values of an earlier run's shooting do not fit {} patches in {} bands",
                        part->rows(), part->cols(), system.size(), system.bands()));
    report.history = partial.history;
  }
  iterate(system, own, state, [&](double estimate) {
    report.residual = estimate;
    report.iterations = static_cast<Index>(report.history.size());
    report.history.push_back(estimate);
    bool go_on = true;
    if (options.step) {
      bands.restore(scaling.apply(state.radiosity, 1), result.radiosity);
      go_on = options.step(report.iterations, estimate, result.radiosity);
    }
    if (options.progress) go_on = options.progress(report.iterations, estimate) && go_on;
    if (estimate <= options.tolerance) {
      report.status = SolveStatus::converged;
    } else if (!go_on) {
      report.status = SolveStatus::stopped;
    } else if (report.iterations >= limit) {
      report.status = SolveStatus::iteration_limit;
    } else {
      return true;
    }
    return false;
  });
  if (cheap && (state.radiosity < 0).any()) {
    // No light is negative, B ≥ E. A gathering step from the nearest B of which that holds ends at another, as F ≥ 0 and ρ ≥ 0.
    BandArray gathered;
    system.form_factors().apply(state.radiosity.max(system.emission()), gathered);
    state.radiosity = system.emission() + system.reflectance() * gathered;
  }
  bands.restore(scaling.apply(state.radiosity, 1), result.radiosity);
  if (!result.radiosity.isFinite().all()) {
    throw InputError(fmt::format(
        "the radiosity exceeds what a double holds, {:.2g} W/m²: scale the emission, B is proportional to it",
        std::numeric_limits<double>::max()));
  }
  if (cheap) {
    const BandArray r = residual(system, state.radiosity);
    report.residual = power_share(system, r);
    const double left = power_share(system, rounding() * state.radiosity);
    if (report.status == SolveStatus::converged && !(report.residual <= options.tolerance + left)) {
      report.status = SolveStatus::failed;
    }
    const Bounds bounds(system, state.least, state.largest, state.radiosity, r, bands.solved);
    bands.restore(scaling.apply(bounds.error, 1), report.error_bound);
    bands.restore(bounds.condition, report.condition);
    report.warning = bounds.warning;
  }
  report.message = describe(report, options);
  return result;
}

std::span<const SolverInfo> solvers() {
  return kSolvers;
}

const SolverInfo& find_solver(std::string_view name) {
  return find_named(kSolvers, "solver", name);
}

}  // namespace radiosity
