// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/estimate_seconds.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/refine.hpp"
#include "radiosity/simulation/restrict_to.hpp"
#include "watch.hpp"

namespace radiosity {
namespace {

constexpr std::string_view kPairs = "analytic", kSampled = "hemisphere";
constexpr double kSafety = 1.5;  // what a prediction from a few rows may fall short by
constexpr double kFiner = 10;    // a reference has so many times the rays or points of what it judges
// How many patches of the finer reference lie along one of the user's: exact, or of rays.
constexpr std::array<Index, 3> kFinerExact{4, 3, 2};
constexpr std::array<Index, 2> kFinerSampled{4, 2};
constexpr double kShare = 0.25;           // of the budget for each of the two references
constexpr double kSolverShare = 0.1;      // for the solvers
constexpr double kPictureShare = 0.25;    // of what is left, for the default setting of a method
constexpr double kWritingShare = 0.06;    // kept for whoever writes the results
constexpr double kSingleRounding = 6e-8;  // F is stored in single precision
constexpr Index kLeastRays = 256, kMostRays = 1 << 18;
constexpr std::uint64_t kOtherSeeds = 1'000'003;  // references share no random numbers with what they judge

class Budget {
 public:
  Budget(double seconds, const Progress& watcher) : seconds_(seconds), watcher_(watcher) {}

  double elapsed() const { return clock_.elapsed(); }
  double seconds() const { return seconds_; }
  double left() const { return (1 - kWritingShare) * seconds_ - elapsed(); }
  bool interrupted() const { return interrupted_; }
  /// False when the work under way should stop: `until` (s since the start) is over, or somebody asked.
  bool go_on(double until) {
    if (watcher_ && !watcher_(std::min(1.0, elapsed() / seconds_))) interrupted_ = true;
    return !interrupted_ && elapsed() < until;
  }

 private:
  Stopwatch clock_;
  double seconds_;
  const Progress& watcher_;
  bool interrupted_ = false;
};

struct Mesh {
  ComparedMesh facts;
  Patches patches;
  std::unique_ptr<Visibility> visibility;
};

// To three digits, as it will be typed.
double rounded(double size) {
  const double unit = std::pow(10.0, std::floor(std::log10(size)) - 2);
  return std::stod(fmt::format("{:.6g}", std::round(size / unit) * unit));
}

// On the heap: the visibility keeps a reference to the mesh.
std::unique_ptr<Mesh> make_mesh(Patches patches, const PatchOptions& options, const Stopwatch& watch) {
  auto out = std::make_unique<Mesh>(Mesh{{}, std::move(patches), {}});
  const PatchMesh& mesh = out->patches.mesh;
  out->visibility = std::make_unique<Visibility>(mesh);
  ComparedMesh& facts = out->facts;
  facts.options = options;
  facts.patches = mesh.patch_count();
  facts.size = out->patches.patch_size;
  if (!(facts.size > 0)) {
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      const auto corners = mesh.corners(i);
      for (std::size_t k = 0; k < corners.size(); ++k)
        facts.size = std::max(
            facts.size, (mesh.vertex(corners[k]) - mesh.vertex(corners[(k + 1) % corners.size()])).norm());
    }
  }
  facts.seconds = watch.elapsed();
  return out;
}

std::unique_ptr<Mesh> make_mesh(const Scene& scene, const PatchOptions& options) {
  const Stopwatch watch;
  return make_mesh(make_patches(scene, options), options, watch);
}

struct Solved {
  BandArray radiosity;
  std::optional<FormFactorMatrix> f;
  double seconds = 0;
  std::uint64_t rays = 0;
  std::string failure;  // of the solver
};

// Nothing where the budget stopped it.
std::optional<Solved> solve_on(const Mesh& mesh, const FormFactorMethodInfo& info,
                               const FormFactorOptions& settings, double tolerance, std::size_t memory,
                               Budget& budget, double until) {
  const Stopwatch watch;
  const auto method = info.make(*mesh.visibility, settings);
  AssemblyOptions assembly;
  assembly.memory_limit_bytes = memory;
  assembly.progress = [&](double) { return budget.go_on(until); };
  AssemblyReport report;
  Solved out;
  out.f.emplace(assemble(*method, *mesh.visibility, assembly, &report));
  if (!report.completed) return std::nullopt;
  SolverOptions options;
  options.tolerance = tolerance;
  auto result =
      find_solver("conjugate-gradient").make()->solve(RadiositySystem(*out.f, mesh.patches.mesh), options);
  if (result.report.status != SolveStatus::converged) out.failure = result.report.message;
  out.radiosity = std::move(result.radiosity);
  out.seconds = watch.elapsed();
  out.rays = report.rays;
  return out;
}

double relative_rms(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected) {
  double worst = 0;
  for (Index b = 0; b < error.cols(); ++b) {
    double above = 0, below = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      if (std::isnan(error(i, b)) || std::isnan(reflected(i, b))) continue;
      above += mesh.area(i) * error(i, b) * error(i, b);
      below += mesh.area(i) * reflected(i, b) * reflected(i, b);
    }
    if (below > 0) worst = std::max(worst, std::sqrt(above / below));
  }
  return worst;
}

