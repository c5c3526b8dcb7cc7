// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/report.hpp"

#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "radiosity/io/output.hpp"

namespace radiosity {
namespace {

using Json = nlohmann::ordered_json;

template <class Derived>
Json numbers(const Eigen::DenseBase<Derived>& values) {
  Json array = Json::array();
  for (Eigen::Index k = 0; k < values.size(); ++k) array.push_back(values.derived().coeff(k));
  return array;
}

Json to_json(const Repairs& repairs) {
  return {{"merged_vertices", repairs.merged_vertices},
          {"degenerate_faces", repairs.degenerate_faces},
          {"duplicate_faces", repairs.duplicate_faces},
          {"unwound_faces", repairs.unwound_faces},
          {"flipped_faces", repairs.flipped_faces},
          {"triangulated_faces", repairs.triangulated_faces},
          {"non_planar_faces", repairs.non_planar_faces},
          {"split_edges", repairs.split_edges},
          {"cut_faces", repairs.cut_faces}};
}

Json to_json(const Report::SceneFacts& scene) {
  Json json = {{"file", scene.file},
               {"surfaces", scene.surfaces},
               {"patches", scene.patches},
               {"pieces", scene.pieces},
               {"bands", scene.bands},
               {"area_m2", scene.area_m2},
               {"bounds_m", Json::array({numbers(scene.lower), numbers(scene.upper)})},
               {"repairs", to_json(scene.repairs)}};
  if (scene.auto_sides)
    json["auto_sides"] = {{"sheets", scene.auto_sides->sheets},
                          {"faces", scene.auto_sides->faces},
                          {"area_m2", scene.auto_sides->area_m2},
                          {"unseen_sheets", scene.auto_sides->unseen_sheets},
                          {"solids", scene.auto_sides->solids}};
  json["warnings"] = scene.warnings;
  return json;
}

Json to_json(const Modelled& modelled) {
  Json saved = Json::object();
  const auto add = [&saved](const char* what, const std::optional<std::uint64_t>& count) {
    if (count) saved[what] = *count;
  };
  add("band_products", modelled.saved.band_products);
  add("radiosity_bytes", modelled.saved.radiosity_bytes);
  add("visibility_tests", modelled.saved.visibility_tests);
  add("pairs_behind", modelled.saved.pairs_behind);
  Json json = {{"bands", modelled.bands},
               {"occlusion", modelled.occlusion},
               {"left_out", modelled.left_out},
               {"saved", saved}};
  if (const Symmetry& symmetry = modelled.symmetry; !symmetry.none()) {
    Json planes = Json::array();
    for (const MirrorPlane& plane : symmetry.planes) planes.push_back(text_of(plane));
    json["symmetry"] = {{"planes", planes},
                        {"period_m", numbers(symmetry.period)},
                        {"steps", symmetry.steps},
                        {"images", images(symmetry).size()}};
  }
  return json;
}

Json to_json(const FormFactorQuality& quality) {
  return {{"closure_error_max", quality.closure_error_max},
          {"closure_error_mean", quality.closure_error_mean},
          {"reciprocity_error_max", quality.reciprocity_error_max},
          {"reciprocity_error_mean", quality.reciprocity_error_mean}};
}

Json to_json(const FormFactorFacts& facts) {
  Json parameters = {{"seed", facts.options.seed}};
  if (facts.options.has_samples()) parameters["samples"] = facts.options.samples;
  if (facts.options.has_resolution()) parameters["resolution"] = facts.options.resolution;
  if (facts.options.has_tolerance()) parameters["factor_tolerance"] = facts.options.tolerance;
  const AssemblyReport& assembly = facts.assembly;
  Json json = {{"method", facts.method},     {"parameters", parameters}, {"storage", name_of(facts.storage)},
               {"nonzeros", facts.nonzeros}, {"bytes", facts.bytes},     {"rays", assembly.rays}};
  json.update(to_json(assembly.after));
  json["escaped_mean"] = assembly.escaped_mean;
  json["before"] = to_json(assembly.before);
  json["closed_scene"] = assembly.closed_scene;
  json["closed_rows"] = assembly.closed_rows;
  json["blind_patches"] = assembly.isolated_patches;
  const PairCounts& pairs = assembly.pairs;
  json["pairs"] = {{"behind", pairs.behind},
                   {"hidden", pairs.hidden},
                   {"free", pairs.free},
                   {"partial", pairs.partial},
                   {"by_rays", pairs.by_rays}};
  return json;
}

const char* name(SolveStatus status) {
  switch (status) {
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::iteration_limit:
      return "iteration_limit";
    case SolveStatus::stopped:
      return "stopped";
    case SolveStatus::failed:
      break;
  }
  return "failed";
}

Json to_json(const Report::SolverFacts& solver) {
  return {{"name", solver.name},
          {"iterations", solver.report.iterations},
          {"residual", solver.report.residual},
          {"tolerance", solver.tolerance},
          {"status", name(solver.report.status)},
          {"message", solver.report.message},
          {"history", solver.report.history},
          {"error_bound", numbers(solver.report.error_bound)},
          {"condition", numbers(solver.report.condition)},
          {"warning", solver.report.warning}};
}

Json to_json(const EnergyBalance& energy) {
  return {{"emitted_w", numbers(energy.emitted_w)},
          {"absorbed_w", numbers(energy.absorbed_w)},
          {"escaped_w", numbers(energy.escaped_w)},
          {"imbalance", numbers(energy.imbalance)}};
}

Json to_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

Json to_json(const ErrorEstimate& error) {
  return {{"form_factors", to_json(error.form_factors)},
          {"patches", to_json(error.patches)},
          {"solver", error.solver},
          {"gather", to_json(error.gather)},
          {"total", to_json(error.total)},
          {"known", error.known},
          {"largest", to_json(error.largest)},
          {"order", to_json(error.order)},
          {"extrapolated", error.correction.size() > 0},
          {"notes", error.notes}};
}

Json to_json(const AccuracyReport& accuracy) {
  Json rounds = Json::array();
  for (const AccuracyRound& round : accuracy.rounds)
    rounds.push_back({{"method", round.method->name},
                      {"samples", round.options.samples},
                      {"patches", round.patches},
                      {"patch_size_m", round.patch_size},
                      {"error", to_json(round.error.total)},
                      {"seconds", round.seconds}});
  return {{"goal", accuracy.goal}, {"reached", accuracy.reached}, {"rounds", rounds}};
}

Json to_json(const Report::ElementFacts& elements) {
  return {{"count", elements.count},
          {"size_m", elements.size_m},
          {"samples", elements.samples},
          {"noise", elements.noise}};
}

Json to_json(const Report::Probe& probe) {
  return {{"sensors", probe.sensors},
          {"samples", probe.samples},
          {"irradiance_mean", numbers(probe.irradiance_mean)},
          {"standard_error_rms", numbers(probe.standard_error_rms)}};
}

Json to_json(const Report::Seconds& seconds) {
  return {{"read", seconds.read},   {"mesh", seconds.mesh},   {"form_factors", seconds.form_factors},
          {"solve", seconds.solve}, {"error", seconds.error}, {"elements", seconds.elements},
          {"write", seconds.write}, {"total", seconds.total}};
}

}  // namespace

void write_report(const std::filesystem::path& file, const Report& report) {
  Json json = {{"version", report.version}, {"command", report.command}, {"converged", report.converged}};
  const auto add = [&json](const char* part, const auto& facts) {
    if (facts) json[part] = to_json(*facts);
  };
  add("scene", report.scene);
  add("modelled", report.modelled);
  add("form_factors", report.form_factors);
  add("solver", report.solver);
  add("energy", report.energy);
  for (const auto& [setup, energy] : report.setups) json["setups"][setup]["energy"] = to_json(energy);
  add("error", report.error);
  add("accuracy", report.accuracy);
  add("elements", report.elements);
  add("probe", report.probe);
  json["seconds"] = to_json(report.seconds);
  json["peak_memory_bytes"] = report.peak_memory_bytes;
  for (const Report::Rank& rank : report.ranks)
    json["ranks"].push_back({{"rows", rank.rows},
                             {"form_factor_bytes", rank.form_factor_bytes},
                             {"form_factors_s", rank.form_factors_s},
                             {"solve_s", rank.solve_s},
                             {"received_bytes", rank.received_bytes},
                             {"exchange_s", rank.exchange_s},
                             {"peak_memory_bytes", rank.peak_memory_bytes}});
  // File names need not be UTF-8; numbers that are not finite become null.
  write_file(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts KiB
}

}  // namespace radiosity
