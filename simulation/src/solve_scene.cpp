// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/solve_scene.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "radiosity/formfactors/sides.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/error.hpp"
#include "solve_once.hpp"

namespace radiosity {
namespace {

AssemblyOptions assembly_options(const SceneToSolve& task, SolveStage stage) {
  AssemblyOptions assembly;
  assembly.close = task.options.close;
  assembly.memory_limit_bytes = memory_limit(task.options.memory_limit_bytes);
  assembly.progress = task.watch.of(stage);
  assembly.ranks = task.options.ranks;
  return assembly;
}

/// What the scene has of mirrors and glass: a sentence, empty where there is none.
std::string not_diffuse(const Scene& scene) {
  std::string names;
  double area = 0, all = 0;
  for (Index m = 0; m < static_cast<Index>(scene.materials().size()); ++m) {
    const Material& material = scene.materials()[m];
    const double own = scene.material_area(m);
    all += own;
    if (!(own > 0) || ((specular(material) == 0).all() && (transmission(material) == 0).all())) continue;
    area += own;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", material.name);
  }
  if (names.empty()) return {};
  return fmt::format(
      "mirrors and glass: {}, {:.2g} % of the area, reflect diffusely only; the rest counts as absorbed",
      names, 100 * area / all);
}

/// Patches, their visibility, and the method that is to compute their form factors.
class Prepared {
 public:
  Prepared(const SceneToSolve& task, const Scene& scene, const SceneSettings& settings,
           std::string_view where_few, Modelled modelled, Index bands)
      : task_(task),
        out_{make_patches(scene, settings.patches.value_or(PatchOptions{})), bands, std::move(modelled)} {
    out_.modelled.symmetry = scene.symmetry();
    ended(SolveStage::patches, out_.patches.warnings);
    visibility_.emplace(out_.patches.mesh);
    PatchMesh& mesh = out_.patches.mesh;  // its patches, which the visibility refers to, stay the same
    mesh = mesh.with_clusters(clusters_apart(*visibility_));
    if (mesh.clustered() && !mesh.symmetry().none())
      visibility_.emplace(mesh);  // its images are in clusters, too
    chosen_ = choose_method(*visibility_, settings, where_few);
    const SeenSides seen = seen_sides(*visibility_);
    look_outwards_ = seen.look_outwards;
    out_.seconds.mesh = watch_.lap();
    FormFactorFacts& facts = out_.form_factors;
    facts.method = chosen_.info->name;
    facts.why = chosen_.why;
    facts.options = chosen_.method->options();
    facts.reciprocal = chosen_.method->reciprocal();
    facts.exact = chosen_.method->exact();
    out_.modelled.occlusion = !visibility_->convex();
    if (visibility_->convex())
      out_.modelled.left_out.emplace_back(
          "occlusion: no patch can stand between two others, the room is convex");
    ended(SolveStage::method, side_warnings(seen, out_.patches.mesh));
  }

  /// All of F can be assembled within the memory limit.
  bool fits_memory() const {
    const auto ranks = task_.options.ranks ? task_.options.ranks->count() : 1;
    return assembly_bytes(out_.patches.mesh.cluster_count(), chosen_.method->max_entries_per_row()) / ranks <=
           static_cast<double>(memory_limit(task_.options.memory_limit_bytes));
  }

