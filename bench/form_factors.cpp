// SPDX-License-Identifier: GPL-3.0-or-later
// Form factor methods × settings × scenes: time, memory, rays and error, side by side.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "radiosity/formfactors/assemble.hpp"
#include "support/scenes.hpp"

namespace {

using namespace radiosity;
using test::Facing;

struct BenchScene {
  std::string name;
  PatchMesh mesh;
};

BenchScene empty_cube(Index n) {
  return {fmt::format("empty cube, {} patches", 6 * n * n), test::cube_room(n)};
}

BenchScene cube_with_box(Index n, Index m, const Vec3& shift) {
  return {
      fmt::format("cube with box{}, {} patches", shift.isZero() ? "" : " off centre", 6 * (n * n + m * m)),
      test::MeshBuilder()
          .box({0, 0, 0}, {1, 1, 1}, n, Facing::inward)
          .box(Vec3::Constant(0.25) + shift, Vec3::Constant(0.75) + shift, m, Facing::outward)
          .build()};
}

BenchScene near_plates(Index n) {
  return {fmt::format("plates at a gap of 1e-3, {} patches", 2 * n * n), test::opposed_squares(1e-3, n)};
}

/// Rows of F for a few patches spread over the mesh, by the analytic method with 64 times as many points as by default. The
/// tests hold that method against brute force and closed forms.
struct Reference {
  std::vector<Index> rows;
  std::vector<Eigen::ArrayXd> factors;
};

Reference reference(const BenchScene& scene, Index row_count) {
  const PatchMesh& mesh = scene.mesh;
  Reference out;
  const Index step = std::max<Index>(1, mesh.patch_count() / row_count);
  for (Index i = step / 2; i < mesh.patch_count(); i += step) out.rows.push_back(i);
  out.factors.assign(out.rows.size(), Eigen::ArrayXd::Zero(mesh.patch_count()));
  const Visibility visibility(mesh);
  const FormFactorMethodInfo& info = find_form_factor_method("analytic");
  const auto method = info.make(visibility, {.samples = 64 * info.default_setting});
  tbb::parallel_for(std::size_t{0}, out.rows.size(), [&](std::size_t r) {
    method->rows(out.rows[r], out.rows[r] + 1, false,
                 [&](Index, std::span<const Index> columns, std::span<const double> values, double) {
                   for (std::size_t k = 0; k < columns.size(); ++k) out.factors[r][columns[k]] = values[k];
                 });
  });
  return out;
}

void run(const BenchScene& scene, const Reference& exact, const FormFactorMethodInfo& info, Index setting,
         bool close) {
  using Clock = std::chrono::steady_clock;
  FormFactorOptions options;
  (info.setting == "resolution" ? options.resolution : options.samples) = setting;
  const auto start = Clock::now();
  const Visibility visibility(scene.mesh);
  const auto method = info.make(visibility, options);
  AssemblyOptions assembly;
  assembly.close = close;
  AssemblyReport report;
  const FormFactorMatrix f = assemble(*method, visibility, assembly, &report);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();

  double square = 0;
  double norm = 0;
  double l1 = 0;
  double largest = 0;
  for (std::size_t r = 0; r < exact.rows.size(); ++r) {
    double row = 0;
    for (Index j = 0; j < f.size(); ++j) {
      const double error = std::abs(f(exact.rows[r], j) - exact.factors[r][j]);
      square += error * error;
      norm += exact.factors[r][j] * exact.factors[r][j];
      row += error;
      largest = std::max(largest, error);
    }
    l1 += row / static_cast<double>(exact.rows.size());
  }
  fmt::print("| {} | {} {}{} | {:.2f} | {:.1f} | {:.2g} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |\n",
             scene.name, info.name, setting > 0 ? setting : info.default_setting,
             close ? "" : ", rows as they are", seconds, static_cast<double>(f.bytes()) / 1e6,
             static_cast<double>(report.rays), l1, std::sqrt(square / norm), largest,
             report.before.closure_error_max, report.before.reciprocity_error_max);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Form factor methods compared at equal error: prints a Markdown table"};
  Index rows = 24;
  bool smallest = false;
  std::string only;
  app.add_option("--rows", rows, "rows of F that are compared with the reference")->capture_default_str();
  app.add_option("--method", only, "only this method");
  app.add_flag("--smallest", smallest, "only scenes of a few hundred patches");
  CLI11_PARSE(app, argc, argv);

  const Index n = smallest ? 6 : 16;
  const std::vector<BenchScene> scenes{empty_cube(n), cube_with_box(n, n / 2, Vec3::Zero()),
                                       cube_with_box(n, n / 2, Vec3(0.1, -0.07, -0.12)), near_plates(n)};
  fmt::print(
      "| scene | method | s | MB | rays | row L1 | relative Frobenius | largest | closure before | "
      "reciprocity "
      "before |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const BenchScene& scene : scenes) {
    const Reference exact = reference(scene, rows);
    for (const FormFactorMethodInfo& info : form_factor_methods()) {
      if (!only.empty() && only != info.name) continue;
      const Index finer =
          info.default_setting * (info.setting == "resolution" ? 2 : 4);  // about 4 times the work
      run(scene, exact, info, info.default_setting, true);
      run(scene, exact, info, info.default_setting, false);
      run(scene, exact, info, finer, true);
    }
  }
  return 0;
}