// Area-weighted mean, rows that are not a number left out.
double mean(const PatchMesh& mesh, const Eigen::ArrayXd& values) {
  const Eigen::ArrayXd known = values.isNaN().select(0.0, mesh.areas());
  return (known * values.isNaN().select(0.0, values)).sum() / known.sum();
}

Eigen::ArrayXd where_wrong(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference) {
  Eigen::ArrayXd out = Eigen::ArrayXd::Zero(mesh.patch_count());
  const BandArray emission = mesh.emission();
  for (Index b = 0; b < radiosity.cols(); ++b) {
    const double scale = mean(mesh, reference.col(b) - emission.col(b));
    const Eigen::ArrayXd error = (radiosity.col(b) - reference.col(b)).abs();
    if (scale > 0) out = out.max(error.isNaN().select(0.0, error) / scale);
  }
  return out;
}

struct ReferenceSolution {
  ComparedReference facts;
  BandArray radiosity, noise;  // n × bands
  std::optional<FormFactorMatrix> f;
};

class Comparer {
 public:
  Comparer(const Scene& scene, const CompareOptions& options)
      : scene_(merge_equal_bands(scene)), options_(options), budget_(options.budget_s, options.progress) {}

  Comparison run(const PatchOptions& patches) {
    out_.budget_s = options_.budget_s;
    auto own = make_mesh(scene_, patches);
    if (options_.meshed) options_.meshed(own->patches);
    const double size = own->facts.size;
    auto reference = make_reference(*own, kShare * options_.budget_s);
    if (!reference && !budget_.interrupted())
      throw InputError(
          fmt::format("a budget of {} s does not suffice for a reference of {} rays for each of {} patches; "
                      "allow more time or larger patches",
                      options_.budget_s, kLeastRays, own->facts.patches));
    if (reference) {
      if (exact_s_ > 0 && reference->facts.method != kPairs)
        out_.notes.push_back(fmt::format(
            "the reference is of rays: factors pair by pair, exact here, would take about {:.2g} s; a budget "
            "of {:.2g} s would do",
            exact_s_, kSafety * exact_s_ / (2 * kShare)));
      const BandArray reflected = reference->radiosity - own->patches.mesh.emission();
      out_.factors = reference->facts;
      out_.factors.noise = relative_rms(own->patches.mesh, reference->noise, reflected);
      out_.radiosity = reference->radiosity;
      compare_solvers(*own, *reference->f);
      reference->f.reset();
      make_coarser(*own, size);
      out_.own = meshes_.size();
      meshes_.push_back(std::move(own));
      make_finer_reference(size);
      run_methods();
    } else {
      meshes_.push_back(std::move(own));
    }
    for (const auto& mesh : meshes_) out_.meshes.push_back(mesh->facts);
    out_.mesh.emplace(std::move(meshes_[out_.own]->patches.mesh));
    out_.completed = !budget_.interrupted();
    out_.seconds = budget_.elapsed();
    return std::move(out_);
  }

 private:
  struct Rung {
    const FormFactorMethodInfo* info;
    ComparedRun* run;
  };

