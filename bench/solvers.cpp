// SPDX-License-Identifier: GPL-3.0-or-later
// Solvers × reflectances on the furnished rooms: passes over F and seconds to three accuracies; and how fast F is read.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solver.hpp"

namespace {

using namespace radiosity;

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The shortest of a few runs.
double fastest(int runs, const auto& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int run = 0; run < runs; ++run) best = std::min(best, seconds_of(work));
  return best;
}

struct Reflectance {
  std::string name;
  BandArray rho, alpha;
};

/// 1 − ρ everywhere, or, where it is 0, ρ of every surface drawn from [0.2, 0.9].
Reflectance reflectance(const PatchMesh& mesh, double absorptance) {
  const Index n = mesh.patch_count();
  if (absorptance > 0)
    return {absorptance < 1e-3 ? fmt::format("1 − {:.0e}", absorptance) : fmt::format("{}", 1 - absorptance),
            BandArray::Constant(n, 1, 1 - absorptance), BandArray::Constant(n, 1, absorptance)};
  std::mt19937_64 random(5);
  std::vector<double> of_surface;
  BandArray rho(n, 1);
  for (Index i = 0; i < n; ++i) {
    while (static_cast<Index>(of_surface.size()) <= mesh.surface(i))
      of_surface.push_back(0.2 + 0.7 * test::uniform(random));
    rho(i, 0) = of_surface[mesh.surface(i)];
  }
  return {"mixed 0.2–0.9", rho, 1 - rho};
}

class Comparison {
 public:
  std::string only;  // solvers whose name contains this

  Comparison(const PatchMesh& mesh, const FormFactorMatrix& f) : mesh_(mesh), f_(f) {}

  void run(const Reflectance& material, double most_passes) {
    const RadiositySystem system(f_, mesh_.areas(), material.rho, mesh_.emission(), material.alpha);
    SolverOptions exact;
    exact.tolerance = 1e-13;
    reference_ = find_solver("conjugate-gradient").make()->solve(system, exact).radiosity;
    for (const SolverInfo& info : solvers()) {
      if (info.name.find(only) == std::string_view::npos) continue;
      report(system, material, info, 1, most_passes);
      if (info.name == "gauss-seidel") report(system, material, info, 1.3, most_passes);
    }
  }

 private:
  double error(const BandArray& b) const {
    return std::sqrt((mesh_.areas() * (b - reference_).col(0).square()).sum() /
                     (mesh_.areas() * reference_.col(0).square()).sum());
  }

  void report(const RadiositySystem& system, const Reflectance& material, const SolverInfo& info,
              double relaxation, double most_passes) {
    constexpr std::array kAccuracies{1e-3, 1e-6, 1e-10};
    // A first run tells how many steps each accuracy takes, a second one how long they take.
    std::array<std::optional<Index>, 3> steps;
    const bool shooting = !info.gathers;
    const double steps_per_pass = shooting ? mesh_.patch_count() : 1;
    SolverOptions options;
    options.tolerance = 1e-13;
    options.relaxation = relaxation;
    options.max_iterations = static_cast<Index>(most_passes * steps_per_pass);
    options.step = [&](Index iteration, double, const BandArray& b) {
      if (shooting && iteration % 64 != 0) return true;
      const double e = error(b);
      for (std::size_t k = 0; k < kAccuracies.size(); ++k)
        if (e <= kAccuracies[k] && !steps[k]) steps[k] = iteration;
      return !steps.back();
    };
    const auto solver = info.make();
    solver->solve(system, options);
    std::string line = fmt::format("| {} | {}{} |", material.name, info.name,
                                   relaxation == 1 ? "" : fmt::format(", ω = {}", relaxation));
    for (const auto& count : steps) {
      if (!count) {
        line += " – |";
        continue;
      }
      SolverOptions timed = options;
      timed.step = {};
      timed.max_iterations = std::max<Index>(1, *count);
      const double seconds = fastest(shooting ? 1 : 2, [&] { solver->solve(system, timed); });
      line += fmt::format(" {:.3g}, {:.2f} s |", *count / steps_per_pass, seconds);
    }
    fmt::print("{}\n", line);
    std::fflush(stdout);
  }

  const PatchMesh& mesh_;
  const FormFactorMatrix& f_;
  BandArray reference_;
};

/// GB/s of F, beside what a plain sum over as many floats reads.
void bandwidth(Index n) {
  FormFactorMatrix::Rows rows;
  rows.n = n;
  const float each = 1.0F / static_cast<float>(n);
  rows.values.assign(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), each);
  rows.escaped.assign(n, 1 - n * static_cast<double>(each));
  const FormFactorMatrix f(std::move(rows));
  fmt::print("\n| bands | GB/s of F, dense, {} patches | of one band's |\n|---|---|---|\n", n);
  double one = 0;
  for (const Index bands : {1, 2, 3, 4, 6, 8, 16, 64}) {
    const BandArray x = BandArray::Constant(n, bands, 0.5);
    BandArray y;
    const double seconds = fastest(5, [&] { f.apply(x, y); });
    const double rate = static_cast<double>(f.bytes()) / seconds / 1e9;
    if (bands == 1) one = rate;
    fmt::print("| {} | {:.1f} | {:.0f} % |\n", bands, rate, 100 * rate / one);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Solvers compared at equal error: prints Markdown tables"};
  double patch_size = 0.31;
  double most = 150;
  bool smallest = false, only_bandwidth = false;
  std::string only;
  app.add_option("--patch-size", patch_size, "of the furnished rooms, m")->capture_default_str();
  app.add_option("--most-passes", most, "over F, after which a solver is given up")->capture_default_str();
  app.add_option("--solver", only, "only those whose name contains this");
  app.add_flag("--smallest", smallest, "only rooms of a few hundred patches");
  app.add_flag("--bandwidth", only_bandwidth, "only how fast F is read");
  CLI11_PARSE(app, argc, argv);
  if (!only_bandwidth) {
    const PatchMesh mesh = make_patches(test::two_furnished_rooms(), PatchSize{smallest ? 2 : patch_size})
                               .mesh.with_clusters({});
    const Visibility visibility(mesh);
    const auto method = find_form_factor_method("hemisphere").make(visibility, {});
    const FormFactorMatrix f = assemble(*method, visibility).matrix;
    fmt::print(
        "Two furnished rooms, {} patches. Passes over F (shots/n) and seconds to a relative error of B "
        "of\n\n",
        mesh.patch_count());
    fmt::print("| ρ | solver | 1e-3 | 1e-6 | 1e-10 |\n|---|---|---|---|---|\n");
    Comparison comparison(mesh, f);
    comparison.only = only;
    for (const double absorptance : {0.0, 0.5, 0.2, 0.05, 1e-3, 1e-6})
      comparison.run(reflectance(mesh, absorptance), smallest ? 20 : most);
  }
  bandwidth(smallest ? 256 : 10'000);
  return 0;
}
