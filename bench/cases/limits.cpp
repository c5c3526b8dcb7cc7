// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/limits.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "cases/closed_forms.hpp"
#include "cases/matrices.hpp"
#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "cases/trapped.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity::test {
namespace {

using Outcome = Limit::Outcome;
using std::numbers::pi;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

LimitSolve other_solve;

SolveResult solve(const SolverInfo& solver, const RadiositySystem& system, double tolerance = 1e-8) {
  SolverOptions options;
  options.tolerance = tolerance;
  if (other_solve && solver.name == kDefaultSolver) return other_solve(system, options);
  const FloatingPointTrap trap;
  return solver.make()->solve(system, options);
}

double relative(const BandArray& b, const BandArray& exact) {
  return ((b - exact).abs() / exact).maxCoeff();
}

/// The largest of several errors, and what made it.
class Worst {
 public:
  void add(double error, std::string_view what) {
    if (!(error <= error_)) {  // not-a-number is the worst
      error_ = error;
      what_ = what;
    }
  }
  Outcome within(double allowed, std::string_view rest = "") const {
    std::string came_out =
        fmt::format("off by {:.1e}{}", error_, what_.empty() ? "" : fmt::format(" ({})", what_));
    if (!rest.empty()) came_out += fmt::format("; {}", rest);
    return {error_, allowed, came_out};
  }

 private:
  double error_ = -1;
  std::string what_;
};

/// A sphere without facets, F_ij = A_j / Σ A, or several that do not see each other.
struct Spheres {
  explicit Spheres(Index count, Index each = 50) : n(count * each), areas(n) {
    std::mt19937_64 random(4);
    for (double& a : areas) a = 0.5 + uniform(random);
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    for (Index s = 0; s < count; ++s) {
      const auto part = areas.segment(s * each, each);
      m.block(s * each, s * each, each, each) = (part / part.sum()).matrix().transpose().replicate(each, 1);
    }
    f = std::make_unique<FormFactorMatrix>(dense_matrix(m));
  }
  /// R2 on each: B_i = E_i + ρ_i ⟨E⟩/⟨1 − ρ⟩.
  BandArray exact(const BandArray& rho, const BandArray& e, const BandArray& alpha, Index each = 50) const {
    BandArray b(e.rows(), e.cols());
    for (Index first = 0; first < n; first += each) {
      const Eigen::ArrayXd share = areas.segment(first, each) / areas.segment(first, each).sum();
      const auto mean = [&](const BandArray& x) -> Eigen::Array<double, 1, Eigen::Dynamic> {
        return (x.middleRows(first, each).colwise() * share).colwise().sum();
      };
      b.middleRows(first, each) =
          e.middleRows(first, each) + rho.middleRows(first, each).rowwise() * (mean(e) / mean(alpha));
    }
    return b;
  }