  double predict(const Mesh& mesh, const FormFactorMethodInfo& info,
                 const FormFactorOptions& settings) const {
    const auto method = info.make(*mesh.visibility, settings);
    return estimate_seconds(*method, mesh.facts.patches, 8, options_.budget_s / 400);
  }

  // F has no more entries than there are rays or patches, of 8 bytes each.
  bool fits_memory(const Mesh& mesh, Index entries) const {
    const double n = mesh.facts.patches;
    return 8 * n * std::min<double>(n, entries) <= static_cast<double>(memory_limit_);
  }

  ReferenceSolution finish(const Mesh& mesh, double start, std::string_view method,
                           const FormFactorOptions& settings, int solves, BandArray radiosity,
                           BandArray noise, std::optional<FormFactorMatrix> f) const {
    ReferenceSolution out{{}, std::move(radiosity), std::move(noise), std::move(f)};
    out.facts.method = method;
    out.facts.settings = settings;
    out.facts.solves = solves;
    out.facts.size = mesh.facts.size;
    out.facts.patches = mesh.facts.patches;
    out.facts.seconds = budget_.elapsed() - start;
    return out;
  }

  std::optional<Solved> solve_until(const Mesh& mesh, const FormFactorMethodInfo& info,
                                    const FormFactorOptions& settings, double until) {
    return solve_on(mesh, info, settings, 1e-10, memory_limit_, budget_,
                    std::min(until, budget_.elapsed() + budget_.left()));
  }

  // Pair by pair. Where no patch hides another one solution is exact, so it may take what two references share; elsewhere two
  // with different numbers of points tell the error of the better one. Nothing where that takes too long.
  std::optional<ReferenceSolution> refer_to_pairs(const Mesh& mesh, double share) {
    const double start = budget_.elapsed();
    const FormFactorMethodInfo& pairs = find_form_factor_method(kPairs);
    FormFactorOptions many = pairs.defaults, fewer = pairs.defaults;
    many.samples *= 16;
    fewer.samples *= 4;
    if (!fits_memory(mesh, mesh.facts.patches)) return std::nullopt;
    const double predicted = predict(mesh, pairs, fewer);
    if (mesh.visibility->convex()) {
      exact_s_ = predicted;
      if (predicted > 2 * share) return std::nullopt;
      auto exact = solve_until(mesh, pairs, fewer, start + kSafety * 2 * share);
      if (!exact) return std::nullopt;
      return finish(mesh, start, kPairs, fewer, 1, exact->radiosity, kSingleRounding * exact->radiosity,
                    std::move(exact->f));
    }
    // Four times as many points cost at most four times as much.
    if (predicted > share / 2) return std::nullopt;
    auto second = solve_until(mesh, pairs, fewer, start + share);
    if (!second || budget_.elapsed() - start + 4 * second->seconds > 1.5 * share) return std::nullopt;
    second->f.reset();
    auto best = solve_until(mesh, pairs, many, start + 2 * share);
    if (!best) return std::nullopt;
    return finish(mesh, start, kPairs, many, 1, best->radiosity, (best->radiosity - second->radiosity) / 3,
                  std::move(best->f));
  }

  // Two solutions, as many rays as they may have, found by what fewer took: the first has the fewest. Their difference tells
  // the error of their mean.
  std::optional<ReferenceSolution> refer_to_rays(const Mesh& mesh, double share) {
    const double start = budget_.elapsed();
    const double until = start + 1.5 * share;
    const FormFactorMethodInfo& sampled = find_form_factor_method(kSampled);
    FormFactorOptions settings = sampled.defaults;
    settings.seed = options_.seed + kOtherSeeds;
    settings.samples = kLeastRays;
    if (!fits_memory(mesh, settings.samples)) return std::nullopt;
    auto first = solve_until(mesh, sampled, settings, until);
    while (first && settings.samples < kMostRays) {
      const double left = share - (budget_.elapsed() - start);
      Index more = 1;
      while (more < 16 && 2.0 * (2 * more) * first->seconds < left &&
             fits_memory(mesh, 2 * more * settings.samples) && more * settings.samples < kMostRays)
        more *= 2;
      if (more == 1) break;
      settings.samples *= more;
      first = solve_until(mesh, sampled, settings, until);
    }
    if (!first || budget_.elapsed() + first->seconds > until) return std::nullopt;
    ++settings.seed;
    const auto second = solve_until(mesh, sampled, settings, until);
    if (!second) return std::nullopt;
    --settings.seed;
    return finish(mesh, start, kSampled, settings, 2, (first->radiosity + second->radiosity) / 2,
                  (first->radiosity - second->radiosity) / 2, std::move(first->f));
  }

