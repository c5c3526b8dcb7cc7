// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <system_error>
#include <utility>

#include "radiosity/formfactors/sides.hpp"
#include "radiosity/io/form_factor_file.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/io/scene_bytes.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::app {
namespace {

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

void print_energy(const Console& console, std::string_view label, const EnergyBalance& energy) {
  for (Index b = 0; b < energy.emitted_w.size(); ++b)
    console.line(b == 0 ? label : "",
                 "{}emitted {:.6g} W, absorbed {:.6g} W, escaped {:.6g} W, imbalance {:.2g}",
                 energy.emitted_w.size() == 1 ? std::string() : fmt::format("band {}: ", b),
                 energy.emitted_w[b], energy.absorbed_w[b], energy.escaped_w[b], energy.imbalance[b]);
}

void tell_error(const Console& console, const ErrorEstimate& error) {
  const auto percent = [](double share) { return fmt::format("{:.2g} %", 100 * share); };
  const auto part = [&](const std::optional<double>& share) { return share ? percent(*share) : "unknown"; };
  console.line("error", "{} of the reflected light (rms): form factors {}, patches {}{}, solver {}{}",
               error.total ? "about " + percent(*error.total) : "total unknown;", part(error.form_factors),
               part(error.patches),
               error.order ? fmt::format(" ({}falls as size^{:.2g})",
                                         error.correction.size() > 0 ? "corrected, " : "", *error.order)
                           : "",
               percent(error.solver), error.gather ? ", elements " + percent(*error.gather) : "");
  for (const std::string& note : error.notes) console.line("", "{}", note);
}

const char* bar_label(SolveStage stage) {
  return stage == SolveStage::form_factors ? "form factors"
         : stage == SolveStage::solve      ? "solve"
         : stage == SolveStage::elements   ? "elements"
                                           : "error estimate";
}

void note_patches(Report::SceneFacts& facts, const Patches& patches) {
  facts.patches = patches.mesh.cluster_count();
  facts.pieces = patches.mesh.patch_count();
  facts.area_m2 = patches.mesh.areas().sum();
  facts.repairs = patches.repairs;
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

void warn(Job& job, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    job.console.line("warning", "{}", warning);
    if (job.report.scene) job.report.scene->warnings.push_back(warning);
  }
}

void warn_of_lights(Job& job, const LoadedScene& loaded) {
  if (loaded.lights.empty()) return;
  std::vector<std::string> names;
  for (const Light& light : loaded.lights) names.push_back(fmt::format("[lights.{}]", light.name));
  warn(job,
       {fmt::format(
           "{}: no light is taken from what has no surface; view with --pipeline ray-tracing, path-tracing "
           "or a local one shows it",
           fmt::join(names, ", "))});
}

LoadedScene read_stage(Job& job, const std::filesystem::path& file, MissingMaterials missing,
                       const ChordError& chord_error) {
  job.stage.lap();
  LoadedScene loaded = read_scene(file, missing, chord_error);
  std::optional<DecidedSides> sides;
  if (has_open_sides(loaded.scene)) {
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

LoadedScene read_stage_shared(Job& job, const std::filesystem::path& file) {
  const SharedRun& shared = *job.options.shared;
  if (job.options.speaks()) {
    LoadedScene loaded = read_stage(job, file);
    shared.broadcast(scene_bytes(loaded));
    shared.broadcast(std::to_string(digest(loaded, loaded.settings, true)));
    return loaded;
  }
  job.report.scene.emplace();
  LoadedScene loaded = scene_of_bytes(shared.broadcast({}));
  if (shared.broadcast({}) != std::to_string(digest(loaded, loaded.settings, true)))
    throw InputError("the scene of this rank is not that of rank 0: they run different programs");
  return loaded;
}

void note_ranks(Job& job, const SolvedScene& solved) {
  const SharedRun& shared = *job.options.shared;
  const Ranks& ranks = *shared.ranks;
  const auto [bytes, seconds] = shared.traffic();
  const std::array own = {
      static_cast<double>(ranks.rows_of(ranks.rank(), solved.patches.mesh.cluster_count())),
      static_cast<double>(solved.form_factors.own_bytes),
      solved.seconds.form_factors,
      solved.seconds.solve,
      static_cast<double>(bytes),
      seconds,
      static_cast<double>(peak_memory_bytes())};
  std::vector<double> all(own.size() * static_cast<std::size_t>(ranks.count()));
  const std::vector<int> counts(static_cast<std::size_t>(ranks.count()), static_cast<int>(own.size()));
  ranks.all_gather(own, counts, all);
  for (std::size_t k = 0; k < all.size(); k += own.size())
    job.report.ranks.push_back(
        {all[k], all[k + 1], all[k + 2], all[k + 3], all[k + 4], all[k + 5], all[k + 6]});
  const auto most = [&](double Report::Rank::*value) {
    return (*std::ranges::max_element(job.report.ranks, {}, value)).*value;
  };
  job.console.line("ranks", "{}, each with {} of form factors at most; {} received, at most {} of memory",
                   ranks.count(), bytes_text(most(&Report::Rank::form_factor_bytes)),
                   bytes_text(most(&Report::Rank::received_bytes)),
                   bytes_text(most(&Report::Rank::peak_memory_bytes)));
}

void tell_patches(Job& job, const Patches& patches, const PatchOptions& options) {
  auto& facts = *job.report.scene;
  note_patches(facts, patches);
  const std::string repairs = repairs_text(patches.repairs);
  if (!repairs.empty()) job.console.line("repaired", "{}", repairs);
  warn(job, patches.warnings);
  job.console.line("patches", "{}, {}; {:.6g} m²", facts.patches, patch_rule(options, patches.patch_size),
                   facts.area_m2);
  if (!patches.mesh.symmetry().none()) job.console.line("symmetry", "{}", text_of(patches.mesh.symmetry()));
  if (patches.mesh.clustered())
    job.console.line("", "clusters of smaller faces and pieces of faces, {} in all", facts.pieces);
}

std::string settings_text(const FormFactorOptions& options) {
  std::vector<std::string> parts;
  if (options.has_samples()) parts.push_back(fmt::format("samples {}", options.samples));
  if (options.has_resolution()) parts.push_back(fmt::format("resolution {}", options.resolution));
  if (options.has_tolerance()) parts.push_back(fmt::format("factor tolerance {:g}", options.tolerance));
  return fmt::format("{}", fmt::join(parts, ", "));
}

Telling::Telling(Job& job, const SceneSettings& settings, std::span<const LightingSetup> setups)
    : job_(job), settings_(settings), setups_(setups) {}

SolveOptions Telling::options() {
  const Options& given = job_.options;
  SolveOptions options;
  options.close = given.close;
  options.estimate_error = given.estimate_error;
  if (given.accuracy > 0) options.accuracy = given.accuracy / 100;
  if (given.time_limit > 0) options.seconds = given.time_limit - job_.total.elapsed();
  options.memory_limit_bytes = given.memory_limit_bytes;
  if (given.shared) {
    options.ranks = given.shared->ranks;
    options.make_solver = given.shared->make_solver;
  }
  options.progress = [this](SolveStage stage, double fraction) {
    if (bar_stage_ != stage) bar_.emplace(job_.console, bar_label(stage));
    bar_stage_ = stage;
    return (*bar_)(fraction);
  };
  options.ended = [this](SolveStage ended, const SolvedScene& scene) { stage(ended, scene); };
  options.round_ended = [this](const AccuracyRound& round) {
    hide_bar();
    job_.console.line(rounds_++ == 0 ? "accuracy" : "", "{:.2g} %{} by {}, {} patches, {} samples, in {}",
                      100 * round.error.known, round.error.total ? "" : " and what is unknown",
                      round.method->name, round.patches, round.options.samples, seconds_text(round.seconds));
  };
  options.round_planned = [this](const AccuracyPlan& plan) {
    job_.console.line("", "next: {}, about {:.0f} patches, {} samples; expected {:.2g} % in {}",
                      plan.method->name, plan.patches, plan.options.samples, 100 * plan.error,
                      seconds_text(plan.seconds));
  };
  return options;
}

void Telling::hide_bar() {
  bar_.reset();
  bar_stage_.reset();
}

void Telling::stage(SolveStage ended, const SolvedScene& scene) {
  hide_bar();
  switch (ended) {
    case SolveStage::patches:
      tell_patches(job_, scene.patches, settings_.patches.value_or(PatchOptions{}));
      if (!setups_.empty())
        job_.console.line("set-ups", "{} beside the scene as it is; all share the form factors",
                          setups_.size());
      warnings_ = scene.warnings.size();
      break;
    case SolveStage::method:
      warn_anew(scene);
      job_.console.line("method", "{} ({}, seed {}){}", scene.form_factors.method,
                        settings_text(scene.form_factors.options), scene.form_factors.options.seed,
                        scene.form_factors.why.empty() ? "" : "; chosen: " + scene.form_factors.why);
      for (const std::string& reason : scene.modelled.left_out) job_.console.line("left out", "{}", reason);
      break;
    case SolveStage::form_factors:
      form_factors(scene);
      warn_anew(scene);
      break;
    case SolveStage::solve:
      solution(scene);
      break;
    case SolveStage::error:
      if (scene.error)
        tell_error(job_.console, *scene.error);
      else
        job_.console.line("error", "interrupted before it was known");
      break;
    case SolveStage::elements:
      elements(scene);
      break;
  }
}

void Telling::warn_anew(const SolvedScene& scene) {
  warn(job_, {scene.warnings.begin() + static_cast<std::ptrdiff_t>(warnings_), scene.warnings.end()});
  warnings_ = scene.warnings.size();
}

void Telling::form_factors(const SolvedScene& scene) {
  const FormFactorFacts& facts = scene.form_factors;
  const AssemblyReport& assembly = facts.assembly;
  if (facts.storage == FormFactorStorage::rows) {
    job_.console.line("form factors", "not stored: {} asks for one row at a time", scene.solver);
    return;
  }
  if (!assembly.completed) {
    job_.console.line("form factors", "interrupted");
    return;
  }
  if (!job_.options.form_factor_file.empty())
    job_.console.line("form factors", "read from {}", job_.options.form_factor_file.string());
  job_.console.line(
      "form factors", "stored {}, {}, {} entries are not zero; {}", name_of(facts.storage),
      bytes_text(static_cast<double>(facts.bytes)), facts.nonzeros,
      assembly.rays > 0 ? fmt::format("{:.3g} rays", static_cast<double>(assembly.rays)) : "no rays");
  if (assembly.lamps > 0)
    job_.console.line("", "{} computed pair by pair, not sampled",
                      numbered(assembly.lamps, "lamp patch", "lamp patches"));
  if (assembly.pairwise > assembly.lamps)
    job_.console.line(
        "", "{} computed pair by pair that rays or cells cannot tell: nearly touching, thin or distant",
        numbered(assembly.pairwise - assembly.lamps, "patch", "patches"));
  const PairCounts& pairs = assembly.pairs;
  const auto all =
      static_cast<double>(pairs.behind + pairs.hidden + pairs.free + pairs.partial + pairs.by_rays);
  if (all > 0) {
    const auto percent = [&](std::uint64_t count) { return 100 * static_cast<double>(count) / all; };
    job_.console.line(
        "",
        "of {:.3g} pairs {:.3g} % lie behind one another, {:.3g} % are hidden, {:.3g} % see all "
        "of each other, {:.3g} % part",
        all, percent(pairs.behind), percent(pairs.hidden), percent(pairs.free),
        percent(pairs.partial + pairs.by_rays));
  }
  if (!facts.reciprocal && assembly.before.reciprocity_error_mean > 0)
    job_.console.line("", "single factors are off by noise that adds up to {:.2g} of a row, on average",
                      assembly.before.reciprocity_error_mean);
  const auto error_line = [&](std::string_view label, double before, double after) {
    job_.console.line("", "{} error at most {:.2g}{}", label, after,
                      assembly.closed_rows ? fmt::format(", {:.2g} before rows were restored", before) : "");
  };
  error_line("closure", assembly.before.closure_error_max, assembly.after.closure_error_max);
  error_line("reciprocity", assembly.before.reciprocity_error_max, assembly.after.reciprocity_error_max);
  if (const double percent = std::round(1e5 * assembly.escaped_mean) / 1e3; percent > 0)
    job_.console.line("", "{:.3g} % of what leaves the patches that see any reaches no patch, on average",
                      percent);
}

void Telling::solution(const SolvedScene& scene) {
  const SolveReport& report = scene.solution.report;
  job_.console.line("solver", "{}: {} {}, residual {:.2g}, tolerance {:.2g}",
                    job_.options.petsc ? "petsc" : scene.solver, report.iterations,
                    find_solver(scene.solver).gathers ? "iterations" : "shots", report.residual,
                    scene.solver_options.tolerance);
  if (!scene.converged()) job_.console.line("not converged", "{}", report.message);
  if (report.condition.size() > 0 && report.condition.isFinite().all())
    job_.console.line("", "no radiosity is off by more than {:.2g} W/m²; condition {:.2g}",
                      report.error_bound.maxCoeff(), report.condition.maxCoeff());
  if (!report.warning.empty()) job_.console.line("warning", "{}", report.warning);
  if (!scene.form_factors.assembly.completed) return;
  print_energy(job_.console, "energy", scene.energy_of_setup(0));
  for (std::size_t k = 0; k < setups_.size(); ++k)
    print_energy(job_.console, setups_[k].name, scene.energy_of_setup(static_cast<Index>(k + 1)));
}

void Telling::elements(const SolvedScene& scene) {
  if (!scene.elements) {
    job_.console.line("elements", "interrupted; light is told of the patches");
    return;
  }
  const Elements& elements = *scene.elements;
  job_.console.line("elements", "{}, {} {:.4g} m; {} rays each, noise {:.2g} % of the reflected light (rms)",
                    elements.mesh.patch_count(),
                    elements.adaptive ? "edges of the smallest at most" : "no edge longer than",
                    elements.size, elements.samples, 100 * elements.noise());
}

void Telling::finish(const SolvedScene& solved) {
  hide_bar();
  Report& report = job_.report;
  if (solved.accuracy) {
    if (solved.error) tell_error(job_.console, *solved.error);
    if (!solved.accuracy->reached)
      job_.console.line("not reached", "{}; this is the best there is", solved.accuracy->why_not);
    warn_anew(solved);
  } else if (solved.converged() && job_.options.estimate_error &&
             solved.form_factors.storage == FormFactorStorage::rows) {
    job_.console.line("error", "not estimated: that takes factors that are stored");
  }
  report.scene->bands = solved.bands;
  note_patches(*report.scene, solved.patches);
  report.modelled = solved.modelled;
  report.form_factors = solved.form_factors;
  report.accuracy = solved.accuracy;
  report.error = solved.error;
  report.seconds.mesh = solved.seconds.mesh;
  report.seconds.form_factors = solved.seconds.form_factors;
  report.seconds.solve = solved.seconds.solve;
  report.seconds.error = solved.seconds.error;
  report.seconds.elements = solved.seconds.elements;
  if (solved.elements)
    report.elements = Report::ElementFacts{solved.elements->mesh.patch_count(), solved.elements->samples,
                                           solved.elements->size, solved.elements->noise()};
  if (solved.solver.empty()) return;
  report.converged = solved.converged();
  report.solver = {job_.options.petsc ? "petsc" : solved.solver, solved.solver_options.tolerance,
                   solved.solution_of_setup(0).report};
  if (!solved.form_factors.assembly.completed) return;
  report.energy = solved.energy_of_setup(0);
  for (std::size_t k = 0; k < setups_.size(); ++k)
    report.setups.emplace_back(setups_[k].name, solved.energy_of_setup(static_cast<Index>(k + 1)));
}

SolvedScene solve_stage(Job& job, const LoadedScene& loaded, const SceneSettings& settings,
                        const std::function<void(Index iteration, const BandArray& radiosity)>& step,
                        Checkpoints* checkpoints) {
  warn_of_lights(job, loaded);
  require_emission(loaded.scene, job.options.scene);
  Telling telling(job, settings, loaded.setups);
  SolveOptions options = telling.options();
  options.step = step;
  const std::filesystem::path& file = job.options.form_factor_file;
  if (!file.empty())
    options.form_factors = [&file, ranks = options.ranks](const PatchMesh& mesh) {
      return read_form_factors(file, mesh, ranks.get());
    };
  if (checkpoints != nullptr) checkpoints->connect(options);
  SolvedScene solved = solve_scene(loaded.scene, settings, options, loaded.setups);
  telling.finish(solved);
  job.stage.lap();  // what comes now is writing
  return solved;
}

Outputs::~Outputs() {
  std::error_code ignored;  // the error that brought us here is the one to tell
  if (!keep_)
    for (const auto& file : made_) std::filesystem::remove_all(file, ignored);
}

void Outputs::will_write(const std::filesystem::path& file, bool tell) {
  std::error_code unknown;  // then it is not ours to remove
  if (!std::filesystem::exists(file, unknown) && !unknown) made_.push_back(file);
  if (tell) files_.push_back(file);
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
                                      {"elements", s.elements},
                                      {"write", s.write}})
    if (seconds > 0) parts.push_back(fmt::format("{} {}", name, seconds_text(seconds)));
  job_.console.line("time", "{} ({}); at most {} of memory", seconds_text(s.total), fmt::join(parts, ", "),
                    bytes_text(static_cast<double>(report.peak_memory_bytes)));
}

}  // namespace radiosity::app
