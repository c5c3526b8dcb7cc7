// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <system_error>

#include "comparison_page.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 3> kFiles{"trade.csv", "trade.json", "index.html"};
constexpr std::array kAccuracies{0.05, 0.02, 0.01, 0.005};

// A field of a CSV line (RFC 4180).
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string number(const std::optional<double>& value) {
  return value ? fmt::format("{}", *value) : std::string();
}

// Of Comparison::runs, whether no other beats it in both cost and error.
std::vector<bool> on_front(const Comparison& comparison, const std::vector<CostAndError> Measured::*points) {
  const Measured all = measured(comparison);
  std::vector<bool> out(comparison.runs.size());
  for (const std::size_t k : pareto_front(all.*points)) out[all.index[k]] = true;
  return out;
}

std::string csv(const Comparison& comparison) {
  std::string out =
      "kind,name,samples,resolution,seed,patch_size_m,patches,tolerance,products,seconds,bytes,rays,residual,"
      "error_factors,largest_factors,error_total,largest_total,error_at_most,path_tracing,path_tracing_error,"
      "pareto,left_out\n";
  const auto rms = [](const std::optional<RelativeError>& error) {
    return error ? std::optional(error->rms) : std::nullopt;
  };
  const auto traced = [](const std::optional<TracedError>& error) {
    return error ? fmt::format("{},{}", error->rms, error->standard_error) : ",";
  };
  const auto largest = [](const std::optional<RelativeError>& error) {
    return error ? std::optional(error->largest) : std::nullopt;
  };
  const std::vector<bool> best = on_front(comparison, &Measured::by_seconds);
  for (std::size_t r = 0; r < comparison.runs.size(); ++r) {
    const ComparedRun& run = comparison.runs[r];
    const ComparedMesh& mesh = comparison.meshes[run.mesh];
    const bool ran = run.left_out.empty();
    out += fmt::format("method,{},{},{},{},{},{},,,{},{},{},,{},{},{},{},{},{},{},{}\n", run.method,
                       run.settings.samples,
                       run.settings.has_resolution() ? fmt::format("{}", run.settings.resolution) : "",
                       run.settings.seed, mesh.size, mesh.patches, ran ? fmt::format("{}", run.seconds) : "",
                       ran ? fmt::format("{}", run.bytes) : "", ran ? fmt::format("{}", run.rays) : "",
                       number(rms(run.factors)), number(largest(run.factors)), number(rms(run.total)),
                       number(largest(run.total)), number(error_at_most(comparison, run)), traced(run.traced),
                       ran ? (best[r] ? "1" : "0") : "", quoted(run.left_out));
  }
  const ComparedMesh& own = comparison.meshes[comparison.own];
  for (const SolverRun& run : comparison.solvers) {
    const bool ran = run.seconds > 0;
    out += fmt::format("solver,{},,,,{},{},{},{},{},,,{},{},,,,,{},,{}\n", run.solver, own.size, own.patches,
                       run.tolerance, ran ? fmt::format("{}", run.products) : "",
                       ran ? fmt::format("{}", run.seconds) : "", ran ? fmt::format("{}", run.residual) : "",
                       ran ? fmt::format("{}", run.error) : "", traced(run.traced), quoted(run.left_out));
  }
  return out;
}

void add_traced(Json& json, const std::optional<TracedError>& error) {
  if (!error) return;
  json["path_tracing"] = {{"rms", error->rms},
                          {"standard_error", error->standard_error},
                          {"mean", error->mean},
                          {"mean_standard_error", error->mean_standard_error}};
}

Json to_json(const ComparedReference& reference) {
  Json json = {{"method", reference.method},      {"samples", reference.settings.samples},
               {"seed", reference.settings.seed}, {"solves", reference.solves},
               {"patch_size_m", reference.size},  {"patches", reference.patches},
               {"seconds", reference.seconds},    {"noise", reference.noise}};
  if (reference.patch_error) {
    json["patch_error"] = *reference.patch_error;
    json["order"] = *reference.order;
    json["order_assumed"] = reference.order_assumed;
  }
  add_traced(json, reference.traced);
  return json;
}

Json to_json(const std::optional<RelativeError>& error) {
  return error ? Json{{"rms", error->rms}, {"largest", error->largest}} : Json();
}

