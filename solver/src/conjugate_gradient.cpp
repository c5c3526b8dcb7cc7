// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "radiosity/meshing/tolerances.hpp"
#include "solvers.hpp"

namespace radiosity {
namespace {

// A residual that is smaller than the first one by this factor is nothing but rounding.
constexpr double kRounding = 1e-14;

// Coefficients of the iteration for one band of one component; they make the tridiagonal matrix of Lanczos, whose
// eigenvalues lie among those of the matrix: T_kk = 1/α_k + β_{k−1}/α_{k−1}, T_{k,k+1} = √β_k / α_k.
class Lanczos {
 public:
  void add(double alpha, double beta) {
    alpha_.push_back(alpha);
    beta_.push_back(beta);
  }

  void widen(double& least, double& largest) const {
    const auto n = static_cast<Eigen::Index>(alpha_.size());
    if (n == 0) return;
    Eigen::VectorXd diagonal(n), beside(n - 1);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      diagonal[k] = 1 / alpha_[at] + (k > 0 ? beta_[at - 1] / alpha_[at - 1] : 0);
      if (k + 1 < n) beside[k] = std::sqrt(beta_[at]) / alpha_[at];
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(diagonal, beside, Eigen::EigenvaluesOnly);
    if (solver.info() != Eigen::Success) return;
    least = std::min(least, solver.eigenvalues()[0]);
    largest = std::max(largest, solver.eigenvalues()[n - 1]);
  }

 private:
  std::vector<double> alpha_, beta_;
};

/// Conjugate gradients on M B = W E with M = W (I − ρF), W = diag(A/ρ): symmetric where A_i F_ij = A_j F_ji, positive
/// definite where energy is absorbed or escapes. Patches with ρ = 0 are known, B = E, and stay out. Preconditioned by W itself,
/// everything can be written in radiosities, ⟨a, b⟩ = Σ_i (A_i/ρ_i) a_i b_i.
///
/// As ρ → 1 one eigenvalue goes to 0, that of light which is spread evenly over a room. The constant of each component is
/// therefore deflated [Frank2001]: B = γ + w, with
///   M 1 = A s,   s_i = (1 − ρ_i)/ρ_i + escaped_i + Σ_{j black} F_ij,
/// known without a subtraction, and γ such that ⟨1, r⟩ = 0:
///   q = p − ρFp,   μ = ⟨1, q⟩ / Σ A s,   α = ⟨r, r⟩ / ⟨p, q − ρ s μ⟩,   w += α p,   γ −= α μ,   r −= α (q − ρ s μ).
/// w stays as small as the unevenness of the light, however large γ.
///
/// Bands and components are systems of their own, each with its own α, β, γ, but share each pass over F.
class ConjugateGradient final : public Solver {
  void iterate(const RadiositySystem& system, const SolverOptions& options, State& state,
               const Step& step) const override {
    const BandArray& rho = system.reflectance();
    const BandArray area = system.areas().replicate(1, system.bands());
    const BandArray reflects = (rho > tolerance::kBlack).cast<double>();
    const BandArray weight = divide_or_zero(area, reflects * rho);
    const auto product = [&](const BandArray& a, const BandArray& b) -> BandArray {
      return system.sums(weight * a * b);
    };
    const auto gather = [&](const BandArray& x) -> BandArray {
      BandArray y;
      system.form_factors().apply(x, y);
      return y;
    };
    // ρ s, and Σ A s per component.
    BandArray loss = system.absorptance() + rho.colwise() * system.escaped();
    if ((reflects == 0).any()) loss += rho * gather(1 - reflects);
    loss *= reflects;
    const BandArray sink = system.sums(weight * loss);

    BandArray& radiosity = state.radiosity;
    BandArray w = radiosity, gamma;
    // r of w, before and after the γ with ⟨1, r⟩ = 0.
    const auto residual_of_w = [&]() -> BandArray {
      return reflects * (system.emission() - w + rho * gather(w));
    };
    const auto deflate = [&](BandArray& r) {
      gamma = divide_or_zero(system.sums(weight * r), sink);
      r -= loss * system.spread(gamma);
      radiosity = w + reflects * system.spread(gamma);
    };
    BandArray r = residual_of_w();
    const BandArray negligible = kRounding * kRounding * product(r, r);
    deflate(r);

    BandArray p = r;
    BandArray rr = product(r, r);
    std::vector<Lanczos> spectrum(gamma.size());
    double least_recomputed = std::numeric_limits<double>::infinity();
    for (int steps = 0;; ++steps) {
      double share = power_share(system, r);
      if (steps > tolerance::kStepsWithoutDrift && share <= options.tolerance) {
        r = residual_of_w();
        deflate(r);
        const double recomputed = power_share(system, r);
        if (recomputed > options.tolerance && recomputed < least_recomputed / 2) {  // start again from here
          least_recomputed = share = recomputed;
          p = r;
          rr = product(r, r);
        }
      }
      if (!step(share)) break;
      BandArray q = reflects * (p - rho * gather(p));
      const BandArray mu = divide_or_zero(system.sums(weight * q), sink);
      q -= loss * system.spread(mu);
      const BandArray curvature = product(p, q);
      const BandArray under_way = (rr > negligible && curvature > 0).cast<double>();
      if ((under_way == 0).all()) break;  // nothing but rounding is left, or F is too far from reciprocal
      const BandArray alpha = under_way * divide_or_zero(rr, curvature);
      const BandArray each = system.spread(alpha);
      w += each * p;
      r -= each * q;
      gamma -= alpha * mu;
      radiosity = w + reflects * system.spread(gamma);
      const BandArray next = product(r, r);
      const BandArray beta = under_way * divide_or_zero(next, rr);
      for (Eigen::Index k = 0; k < alpha.size(); ++k)
        if (alpha.data()[k] > 0 && std::isinf(least_recomputed))
          spectrum[k].add(alpha.data()[k], beta.data()[k]);
      p = r + system.spread(beta) * p;
      rr = next;
    }
    for (Eigen::Index k = 0; k < gamma.size(); ++k) {
      const Eigen::Index band = k % system.bands();
      spectrum[k].widen(state.least[band], state.largest[band]);
    }
  }
  Index default_max_iterations(Index) const override { return 1000; }
};

}  // namespace

std::unique_ptr<Solver> make_conjugate_gradient() {
  return std::make_unique<ConjugateGradient>();
}

}  // namespace radiosity