  // Nothing where the budget does not allow it, or somebody asked to stop.
  std::optional<ReferenceSolution> make_reference(const Mesh& mesh, double share) {
    auto reference = refer_to_pairs(mesh, share);
    if (!reference && !budget_.interrupted()) reference = refer_to_rays(mesh, share);
    return reference;
  }

  void compare_solvers(const Mesh& mesh, const FormFactorMatrix& f) {
    const RadiositySystem system(f, mesh.patches.mesh);
    SolverOptions options;
    options.tolerance = 1e-12;
    const BandArray exact = find_solver("conjugate-gradient").make()->solve(system, options).radiosity;
    options.tolerance = 1e-8;
    const double end =
        budget_.elapsed() + std::min(kSolverShare * options_.budget_s, std::max(0.0, budget_.left()));
    auto waiting = static_cast<double>(std::size(solvers()));
    for (const SolverInfo& info : solvers()) {
      const double until = budget_.elapsed() + (end - budget_.elapsed()) / waiting--;
      const double passes = info.needs_stored_rows ? 1 : 1.0 / f.size();
      int digits = 1;  // of the next tolerance to be met
      double paused = 0;
      const Stopwatch watch;
      const auto record = [&](Index iteration, double residual, const BandArray& radiosity) {
        const double reached = watch.elapsed();
        for (; digits <= 8 && residual <= std::pow(10.0, -digits); ++digits) {
          SolverRun& run = out_.solvers.emplace_back();
          run.solver = info.name;
          run.tolerance = std::pow(10.0, -digits);
          run.products = iteration * passes;
          run.seconds = reached - paused;
          run.residual = residual;
          run.error = relative_error(mesh.patches.mesh, radiosity, exact).rms;
        }
        paused += watch.elapsed() - reached;
        return budget_.go_on(until);
      };
      options.step = record;
      const SolveReport report = info.make()->solve(system, options).report;
      for (; digits <= 8; ++digits)
        out_.solvers.push_back({.solver = std::string(info.name),
                                .tolerance = std::pow(10.0, -digits),
                                .left_out = report.status == SolveStatus::stopped
                                                ? "not reached in the time for solvers"
                                                : report.message});
    }
  }

  void make_coarser(const Mesh& own, double size) {
    for (const double factor : {4.0, 2.0}) {
      auto coarse = make_mesh(scene_, PatchSize{rounded(factor * size)});
      const Index before = meshes_.empty() ? 0 : meshes_.back()->facts.patches;
      if (coarse->facts.patches > 0.7 * own.facts.patches || coarse->facts.patches <= before) continue;
      coarse->facts.size = rounded(factor * size);
      twice_there_ = factor == 2;
      meshes_.push_back(std::move(coarse));
    }
  }

  void no_finer_reference() {
    out_.notes.emplace_back(
        "no reference on finer patches fits the budget, so the errors say nothing of what the size of the "
        "patches does");
  }