  FormFactorMatrix form_factors() {
    watch_.lap();
    FormFactorFacts& facts = out_.form_factors;
    const SolveOptions& options = task_.options;
    AssemblyOptions assembly_settings = assembly_options(task_, SolveStage::form_factors);
    if (!options.accuracy) {
      assembly_settings.partial = options.partial_rows;
      assembly_settings.save = options.save_rows;
    }
    AssembledFormFactors assembled = options.form_factors
                                         ? options.form_factors(out_.patches.mesh)
                                         : assemble(*chosen_.method, *visibility_, assembly_settings);
    const FormFactorMatrix& matrix = assembled.matrix;
    facts.assembly = std::move(assembled.report);
    out_.seconds.form_factors = watch_.lap();
    facts.storage = matrix.sparse() ? FormFactorStorage::sparse : FormFactorStorage::dense;
    facts.nonzeros = total(options.ranks.get(), matrix.nonzeros());
    facts.own_bytes = matrix.bytes();
    facts.bytes = total(options.ranks.get(), facts.own_bytes);
    const AssemblyReport& assembly = facts.assembly;
    Modelled::Saved& saved = out_.modelled.saved;
    const PairCounts& pairs = assembly.pairs;
    if (assembly.completed && pairs.behind + pairs.hidden + pairs.free + pairs.partial + pairs.by_rays > 0) {
      saved.pairs_behind = pairs.behind;
      if (!out_.modelled.occlusion) saved.visibility_tests = pairs.free;
    }
    std::vector<std::string> warnings;
    const Index n = out_.patches.mesh.cluster_count();
    if (assembly.completed && assembly.isolated_patches > 0 && !look_outwards_)
      warnings.push_back(fmt::format("{} of {} {} see no other patch: they keep their own emission",
                                     assembly.isolated_patches, n, n == 1 ? "patch" : "patches"));
    if (assembly.completed)
      warnings.insert(warnings.end(), assembly.warnings.begin(), assembly.warnings.end());
    ended(SolveStage::form_factors, warnings);
    return std::move(assembled.matrix);
  }

  void ended(SolveStage stage, const std::vector<std::string>& warnings = {}) {
    out_.warnings.insert(out_.warnings.end(), warnings.begin(), warnings.end());
    if (task_.options.ended) task_.options.ended(stage, out_);
  }

  SolvedScene& out() { return out_; }
  const Visibility& visibility() const { return *visibility_; }
  const ChosenMethod& chosen() const { return chosen_; }

