// SPDX-License-Identifier: GPL-3.0-or-later
#include "solvers.hpp"

namespace radiosity {
namespace {

/// Conjugate gradients on M B = W E with M = W (I − ρF), W = diag(A/ρ): symmetric where A_i F_ij = A_j F_ji, positive
/// definite where energy is absorbed or escapes. Preconditioned by W itself, everything can be written in radiosities:
///   z = r = E − B + ρFB,   ⟨a, b⟩ = Σ_i (A_i/ρ_i) a_i b_i,   α = ⟨r, r⟩ / ⟨p, p − ρFp⟩,   β = ⟨r', r'⟩ / ⟨r, r⟩.
/// Patches with ρ = 0 are known, B = E, and stay out: their residual is zero from the start. All bands share each pass
/// over F, each with its own α and β. When the recurrence says it is done, the true residual is computed, and
/// if single precision F has made them differ, the iteration starts again from there.
class ConjugateGradient final : public Solver {
  void iterate(const RadiositySystem& system, double tolerance, BandArray& radiosity,
               const Step& step) const override {
    const BandArray& rho = system.reflectance();
    const BandArray weight = (rho > 0).select(system.areas().replicate(1, system.bands()) / rho, 0.0);
    const auto product = [&](const BandArray& a, const BandArray& b) -> Eigen::ArrayXd {
      return (weight * a * b).colwise().sum().transpose();
    };
    BandArray r = residual(system, radiosity);
    double size = power_share(system, r);
    BandArray gathered;
    while (step(size)) {
      BandArray p = r;
      Eigen::ArrayXd rr = product(r, r);
      const double start = size;
      while (true) {
        system.form_factors().multiply(p, gathered);
        const BandArray q = p - rho * gathered;
        const Eigen::ArrayXd curvature = product(p, q);
        if (((curvature <= 0) && (rr > 0)).any()) return;  // not positive definite
        const Eigen::ArrayXd alpha = (rr > 0).select(rr / curvature, 0.0);
        radiosity += p.rowwise() * alpha.transpose();
        r -= q.rowwise() * alpha.transpose();
        const Eigen::ArrayXd next = product(r, r);
        size = power_share(system, r);
        if (size <= tolerance || size < 1e-5 * start) break;
        if (!step(size)) return;
        const Eigen::ArrayXd beta = (rr > 0).select(next / rr, 0.0);
        p = r + p.rowwise() * beta.transpose();
        rr = next;
      }
      r = residual(system, radiosity);
      size = power_share(system, r);
    }
  }
  Index default_max_iterations(Index) const override { return 1000; }
};

}  // namespace

std::unique_ptr<Solver> make_conjugate_gradient() {
  return std::make_unique<ConjugateGradient>();
}

}  // namespace radiosity