  Index n;
  Eigen::ArrayXd areas;
  std::unique_ptr<FormFactorMatrix> f;
};

/// 1 − ρ drawn from [½, 1½]·10^−k, a tenth of the patches lamps of 1 W/m² and less.
struct WhiteSphere : Spheres {
  explicit WhiteSphere(int k) : Spheres(1), alpha(n, 1), e(BandArray::Zero(n, 1)) {
    std::mt19937_64 random(7);
    for (Index i = 0; i < n; ++i) {
      alpha(i, 0) = std::pow(10.0, -k) * (0.5 + uniform(random));
      if (i % 10 == 0) e(i, 0) = uniform(random);
    }
  }
  RadiositySystem system() const { return {*f, areas, 1 - alpha, e, alpha}; }
  BandArray exact() const { return Spheres::exact(1 - alpha, e, alpha); }
  BandArray alpha, e;
};

/// The names of the solvers for which `good` holds.
std::string those(const auto& good) {
  std::string names;
  for (const SolverInfo& solver : solvers())
    if (good(solver)) names += fmt::format("{}{}", names.empty() ? "" : ", ", solver.name);
  return names;
}

Limit white_spheres(std::string name, int first, int last, double allowed) {
  return {std::move(name),
          fmt::format("sphere with 1 − ρ about 10^−k, k = {} … {}, different on every patch", first, last),
          "B = E + ρ⟨E⟩/⟨1 − ρ⟩, in at most 40 products by F", "conjugate-gradient", [=] {
            Worst worst;
            Index most = 0;
            for (int k = first; k <= last; ++k) {
              const WhiteSphere sphere(k);
              const SolveResult result = solve(find_solver("conjugate-gradient"), sphere.system());
              const bool good = result.report.status == SolveStatus::converged;
              worst.add(good ? relative(result.radiosity, sphere.exact()) : kNan, fmt::format("k = {}", k));
              most = std::max(most, result.report.iterations + 1);
            }
            if (most > 40) return Outcome{kNan, allowed, fmt::format("{} products", most)};
            return worst.within(allowed, fmt::format("{} products", most));
          }};
}

/// Closed rooms in which every patch absorbs the same: Σ A B = Σ A E / (1 − ρ); lit by one surface, or by all, where B is
/// that everywhere.
Limit white_rooms(std::string name, std::string_view scene, const PatchMesh& mesh, int first, int last,
                  double allowed) {
  return {
      std::move(name),
      fmt::format("{}, 1 − ρ = 10^−k, k = {} … {}, lit by all its patches, or by one", scene, first, last),
      "B = E/(1 − ρ); or the area mean of it; energy balanced to 1e-6; at most 40 products",
      "analytic, conjugate-gradient", [=] {
        const MethodSetup setup(mesh, find_form_factor_method("analytic"));
        const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
        const Index n = mesh.patch_count();
        const Eigen::ArrayXd share = mesh.areas() / mesh.areas().sum();
        Worst worst;
        Index most = 0;
        double imbalance = 0;
        for (int k = first; k <= last; ++k) {
          const double alpha = std::pow(10.0, -k);
          // Both in one pass, as two bands.
          BandArray e = BandArray::Zero(n, 2);
          e.col(0) = 1;
          e(n - 1, 1) = 1;
          const RadiositySystem system(f, mesh.areas(), BandArray::Constant(n, 2, 1 - alpha), e,
                                       BandArray::Constant(n, 2, alpha));
          const SolveResult result = solve(find_solver("conjugate-gradient"), system);
          const BandArray& b = result.radiosity;
          const bool good = result.report.status == SolveStatus::converged;
          worst.add(good ? (b.col(0) * alpha - 1).abs().maxCoeff() : kNan, fmt::format("k = {}, all lit", k));
          worst.add(std::abs((share * b.col(1)).sum() * alpha / share[n - 1] - 1),
                    fmt::format("k = {}, one lit", k));
          imbalance =
              std::max(imbalance, energy_balance(system, b, system.irradiance(b)).imbalance.abs().maxCoeff());
          most = std::max(most, result.report.iterations + 1);
        }
        const std::string rest = fmt::format("imbalance {:.0e}, {} products", imbalance, most);
        worst.add(most > 40 || imbalance > 1e-6 ? kNan : 0, rest);
        return worst.within(allowed, rest);
      }};
}

/// A right answer is a refusal with these words.
Limit refusal(std::string name, std::string asked, std::string reason,
              std::function<void(const SolverInfo&)> attempt) {
  return {std::move(name), std::move(asked), "refused: " + reason, "every solver", [=] {
            Outcome outcome{0, 0, "refused by all"};
            for (const SolverInfo& solver : solvers()) {
              try {
                attempt(solver);
                outcome = {kNan, 0, fmt::format("{} gave an answer", solver.name)};
              } catch (const InputError& error) {
                if (std::string(error.what()).find(reason) == std::string::npos)
                  outcome = {kNan, 0, fmt::format("{}: {}", solver.name, error.what())};
              }
            }
            return outcome;
          }};
}

/// Every solver on a system with a known answer.
Limit solved(std::string name, std::string asked, std::string exact, double allowed,
             std::function<RadiositySystem()> make, std::function<BandArray()> answer) {
  return {std::move(name), std::move(asked), std::move(exact), "every solver", [=] {
            const RadiositySystem system = make();
            const BandArray expected = answer();
            Worst worst;
            for (const SolverInfo& solver : solvers()) {
              const SolveResult result = solve(solver, system);
              const BandArray scale = (expected > 0).select(expected, 1.0);
              const bool good = result.report.status == SolveStatus::converged;
              worst.add(good && expected.size() > 0 ? ((result.radiosity - expected).abs() / scale).maxCoeff()
                        : good                      ? 0
                                                    : kNan,
                        solver.name);
            }
            return worst.within(allowed);
          }};
}

BandArray constant(Index n, double value) {
  return BandArray::Constant(n, 1, value);
}

void add_reflectances(std::vector<Limit>& list) {
  // M the mean radiosities of two spheres of equal area, ε the share of light that goes across:
  //   M1 + M2 = (⟨E⟩1 + ⟨E⟩2)/(1 − ρ),   M1 − M2 = (⟨E⟩1 − ⟨E⟩2)/(1 − ρ + 2ρε),   B = E + ρ ((1 − ε) M_own + ε M_other).
  list.push_back(
      {"RoomsThroughAPinhole",
       "two spheres that exchange a share ε = 10^−k of their light, k = 1 … 8, 1 − ρ = 10⁻⁹, a lamp in one",
       "B = E + ρ((1 − ε)M + εM'), in at most 40 products by F", "conjugate-gradient", [] {
         Worst worst;
         Index most = 0;
         const double alpha = 1e-9;
         const Index n = 40;
         for (int k = 1; k <= 8; ++k) {
           const double e = std::pow(10.0, -k);
           Eigen::MatrixXd m(n, n);
           const Index half = n / 2;
           m.setConstant((1 - e) / half);
           m.topRightCorner(half, half).setConstant(e / half);
           m.bottomLeftCorner(half, half).setConstant(e / half);
           const FormFactorMatrix f = dense_matrix(m);
           BandArray lamp = BandArray::Zero(n, 1);
           lamp(3, 0) = 1;
           const RadiositySystem system(f, Eigen::ArrayXd::Ones(n), BandArray::Constant(n, 1, 1 - alpha),
                                        lamp, BandArray::Constant(n, 1, alpha));
           const SolveResult result = solve(find_solver("conjugate-gradient"), system);
           const double mean = 1.0 / half, sum = mean / alpha,
                        difference = mean / (alpha + 2 * (1 - alpha) * e);
           const double near = (sum + difference) / 2, far = (sum - difference) / 2;
           BandArray exact = lamp;
           exact.topRows(half) += (1 - alpha) * ((1 - e) * near + e * far);
           exact.bottomRows(half) += (1 - alpha) * ((1 - e) * far + e * near);
           worst.add(
               result.report.status == SolveStatus::converged ? relative(result.radiosity, exact) : kNan,
               fmt::format("k = {}", k));
           most = std::max(most, result.report.iterations + 1);
         }
         worst.add(most > 40 ? kNan : 0, "products");
         return worst.within(1e-6, fmt::format("{} products", most));
       }});
  list.push_back(white_spheres("WhiteSpheres", 1, 9, 1e-6));
  list.push_back(white_spheres("WhiterSpheres", 10, 12, 1e-4));
  const auto boxed = [] { return room_with_floating_box(3, 2); };
  list.push_back(white_rooms("WhiteRoomWithBox", "closed room with a box in mid-air", boxed(), 1, 9, 1e-6));
  list.push_back(
      white_rooms("WhiterRoomWithBox", "closed room with a box in mid-air", boxed(), 10, 12, 1e-4));
  list.push_back(white_rooms("WhiteRoomsWithDoor", "two rooms joined by a door", two_rooms(2), 1, 9, 1e-6));
  list.push_back(
      white_rooms("WhiterRoomsWithDoor", "two rooms joined by a door", two_rooms(2), 10, 12, 1e-4));

  list.push_back({"WhiteSphereByEverySolver", "sphere with 1 − ρ about 10^−k, k = 1, 2",
                  "B = E + ρ⟨E⟩/⟨1 − ρ⟩", "every solver", [] {
                    Worst worst;
                    for (const int k : {1, 2}) {
                      const WhiteSphere sphere(k);
                      for (const SolverInfo& solver : solvers()) {
                        const SolveResult result = solve(solver, sphere.system());
                        worst.add(result.report.status == SolveStatus::converged
                                      ? relative(result.radiosity, sphere.exact())
                                      : kNan,
                                  fmt::format("{}, k = {}", solver.name, k));
                      }
                    }
                    return worst.within(1e-5);
                  }});
  list.push_back({"SlowSolversSaySo", "sphere with 1 − ρ about 10⁻⁹",
                  "B = E + ρ⟨E⟩/⟨1 − ρ⟩, or: not converged", "every solver", [] {
                    const WhiteSphere sphere(9);
                    Worst worst;
                    for (const SolverInfo& solver : solvers()) {
                      const SolveResult result = solve(solver, sphere.system());
                      if (result.report.status == SolveStatus::converged)
                        worst.add(relative(result.radiosity, sphere.exact()), solver.name);
                    }
                    return worst.within(1e-6, "not converged: " + those([&](const SolverInfo& solver) {
                                                return solve(solver, sphere.system()).report.status !=
                                                       SolveStatus::converged;
                                              }));
                  }});

  list.push_back(refusal("PerfectWhiteThatEmits", "closed, ρ = 1 everywhere, a lamp",
                         "there is no steady state", [](const SolverInfo& solver) {
                           const Spheres s(1);
                           solve(solver, {*s.f, s.areas, constant(s.n, 1), constant(s.n, 1)});
                         }));
  list.push_back(refusal("PerfectWhiteInTheDark", "closed, ρ = 1 everywhere, no lamp",
                         "any constant is a solution", [](const SolverInfo& solver) {
                           const Spheres s(1);
                           solve(solver, {*s.f, s.areas, constant(s.n, 1), constant(s.n, 0)});
                         }));
  list.push_back(refusal("PerfectWhiteBesideGrey",
                         "two closed spheres, ρ = 1 with a lamp in one, ρ = ½ in the other",
                         "the part of the scene that patch 50 sees", [](const SolverInfo& solver) {
                           const Spheres s(2);
                           BandArray rho = constant(s.n, 0.5);
                           rho.bottomRows(50) = 1;
                           solve(solver, {*s.f, s.areas, rho, constant(s.n, 1)});
                         }));
  static const FormFactorMatrix open = [] {
    Eigen::MatrixXd f(2, 2);
    f << 0, 0.5, 0.5, 0;
    return dense_matrix(f);
  }();
  list.push_back(solved(
      "PerfectWhiteInTheOpen", "ρ = 1, but half of all light escapes", "B = 4/3, 2/3", 1e-7,
      [] {
        BandArray e(2, 1);
        e << 1, 0;
        return RadiositySystem(open, Eigen::Array2d(1, 1), constant(2, 1), e);
      },
      [] {
        BandArray b(2, 1);
        b << 4.0 / 3, 2.0 / 3;
        return b;
      }));
  static const Spheres one(1);
  static const Spheres two(2);
  const auto mixed = [](Index n) {
    std::mt19937_64 random(9);
    BandArray rho(n, 1);
    for (double& r : rho.reshaped()) r = 0.9 * uniform(random);
    return rho;
  };
  list.push_back(solved(
      "Black", "ρ = 0 everywhere", "B = E, no iteration", 0,
      [=] { return RadiositySystem(*one.f, one.areas, constant(one.n, 0), mixed(one.n)); },
      [=] { return mixed(one.n); }));
  list.push_back(solved(
      "NearlyBlack", "ρ = 10⁻³⁰⁰ on half of a sphere, 0.9 elsewhere", "B = E + ρ⟨E⟩/⟨1 − ρ⟩", 1e-6,
      [] {
        BandArray rho = constant(one.n, 0.9);
        rho.topRows(25) = 1e-300;
        return RadiositySystem(*one.f, one.areas, rho, constant(one.n, 1));
      },
      [] {
        BandArray rho = constant(one.n, 0.9);
        rho.topRows(25) = 1e-300;
        return one.exact(rho, constant(one.n, 1), 1 - rho);
      }));

  // Emission.
  const auto wide = [](Index n) {  // 10⁻³⁰ … 10³⁰ W/m²
    BandArray e(n, 1);
    for (Index i = 0; i < n; ++i) e(i, 0) = std::pow(10.0, -30 + 60.0 * i / (n - 1));
    return e;
  };
  list.push_back(solved(
      "LampsSixtyOrdersApart", "lamps of 10⁻³⁰ to 10³⁰ W/m² in one sphere", "B = E + ρ⟨E⟩/⟨1 − ρ⟩", 1e-6,
      [=] { return RadiositySystem(*one.f, one.areas, mixed(one.n), wide(one.n)); },
      [=] { return one.exact(mixed(one.n), wide(one.n), 1 - mixed(one.n)); }));
  list.push_back(solved(
      "RoomsSixtyOrdersApart",
      "a sphere lit by 10⁻³⁰ W/m² beside one lit by 10³⁰, closed off from each other",
      "B = E + ρ⟨E⟩/⟨1 − ρ⟩ in both", 1e-6,
      [=] {
        BandArray e = constant(two.n, 0);
        e(3, 0) = 1e-30;
        e(80, 0) = 1e30;
        return RadiositySystem(*two.f, two.areas, mixed(two.n), e);
      },
      [=] {
        BandArray e = constant(two.n, 0);
        e(3, 0) = 1e-30;
        e(80, 0) = 1e30;
        return two.exact(mixed(two.n), e, 1 - mixed(two.n));
      }));
  list.push_back(solved(
      "BandsThirtyOrdersApart", "bands lit by 10⁻¹⁵, 1, 10¹⁵ and 10³⁰⁰ W/m²", "B = E + ρ⟨E⟩/⟨1 − ρ⟩ in each",
      1e-6,
      [=] {
        BandArray e = BandArray::Zero(one.n, 4);
        e.row(5) << 1e-15, 1, 1e15, 1e300;
        return RadiositySystem(*one.f, one.areas, mixed(one.n).replicate(1, 4), e);
      },
      [=] {
        BandArray e = BandArray::Zero(one.n, 4);
        e.row(5) << 1e-15, 1, 1e15, 1e300;
        const BandArray rho = mixed(one.n).replicate(1, 4);
        return one.exact(rho, e, 1 - rho);
      }));
  list.push_back(refusal("RadiosityBeyondDoubles", "E = 10³⁰⁸ W/m², ρ = 0.99", "exceeds what a double holds",
                         [](const SolverInfo& solver) {
                           solve(solver, {*one.f, one.areas, constant(one.n, 0.99), constant(one.n, 1e308)});
                         }));
  list.push_back(solved(
      "SixtyFourBands", "64 bands, all different", "B = E + ρ⟨E⟩/⟨1 − ρ⟩ in each", 1e-6,
      [] {
        std::mt19937_64 random(2);
        BandArray rho(one.n, 64);
        for (double& r : rho.reshaped()) r = 0.9 * uniform(random);
        return RadiositySystem(*one.f, one.areas, rho, rho);
      },
      [] {
        std::mt19937_64 random(2);
        BandArray rho(one.n, 64);
        for (double& r : rho.reshaped()) r = 0.9 * uniform(random);
        return one.exact(rho, rho, 1 - rho);
      }));

  // Few patches.
  static const FormFactorMatrix none = dense_matrix(Eigen::MatrixXd(0, 0));
  static const FormFactorMatrix lone = dense_matrix(Eigen::MatrixXd::Zero(1, 1));
  list.push_back(solved(
      "NoPatch", "n = 0", "nothing", 0,
      [] { return RadiositySystem(none, Eigen::ArrayXd(0), BandArray(0, 1), BandArray(0, 1)); },
      [] { return BandArray(0, 1); }));
  list.push_back(solved(
      "OnePatch", "one patch, ρ = ½, that sees nothing", "B = E", 1e-15,
      [] { return RadiositySystem(lone, Eigen::ArrayXd::Ones(1), constant(1, 0.5), constant(1, 3)); },
      [] { return constant(1, 3); }));
  list.push_back(solved(
      "DarkRoomBesideALitOne", "two closed spheres, a lamp in one",
      "B = E + ρ⟨E⟩/⟨1 − ρ⟩ there, B = 0 in the other", 1e-6,
      [=] {
        BandArray e = constant(two.n, 0);
        e(60, 0) = 5;
        return RadiositySystem(*two.f, two.areas, mixed(two.n), e);
      },
      [=] {
        BandArray e = constant(two.n, 0);
        e(60, 0) = 5;
        return two.exact(mixed(two.n), e, 1 - mixed(two.n));
      }));
}

/// How far a method may be off: one that looks at pairs, at rays (4 standard errors), or at cells.
struct Allowed {
  double pairs, rays, cells;
};

/// What is compared, method by method: a factor, or a radiosity.
Limit by_methods(std::string name, std::string asked, std::string exact, Allowed allowed,
                 std::function<double(const FormFactorMethodInfo&)> error) {
  return {std::move(name), std::move(asked), std::move(exact), "every method", [=] {
            Outcome out{0, 1, ""};
            for (const FormFactorMethodInfo& method : form_factor_methods()) {
              const double most = method.name == "analytic"           ? allowed.pairs
                                  : !method.defaults.has_resolution() ? allowed.rays
                                                                      : allowed.cells;
              const double e = error(method);
              out.came_out += fmt::format("{}{} {:.1e} (allowed: {:.0e})",
                                          out.came_out.empty() ? "off by: " : ", ", method.name, e, most);
              out.error = !(e / most <= out.error) ? e / most : out.error;
            }
            return out;
          }};
}

double factor(const PatchMesh& mesh, const FormFactorMethodInfo& method, Index i, Index j) {
  const MethodSetup setup(mesh, method);
  return assemble(*setup.method, setup.visibility).matrix(i, j);
}

/// Every solver of the mesh's own materials, closed, E = 1, ρ = ½: B = 2.
double furnace(const PatchMesh& mesh, const FormFactorMethodInfo& method) {
  const MethodSetup setup(mesh, method);
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  double worst = 0;
  for (const SolverInfo& solver : solvers()) {
    const BandArray b = solve(solver, {f, setup.mesh}).radiosity;
    worst = std::max(worst, (b / 2 - 1).abs().maxCoeff());
  }
  return worst;
}

/// R10 on 8 × 8 patches a face: ceiling E = 1, ρ = ½; the mean of the floor.
double cube_floor(const PatchMesh& mesh, const FormFactorMethodInfo& method) {
  const MethodSetup setup(mesh, method);
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  BandArray e = constant(mesh.patch_count(), 0);
  const Index face = mesh.patch_count() / 6;
  e.bottomRows(face) = 1;
  const BandArray b =
      solve(find_solver("conjugate-gradient"), {f, mesh.areas(), constant(mesh.patch_count(), 0.5), e})
          .radiosity;
  return std::abs(b.middleRows(4 * face, face).mean() / 0.1713732235 - 1);
}

PatchMesh placed(const PatchMesh& mesh, double scale, double shift) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.translate(Vec3(shift, -0.7 * shift, 0.3 * shift)).scale(scale);
  return transformed(mesh, transform);
}