 private:
  const SceneToSolve& task_;
  Stopwatch watch_;
  SolvedScene out_;
  std::optional<Visibility> visibility_;
  ChosenMethod chosen_;
  bool look_outwards_ = false;
};

Solution nothing_exchanged(const PatchMesh& mesh, const RadiositySystem& system) {
  Solution solution;
  solution.radiosity = mesh.emission();
  solution.irradiance = BandArray::Zero(mesh.patch_count(), system.bands());
  solution.vertex_radiosity = vertex_values(mesh, solution.radiosity);
  solution.report.status = SolveStatus::stopped;
  solution.report.residual = 1;  // all that was emitted may be unaccounted for
  solution.report.history = {1};
  solution.report.message = "interrupted while computing form factors: nothing was exchanged yet, B = E";
  return solution;
}

// How far a solve has come, on the logarithmic scale on which residuals fall evenly.
double solved_fraction(double residual, double tolerance) {
  if (!(residual > 0) || tolerance >= 1) return 1;
  return std::clamp(std::log(residual) / std::log(tolerance), 0.0, 1.0);
}

SolverOptions solver_options(const SceneSettings& settings, const SolverInfo& info) {
  SolverOptions options;
  options.tolerance = settings.tolerance.value_or(options.tolerance);
  options.max_iterations = settings.max_iterations.value_or(0);
  options.relaxation = settings.relaxation.value_or(1);
  options.ambient = settings.ambient.value_or(false);
  if (options.relaxation != 1 && !info.make()->relaxes())
    throw InputError(fmt::format("relaxation {} has no effect with solver {}; it belongs to gauss-seidel",
                                 options.relaxation, info.name));
  if (options.ambient && info.gathers)
    throw InputError(fmt::format("ambient has no effect with solver {}; it belongs to shooting", info.name));
  return options;
}

const SolverInfo& chosen_solver(const SceneSettings& settings) {
  return find_solver(settings.solver ? *settings.solver : kDefaultSolver);
}

}  // namespace

Scene with_decided_sides(const Scene& scene) {
  return has_open_sides(scene) ? decide_sides(scene).scene : scene;
}

std::size_t memory_limit(std::size_t asked) {
  if (asked > 0) return asked;
  return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

std::string_view name_of(FormFactorStorage storage) {
  switch (storage) {
    case FormFactorStorage::dense:
      return "dense";
    case FormFactorStorage::sparse:
      return "sparse";
    case FormFactorStorage::rows:
      break;
  }
  return "rows";
}

PatchMesh SolvedScene::mesh_of_setup(Index k) const {
  return patches.mesh.with_materials(select_bands(patches.mesh.materials(), k * bands, bands));
}

Solution SolvedScene::solution_of_setup(Index k) const {
  return select_bands(solution, k * bands, bands);
}

EnergyBalance SolvedScene::energy_of_setup(Index k) const {
  return select_bands(solution.energy, k * bands, bands);
}

std::optional<BandArray> SolvedScene::error_of_setup(Index k) const {
  if (!error || !error->total) return std::nullopt;
  return error->per_patch.middleCols(k * bands, bands);
}

SolvedScene::Told SolvedScene::told_of_setup(Index k) const {
  const auto clusters_of = [&](std::vector<Index> of_patches) {
    for (Index& patch : of_patches) patch = patches.mesh.cluster(patch);
    return of_patches;
  };
  if (!elements) {
    std::vector<Index> each;
    if (patches.mesh.clustered()) {
      each.resize(static_cast<std::size_t>(patches.mesh.patch_count()));
      std::iota(each.begin(), each.end(), 0);
    }
    return {mesh_of_setup(k), solution_of_setup(k), error_of_setup(k), clusters_of(std::move(each))};
  }
  const auto of_setup = [&](const BandArray& all) -> BandArray { return all.middleCols(k * bands, bands); };
  Solution told = solution_of_setup(k);
  told.radiosity = of_setup(elements->radiosity);
  told.irradiance = of_setup(elements->irradiance);
  told.vertex_radiosity = of_setup(elements->vertex_radiosity);
  std::optional<BandArray> both = error_of_setup(k);
  if (both) {
    const BandArray of_patches = (*both)(elements->patch, Eigen::all);
    both = (of_patches.square() + of_setup(elements->standard_error).square()).sqrt();
  }
  return {elements->mesh.with_materials(select_bands(elements->mesh.materials(), k * bands, bands)),
          std::move(told), std::move(both), clusters_of(elements->patch)};
}

SolvedScene solve_once(const SceneToSolve& task, const SceneSettings& settings, std::string_view where_few) {
  const SolverInfo& info = chosen_solver(settings);
  SolverOptions options = solver_options(settings, info);
  if (!emits(task.scene)) throw InputError("nothing in the scene emits light, so every radiosity is 0");
  const Scene grey = merge_equal_bands(task.scene);
  Modelled modelled;
  modelled.bands = grey.bands();
  const Index bands_left_out = task.scene.bands() - grey.bands();
  if (bands_left_out > 0)
    modelled.left_out.push_back(
        fmt::format("bands: all {} are equal in every material, so one was solved", task.scene.bands()));

  if (std::string sentence = not_diffuse(task.scene); !sentence.empty())
    modelled.left_out.push_back(std::move(sentence));

  const Scene scene = with_setups(grey, task.setups);
  Prepared prepared(task, scene, settings, where_few, std::move(modelled), grey.bands());
  SolvedScene& out = prepared.out();
  const PatchMesh& mesh = out.patches.mesh;
  AssemblyReport& assembly = out.form_factors.assembly;
  out.solver = info.name;
  out.solver_options = options;

  const std::shared_ptr<const Ranks>& ranks = task.options.ranks;
  if (ranks && (!info.gathers || info.make()->reads_rows()))
    throw InputError(fmt::format(
        "solver {} runs in one process: on several ranks take conjugate-gradient or jacobi", info.name));
  // Shooting reads a row at a time; but what tells the error needs all of them, as leaving them open on request does.
  const bool all_rows = info.gathers || !task.options.close || task.options.accuracy ||
                        task.options.form_factors || (task.options.estimate_error && prepared.fits_memory());
  std::unique_ptr<const FormFactorMatrix> matrix;
  std::unique_ptr<const RowsOnDemand> rows;
  if (all_rows) {
    matrix = std::make_unique<const FormFactorMatrix>(prepared.form_factors());
    if (!task.options.estimate_error) assembly.pair_rows.reset();
  } else {
    out.form_factors.storage = FormFactorStorage::rows;
    rows = std::make_unique<const RowsOnDemand>(*prepared.chosen().method, prepared.visibility(),
                                                memory_limit(task.options.memory_limit_bytes) / 2);
    prepared.ended(SolveStage::form_factors);
  }

  Stopwatch watch;
  Eigen::ArrayXd escaped;
  const std::unique_ptr<Solver> solver = task.options.make_solver ? task.options.make_solver() : info.make();
  {
    std::optional<DistributedFormFactors> distributed;
    if (ranks) distributed.emplace(*matrix, ranks);
    const FormFactorOperator& form_factors = distributed
                                                 ? static_cast<const FormFactorOperator&>(*distributed)
                                             : all_rows ? static_cast<const FormFactorOperator&>(*matrix)
                                                        : *rows;
    const RadiositySystem system(form_factors, mesh);
    if (task.options.step) {
      options.step = [&](Index iteration, double, const BandArray& radiosity) {
        task.options.step(iteration, mesh.per_patch(radiosity));
        return true;
      };
    } else if (rows) {
      options.partial = task.options.partial_shots;
      options.save = task.options.save_shots;
    }
    const Progress progress = task.watch.of(SolveStage::solve);
    options.progress = [&, done = 0.0](Index, double residual) mutable {  // residuals may rise
      done = std::max(done, solved_fraction(residual, options.tolerance));
      return on_all(ranks.get(), progress(done));
    };
    escaped = system.escaped();
    out.solution =
        assembly.completed ? solve(*solver, system, mesh, options) : nothing_exchanged(mesh, system);
  }
  out.seconds.solve = watch.lap();
  if (!all_rows) assembly.rays = prepared.chosen().method->rays();
  if (bands_left_out > 0) {
    const auto bands =
        static_cast<std::uint64_t>(bands_left_out) * static_cast<std::uint64_t>(1 + task.setups.size());
    Modelled::Saved& saved = out.modelled.saved;
    saved.radiosity_bytes = sizeof(double) * bands * static_cast<std::uint64_t>(mesh.cluster_count());
    if (info.gathers)  // a shot reads a row, not F
      saved.band_products = bands * static_cast<std::uint64_t>(out.solution.report.iterations);
  }
  prepared.ended(SolveStage::solve);

  if (task.options.estimate_error && all_rows && assembly.completed && out.converged()) {
    watch.lap();
    out.error = estimate_error(
        {scene, out.patches, prepared.visibility(), *prepared.chosen().info, prepared.chosen().options,
         assembly_options(task, SolveStage::error), *solver, out.solver_options, out.solution, assembly.lamps,
         assembly.unrestored(), assembly.unreliable, assembly.pair_rows, task.options.extrapolate},
        std::move(matrix));
    if (out.error && out.error->correction.size() > 0)
      add_irradiance(mesh, escaped, out.error->correction, out.solution);
    out.seconds.error = watch.lap();
    prepared.ended(SolveStage::error);
  }
  assembly.pair_rows.reset();
  return std::move(out);
}

namespace {

// Where nothing is said of elements, of the members of clusters.
void add_elements(SolvedScene& solved, const SceneSettings& settings, const SceneToSolve& task) {
  const Stopwatch watch;
  ElementGather gather;
  if (!settings.elements)
    gather.size = solved.patches.patch_size;
  else if (const auto* given = std::get_if<ElementSize>(&*settings.elements))
    gather.size = given->metres;
  if (solved.accuracy) gather.variation = std::min(gather.variation, solved.accuracy->goal / 2);
  gather.samples = settings.element_samples.value_or(gather.samples);
  gather.seed = settings.seed.value_or(gather.seed);
  gather.progress = task.watch.of(SolveStage::elements);
  gather.ranks = task.options.ranks;
  if (!task.options.accuracy) {
    gather.partial = task.options.partial_elements;
    gather.save = task.options.save_elements;
  }
  const Visibility visibility(solved.patches.mesh);
  const auto gathered = [&] {
    return settings.elements ? gather_elements(visibility, solved.solution, gather)
                             : gather_members(visibility, solved.solution, gather);
  };
  solved.elements = gathered();
  // Where an accuracy was reached, the noise may be what is left of it.
  if (solved.elements && solved.accuracy && solved.accuracy->reached && !settings.element_samples) {
    const double goal = solved.accuracy->goal, known = solved.error->known;
    const double more = std::pow(solved.elements->noise(), 2) / (goal * goal - known * known);
    if (more > 1) {
      constexpr double kMost = 32;
      gather.samples = static_cast<Index>(std::ceil(std::min(1.1 * more, kMost) * gather.samples));
      if (auto better = gathered()) solved.elements = std::move(better);
    }
  }
  if (solved.elements && solved.error) {
    ErrorEstimate& error = *solved.error;
    error.gather = solved.elements->noise();
    error.known = std::hypot(error.known, *error.gather);
    if (error.total) error.total = error.known;
    if (solved.accuracy && solved.accuracy->reached && error.known > solved.accuracy->goal) {
      solved.accuracy->reached = false;
      solved.accuracy->why_not = "the noise of the elements takes more samples";
    }
  }
  solved.seconds.elements = watch.elapsed();
  if (task.options.ended) task.options.ended(SolveStage::elements, solved);
}

}  // namespace

SolvedScene solve_scene(const Scene& scene, const SceneSettings& settings, const SolveOptions& given,
                        std::span<const LightingSetup> setups) {
  SolveOptions options = given;
  if (given.ranks)
    options.memory_limit_bytes = static_cast<std::size_t>(std::ranges::min(
        of_all(given.ranks.get(), static_cast<double>(memory_limit(given.memory_limit_bytes)))));
  Watch watch(options);
  const Scene decided = with_decided_sides(scene);
  const SceneToSolve task{decided, options, setups, watch};
  if (options.accuracy &&
      (options.form_factors || options.partial_rows || options.partial_shots || options.partial_elements))
    throw InputError("an accuracy chooses patches and form factors: those of an earlier run cannot be used");
  const auto* const size = settings.elements ? std::get_if<ElementSize>(&*settings.elements) : nullptr;
  if (size != nullptr && !(size->metres > 0))
    throw InputError(fmt::format("elements: size {} m is not positive", size->metres));
  SolvedScene solved =
      options.accuracy ? solve_to_accuracy(task, settings) : solve_once(task, settings, "analytic");
  if (gathers_in_the_end(settings, solved.patches.mesh.clustered()) &&
      solved.form_factors.assembly.completed && on_all(options.ranks.get(), !watch.stopped()))
    add_elements(solved, settings, task);
  return solved;
}

SceneFormFactors scene_form_factors(const Scene& scene, const SceneSettings& settings,
                                    const SolveOptions& options) {
  Watch watch(options);
  const Scene decided = with_decided_sides(scene);
  const SceneToSolve task{decided, options, {}, watch};
  Prepared prepared(task, decided, settings, "analytic", {decided.bands()}, decided.bands());
  FormFactorMatrix matrix = prepared.form_factors();
  prepared.out().form_factors.assembly.pair_rows.reset();
  return {std::move(prepared.out()), std::move(matrix)};
}

}  // namespace radiosity