Json to_json(const Comparison& comparison, const ComparisonOrigin& origin) {
  Json meshes = Json::array(), runs = Json::array(), solvers = Json::array(), advised = Json::array();
  for (const ComparedMesh& mesh : comparison.meshes)
    meshes.push_back({{"patch_size_m", mesh.size},
                      {"patches", mesh.patches},
                      {"seconds", mesh.seconds},
                      {"reference_noise", mesh.own_noise}});
  const std::vector<bool> fastest = on_front(comparison, &Measured::by_seconds);
  const std::vector<bool> smallest = on_front(comparison, &Measured::by_bytes);
  for (std::size_t r = 0; r < comparison.runs.size(); ++r) {
    const ComparedRun& run = comparison.runs[r];
    Json json = {{"method", run.method}, {"mesh", run.mesh}, {"samples", run.settings.samples}};
    if (run.settings.has_resolution()) json["resolution"] = run.settings.resolution;
    json["seed"] = run.settings.seed;
    json["standard"] = run.standard;
    json["predicted_seconds"] = run.predicted_s;
    if (!run.left_out.empty()) {
      json["left_out"] = run.left_out;
    } else {
      json["seconds"] = run.seconds;
      json["bytes"] = run.bytes;
      json["rays"] = run.rays;
      json["error_factors"] = to_json(run.factors);
      json["error_total"] = to_json(run.total);
      json["error_at_most"] = error_at_most(comparison, run).value_or(0);
      add_traced(json, run.traced);
      json["pareto"] = bool(fastest[r]);
      json["pareto_bytes"] = bool(smallest[r]);
    }
    json["command"] = solve_command(comparison, run, origin);
    runs.push_back(std::move(json));
  }
  for (const SolverRun& run : comparison.solvers) {
    Json json = {{"solver", run.solver}, {"tolerance", run.tolerance}};
    if (run.seconds > 0) {
      json["products"] = run.products;
      json["seconds"] = run.seconds;
      json["residual"] = run.residual;
      json["error"] = run.error;
      add_traced(json, run.traced);
    }
    if (!run.left_out.empty()) json["left_out"] = run.left_out;
    solvers.push_back(std::move(json));
  }
  for (const Advice& line : advice(comparison)) {
    Json json = {{"error", line.error}};
    if (line.run) {
      const ComparedRun& run = comparison.runs[*line.run];
      json["run"] = *line.run;
      json["command"] = solve_command(comparison, run, origin);
      json["seconds"] = run.seconds;
      json["error_at_most"] = *error_at_most(comparison, run);
    }
    advised.push_back(std::move(json));
  }
  Json json = {{"version", origin.version},
               {"command", origin.command},
               {"scene", origin.scene},
               {"bands", comparison.radiosity.cols()},
               {"completed", comparison.completed},
               {"budget_s", comparison.budget_s},
               {"seconds", comparison.seconds},
               {"reference", to_json(comparison.factors)}};
  if (comparison.finer) json["finer_reference"] = to_json(*comparison.finer);
  if (comparison.tracing)
    json["path_tracing"] = {{"patches", comparison.tracing->patches},
                            {"rounds", comparison.tracing->rounds},
                            {"paths", comparison.tracing->paths},
                            {"seconds", comparison.tracing->seconds},
                            {"noise", comparison.tracing->noise}};
  json["own_mesh"] = comparison.own;
  json["meshes"] = std::move(meshes);
  json["runs"] = std::move(runs);
  json["solvers"] = std::move(solvers);
  json["advice"] = std::move(advised);
  json["notes"] = comparison.notes;
  return json;
}

}  // namespace

void require_comparison_directory(const fs::path& directory) {
  std::error_code error;
  if (!fs::exists(directory, error)) {
    require_writable(directory.has_filename() ? directory : directory.parent_path(), "");
    return;
  }
  if (!fs::is_directory(directory, error))
    throw IoError(fmt::format("{}: is not a directory", directory.string()));
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (std::find(kFiles.begin(), kFiles.end(), name) == kFiles.end())
      throw IoError(fmt::format(
          "{}: holds '{}'; -o must name a new or an empty directory, or one of an earlier comparison",
          directory.string(), name));
  }
  require_writable(directory / kFiles[0], "");
}

std::string solve_command(const Comparison& comparison, const ComparedRun& run,
                          const ComparisonOrigin& origin) {
  const PatchOptions& patches = comparison.meshes[run.mesh].options;
  std::string size = "auto";
  if (const auto* given = std::get_if<PatchSize>(&patches)) size = fmt::format("{}", given->metres);
  if (std::holds_alternative<KeepFaces>(patches)) size = "none";
  std::string out = fmt::format("radiosity solve {} -o OUT.vtp --patch-size {} --method {} --samples {}",
                                origin.scene, size, run.method, run.settings.samples);
  if (run.settings.has_resolution()) out += fmt::format(" --resolution {}", run.settings.resolution);
  if (run.settings.seed != FormFactorOptions{}.seed) out += fmt::format(" --seed {}", run.settings.seed);
  if (origin.threads > 0) out += fmt::format(" --threads {}", origin.threads);
  return out + " --no-error-estimate";
}

std::vector<Advice> advice(const Comparison& comparison) {
  const Measured all = measured(comparison);
  std::vector<Advice> out;
  for (const double error : kAccuracies) {
    const auto best = cheapest(all.by_seconds, error);
    out.push_back({error, best ? std::optional(all.index[*best]) : std::nullopt});
  }
  return out;
}

std::string advice_text(const Comparison& comparison, const Advice& advice, const ComparisonOrigin& origin) {
  if (!advice.run) return fmt::format("{} %: not reached by anything that was tried", 100 * advice.error);
  const ComparedRun& run = comparison.runs[*advice.run];
  return fmt::format("{} %: {}  ({:.2g} s, at most {:.2g} %)", 100 * advice.error,
                     solve_command(comparison, run, origin), run.seconds,
                     100 * *error_at_most(comparison, run));
}

std::vector<fs::path> comparison_files(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const char* name : kFiles) files.push_back(directory / name);
  return files;
}

void write_comparison(const fs::path& directory, const Comparison& comparison,
                      const ComparisonOrigin& origin) {
  // Names of files may hold bytes that are not UTF-8, and what would end an element of the page.
  std::string json;
  for (const char c : to_json(comparison, origin).dump(2, ' ', false, Json::error_handler_t::replace))
    json += c == '<' ? std::string("\\u003c") : std::string(1, c);
  json += '\n';
  const std::string page = comparison_page(json, comparison, origin);  // before anything is written
  std::error_code error;
  fs::create_directory(directory, error);
  if (error) throw IoError(fmt::format("{}: cannot be made: {}", directory.string(), error.message()));
  write_file(directory / kFiles[0], csv(comparison));
  write_file(directory / kFiles[1], json);
  write_file(directory / kFiles[2], page);
}

}  // namespace radiosity
