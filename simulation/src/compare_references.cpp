// SPDX-License-Identifier: GPL-3.0-or-later
#include "compare_references.hpp"

#include <array>
#include <cmath>

#include "radiosity/meshing/refine.hpp"
#include "radiosity/simulation/restrict_to.hpp"
#include "relative_error.hpp"

namespace radiosity {
namespace {

// Patches of the finer reference along one of the user's, the best first. Exact form factors on patches of a third of the size
// tell more than rays on patches of a quarter.
constexpr std::array<Index, 3> kExact{4, 3, 2};
constexpr std::array<Index, 2> kSampled{4, 2};
constexpr double kFiner = 1.5;  // times the clusters: where faces are small, smaller ones may be as many
constexpr Index kMostRays = 1 << 18;
constexpr double kSingleRounding = 6e-8;          // F is stored in single precision
constexpr std::uint64_t kOtherSeeds = 1'000'003;  // apart from those of the runs that are judged

const FormFactorMethodInfo& pairs() {
  return find_form_factor_method("analytic");
}
const FormFactorMethodInfo& rays() {
  return find_form_factor_method("hemisphere");
}

FormFactorOptions pairs_with(Index times_samples) {
  FormFactorOptions settings = pairs().defaults;
  settings.samples *= times_samples;
  return settings;
}

std::optional<SolvedRun> solve(const PreparedMesh& mesh, const FormFactorMethodInfo& info,
                               const FormFactorOptions& settings, Budget& budget, double until) {
  return solve_on(mesh, info, settings, 1e-10, budget, until);
}

// `facts` lack what the mesh and the noise tell.
Reference reference_on(const PreparedMesh& mesh, ComparedReference facts, BandArray radiosity,
                       BandArray noise, std::optional<FormFactorMatrix> f) {
  facts.size = mesh.facts.size;
  facts.patches = mesh.facts.patches;
  facts.noise = relative_rms(mesh.mesh(), noise, radiosity - mesh.mesh().emission());
  return {std::move(facts), std::move(radiosity), std::move(noise), std::move(f)};
}

std::optional<Reference> rays_reference(const PreparedMesh& mesh, double share, std::uint64_t seed,
                                        Budget& budget) {
  const double start = budget.elapsed(), until = start + 1.5 * share;
  FormFactorOptions settings{.samples = kLeastRays, .seed = seed + kOtherSeeds};
  if (!budget.holds(mesh.facts.patches, settings.samples)) return std::nullopt;
  auto first = solve(mesh, rays(), settings, budget, until);
  // As many rays as two solutions may have, from the time of fewer: it overestimates, as part of it does not grow with them.
  while (first && settings.samples < kMostRays) {
    const double left = share - (budget.elapsed() - start);
    Index more = 1;
    while (more < 16 && 2.0 * (2 * more) * first->seconds < left &&
           budget.holds(mesh.facts.patches, 2 * more * settings.samples) &&
           more * settings.samples < kMostRays)
      more *= 2;
    if (more == 1) break;
    settings.samples *= more;
    first = solve(mesh, rays(), settings, budget, until);
  }
  if (!first || budget.elapsed() + first->seconds > until) return std::nullopt;
  FormFactorOptions other = settings;
  ++other.seed;
  const auto second = solve(mesh, rays(), other, budget, until);
  if (!second) return std::nullopt;
  return reference_on(mesh,
                      {.method = std::string(rays().name),
                       .settings = settings,
                       .solves = 2,
                       .seconds = budget.elapsed() - start},
                      (first->radiosity + second->radiosity) / 2, (first->radiosity - second->radiosity) / 2,
                      std::move(first->f));
}

// What came of form factors pair by pair: nothing where they take too long or too much memory, or interrupted.
struct PairsAttempt {
  std::optional<Reference> reference = {};
  std::optional<double> exact_s = {};  // predicted, where they are exact on this mesh
};

// In about `share` (s). Where they are exact, one solution is enough and may take as long as two references. Elsewhere two with
// different numbers of points tell the error of the better one, which falls as 1/N: a third of their difference.
PairsAttempt pairs_reference(const PreparedMesh& mesh, double share, Budget& budget) {
  const double start = budget.elapsed();
  const FormFactorOptions fewer = pairs_with(4), many = pairs_with(16);
  if (!budget.holds(mesh.facts.patches, mesh.facts.patches)) return {};
  const double predicted = predict_seconds(mesh, pairs(), fewer, budget);
  const auto facts = [&](const FormFactorOptions& settings) {
    return ComparedReference{
        .method = std::string(pairs().name), .settings = settings, .seconds = budget.elapsed() - start};
  };
  if (pairs().make(*mesh.visibility)->exact()) {
    PairsAttempt out{.exact_s = predicted};
    if (predicted > 2 * share) return out;
    if (auto exact = solve(mesh, pairs(), fewer, budget, start + kSafety * 2 * share)) {
      out.reference = reference_on(mesh, facts(fewer), exact->radiosity, kSingleRounding * exact->radiosity,
                                   std::move(exact->f));
      out.reference->exact = true;
    }
    return out;
  }
  // Four times as many points cost at most four times as much.
  if (predicted > share / 2) return {};
  auto second = solve(mesh, pairs(), fewer, budget, start + share);
  if (!second || budget.elapsed() - start + 4 * second->seconds > 1.5 * share) return {};
  second->f.reset();
  auto best = solve(mesh, pairs(), many, budget, start + 2 * share);
  if (!best) return {};
  return {reference_on(mesh, facts(many), best->radiosity, (best->radiosity - second->radiosity) / 3,
                       std::move(best->f))};
}

// s of what does not fall with the number of rays: the pairs of lamps, and closing the rows. Nothing where it exceeds the share.
std::optional<double> fixed_seconds(const PreparedMesh& mesh, double share, Budget& budget) {
  const double start = budget.elapsed();
  const FormFactorOptions few{.samples = 64};
  if (!solve(mesh, rays(), few, budget, start + share)) return std::nullopt;
  return budget.elapsed() - start;
}

// What patches do to the radiosity: its rms error against the finer reference, less the noise of both. Noise that is estimated too
// large leaves a fifth.
double patch_effect(const MeshSeries& series, std::size_t m, const FinerReference& finer,
                    const Reference& reference) {
  const double raw = relative_error(series.meshes[m].mesh(), reference.radiosity, finer.radiosity[m]).rms;
  const double noise = std::hypot(reference.facts.noise, finer.noise[m]);
  return std::sqrt(std::max(raw * raw - noise * noise, 0.04 * raw * raw));
}

// Of clusters, whose members share one radiosity; those that are not-a-number do not count.
BandArray cluster_means(const PatchMesh& mesh, BandArray values) {
  for (Index c = 0; mesh.clustered() && c < mesh.cluster_count(); ++c) {
    Eigen::Array<double, 1, Eigen::Dynamic> sum =
        Eigen::Array<double, 1, Eigen::Dynamic>::Zero(values.cols());
    double area = 0;
    for (const Index i : mesh.members(c)) {
      if (values.row(i).isNaN().any()) continue;
      sum += mesh.area(i) * values.row(i);
      area += mesh.area(i);
    }
    for (const Index i : mesh.members(c)) values.row(i) = sum / area;
  }
  return values;
}

// p of (2^p − k^−p) / (1 − k^−p) = ratio, by bisection; it rises with p. Nothing where p is not within [1, 2].
std::optional<double> measured_order(double ratio, double k) {
  const auto ratio_at = [&](double p) { return (std::exp2(p) - std::pow(k, -p)) / (1 - std::pow(k, -p)); };
  double low = 1, high = 2;
  if (!(ratio >= ratio_at(low) && ratio <= ratio_at(high))) return std::nullopt;
  for (int step = 0; step < 40; ++step) {
    const double p = (low + high) / 2;
    (ratio_at(p) < ratio ? low : high) = p;
  }
  return (low + high) / 2;
}

}  // namespace

std::optional<Reference> make_reference(const PreparedMesh& mesh, double share, std::uint64_t seed,
                                        Budget& budget) {
  auto [by_pairs, exact_s] = pairs_reference(mesh, share, budget);
  if (by_pairs || budget.interrupted()) return std::move(by_pairs);
  auto by_rays = rays_reference(mesh, share, seed, budget);
  if (by_rays) by_rays->exact_s = exact_s;
  return by_rays;
}

std::optional<RefinedReference> refine_reference(const PreparedMesh& user, const Scene& scene,
                                                 const Reference& reference, std::uint64_t seed,
                                                 Budget& budget) {
  const double share = kReferenceShare * budget.seconds();
  const auto on = [&](Index k, double least_s, auto refer) -> std::optional<RefinedReference> {
    const Stopwatch watch;
    const PatchSize size{user.facts.size / k};
    const bool clustered = user.mesh().clustered();
    std::optional<Coarsening> to_user;
    PreparedMesh mesh = [&] {
      if (clustered) return prepare(scene, size);
      Refinement finer = refine(user.mesh(), k);
      to_user = std::move(finer.coarsening);
      return prepare(Patches{std::move(finer.mesh), {}, {}, size.metres}, size, watch);
    }();
    if (clustered) {
      const double times = static_cast<double>(mesh.facts.patches) / user.facts.patches;
      if (times < kFiner || kSafety * times * times * least_s > share) return std::nullopt;
    }
    std::optional<Reference> found = refer(mesh);
    if (!found) return std::nullopt;
    found->f.reset();
    return RefinedReference{k, std::move(to_user), std::move(mesh), *std::move(found)};
  };
  if (reference.exact)
    for (const Index k : kExact) {
      if ((1 + std::pow(k, 4)) * reference.facts.seconds >= 2 * share || budget.interrupted()) continue;
      if (auto out = on(
              k, 0, [&](const PreparedMesh& mesh) { return pairs_reference(mesh, share, budget).reference; }))
        return out;
    }
  const auto fixed_s = fixed_seconds(user, share, budget);
  if (!fixed_s) return std::nullopt;
  for (const Index k : kSampled) {
    const bool too_many = !user.mesh().clustered() && kSafety * std::pow(k, 4) * *fixed_s > share;
    if (too_many || budget.interrupted()) continue;
    if (auto out = on(k, *fixed_s,
                      [&](const PreparedMesh& mesh) { return make_reference(mesh, share, seed, budget); }))
      return out;
  }
  return std::nullopt;
}

FinerReference restrict_reference(const RefinedReference& refined, const MeshSeries& series) {
  const PatchMesh& fine = refined.mesh.mesh();
  FinerReference out{refined.reference.facts, {}, {}};
  for (std::size_t m = 0; m < series.meshes.size(); ++m) {
    const PatchMesh& mesh = series.meshes[m].mesh();
    const auto means = [&](const BandArray& values) {
      return m == series.own && refined.to_user ? restrict_to(*refined.to_user, fine.areas(), values)
                                                : cluster_means(mesh, restrict_to(mesh, fine, values));
    };
    out.radiosity.push_back(means(refined.reference.radiosity));
    out.noise.push_back(
        relative_rms(mesh, means(refined.reference.noise), out.radiosity.back() - mesh.emission()));
  }
  out.facts.noise = out.noise[series.own];
  return out;
}

ComparedReference with_patch_error(const FinerReference& finer, Index k, const Reference& reference,
                                   const MeshSeries& series, std::uint64_t seed, Budget& budget) {
  const double effect = patch_effect(series, series.own, finer, reference);
  std::optional<double> order;
  if (const auto m = series.twice_as_coarse)
    if (const auto coarse =
            make_reference(series.meshes[*m], kReferenceShare / 4 * budget.seconds(), seed, budget))
      order = measured_order(patch_effect(series, *m, finer, *coarse) / effect, k);
  ComparedReference out = finer.facts;
  out.order = order.value_or(1);
  out.order_assumed = !order;
  out.patch_error = effect / (std::pow(k, *out.order) - 1);
  return out;
}

}  // namespace radiosity
