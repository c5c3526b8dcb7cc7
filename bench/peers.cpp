// SPDX-License-Identifier: GPL-3.0-or-later
// The analytic method and View3D [Walton2002] in turn on the same scenes, one thread each: error, seconds and their ratio.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "cases/known_rows.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"

namespace {

using namespace radiosity;
using test::KnownRows;
using test::KnownScene;
using test::RowErrors;

struct Run {
  double seconds = 0;
  RowErrors errors{};
};

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(": ") + 2);
  return "unknown";
}

Run run_ours(const KnownScene& scene, const KnownRows& known, const FormFactorOptions& options) {
  const std::clock_t start = std::clock();
  const Visibility visibility(scene.mesh);
  const auto method = find_form_factor_method("analytic").make(visibility, options);
  const FormFactorMatrix f = assemble(*method, visibility).matrix;
  return {static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC,
          known.errors([&](Index i, Index j) { return static_cast<double>(f(i, j)); })};
}

// Its input: vertices and surfaces, numbered from 1; enclosures are normalised.
void write_vs3(const std::filesystem::path& file, const PatchMesh& mesh, double eps) {
  std::ofstream out(file);
  fmt::print(out, "T grid\nC encl=1 out=1 maxU=12 maxO=12 eps={:g}\nF 3\n", eps);
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    fmt::print(out, "V {} {:.9g} {:.9g} {:.9g}\n", v + 1, mesh.vertex(v).x(), mesh.vertex(v).y(),
               mesh.vertex(v).z());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const auto corners = mesh.corners(i);
    fmt::print(out, "S {} {} {} {} {} 0 0 0.5 p{}\n", i + 1, corners[0] + 1, corners[1] + 1, corners[2] + 1,
               corners.size() > 3 ? corners[3] + 1 : 0, i + 1);
  }
  fmt::print(out, "End of data\n");
}

// Seconds, of the processor as everywhere here, are those that its log gives for finding, computing and adjusting factors.
std::optional<Run> run_view3d(const std::filesystem::path& program, const std::filesystem::path& folder,
                              const KnownScene& scene, const KnownRows& known, double eps) {
  write_vs3(folder / "scene.vs3", scene.mesh, eps);
  const std::string command =
      fmt::format("cd '{}' && '{}' scene.vs3 factors >/dev/null 2>&1", folder.string(), program.string());
  if (std::system(command.c_str()) != 0) return {};
  std::ifstream log(folder / "View3D.log");
  const std::string text{std::istreambuf_iterator<char>(log), {}};
  Run run;
  const std::regex line("([0-9.]+) seconds to (determine|compute|adjust)");
  for (std::sregex_iterator match(text.begin(), text.end(), line), end; match != end; ++match)
    run.seconds += std::stod((*match)[1]);
  // A header of 32 bytes, the areas, then F, all in single precision.
  const Index n = scene.mesh.patch_count();
  std::ifstream in(folder / "factors", std::ios::binary);
  std::vector<float> row(n);
  Index at = -1;
  run.errors = known.errors([&](Index i, Index j) {
    if (i != at) {
      in.seekg(32 + static_cast<std::streamoff>(sizeof(float)) * n * (i + std::streamoff{1}));
      in.read(reinterpret_cast<char*>(row.data()), static_cast<std::streamsize>(sizeof(float)) * n);
      at = i;
    }
    return static_cast<double>(row[j]);
  });
  if (!in) return {};
  return run;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"The analytic method beside View3D, one thread each: prints a Markdown table"};
  std::string view3d, scene_name;
  Index rows = 48, samples = 0;
  int rounds = 3;
  double eps = 1e-4, tolerance = 0;
  bool smallest = false;
  app.add_option("--view3d", view3d, "the program; without it only ours runs");
  app.add_option("--eps", eps, "View3D's own tolerance")->capture_default_str();
  app.add_option("--samples", samples, "of ours; 0: the default")->capture_default_str();
  app.add_option("--factor-tolerance", tolerance, "of ours; 0: the default")->capture_default_str();
  app.add_option("--rows", rows, "rows of F that are compared with the reference")->capture_default_str();
  app.add_option("--rounds", rounds, "runs of each in turn, of which the median is taken")
      ->capture_default_str();
  app.add_option("--scene", scene_name, "only scenes whose name contains this");
  app.add_flag("--smallest", smallest, "only scenes of a hundred patches, once");
  CLI11_PARSE(app, argc, argv);

  const Vec3 off_centre(0.1, -0.07, -0.12);
  std::vector<std::function<KnownScene()>> scenes;
  for (const Index n : smallest ? std::vector<Index>{4} : std::vector<Index>{16, 32}) {
    scenes.push_back([=] { return test::empty_cube(n); });
    scenes.push_back([=] { return test::cube_with_box("cube with box", n, Vec3::Zero()); });
    scenes.push_back([=] { return test::cube_with_box("cube with box off centre", n, off_centre); });
  }
  const auto folder =
      std::filesystem::temp_directory_path() / fmt::format("radiosity-peers-{}", std::random_device{}());
  std::filesystem::create_directories(folder);

  fmt::print(
      "{}\n\n| scene | ours, s | Frobenius | View3D, s | Frobenius | ratio |\n|---|---|---|---|---|---|\n",
      processor());
  for (const auto& make : scenes) {
    const KnownScene scene = make();
    if (scene.name.find(scene_name) == std::string::npos) continue;
    const KnownRows known = test::known_rows(scene, rows);
    const ThreadLimit one(1);
    std::vector<double> ours, theirs;
    RowErrors our_errors{}, their_errors{};
    for (int round = 0; round < (smallest ? 1 : rounds); ++round) {
      const Run a = run_ours(scene, known, {.samples = samples, .tolerance = tolerance});
      ours.push_back(a.seconds);
      our_errors = a.errors;
      if (view3d.empty()) continue;
      const std::optional<Run> b = run_view3d(std::filesystem::absolute(view3d), folder, scene, known, eps);
      if (!b) {
        fmt::print(stderr, "View3D failed on {}; its log is in {}\n", scene.name, folder.string());
        return 1;
      }
      theirs.push_back(b->seconds);
      their_errors = b->errors;
    }
    fmt::print("| {} | {:.3f} | {:.1e} ", scene.name, median(ours), our_errors.frobenius);
    if (theirs.empty())
      fmt::print("| – | – | – |\n");
    else
      fmt::print("| {:.2f} | {:.1e} | {:.1f} |\n", median(theirs), their_errors.frobenius,
                 median(theirs) / median(ours));
    std::fflush(stdout);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