  void make_finer_reference(double size) {
    const Mesh& user = *meshes_[out_.own];
    const double share = kShare * options_.budget_s;
    std::unique_ptr<Mesh> fine;
    Coarsening to_own;
    std::optional<ReferenceSolution> reference;
    Index k = 0;
    const auto refer = [&](Index times, auto make) {
      k = times;
      const Stopwatch watch;
      Refinement finer = refine(user.patches.mesh, k);
      to_own = std::move(finer.coarsening);
      fine = make_mesh(Patches{std::move(finer.mesh), {}, {}, size / k}, PatchSize{size / k}, watch);
      reference = (this->*make)(*fine, share);
      return reference || budget_.interrupted();
    };
    // Exact factors of somewhat larger patches tell more than rays from a quarter of the size in the same time.
    bool done = false;
    if (user.visibility->convex() && out_.factors.method == kPairs)
      for (const Index times : kFinerExact)
        done = done || ((1 + std::pow(times, 4)) * out_.factors.seconds < 2 * share &&
                        refer(times, &Comparer::refer_to_pairs));
    if (!done) {
      // Few rays: what is left is the cost of lamps, whose pairs grow with k⁴, and of closing the rows.
      FormFactorOptions few;
      few.samples = 64;
      const double start = budget_.elapsed();
      if (!solve_until(user, find_form_factor_method(kSampled), few, start + share))
        return no_finer_reference();
      const double fixed = budget_.elapsed() - start;
      for (const Index times : kFinerSampled)
        done = done ||
               (kSafety * std::pow(times, 4) * fixed <= share && refer(times, &Comparer::make_reference));
    }
    if (!reference) return no_finer_reference();
    if (k > 2) meshes_.push_back(make_mesh(scene_, PatchSize{rounded(size / 2)}));
    for (std::size_t m = 0; m < meshes_.size(); ++m) {
      const PatchMesh &coarse = meshes_[m]->patches.mesh, &finer = fine->patches.mesh;
      const auto means = [&](const BandArray& values) {
        return m == out_.own ? restrict_to(to_own, finer.areas(), values) : restrict_to(coarse, finer, values);
      };
      finer_.push_back(means(reference->radiosity));
      meshes_[m]->facts.own_noise = relative_rms(coarse, means(reference->noise), finer_.back() - coarse.emission());
    }
    ComparedReference& facts = out_.finer.emplace(reference->facts);
    const Mesh& own = *meshes_[out_.own];
    facts.noise = own.facts.own_noise;
    out_.where_patches = where_wrong(own.patches.mesh, out_.radiosity, finer_[out_.own]);

    // What patches do, after the noise of both references has been taken off.
    const auto patch_effect = [&](std::size_t m, const BandArray& radiosity, double noise) {
      const double raw = relative_error(meshes_[m]->patches.mesh, radiosity, finer_[m]).rms;
      const double both = std::hypot(noise, meshes_[m]->facts.own_noise);
      return std::sqrt(std::max(raw * raw - both * both, 0.04 * raw * raw));
    };
    const double at_own = patch_effect(out_.own, out_.radiosity, out_.factors.noise);
    facts.order = 1;
    facts.order_assumed = true;
    if (twice_there_) {
      if (const auto coarse = make_reference(*meshes_[out_.own - 1], kShare / 4 * options_.budget_s)) {
        const PatchMesh& mesh = meshes_[out_.own - 1]->patches.mesh;
        const double noise = relative_rms(mesh, coarse->noise, coarse->radiosity - mesh.emission());
        const auto order = measured_order(patch_effect(out_.own - 1, coarse->radiosity, noise) / at_own, k);
        facts.order = order.value_or(1);
        facts.order_assumed = !order;
      }
    }
    facts.patch_error = at_own / (std::pow(k, *facts.order) - 1);
  }

  /// p of (2^p − k^−p) / (1 − k^−p) = ratio, by bisection; it rises with p. Nothing where that is not within [1, 2].
  static std::optional<double> measured_order(double ratio, double k) {
    const auto ratio_at = [&](double p) { return (std::exp2(p) - std::pow(k, -p)) / (1 - std::pow(k, -p)); };
    double low = 1, high = 2;
    if (!(ratio >= ratio_at(low) && ratio <= ratio_at(high))) return std::nullopt;
    for (int step = 0; step < 40; ++step) {
      const double p = (low + high) / 2;
      (ratio_at(p) < ratio ? low : high) = p;
    }
    return (low + high) / 2;
  }

