// SPDX-License-Identifier: GPL-3.0-or-later
#include "solvers.hpp"

namespace radiosity {
namespace {

/// B_i ← B_i + ω ((E_i + ρ_i Σ_{j≠i} F_ij B_j) / (1 − ρ_i F_ii) − B_i), each with the values of this sweep as soon as they
/// exist; ω > 1 is over-relaxation. The change in a sweep over ω bounds the residual before it and estimates the one after it
/// from above.
class GaussSeidel final : public Solver {
  void iterate(const RadiositySystem& system, const SolverOptions& options, State& state,
               const Step& step) const override {
    BandArray& radiosity = state.radiosity;
    const BandArray& rho = system.reflectance();
    if (!step(power_share(system, residual(system, radiosity)))) return;
    BandArray change(radiosity.rows(), radiosity.cols());
    RowBuffer buffer;
    using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;
    Bands gathered(system.bands());
    do {
      for (Index i = 0; i < system.size(); ++i) {
        const FormFactorRow row = system.rows()->row(i, buffer);
        gathered.setZero();
        double own = row.diagonal;
        for_each_entry(row, [&](Index j, float f) {
          if (j == i) {
            own += static_cast<double>(f);
          } else {
            gathered += static_cast<double>(f) * radiosity.row(j);
          }
        });
        change.row(i) =
            (system.emission().row(i) + rho.row(i) * gathered) / (1 - rho.row(i) * own) - radiosity.row(i);
        radiosity.row(i) += options.relaxation * change.row(i);
      }
    } while (step(power_share(system, change)));
  }
  bool relaxes() const override { return true; }
  bool reads_rows() const override { return true; }
  Index default_max_iterations(Index) const override { return 10000; }
};

}  // namespace

std::unique_ptr<Solver> make_gauss_seidel() {
  return std::make_unique<GaussSeidel>();
}

}  // namespace radiosity
