// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "solvers.hpp"

namespace radiosity {
namespace {

/// Progressive refinement [Cohen1988]. Unshot radiosity ΔB starts at E; the patch with most unshot power shoots:
///   ΔRad_j = ρ_j F_ij (A_i/A_j) ΔB_i,   B_j += ΔRad_j,   ΔB_j += ΔRad_j,   then ΔB_i = 0,
/// until Σ ΔB_i A_i ≤ tolerance · Σ E_i A_i in every band. One row of F a shot. Rows are fetched for a block of the
/// strongest patches at a time, in parallel; the block's size is fixed, so the order of shots is too.
class Progressive final : public Solver {
  void iterate(const RadiositySystem& system, double, BandArray& radiosity, const Step& step) const override {
    const Index n = system.size();
    const Eigen::ArrayXd& area = system.areas();
    const BandArray& rho = system.reflectance();
    const Eigen::ArrayXd emitted = (system.emission().colwise() * area).colwise().sum().transpose();
    BandArray unshot = system.emission();
    const auto unshot_share = [&] {
      const Eigen::ArrayXd power = (unshot.colwise() * area).colwise().sum().transpose();
      return (emitted > 0).select(power / emitted, 0.0).maxCoeff();
    };
    // Bands count by their share of the emitted power: a faint band must converge too.
    const Eigen::ArrayXd band_weight = (emitted > 0).select(1 / emitted, 0.0);
    Eigen::ArrayXd strength(n);
    std::vector<Index> order(static_cast<std::size_t>(n));
    const auto block = std::min<std::size_t>(kBlock, order.size());
    std::vector<RowBuffer> buffers(block);
    std::vector<FormFactorRow> rows(block);
    using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;

    if (!step(unshot_share())) return;
    while (true) {
      strength = area * (unshot.matrix() * band_weight.matrix()).array();
      std::iota(order.begin(), order.end(), 0);
      std::partial_sort(
          order.begin(), order.begin() + static_cast<std::ptrdiff_t>(block), order.end(),
          [&](Index a, Index b) { return strength[a] != strength[b] ? strength[a] > strength[b] : a < b; });
      tbb::parallel_for(std::size_t{0}, block,
                        [&](std::size_t k) { rows[k] = system.form_factors().row(order[k], buffers[k]); });
      for (std::size_t k = 0; k < block; ++k) {
        const Index i = order[k];
        const Bands power = area[i] * unshot.row(i);
        unshot.row(i).setZero();
        const auto receive = [&](Index j, double f) {
          const Bands gain = rho.row(j) * power * (f / area[j]);
          radiosity.row(j) += gain;
          unshot.row(j) += gain;
        };
        for_each_entry(rows[k], [&](Index j, float f) { receive(j, static_cast<double>(f)); });
        receive(i, rows[k].diagonal);
        if (!step(unshot_share())) return;
      }
    }
  }
  Index default_max_iterations(Index patches) const override { return std::max<Index>(1000, 100 * patches); }

  static constexpr std::size_t kBlock = 8;
};

}  // namespace

std::unique_ptr<Solver> make_progressive() {
  return std::make_unique<Progressive>();
}

}  // namespace radiosity