  // Why a rung cannot be judged.
  std::string too_fine(const Rung& rung) const {
    const auto& settings = rung.run->settings;
    const auto finer_than = [&](const ComparedReference& reference) {
      if (reference.method != rung.info->name) return false;
      // Fine patches are averaged: what counts of rays is how many a piece of surface sends.
      const double share = reference.method == kSampled
                               ? static_cast<double>(reference.patches) /
                                     meshes_[rung.run->mesh]->facts.patches * reference.solves
                               : 1;
      return kFiner * settings.samples > share * reference.settings.samples;
    };
    const bool own = rung.run->mesh == out_.own;
    return (own && finer_than(out_.factors)) || (out_.finer && finer_than(*out_.finer))
               ? fmt::format("has more than a tenth of the reference's {}",
                             rung.info->name == kSampled ? "rays" : "points")
               : std::string();
  }

  void run_methods() {
    std::vector<const FormFactorMethodInfo*> infos;
    for (std::size_t m = 0; m < meshes_.size(); ++m) {
      if (m != out_.own && !out_.finer) continue;
      for (const FormFactorMethodInfo& info : form_factor_methods()) {
        const bool exact = info.make(*meshes_[m]->visibility)->exact();
        for (const FormFactorOptions& settings : ladder(info)) {
          const bool standard =
              settings.samples == info.defaults.samples && settings.resolution == info.defaults.resolution;
          if (exact && !standard) continue;  // the settings change nothing
          ComparedRun& run = out_.runs.emplace_back();
          infos.push_back(&info);
          run.mesh = m;
          run.method = info.name;
          run.settings = settings;
          run.settings.seed = options_.seed;
          run.standard = standard;
        }
      }
    }
    std::vector<std::size_t> order(out_.runs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (const std::size_t r : order) {
      ComparedRun& run = out_.runs[r];
      const bool exact = infos[r]->make(*meshes_[run.mesh]->visibility)->exact();
      if (!exact) run.left_out = too_fine({infos[r], &run});
      if (run.left_out.empty() && !budget_.interrupted())
        run.predicted_s = predict(*meshes_[run.mesh], *infos[r], run.settings);
    }
    // The cheapest first, but for what is shown: an expensive default would never get its turn.
    const double most_s = kPictureShare * std::max(0.0, budget_.left());
    const auto turn = [&](std::size_t r) {
      const ComparedRun& run = out_.runs[r];
      const bool shown = run.standard && run.mesh == out_.own && run.predicted_s <= most_s;
      return std::pair{!shown, run.predicted_s};
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return turn(a) < turn(b); });
    for (const std::size_t r : order)
      if (out_.runs[r].left_out.empty()) run_one(*infos[r], out_.runs[r]);
  }

  void run_one(const FormFactorMethodInfo& info, ComparedRun& run) {
    const Mesh& mesh = *meshes_[run.mesh];
    const double left = budget_.left();
    if (!budget_.go_on(budget_.elapsed() + left) || kSafety * run.predicted_s > left) {
      run.left_out = budget_.interrupted()
                         ? std::string("interrupted")
                         : fmt::format("would take about {:.2g} s; {:.2g} s of the budget were left",
                                       run.predicted_s, std::max(left, 0.0));
      return;
    }
    std::optional<Solved> solved;
    try {
      solved = solve_on(mesh, info, run.settings, SolverOptions{}.tolerance, memory_limit_,
                        budget_, budget_.elapsed() + left);
    } catch (const InputError& error) {  // more memory than allowed
      run.left_out = error.what();
      return;
    }
    if (!solved || !solved->failure.empty()) {
      run.left_out = solved                  ? solved->failure
                     : budget_.interrupted() ? "interrupted"
                                             : "stopped: the budget was over";
      return;
    }
    run.seconds = mesh.facts.seconds + solved->seconds;
    run.bytes = static_cast<double>(solved->f->bytes());
    run.rays = solved->rays;
    const PatchMesh& patches = mesh.patches.mesh;
    if (run.mesh == out_.own) {
      run.factors = relative_error(patches, solved->radiosity, out_.radiosity);
      show(run, solved->radiosity);
    }
    if (out_.finer) run.total = relative_error(patches, solved->radiosity, finer_[run.mesh]);
  }

