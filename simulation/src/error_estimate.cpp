// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/error_estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

#include "light_unit.hpp"
#include "radiosity/formfactors/aggregate.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/coarsen.hpp"
#include "radiosity/meshing/error.hpp"
#include "relative_error.hpp"

namespace radiosity {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Stopped {};

// F as a system takes it, whole or shared by ranks.
class Applied {
 public:
  Applied(const FormFactorMatrix& f, const std::shared_ptr<const Ranks>& ranks) : f_(f) {
    if (ranks) distributed_.emplace(f, ranks);
  }
  const FormFactorOperator& form_factors() const {
    return distributed_ ? static_cast<const FormFactorOperator&>(*distributed_) : f_;
  }

 private:
  const FormFactorMatrix& f_;
  std::optional<DistributedFormFactors> distributed_;
};

struct Solved {
  BandArray radiosity;
  Index lamps;                                // AssemblyReport::lamps
  std::shared_ptr<const PairRows> pair_rows;  // AssemblyReport::pair_rows
};

SolverOptions quiet(SolverOptions options) {
  options.step = {};
  options.progress = {};
  return options;
}

Solved solve_on(const SolvedProblem& problem, const PatchMesh& mesh, const Visibility& visibility,
                const FormFactorOptions& options, std::shared_ptr<const PairRows> pair_rows = {}) {
  const auto method = problem.method.make(visibility, options);
  AssemblyOptions assembly = problem.assembly;
  assembly.pair_rows = std::move(pair_rows);
  const auto [f, report] = assemble(*method, visibility, assembly);
  if (!report.completed) throw Stopped{};
  const Applied applied(f, assembly.ranks);
  return {problem.solver.solve(RadiositySystem(applied.form_factors(), mesh), quiet(problem.solver_options))
              .radiosity,
          report.lamps, report.pair_rows};
}

// A cheaper setting of the method, and what the difference in B is to be divided by.
struct Cheaper {
  FormFactorOptions options;
  double divisor;
};

Cheaper cheaper(const FormFactorMethod& method) {
  Cheaper out{method.options(), 1};
  const Index samples = out.options.samples;
  if (method.reciprocal()) {  // pairs: the error falls as 1/N
    out.options.samples = std::max<Index>(1, samples / 4);
    out.divisor = static_cast<double>(samples) / static_cast<double>(out.options.samples) - 1;
    if (!(out.divisor > 0)) out.divisor = 1;
    return out;
  }
  ++out.options.seed;
  // Directions: the square of the error falls as 1/N, and both have one. Where there is but one viewpoint, four in its place:
  // another turn of the same cube would not show that it stands at the centre.
  const bool cells = out.options.has_resolution();
  out.options.samples =
      cells ? (samples >= 4 ? samples / 4 : 4 * samples) : std::max<Index>(64, samples / 16);
  out.divisor = std::sqrt(1 + static_cast<double>(samples) / static_cast<double>(out.options.samples));
  return out;
}

// Root mean square over a cluster and those that share a vertex with it: one difference is a poor estimate of a deviation.
BandArray smooth(const PatchMesh& mesh, const BandArray& error) {
  BandArray out(error.rows(), error.cols());
  std::vector<Index> round;
  for (Index i = 0; i < mesh.cluster_count(); ++i) {
    round.assign(1, i);
    for (const Index member : mesh.members(i))
      for (const Index v : mesh.corners(member))
        for (const Index patch : mesh.vertex_patches(v)) round.push_back(mesh.cluster(patch));
    std::sort(round.begin(), round.end());
    round.erase(std::unique(round.begin(), round.end()), round.end());
    Eigen::Array<double, 1, Eigen::Dynamic> sum = Eigen::Array<double, 1, Eigen::Dynamic>::Zero(error.cols());
    for (const Index j : round) sum += error.row(j).square();
    out.row(i) = (sum / static_cast<double>(round.size())).sqrt();
  }
  return out;
}

struct Noise {
  Eigen::ArrayXd relative_square;  // per band
  BandArray per_patch;
};

// Hemicubes over few points are compared with hemicubes over more, which cost more than what they are about: on patches of twice the
// size, where both cost less and err twice as much. Absent where that mesh is not much coarser, or lamps are computed pair by pair on
// only one of the two.
std::optional<Noise> error_on_larger_patches(const SolvedProblem& problem, const FormFactorOptions& options,
                                             const Cheaper& other) {
  if (!(problem.patches.patch_size > 0)) return std::nullopt;
  const Patches larger = make_patches(problem.scene, PatchSize{2 * problem.patches.patch_size});
  if (larger.mesh.cluster_count() > 0.7 * problem.patches.mesh.cluster_count()) return std::nullopt;
  const Visibility visibility(larger.mesh);
  const Solved given = solve_on(problem, larger.mesh, visibility, options);
  if ((given.lamps > 0) != (problem.lamps > 0)) return std::nullopt;
  const BandArray error =
      (solve_on(problem, larger.mesh, visibility, other.options, given.pair_rows).radiosity -
       given.radiosity) /
      (2 * other.divisor);
  const Eigen::ArrayXd square = mean_square(
      larger.mesh.cluster_areas(), error, given.radiosity - larger.mesh.per_cluster(larger.mesh.emission()));
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray reflected = mesh.per_cluster(problem.solution.radiosity - mesh.emission());
  return Noise{square, reflected.rowwise() * square.sqrt().transpose()};
}

Noise form_factor_error(const SolvedProblem& problem, const FormFactorMethod& method) {
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray radiosity = mesh.per_cluster(problem.solution.radiosity);
  if (method.exact())
    return {Eigen::ArrayXd::Zero(radiosity.cols()), BandArray::Zero(radiosity.rows(), radiosity.cols())};
  const Cheaper other = cheaper(method);
  if (other.options.samples > method.options().samples)
    if (auto noise = error_on_larger_patches(problem, method.options(), other)) return *std::move(noise);
  const BandArray error =
      (solve_on(problem, mesh, problem.visibility, other.options, problem.pair_rows).radiosity - radiosity) /
      other.divisor;
  return {mean_square(mesh.cluster_areas(), error, radiosity - mesh.per_cluster(mesh.emission())),
          smooth(mesh, error)};
}

// Of factors that are known to be wrong: see estimate_error. Per band, relative.
Eigen::ArrayXd unreliable_square(const SolvedProblem& problem, std::vector<std::string>& notes) {
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray reflected = mesh.per_cluster(problem.solution.radiosity - mesh.emission());
  Eigen::ArrayXd share = Eigen::ArrayXd::Zero(mesh.cluster_count());
  for (const auto& [cluster, wrong] : problem.unreliable) share[cluster] = wrong;
  const BandArray power = reflected.colwise() * mesh.cluster_areas(), square = power * reflected;
  const auto part = [](const BandArray& values, const Eigen::ArrayXd& weight) -> Eigen::ArrayXd {
    const Eigen::ArrayXd all = values.colwise().sum().transpose();
    return (all > 0).select((values.colwise() * weight).colwise().sum().transpose() / all, 0.0);
  };
  const Eigen::ArrayXd out = part(square, share.square()) + part(power, share).square();
  if (!problem.unreliable.empty())
    notes.push_back(
        fmt::format("what nearly touches others of {} patches counts as wrong altogether: {:.2g} %",
                    problem.unreliable.size(), 100 * std::sqrt(out.maxCoeff())));
  return out;
}

// Of lamps computed pair by pair: their points and shadow rays are not those that a cheaper method changes. What some
// clusters receive wrongly stands for all.
Eigen::ArrayXd pairs_square(const SolvedProblem& problem) {
  const PatchMesh& mesh = problem.patches.mesh;
  if (!problem.pair_rows || problem.lamps == 0 || problem.visibility.convex())
    return Eigen::ArrayXd::Zero(problem.solution.radiosity.cols());
  const Index n = mesh.cluster_count();
  const Index asked = std::min(n, std::clamp(n / 32, 32, 256));
  std::vector<Index> clusters;
  for (Index k = 0; k < asked; ++k) clusters.push_back(one_of_stretch(k, asked, n));
  const BandArray radiosity = mesh.per_cluster(problem.solution.radiosity);
  const BandArray emission = mesh.per_cluster(mesh.emission());
  return mean_square(
      mesh.cluster_areas(),
      mesh.per_cluster(mesh.reflectance()) * pair_errors(*problem.pair_rows, problem.visibility, radiosity,
                                                         clusters, problem.assembly.ranks.get()),
      radiosity - emission);
}

// What exchanges nothing.
std::vector<std::uint8_t> isolated(const FormFactorMatrix& f, const Ranks* ranks) {
  Eigen::ArrayXd out(f.size());
  for (Index i = 0; i < f.size(); ++i) {
    const auto values = f.row(i).values;
    out[i] = std::none_of(values.begin(), values.end(), [](float v) { return v > 0; }) ? 1 : 0;
  }
  gather(ranks, out);
  return {out.begin(), out.end()};
}

// Absent, with a note, where few patches have others beside them to be joined with.
std::optional<Coarsening> coarser(const SolvedProblem& problem, const FormFactorMatrix& f, double factor,
                                  std::vector<std::string>& notes) {
  const Index n = f.size();
  // Those of the cell come first.
  const std::vector<Facet>& facets = problem.visibility.facets();
  const std::size_t of_cell =
      facets.size() / (static_cast<std::size_t>(problem.visibility.mesh().image_count()) + 1);
  Coarsening out = coarsen(problem.patches.mesh, std::span(facets).first(of_cell), factor,
                           isolated(f, problem.assembly.ranks.get()));
  if (out.count <= 0.7 * n) return out;
  notes.push_back(fmt::format(
      "error of the patches: joining those beside each other leaves {} of {}, too many to tell the order",
      out.count, n));
  return std::nullopt;
}

// B where it is constant on larger patches, less the means of B over these; not-a-number on those of one member: they tell nothing
// and are taken to be wrong by as much as the others.
struct CoarseError {
  BandArray difference;
  Eigen::ArrayXd relative_square;  // per band
  BandArray radiosity;             // on the larger patches
  double growth;  // of what lies on a patch of one size and then of another, the mean ratio of the sizes
};

// exp of the mean of ln √(A_I/A_i) over the area: 2 where each patch is joined with three others. Many are joined with fewer: what
// remains of a face beside a cell, and faces that have no other beside them. Where nearly all are such faces the difference says
// little, however large it is made.
double growth_of(const Eigen::ArrayXd& areas, const Coarsening& larger, const Eigen::ArrayXd& of_larger) {
  constexpr double kLeast = 1.2;
  return std::max(kLeast,
                  std::exp((areas * (of_larger(larger.parent) / areas).log()).sum() / (2 * areas.sum())));
}

CoarseError coarse_error(const SolvedProblem& problem, const FormFactorMatrix& f, const Coarsening& larger) {
  const std::shared_ptr<const Ranks>& ranks = problem.assembly.ranks;
  if (!on_all(ranks.get(), !problem.assembly.progress || problem.assembly.progress(0))) throw Stopped{};
  const PatchMesh& mesh = problem.patches.mesh;
  std::vector<Index> first(
      static_cast<std::size_t>(larger.count));  // members: one material, so one ρ and one E
  Eigen::ArrayXd areas = Eigen::ArrayXd::Zero(larger.count);
  Eigen::ArrayXi members = Eigen::ArrayXi::Zero(larger.count);
  for (Index i = mesh.cluster_count() - 1; i >= 0; --i) {
    const Index p = larger.parent[i];
    first[p] = mesh.members(i)[0];
    areas[p] += mesh.cluster_areas()[i];
    ++members[p];
  }
  const auto of_first = [&](const BandArray& values) -> BandArray { return values(first, Eigen::all); };
  const BandArray emission = of_first(mesh.emission());
  const FormFactorMatrix aggregated = aggregate(f, mesh.cluster_areas(), larger, ranks.get());
  const Applied applied(aggregated, ranks);
  const RadiositySystem system(applied.form_factors(), areas, of_first(mesh.reflectance()), emission,
                               of_first(mesh.absorptance()));
  CoarseError out{{},
                  {},
                  problem.solver.solve(system, quiet(problem.solver_options)).radiosity,
                  growth_of(mesh.cluster_areas(), larger, areas)};
  out.difference =
      out.radiosity - restrict_to(larger, mesh.cluster_areas(), mesh.per_cluster(problem.solution.radiosity));
  for (Index p = 0; p < larger.count; ++p)
    if (members[p] == 1) out.difference.row(p).setConstant(kNan);
  out.relative_square = mean_square(areas, out.difference, out.radiosity - emission);
  return out;
}

struct PatchError {
  Eigen::ArrayXd relative_square;  // per band
  double order;
  BandArray per_patch;
  BandArray correction;  // of H
};

// See ErrorEstimate::correction.
BandArray correction_by(const SolvedProblem& problem, const FormFactorMatrix& f, const Coarsening& larger,
                        const BandArray& radiosity_of_larger) {
  constexpr double kShare = 0.45, kMost = 0.5;
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray within =
      mesh.per_cluster(problem.solution.radiosity) - radiosity_of_larger(larger.parent, Eigen::all);
  const Applied applied(f, problem.assembly.ranks);
  BandArray out;
  applied.form_factors().apply(within, out);
  const BandArray most = kMost * mesh.per_cluster(problem.solution.irradiance);
  return (kShare * out).max(-most).min(most);
}

// The p of an error e ~ h^p with which B on two kinds of larger patches differs from B by (g₄^p − 1) / (g₂^p − 1), the ratio; 0
// where it is smaller than that of any p > 0.
double order_of(double ratio, double g2, double g4) {
  constexpr double kMost = 8;
  double low = 0, high = kMost;
  if (g4 <= g2 || ratio <= std::log(g4) / std::log(g2)) return 0;
  for (int k = 0; k < 50; ++k) {
    const double p = (low + high) / 2;
    ((std::pow(g4, p) - 1) / (std::pow(g2, p) - 1) < ratio ? low : high) = p;
  }
  return low;
}

std::optional<PatchError> patch_error(const SolvedProblem& problem, const FormFactorMatrix& f,
                                      std::vector<std::string>& notes) {
  const auto twice = coarser(problem, f, 2, notes);
  if (!twice) return std::nullopt;
  const auto four_times = coarser(problem, f, 4, notes);
  if (!four_times) return std::nullopt;
  const CoarseError half = coarse_error(problem, f, *twice), quarter = coarse_error(problem, f, *four_times);
  // One order for all bands, from that with the largest error.
  Eigen::Index band = 0;
  half.relative_square.maxCoeff(&band);
  const double ratio = half.relative_square[band] > 0
                           ? std::sqrt(quarter.relative_square[band] / half.relative_square[band])
                           : 0;
  // Where shadows end inside of patches p is 3/2 in the end, however well the smooth light does on coarse meshes. The further p is
  // above 2, the more are the largest patches too large for an order, and the least is taken: what furnished rooms show
  // (docs/calibration.md).
  constexpr double kLeast = 1.15, kMost = 1.5, kDoubtful = 2, kTooCoarse = 2.6;
  const double measured = order_of(ratio, half.growth, quarter.growth);
  const double doubt = std::clamp((measured - kDoubtful) / (kTooCoarse - kDoubtful), 0.0, 1.0);
  const double order = std::clamp(measured, kLeast, std::lerp(kMost, kLeast, doubt));
  const double divisor = std::pow(half.growth, order) - 1;
  BandArray per_patch(f.size(), half.difference.cols());
  for (Index i = 0; i < per_patch.rows(); ++i) {
    const auto error = half.difference.row(twice->parent[i]).abs() / divisor;
    per_patch.row(i) = error.isNaN().select(0.0, error);
  }
  PatchError out{half.relative_square / (divisor * divisor), order, per_patch, {}};
  if (problem.extrapolate) {
    // The less they differ the more from larger patches, the less do these tell.
    constexpr double kLeft = 0.65, kLeftWithoutOrder = 1.2;
    const double left = std::lerp(kLeftWithoutOrder, kLeft, std::clamp(ratio - 1, 0.0, 1.0));
    out.relative_square *= left * left;
    out.per_patch *= left;
    out.correction = correction_by(problem, f, *twice, half.radiosity);
  }
  return out;
}

// What `compute` gives; nothing, and a note, where it has not the memory or breaks a rule: the solution stands without it.
template <class Compute>
auto attempt(std::string_view part, std::vector<std::string>& notes, const Ranks* ranks, Compute&& compute)
    -> std::optional<decltype(compute())> {
  const auto note = [&](std::string_view why) {
    notes.push_back(fmt::format("error of the {}: not estimated: {}", part, why));
  };
  try {
    return compute();
  } catch (const Error& error) {
    note(error.what());
  } catch (const std::bad_alloc&) {
    if (ranks != nullptr) throw;  // others may go on
    note("out of memory");
  }
  return std::nullopt;
}

ErrorEstimate estimate(const SolvedProblem& problem, std::unique_ptr<const FormFactorMatrix> form_factors) {
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray& radiosity = problem.solution.radiosity;
  const Ranks* const ranks = problem.assembly.ranks.get();
  ErrorEstimate out;
  out.solver = problem.solution.report.residual;

  const BandArray reflected = radiosity - mesh.emission();
  Eigen::ArrayXd square = Eigen::ArrayXd::Constant(radiosity.cols(), out.solver * out.solver);
  out.per_patch = mesh.per_cluster(out.solver * reflected).square();

  const auto patches = attempt("patches", out.notes, ranks, [&] {
                         return patch_error(problem, *form_factors, out.notes);
                       }).value_or(std::nullopt);
  form_factors.reset();  // the rest needs the memory
  if (patches) {
    out.patches = std::sqrt(patches->relative_square.maxCoeff());
    out.order = patches->order;
    square += patches->relative_square;
    out.per_patch += patches->per_patch.square();
    if (problem.extrapolate) out.correction = mesh.per_patch(patches->correction);
  }

  const auto method = problem.method.make(problem.visibility, problem.form_factor_options);
  const auto noise =
      attempt("form factors", out.notes, ranks, [&] { return form_factor_error(problem, *method); });
  if (noise) {
    const Eigen::ArrayXd wrong = unreliable_square(problem, out.notes) + pairs_square(problem);
    const Eigen::ArrayXd all = noise->relative_square + wrong + problem.unrestored * problem.unrestored;
    out.form_factors = std::sqrt(all.maxCoeff());
    out.unsampled = std::sqrt(wrong.maxCoeff());
    square += all;
    out.per_patch += noise->per_patch.square();
  }
  out.per_patch = mesh.per_patch(out.per_patch.sqrt());
  out.known = std::sqrt(square.maxCoeff());
  if (!out.form_factors || !out.patches) return out;
  out.total = out.known;
  out.largest = largest_share(mesh, out.per_patch, reflected);
  return out;
}

std::vector<Material> in_units(std::vector<Material> materials, const BandValues& unit) {
  for (Material& material : materials) material.emission /= unit;
  return materials;
}

}  // namespace

std::optional<ErrorEstimate> estimate_error(const SolvedProblem& problem,
                                            std::unique_ptr<const FormFactorMatrix> form_factors) try {
  const PatchMesh& mesh = problem.patches.mesh;
  Solution solution = problem.solution;
  const BandValues unit = light_unit(solution.radiosity);
  const Scene scene = problem.scene.with_materials(in_units(problem.scene.materials(), unit));
  const Patches patches{
      mesh.with_materials(in_units(mesh.materials(), unit)), {}, {}, problem.patches.patch_size};
  solution.radiosity.rowwise() /= unit.transpose();
  ErrorEstimate out =
      estimate({scene, patches, problem.visibility, problem.method, problem.form_factor_options,
                problem.assembly, problem.solver, problem.solver_options, solution, problem.lamps,
                problem.unrestored, problem.unreliable, problem.pair_rows, problem.extrapolate},
               std::move(form_factors));
  for (BandArray* values : {&out.per_patch, &out.correction})
    if (values->size() > 0) values->rowwise() *= unit.transpose();
  return out;
} catch (const Stopped&) {
  return std::nullopt;
}

}  // namespace radiosity
