// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "radiosity/formfactors/sides.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::app {
namespace {

void warn(Job& job, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    job.console.line("warning", "{}", warning);
    if (job.report.scene) job.report.scene->warnings.push_back(warning);
  }
}

std::string numbered(Index n, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

std::string repairs_text(const Repairs& r) {
  std::vector<std::string> done;
  const auto add = [&](Index n, std::string_view what, std::string_view rule) {
    if (n > 0) done.push_back(fmt::format("{} {}", numbered(n, what, fmt::format("{}s", what)), rule));
  };
  add(r.merged_vertices, "vertex position", "merged");
  add(r.degenerate_faces, "face", "without area dropped");
  add(r.duplicate_faces, "duplicate face", "dropped");
  add(r.unwound_faces, "face", "that went round several times cut down to one round");
  add(r.flipped_faces, "face", "turned over");
  add(r.triangulated_faces, "face",
      r.non_planar_faces > 0 ? fmt::format("triangulated ({} of them not planar)", r.non_planar_faces)
                             : std::string("triangulated"));
  add(r.split_edges, "edge", "divided where vertices of other faces lie on it");
  add(r.cut_faces, "face", "cut where others touch");
  return fmt::format("{}", fmt::join(done, ", "));
}

std::string patch_rule(const PatchOptions& options, double size) {
  if (std::holds_alternative<KeepFaces>(options)) return "the faces as they are";
  if (const auto* wanted = std::get_if<AutoPatches>(&options); wanted != nullptr && size == 0)
    return fmt::format("the faces kept, as they are not fewer than the {} aimed at (auto)", wanted->target);
  return fmt::format("no edge longer than {:.4g} m{}", size,
                     std::holds_alternative<AutoPatches>(options) ? " (auto)" : "");
}

void tell_sides(Job& job, const DecidedSides& sides) {
  job.report.scene->auto_sides = {sides.sheets, sides.faces, sides.area, sides.unseen_sheets, sides.solids};
  job.console.line("sides", "auto: {} seen from behind, with backs of their own ({}, {:.4g} m²)",
                   numbered(sides.sheets, "open sheet", "open sheets"),
                   numbered(sides.faces, "face", "faces"), sides.area);
  job.console.line("", "one-sided stay {} that nothing sees from behind and {}",
                   numbered(sides.unseen_sheets, "open sheet", "open sheets"),
                   numbered(sides.solids, "closed surface", "closed surfaces"));
}

// Beyond this a program is not told but killed.
std::size_t machine_memory() {
  return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

Solution nothing_exchanged(const PatchMesh& mesh, const RadiositySystem& system) {
  Solution solution;
  solution.radiosity = system.emission();
  solution.irradiance = BandArray::Zero(system.size(), system.bands());
  solution.vertex_radiosity = vertex_values(mesh, solution.radiosity);
  solution.report.status = SolveStatus::stopped;
  solution.report.residual = 1;  // all that was emitted may be unaccounted for
  solution.report.history = {1};
  solution.report.message = "interrupted while computing form factors: nothing was exchanged yet, B = E";
  return solution;
}

void print_energy(const Console& console, std::string_view label, const EnergyBalance& energy) {
  for (Index b = 0; b < energy.emitted_w.size(); ++b)
    console.line(b == 0 ? label : "",
                 "{}emitted {:.6g} W, absorbed {:.6g} W, escaped {:.6g} W, imbalance {:.2g}",
                 energy.emitted_w.size() == 1 ? std::string() : fmt::format("band {}: ", b),
                 energy.emitted_w[b], energy.absorbed_w[b], energy.escaped_w[b], energy.imbalance[b]);
}

// How far a solve has come, on the logarithmic scale on which residuals fall evenly.
double solved_fraction(double residual, double tolerance) {
  if (!(residual > 0) || tolerance >= 1) return 1;
  return std::log(std::min(residual, 1.0)) / std::log(tolerance);
}

}  // namespace

Job::Job(const Options& given) : options(given), console(given.quiet) {
  report.version = RADIOSITY_VERSION;
  report.command = options.command_line;
}

void check_outputs(const Options& options, const std::string& extension) {
  require_writable(options.output, extension);
  std::error_code missing;  // then they differ
  if (std::filesystem::equivalent(options.output, options.scene, missing))
    throw InputError(
        fmt::format("{}: is the scene itself; -o must name another file", options.output.string()));
  if (!options.report_file.empty()) require_writable(options.report_file, ".json");
  if (!options.series_file.empty()) require_writable(options.series_file, ".pvd");
  if (!options.paraview_file.empty()) require_writable(options.paraview_file, ".py");
}

AssemblyOptions assembly_options(const Options& options) {
  AssemblyOptions assembly;
  assembly.close = options.close;
  assembly.memory_limit_bytes =
      options.memory_limit_bytes > 0 ? options.memory_limit_bytes : machine_memory();
  return assembly;
}

LoadedScene read_stage(Job& job, const std::filesystem::path& file, MissingMaterials missing) {
  job.stage.lap();
  LoadedScene loaded = read_scene(file, missing);
  const bool automatic_sides =
      std::any_of(loaded.scene.materials().begin(), loaded.scene.materials().end(),
                  [](const Material& material) { return material.sides == Sides::automatic; });
  std::optional<DecidedSides> sides;
  if (automatic_sides) {
    sides = decide_sides(loaded.scene);
    loaded.scene = sides->scene;
  }
  const Scene& scene = loaded.scene;
  job.report.seconds.read = job.stage.lap();

  auto& facts = job.report.scene.emplace();
  facts.file = file.string();
  facts.surfaces = scene.face_count();
  facts.bands = scene.bands();
  facts.lower = scene.lower();
  facts.upper = scene.upper();
  job.console.line("scene", "{}{}", file.string(),
                   loaded.mesh_file.empty() || loaded.mesh_file == file
                       ? ""
                       : fmt::format(", mesh {}", loaded.mesh_file.string()));
  const Vec3 size = scene.upper() - scene.lower();
  job.console.line("", "{}, {}, {}, {}; {:.4g} × {:.4g} × {:.4g} m",
                   numbered(scene.face_count(), "face", "faces"),
                   numbered(scene.vertex_count(), "vertex", "vertices"),
                   numbered(static_cast<Index>(scene.materials().size()), "material", "materials"),
                   numbered(scene.bands(), "band", "bands"), size.x(), size.y(), size.z());
  if (sides) tell_sides(job, *sides);
  warn(job, loaded.warnings);
  return loaded;
}

Patches patch_stage(Job& job, const Scene& scene, const SceneSettings& settings) {
  job.stage.lap();
  const PatchOptions options = settings.patches.value_or(PatchOptions{});
  Patches patches = make_patches(scene, options);
  tell_patches(job, patches, options);
  return patches;
}

void tell_patches(Job& job, const Patches& patches, const PatchOptions& options) {
  job.report.seconds.mesh = job.stage.lap();

  auto& facts = *job.report.scene;
  facts.patches = patches.mesh.patch_count();
  facts.area_m2 = patches.mesh.areas().sum();
  facts.repairs = patches.repairs;
  const std::string repairs = repairs_text(patches.repairs);
  if (!repairs.empty()) job.console.line("repaired", "{}", repairs);
  warn(job, patches.warnings);
  job.console.line("patches", "{}, {}; {:.6g} m²", facts.patches, patch_rule(options, patches.patch_size),
                   facts.area_m2);
}

void sides_stage(Job& job, const Visibility& visibility) {
  const SeenSides seen = seen_sides(visibility);
  job.look_outwards = seen.look_outwards;
  warn(job, side_warnings(seen, visibility.mesh()));
}

MethodChoice choose_method(const Visibility& visibility, std::string_view where_few) {
  // Pairs cost n² and are the most accurate; sampled rows cost n and are the fastest where pairs are many.
  constexpr Index kFewPatches = 2000;
  const Index n = visibility.mesh().patch_count();
  if (visibility.convex()) return {"analytic", "no patch hides another, so every factor is a closed form"};
  if (n <= kFewPatches)
    return {std::string(where_few),
            fmt::format("{} patches or fewer: accurate factors of every pair are affordable", kFewPatches)};
  return {"hemisphere", fmt::format("more than {} patches: sampling rays is faster than pairs", kFewPatches)};
}

std::string settings_text(const FormFactorMethod& method) {
  const FormFactorOptions options = method.options();
  std::vector<std::string> parts;
  if (options.samples > 0) parts.push_back(fmt::format("samples {}", options.samples));
  if (options.resolution > 0) parts.push_back(fmt::format("resolution {}", options.resolution));
  return fmt::format("{}", fmt::join(parts, ", "));
}

ChosenMethod method_stage(Job& job, const Visibility& visibility, const SceneSettings& settings) {
  MethodChoice choice{settings.method.value_or(std::string(kAutoMethod)), ""};
  if (choice.name == kAutoMethod) choice = choose_method(visibility, job.where_few);
  const FormFactorMethodInfo& info = find_form_factor_method(choice.name);
  FormFactorOptions options;
  options.samples = settings.samples.value_or(0);
  options.resolution = settings.resolution.value_or(0);
  options.seed = settings.seed.value_or(options.seed);
  auto method = info.make(visibility, options);
  const FormFactorOptions in_force = method->options();

  auto& facts = job.report.form_factors.emplace();
  facts.method = choice.name;
  facts.parameters = {{"seed", static_cast<double>(in_force.seed)}};
  if (in_force.samples > 0) facts.parameters.emplace_back("samples", in_force.samples);
  if (in_force.resolution > 0) facts.parameters.emplace_back("resolution", in_force.resolution);
  auto& modelled = job.report.modelled ? *job.report.modelled : job.report.modelled.emplace();
  modelled.occlusion = !visibility.convex();
  if (visibility.convex())
    modelled.left_out.emplace_back("occlusion: no patch can stand between two others, the room is convex");
  job.console.line("method", "{} ({}, seed {}){}", choice.name, settings_text(*method), in_force.seed,
                   choice.why.empty() ? "" : "; chosen: " + choice.why);
  return {&info, options, std::move(method)};
}

FormFactorMatrix form_factor_stage(Job& job, const FormFactorMethod& method, const Visibility& visibility) {
  auto& facts = *job.report.form_factors;
  job.stage.lap();
  FormFactorMatrix matrix = [&] {
    ProgressBar bar(job.console, "form factors");
    AssemblyOptions options = assembly_options(job.options);
    options.progress = [&](double fraction) { return bar(fraction); };
    return assemble(method, visibility, options, &facts.assembly);
  }();
  job.report.seconds.form_factors = job.stage.lap();

  const AssemblyReport& assembly = facts.assembly;
  facts.storage = matrix.sparse() ? "sparse" : "dense";
  facts.nonzeros = matrix.nonzeros();
  facts.bytes = matrix.bytes();
  if (!assembly.completed) {
    job.console.line("form factors", "interrupted");
    return matrix;
  }
  job.console.line(
      "form factors", "stored {}, {}, {} entries are not zero; {}", facts.storage,
      bytes_text(static_cast<double>(facts.bytes)), facts.nonzeros,
      assembly.rays > 0 ? fmt::format("{:.3g} rays", static_cast<double>(assembly.rays)) : "no rays");
  if (assembly.lamps > 0)
    job.console.line("", "{} computed pair by pair, not sampled",
                     numbered(assembly.lamps, "lamp patch", "lamp patches"));
  if (assembly.pairwise > assembly.lamps)
    job.console.line(
        "", "{} computed pair by pair that rays or cells cannot tell: nearly touching, thin or distant",
        numbered(assembly.pairwise - assembly.lamps, "patch", "patches"));
  const PairCounts& pairs = assembly.pairs;
  const auto all =
      static_cast<double>(pairs.behind + pairs.hidden + pairs.free + pairs.partial + pairs.by_rays);
  if (all > 0) {
    Report::Modelled& modelled = *job.report.modelled;
    modelled.saved.pairs_behind = pairs.behind;
    if (!modelled.occlusion) modelled.saved.visibility_tests = pairs.free;
    const auto percent = [&](std::uint64_t count) { return 100 * static_cast<double>(count) / all; };
    job.console.line("",
                     "of {:.3g} pairs {:.3g} % lie behind one another, {:.3g} % are hidden, {:.3g} % see all "
                     "of each other, {:.3g} % part",
                     all, percent(pairs.behind), percent(pairs.hidden), percent(pairs.free),
                     percent(pairs.partial + pairs.by_rays));
  }
  if (!method.reciprocal() && assembly.before.reciprocity_error_mean > 0)
    job.console.line("", "single factors are off by noise that adds up to {:.2g} of a row, on average",
                     assembly.before.reciprocity_error_mean);
  const auto error_line = [&](std::string_view label, double before, double after) {
    job.console.line("", "{} error at most {:.2g}{}", label, after,
                     assembly.closed_rows ? fmt::format(", {:.2g} before rows were restored", before) : "");
  };
  error_line("closure", assembly.before.closure_error_max, assembly.after.closure_error_max);
  error_line("reciprocity", assembly.before.reciprocity_error_max, assembly.after.reciprocity_error_max);
  if (const double percent = std::round(1e5 * assembly.escaped_mean) / 1e3; percent > 0)
    job.console.line("", "{:.3g} % of what leaves the patches that see any reaches no patch, on average",
                     percent);
  if (assembly.blind_patches > 0 && !job.look_outwards)
    warn(job,
         {fmt::format("{} of {} see no other patch: they keep their own emission", assembly.blind_patches,
                      numbered(visibility.mesh().patch_count(), "patch", "patches"))});
  warn(job, assembly.warnings);
  return matrix;
}

void tell_error(Job& job, const ErrorEstimate& error) {
  const auto percent = [](double share) { return fmt::format("{:.2g} %", 100 * share); };
  const auto part = [&](const std::optional<double>& share) { return share ? percent(*share) : "unknown"; };
  job.console.line("error", "{} of the reflected light (rms): form factors {}, patches {}{}, solver {}",
                   error.total ? "about " + percent(*error.total) : "total unknown;",
                   part(error.form_factors), part(error.patches),
                   error.order ? fmt::format(" (falls as size^{:.2g})", *error.order) : "",
                   percent(error.solver));
  for (const std::string& note : error.notes) job.console.line("", "{}", note);
}

std::optional<ErrorEstimate> error_stage(Job& job, SolvedProblem problem) {
  job.stage.lap();
  std::optional<ErrorEstimate> error;
  {
    ProgressBar bar(job.console, "error estimate");
    problem.assembly.progress = [&](double fraction) { return bar(fraction); };
    error = estimate_error(problem);
  }
  job.report.seconds.error = job.stage.lap();
  job.report.error = error;
  if (!error) {
    job.console.line("error", "interrupted before it was known");
    return error;
  }
  tell_error(job, *error);
  return error;
}

Solved solve_stage(Job& job, const Scene& scene, const SceneSettings& settings, const Step& step,
                   std::span<const LightingSetup> setups) {
  const SolverInfo& info = find_solver(settings.solver.value_or(std::string(kDefaultSolver)));
  const std::unique_ptr<Solver> solver = info.make();
  if (settings.relaxation.value_or(1) != 1 && !solver->relaxes())
    throw InputError(fmt::format("relaxation {} has no effect with solver {}; it belongs to gauss-seidel",
                                 *settings.relaxation, info.name));
  if (settings.ambient.value_or(false) && info.needs_stored_rows)
    throw InputError(fmt::format("ambient has no effect with solver {}; it belongs to shooting", info.name));
  require_emission(scene, job.options.scene);
  const Scene grey = merge_equal_bands(scene);
  const Scene merged = with_setups(grey, setups);
  auto& modelled = job.report.modelled.emplace();
  modelled.bands = grey.bands();
  if (grey.bands() < scene.bands())
    modelled.left_out.push_back(
        fmt::format("bands: all {} are equal in every material, so one was solved", scene.bands()));

  Patches patches = patch_stage(job, merged, settings);
  job.report.scene->bands = grey.bands();
  if (!setups.empty())
    job.console.line("set-ups", "{} beside the scene as it is; all share the form factors", setups.size());
  const Visibility visibility(patches.mesh);
  sides_stage(job, visibility);
  const ChosenMethod chosen = method_stage(job, visibility, settings);
  for (const std::string& reason : modelled.left_out) job.console.line("left out", "{}", reason);

  // Closing rows needs all of them, so a request to leave them open stores them too.
  const bool stored = info.needs_stored_rows || !job.options.close;
  auto& facts = *job.report.form_factors;
  std::unique_ptr<FormFactors> form_factors;
  if (stored) {
    form_factors = std::make_unique<FormFactorMatrix>(form_factor_stage(job, *chosen.method, visibility));
  } else {
    facts.storage = "rows";
    form_factors = std::make_unique<RowsOnDemand>(*chosen.method, visibility);
    job.console.line("form factors", "not stored: {} asks for one row at a time", info.name);
  }

  const RadiositySystem system(*form_factors, patches.mesh);
  SolverOptions options;
  options.tolerance = settings.tolerance.value_or(options.tolerance);
  options.max_iterations = settings.max_iterations.value_or(0);
  options.relaxation = settings.relaxation.value_or(1);
  options.ambient = settings.ambient.value_or(false);
  job.stage.lap();
  const auto run = [&] {
    if (!facts.assembly.completed) return nothing_exchanged(patches.mesh, system);
    ProgressBar bar(job.console, "solve");
    if (step)
      options.step = [&](Index iteration, double, const BandArray& radiosity) {
        step(iteration, radiosity);
        return true;
      };
    options.progress = [&](Index, double residual) {
      return bar(solved_fraction(residual, options.tolerance));
    };
    return solve(*solver, system, patches.mesh, options);
  };
  Solution solution = run();
  job.report.seconds.solve = job.stage.lap();
  if (!stored) facts.assembly.rays = chosen.method->rays();

  const SolveReport& report = solution.report;
  job.report.converged = report.status == SolveStatus::converged;
  if (grey.bands() < scene.bands()) {
    const auto bands =
        static_cast<std::uint64_t>((scene.bands() - grey.bands()) * static_cast<Index>(1 + setups.size()));
    modelled.saved.radiosity_bytes =
        sizeof(double) * bands * static_cast<std::uint64_t>(patches.mesh.patch_count());
    if (info.needs_stored_rows)  // a shot reads a row, not F
      modelled.saved.band_products = bands * static_cast<std::uint64_t>(report.iterations);
  }
  job.report.solver = Report::SolverFacts{std::string(info.name), options.tolerance,
                                          select_bands(solution, 0, grey.bands()).report};
  job.console.line("solver", "{}: {} {}, residual {:.2g}, tolerance {:.2g}", info.name, report.iterations,
                   info.needs_stored_rows ? "iterations" : "shots", report.residual, options.tolerance);
  if (!job.report.converged) job.console.line("not converged", "{}", report.message);
  if (report.condition.size() > 0 && report.condition.isFinite().all())
    job.console.line("", "no radiosity is off by more than {:.2g} W/m²; condition {:.2g}",
                     report.error_bound.maxCoeff(), report.condition.maxCoeff());
  if (!report.warning.empty()) job.console.line("warning", "{}", report.warning);
  if (facts.assembly.completed) {
    job.report.energy = select_bands(solution, 0, grey.bands()).energy;
    print_energy(job.console, "energy", *job.report.energy);
    for (std::size_t k = 0; k < setups.size(); ++k) {
      const auto first = static_cast<Index>(k + 1) * grey.bands();
      job.report.setups.emplace_back(setups[k].name, select_bands(solution, first, grey.bands()).energy);
      print_energy(job.console, setups[k].name, job.report.setups.back().second);
    }
  }
  std::optional<ErrorEstimate> error;
  if (facts.assembly.completed && job.report.converged && job.options.estimate_error) {
    if (stored) {
      form_factors.reset();  // the estimate needs the memory
      error = error_stage(
          job, {merged, patches, visibility, *chosen.info, chosen.options, assembly_options(job.options),
                *solver, options, solution, facts.assembly.lamps, facts.assembly.unrestored(),
                facts.assembly.unreliable, facts.assembly.pair_rows});
    } else {
      job.console.line("error", "not estimated: that takes factors that are stored");
    }
  }
  std::string method_name = facts.method;
  return {std::move(patches),     std::move(solution),        std::move(error),
          std::move(method_name), std::string(info.name),     chosen.method->options(),
          chosen.method->exact(), chosen.method->reciprocal()};
}

Outputs::~Outputs() {
  std::error_code ignored;  // the error that brought us here is the one to tell
  if (!keep_)
    for (const auto& file : made_) std::filesystem::remove_all(file, ignored);
}

void Outputs::will_write(const std::filesystem::path& file) {
  std::error_code unknown;  // then it is not ours to remove
  if (!std::filesystem::exists(file, unknown) && !unknown) made_.push_back(file);
  files_.push_back(file);
}

void Outputs::finish() {
  auto& report = job_.report;
  report.seconds.write = job_.stage.lap();
  report.seconds.total = job_.total.lap();
  report.peak_memory_bytes = peak_memory_bytes();
  if (!job_.options.report_file.empty()) {
    will_write(job_.options.report_file);
    write_report(job_.options.report_file, report);
  }
  keep_ = true;

  for (std::size_t i = 0; i < files_.size(); ++i)
    job_.console.line(i == 0 ? "written" : "", "{}", files_[i].string());
  const Report::Seconds& s = report.seconds;
  std::vector<std::string> parts;
  for (const auto& [name, seconds] : {std::pair{"read", s.read},
                                      {"mesh", s.mesh},
                                      {"form factors", s.form_factors},
                                      {"solve", s.solve},
                                      {"error estimate", s.error},
                                      {"write", s.write}})
    if (seconds > 0) parts.push_back(fmt::format("{} {}", name, seconds_text(seconds)));
  job_.console.line("time", "{} ({}); at most {} of memory", seconds_text(s.total), fmt::join(parts, ", "),
                    bytes_text(static_cast<double>(report.peak_memory_bytes)));
}

}  // namespace radiosity::app