  // One map per method: of the default, or of the finest that ran without it. Runs are in the order of the ladder.
  void show(ComparedRun& run, const BandArray& radiosity) {
    for (ComparedRun& other : out_.runs) {
      if (other.where.size() == 0 || other.method != run.method) continue;
      if (!run.standard && (other.standard || &other > &run)) return;
      other.where.resize(0);
    }
    run.where = where_wrong(meshes_[out_.own]->patches.mesh, radiosity, out_.radiosity);
  }

  Scene scene_;
  const CompareOptions& options_;
  const std::size_t memory_limit_ = memory_limit(options_.memory_limit_bytes);
  Budget budget_;
  Comparison out_;
  std::vector<std::unique_ptr<Mesh>> meshes_;
  double exact_s_ = 0;            // predicted for exact factors of the mesh last referred to
  bool twice_there_ = false;      // the mesh before the user's has patches of twice the size
  std::vector<BandArray> finer_;  // per mesh: the finer reference on its patches
};

}  // namespace

RelativeError relative_error(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference) {
  if (radiosity.rows() != mesh.patch_count() || reference.rows() != mesh.patch_count() ||
      radiosity.cols() != reference.cols())
    throw InputError(fmt::format("radiosities of {} × {} and {} × {} for {} patches", radiosity.rows(),
                                 radiosity.cols(), reference.rows(), reference.cols(), mesh.patch_count()));
  const BandArray reflected = reference - mesh.emission();
  const BandArray error = radiosity - reference;
  RelativeError out{relative_rms(mesh, error, reflected), 0};
  for (Index b = 0; b < error.cols(); ++b) {
    const double least = 0.01 * mean(mesh, reflected.col(b));
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (least > 0 && reflected(i, b) >= least)  // false where it is not a number
        out.largest = std::max(out.largest, std::abs(error(i, b)) / reflected(i, b));
  }
  return out;
}

std::vector<std::size_t> pareto_front(std::span<const CostAndError> points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(points[a].cost, points[a].error) < std::pair(points[b].cost, points[b].error);
  });
  std::vector<std::size_t> front;
  for (const std::size_t k : order)
    if (front.empty() || points[k].error < points[front.back()].error) front.push_back(k);
  return front;
}

std::optional<std::size_t> cheapest(std::span<const CostAndError> points, double error) {
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (points[k].error <= error && (!best || points[k].cost < points[*best].cost)) best = k;
  return best;
}

std::vector<FormFactorOptions> ladder(const FormFactorMethodInfo& method) {
  const FormFactorOptions standard = method.defaults;
  std::vector<FormFactorOptions> steps;
  if (standard.resolution > 0) {
    for (Index samples = 1; samples <= 4 * standard.samples; samples *= 4)
      for (Index resolution = standard.resolution / 4; resolution <= 2 * standard.resolution; resolution *= 2)
        steps.push_back({.samples = samples, .resolution = resolution});
  } else {
    for (const double factor : {1.0 / 16, 1.0 / 4, 1.0, 4.0, 16.0})
      steps.push_back({.samples = std::max<Index>(1, static_cast<Index>(factor * standard.samples))});
  }
  return steps;
}

double ComparedReference::own_error() const {
  return std::hypot(noise, patch_error.value_or(0));
}

std::optional<double> error_at_most(const Comparison& comparison, const ComparedRun& run) {
  if (run.total)
    return run.total->rms +
           std::hypot(comparison.meshes[run.mesh].own_noise, comparison.finer->patch_error.value_or(0));
  if (run.factors) return run.factors->rms + comparison.factors.noise;
  return std::nullopt;
}

Measured measured(const Comparison& comparison) {
  Measured out;
  for (std::size_t r = 0; r < comparison.runs.size(); ++r) {
    const ComparedRun& run = comparison.runs[r];
    const auto error = error_at_most(comparison, run);
    if (!error) continue;
    out.index.push_back(r);
    out.by_seconds.push_back({run.seconds, *error});
    out.by_bytes.push_back({run.bytes, *error});
  }
  return out;
}

Comparison compare(const Scene& scene, const PatchOptions& patches, const CompareOptions& options) {
  if (!(options.budget_s > 0))
    throw InputError(fmt::format("budget: {} s is not positive", options.budget_s));
  return Comparer(scene, options).run(patches);
}

}  // namespace radiosity
