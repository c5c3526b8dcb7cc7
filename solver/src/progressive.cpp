// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "solvers.hpp"

namespace radiosity {
namespace {

/// Progressive refinement [Cohen1988]. Unshot radiosity ΔB starts at E; the patch with most unshot power shoots:
///   ΔRad_j = ρ_j F_ij (A_i/A_j) ΔB_i,   B_j += ΔRad_j,   ΔB_j += ΔRad_j,   then ΔB_i = 0,
/// until Σ ΔB_i A_i ≤ tolerance · Σ E_i A_i in every band (and component, where F is stored and tells them). One row of F a shot.
/// Rows are fetched for a block of the strongest patches at a time, in parallel; the block's size is fixed, so the
/// order of shots is too. A heap for the next shooter would not pay: every shot changes nearly every ΔB_j.
///
/// Light under way is expected to fall evenly on everything: the ambient irradiance [Cohen1988]
///   h = κ Σ A ΔB / Σ A (1 − κρ),   κ the share of what was shot that reached a patch.
/// With overshooting [Feda1992] a patch shoots ΔB_i + ρ_i h, what it holds and what it is still to receive; ΔB_i is then
/// negative until that has arrived. The next shooter is the one with the largest |ΔB_i + ρ_i h| A_i. Where light does not spread
/// evenly, shots and counter-shots may go round in circles: whenever n shots have gained nothing, h counts half as much
/// from then on, which ends as the classical method.
class Progressive final : public Solver {
 public:
  explicit Progressive(bool overshoot) : overshoot_(overshoot) {}

 private:
  using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;

  void iterate(const RadiositySystem& system, const SolverOptions& options, State& state,
               const Step& step) const override {
    const Eigen::ArrayXd& area = system.areas();
    const BandArray& rho = system.reflectance();
    const std::vector<Index>& component = system.component();
    const auto part = [&](Index i) { return component[i]; };
    const BandArray zero = BandArray::Zero(system.components(), system.bands());
    // Bands count by their share of the emitted power: a faint band must converge too.
    const BandArray emitted = system.sums(system.emission().colwise() * area);
    const BandArray weight =
        system.spread(divide_or_zero(BandArray::Ones(emitted.rows(), emitted.cols()), emitted)).colwise() *
        area;
    BandArray received = system.emission();  // what the shots have made of B
    BandArray unshot = system.emission();
    BandArray ahead = BandArray::Zero(unshot.rows(), unshot.cols());  // ρh
    double shot = 0, arrived = 0;                                     // m², over the shots so far
    double trust = 1;                                                 // in h
    const auto look_ahead = [&] {
      if (!overshoot_ && !options.ambient) return;
      const double kappa = shot > 0 ? arrived / shot : 1;
      BandArray under_way = zero, loss = zero;
      for (Index i = 0; i < system.size(); ++i) {
        under_way.row(part(i)) += area[i] * unshot.row(i);
        loss.row(part(i)) += area[i] * (1 - kappa * rho.row(i));
      }
      const BandArray h = trust * kappa * divide_or_zero(under_way, loss);
      for (Index i = 0; i < system.size(); ++i) ahead.row(i) = rho.row(i) * h.row(part(i));
    };
    const auto share = [&]() -> double {
      // r = ρF ΔB of B without the ambient term, ρ(F(ΔB + ρh) − h) of B with it: no more than this.
      BandArray sums = zero;
      for (Index i = 0; i < system.size(); ++i)
        sums.row(part(i)) += weight.row(i) * ((unshot.row(i) + ahead.row(i)).abs() + ahead.row(i).abs());
      return sums.maxCoeff();
    };
    // B is told only where somebody looks at it: a copy of it costs as much as a shot.
    const auto goes_on = [&](double now) {
      if (options.step) state.radiosity = received + ahead;
      if (step(now)) return true;
      state.radiosity = received + ahead;
      return false;
    };

    std::vector<Index> order(system.size());
    const auto block = std::min<std::size_t>(kBlock, order.size());
    std::vector<RowBuffer> buffers(block);
    std::vector<FormFactorRow> rows(block);
    double before = 0;
    Index shots = 0;
    if (options.partial) {
      const ShootingState& partial = *options.partial;
      received = partial.received;
      unshot = partial.unshot;
      shot = partial.shot;
      arrived = partial.arrived;
      trust = partial.trust;
      before = partial.before;
      shots = static_cast<Index>(partial.history.size()) - 1;
      look_ahead();
    } else {
      look_ahead();
      before = share();
      if (!goes_on(before)) return;
    }
    for (;;) {
      if (options.save && shots > 0)
        options.save(shots,
                     [&] { return ShootingState{received, unshot, shot, arrived, trust, before, {}}; });
      const Eigen::ArrayXd strength =
          (weight * (overshoot_ ? BandArray(unshot + ahead) : unshot)).abs().rowwise().sum();
      std::iota(order.begin(), order.end(), 0);
      std::partial_sort(
          order.begin(), order.begin() + static_cast<std::ptrdiff_t>(block), order.end(),
          [&](Index a, Index b) { return strength[a] != strength[b] ? strength[a] > strength[b] : a < b; });
      const auto fetch = [&](std::size_t k) { rows[k] = system.rows()->row(order[k], buffers[k]); };
      if (!system.on_demand()) {  // a look-up: threads would cost more than they save
        for (std::size_t k = 0; k < block; ++k) fetch(k);
      } else {
        tbb::parallel_for(std::size_t{0}, block, fetch);
      }
      for (std::size_t k = 0; k < block; ++k) {
        const Index i = order[k];
        Bands power = area[i] * unshot.row(i);
        if (overshoot_) power += area[i] * ahead.row(i);
        unshot.row(i) -= power / area[i];
        double sum = rows[k].diagonal;
        const auto receive = [&](Index j, double f) {
          for (Index b = 0; b < system.bands(); ++b) {
            const double gain = rho(j, b) * power[b] * (f / area[j]);
            received(j, b) += gain;
            unshot(j, b) += gain;
          }
        };
        for_each_entry(rows[k], [&](Index j, float f) {
          sum += static_cast<double>(f);
          receive(j, static_cast<double>(f));
        });
        receive(i, rows[k].diagonal);
        shot += area[i];
        arrived += area[i] * sum;
        look_ahead();
        const double now = share();
        if (!goes_on(now)) return;
        if (++shots % system.size() != 0) continue;
        if (overshoot_ && now >= before) trust /= 2;
        before = now;
      }
    }
  }
  bool reads_rows() const override { return true; }
  // F_ji is read as F_ij A_i/A_j, which holds to single precision.
  double rounding() const override { return std::numeric_limits<float>::epsilon(); }
  Index default_max_iterations(Index patches) const override {
    constexpr Index kShotsPerPatch = 100;
    return std::max<Index>(
        1000, kShotsPerPatch * std::min(patches, std::numeric_limits<Index>::max() / kShotsPerPatch));
  }

  static constexpr std::size_t kBlock = 8;
  bool overshoot_;
};

}  // namespace

std::unique_ptr<Solver> make_progressive() {
  return std::make_unique<Progressive>(false);
}

std::unique_ptr<Solver> make_progressive_overshoot() {
  return std::make_unique<Progressive>(true);
}

}  // namespace radiosity