/// Unit squares, and nothing that emits: what sampled methods leave to the pairs for that reason is tried elsewhere.
PatchMesh dark_squares(const Vec3& second, const Vec3& u, const Vec3& v) {
  return MeshBuilder()
      .use_material(grey("wall", 0.5, 0))
      .grid({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1, 1)
      .grid(second, u, v, 1, 1)
      .build();
}

void add_geometry(std::vector<Limit>& list) {
  struct Place {
    const char* name;
    const char* asked;
    double scale, shift, analytic;
  };
  // Coordinates of 10⁷ m are rounded to 10⁻⁹ m.
  for (const Place& place : {Place{"Nanometres", "cube of 10⁻⁹ m", 1e-9, 0, 1e-6},
                             Place{"MillionKilometres", "cube of 10⁹ m", 1e9, 0, 1e-6},
                             Place{"FarAway", "cube of 1 m, 10⁷ m from the origin", 1, 1e7, 1e-6}})
    list.push_back(by_methods(place.name, fmt::format("{}, lit ceiling, 8 × 8 patches a face", place.asked),
                              "mean B of the floor 0.1713732235", Allowed{place.analytic, 2.5e-3, 1e-4},
                              [=](const FormFactorMethodInfo& method) {
                                return cube_floor(placed(cube_room(8), place.scale, place.shift), method);
                              }));

  list.push_back(by_methods(
      "TinyPatchInAHall", "hall of 50 × 50 × 25 m (10⁴ m²) with a patch of 10⁻⁶ m², E = 1, ρ = ½",
      "B = 2, every solver", Allowed{1e-6, 1e-6, 1e-6}, [](const FormFactorMethodInfo& method) {
        // A tile of 1 mm² cut out of the floor, and the rest of the floor round it.
        const double a = 0.001;
        const auto mesh = MeshBuilder()
                              .grid({0, 0, 25}, {0, 50, 0}, {50, 0, 0}, 4, 4)
                              .grid({0, 0, 0}, {0, 0, 25}, {50, 0, 0}, 3, 4)
                              .grid({0, 50, 0}, {50, 0, 0}, {0, 0, 25}, 4, 3)
                              .grid({0, 0, 0}, {0, 50, 0}, {0, 0, 25}, 4, 3)
                              .grid({50, 0, 0}, {0, 0, 25}, {0, 50, 0}, 3, 4)
                              .polygon({{0, 0, 0}, {20, 0, 0}, {20, 50, 0}, {0, 50, 0}})
                              .polygon({{20 + a, 0, 0}, {50, 0, 0}, {50, 50, 0}, {20 + a, 50, 0}})
                              .polygon({{20, 0, 0}, {20 + a, 0, 0}, {20 + a, 20, 0}, {20, 20, 0}})
                              .polygon({{20, 20 + a, 0}, {20 + a, 20 + a, 0}, {20 + a, 50, 0}, {20, 50, 0}})
                              .polygon({{20, 20, 0}, {20 + a, 20, 0}, {20 + a, 20 + a, 0}, {20, 20 + a, 0}})
                              .build();
        return furnace(mesh, method);
      }));
  // ∫∫ cosθ cosθ'/(πr²) = A A' /(π d²) between small patches that face each other.
  list.push_back(by_methods("TinyLamp", "lamp of 1 mm² 1 m above a patch of 1 mm²", "F = 10⁻⁶/π",
                            Allowed{1e-5, 1e-5, 1e-5}, [](const FormFactorMethodInfo& method) {
                              const auto mesh = MeshBuilder()
                                                    .use_material(grey("floor", 0.5, 0))
                                                    .grid({0, 0, 0}, {1e-3, 0, 0}, {0, 1e-3, 0}, 1, 1)
                                                    .use_material(grey("lamp", 0, 1))
                                                    .grid({0, 0, 1}, {0, 1e-3, 0}, {1e-3, 0, 0}, 1, 1)
                                                    .build();
                              return std::abs(factor(mesh, method, 0, 1) * pi / 1e-6 - 1);
                            }));
  // Y = 10⁻⁶: F = Y/π ∫∫ ds dt / (1 + (s − t)²)² = Y/4.
  list.push_back(by_methods("Slivers", "opposed strips of 1 m × 1 µm at 1 m (aspect 10⁶)", "F = 10⁻⁶/4",
                            Allowed{1e-3, 1e-3, 1e-3}, [](const FormFactorMethodInfo& method) {
                              const auto mesh = MeshBuilder()
                                                    .grid({0, 0, 0}, {1, 0, 0}, {0, 1e-6, 0}, 1, 1)
                                                    .grid({0, 0, 1}, {0, 1e-6, 0}, {1, 0, 0}, 1, 1)
                                                    .build();
                              return std::abs(factor(mesh, method, 0, 1) / 0.25e-6 - 1);
                            }));
  // 1 − F = 2 gap for gap → 0: what gets out at four edges.
  list.push_back(by_methods("NearlyTouching", "unit squares at a gap of 10⁻⁹", "F = 1 − 2·10⁻⁹",
                            Allowed{1e-7, 1e-7, 1e-7}, [](const FormFactorMethodInfo& method) {
                              return std::abs(factor(opposed_squares(1e-9), method, 0, 1) - (1 - 2e-9));
                            }));
  // No cell over four viewpoints looks out of the gap: F = 1. Rays: 4 √(F (1 − F) / 2 / 1024) in either direction.
  list.push_back(by_methods("Near", "unit squares at a gap of 10⁻³", "F = 0.998005631908",
                            Allowed{1e-7, 4e-3, 2.1e-3}, [](const FormFactorMethodInfo& method) {
                              const PatchMesh mesh = dark_squares({0, 0, 1e-3}, {0, 1, 0}, {1, 0, 0});
                              return std::abs(factor(mesh, method, 0, 1) - 0.998005631908);
                            }));
  // Four Gauss points err by 3.6e-4; the rest is room for 128 cells.
  list.push_back(by_methods("Touching", "unit squares that share an edge at a right angle",
                            "F = 0.2000437760754", Allowed{1e-7, 3.5e-2, 1.4e-3},
                            [](const FormFactorMethodInfo& method) {
                              const PatchMesh mesh = dark_squares({0, 0, 0}, {0, 0, 1}, {1, 0, 0});
                              return std::abs(factor(mesh, method, 0, 1) - 0.200043776075403);
                            }));
  // Long walls of equal width at an angle θ: F = 1 − sin(θ/2); 1000 times as long as wide, their ends take about a thousandth.
  for (const auto& [name, degrees, allowed] :
       {std::tuple{"NearlyClosedBook", 0.01, 1e-6}, std::tuple{"NearlyFlatBook", 179.99, 2e-3}})
    list.push_back(by_methods(name, fmt::format("walls of 1000 × 1 m that meet at {}°", degrees),
                              "F = 1 − sin(θ/2)", Allowed{allowed, allowed, allowed},
                              [degrees = degrees](const FormFactorMethodInfo& method) {
                                const double angle = degrees * pi / 180;
                                const auto mesh = rectangles_sharing_an_edge(1000, 1, 1, angle);
                                const double half = (pi - angle) / 4;  // 1 − sin(θ/2) = 2 sin²((π − θ)/4)
                                const double exact = 2 * std::sin(half) * std::sin(half);
                                return std::abs(factor(mesh, method, 0, 1) / exact - 1);
                              }));
  // Four Gauss points err by 1.45e-3 of 0.2; the rest is room for 128 cells.
  list.push_back(by_methods(
      "TwoPatches", "unit squares at 1 m, ρ = ½, one lit, open", "B = 1/(1 − (F/2)²), F B/2",
      Allowed{2e-7, 1.8e-1, 9e-3}, [](const FormFactorMethodInfo& method) {
        const MethodSetup setup(dark_squares({0, 0, 1}, {0, 1, 0}, {1, 0, 0}), method);
        const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
        BandArray e = constant(2, 0);
        e(0, 0) = 1;
        const double exact = 0.199824895698387 / 2;
        double worst = 0;
        for (const SolverInfo& solver : solvers()) {
          const BandArray b = solve(solver, {f, setup.mesh.areas(), constant(2, 0.5), e}).radiosity;
          worst = std::max({worst, std::abs(b(0, 0) * (1 - exact * exact) - 1),
                            std::abs(b(1, 0) * (1 - exact * exact) / exact - 1)});
        }
        return worst;
      }));
  list.push_back(
      by_methods("BlindPatch", "a cube, and behind its wall a patch that sees nothing; E = 1, ρ = ½",
                 "B = 2 inside, 1 behind", Allowed{1e-6, 2e-6, 2e-6}, [](const FormFactorMethodInfo& method) {
                   const auto mesh = MeshBuilder()
                                         .box({0, 0, 0}, {1, 1, 1}, 3, Facing::inward)
                                         .grid({2, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 1)
                                         .build();
                   const MethodSetup setup(mesh, method);
                   const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
                   BandArray exact = constant(setup.size(), 2);
                   exact(setup.size() - 1, 0) = 1;
                   double worst = 0;
                   for (const SolverInfo& solver : solvers())
                     worst = std::max(worst, relative(solve(solver, {f, setup.mesh}).radiosity, exact));
                   return worst;
                 }));
}

}  // namespace

void solve_limits_by(LimitSolve solve) {
  other_solve = std::move(solve);
}

std::vector<Limit> limits() {
  std::vector<Limit> list;
  add_reflectances(list);
  add_geometry(list);
  return list;
}

}  // namespace radiosity::test
