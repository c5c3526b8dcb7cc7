// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <random>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/path_traced.hpp"
#include "radiosity/simulation/probe.hpp"
#include "radiosity/solver/solution.hpp"

/// Irradiance at sensors in a closed Cornell box, from radiosity and from path tracing.
namespace {

using namespace radiosity;

class Stopwatch {
 public:
  /// Wall seconds and CPU seconds of all threads, since the last call.
  std::pair<double, double> lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    const std::pair seconds{std::chrono::duration<double>(now - wall_).count(),
                            static_cast<double>(cpu - cpu_) / CLOCKS_PER_SEC};
    wall_ = now;
    cpu_ = cpu;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  std::clock_t cpu_ = std::clock();
};

/// Half of the sensors on surfaces, evenly by area; the others in the room, facing anywhere.
std::vector<Place> places(const Visibility& visibility, Index count) {
  const PatchMesh& mesh = visibility.mesh();
  std::mt19937_64 random(7);
  const auto draw = [&] { return test::uniform(random); };
  std::vector<Place> result;
  while (static_cast<Index>(result.size()) < count) {
    if (result.size() % 2 == 0) {
      double where = draw() * mesh.areas().sum();
      Index j = 0;
      while (j + 1 < mesh.patch_count() && where >= mesh.area(j)) where -= mesh.area(j++);
      if (visibility.covered(j) || (mesh.material_of(j).emission > 0).any()) continue;
      const auto triangles = mesh.triangles(j);
      const auto& t = triangles[random() % triangles.size()];
      const double root = std::sqrt(draw()), s = draw();
      const Vec3 x =
          (1 - root) * mesh.vertex(t[0]) + root * (1 - s) * mesh.vertex(t[1]) + root * s * mesh.vertex(t[2]);
      // A place on the floor under a block is inside of it.
      if (visibility.first_hit(x + 1e-4 * mesh.normal(j), mesh.normal(j)).front)
        result.push_back({x, mesh.normal(j), j});
    } else {
      const Vec3 x = mesh.lower() + Vec3(draw(), draw(), draw()).cwiseProduct(mesh.upper() - mesh.lower());
      const double z = 2 * draw() - 1, angle = 6.283185307179586 * draw(), r = std::sqrt(1 - z * z);
      if (visibility.first_hit(x, Vec3::UnitZ()).front)
        result.push_back({x, {r * std::cos(angle), r * std::sin(angle), z}, Visibility::kNothing});
    }
  }
  return result;
}

/// Errors as shares of the mean irradiance of all sensors, the largest of the bands.
double mean_error(const BandArray& a, const BandArray& b) {
  return ((a - b).colwise().mean() / b.colwise().mean()).abs().maxCoeff();
}
double rms_error(const BandArray& a, const BandArray& b) {
  return ((a - b).square().colwise().mean().sqrt() / b.colwise().mean()).maxCoeff();
}
double rms(const BandArray& errors, const BandArray& values) {
  return (errors.square().colwise().mean().sqrt() / values.colwise().mean()).maxCoeff();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Irradiance at sensors, compared with path tracing: prints a Markdown table"};
  Index sensors = 200, paths = 200'000;
  bool smallest = false;
  std::vector<std::string> methods{"hemisphere", "analytic"};
  std::vector<double> sizes{0.1, 0.05, 0.0275};
  std::vector<Index> samples{512, 1152, 4608, 18432};
  app.add_option("--sensors", sensors, "half of them on surfaces")->capture_default_str();
  app.add_option("--paths", paths, "of the reference, per sensor and seed")->capture_default_str();
  app.add_option("--patch-size", sizes, "m")->capture_default_str();
  app.add_option("--samples", samples, "rays per sensor")->capture_default_str();
  app.add_option("--method", methods, "for the form factors")->capture_default_str();
  app.add_flag("--smallest", smallest, "a few sensors on few patches");
  CLI11_PARSE(app, argc, argv);
  if (smallest) {
    sensors = 8;
    paths = 2000;
    sizes = {0.2};
    methods = {"analytic"};
    samples = {512};
  }

  const Scene scene = test::closed_cornell_box();
  const Patches faces = make_patches(scene, KeepFaces{});
  const Visibility faces_visibility(faces.mesh);
  const std::vector<Place> all = places(faces_visibility, sensors);
  std::vector<Sensor> list;
  for (const Place& place : all) list.push_back({place.position, place.normal});

  Stopwatch watch;
  const auto mesh = std::make_shared<const PatchMesh>(faces.mesh);
  const PathTraced a = path_traced(mesh, all, paths, 1), b = path_traced(mesh, all, paths, 2);
  const BandArray exact = (a.irradiance + b.irradiance) / 2;
  const BandArray noise = (a.standard_error.square() + b.standard_error.square()).sqrt() / 2;
  const auto [wall, cpu] = watch.lap();
  const double mean_noise = (noise.square().colwise().sum().sqrt() / exact.colwise().sum()).maxCoeff();
  fmt::print(
      "{} sensors; reference of 2 × {} paths each: {:.1f} s ({:.1f} CPU s), standard error {:.3f} % of the "
      "mean, "
      "{:.3f} % rms of a sensor; the two seeds differ by {:.3f} % in the mean\n\n",
      sensors, paths, wall, cpu, 100 * mean_noise, 100 * rms(noise, exact),
      100 * mean_error(a.irradiance, b.irradiance));

  fmt::print(
      "| method | patches | solve s (CPU) | rays | probe s (CPU) | mean % | rms % | stated rms % | 10,000 "
      "sensors, "
      "CPU s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& method : methods) {
    for (const double size : sizes) {
      watch.lap();
      const Patches patches = make_patches(scene, PatchSize{size});
      const Visibility visibility(patches.mesh);
      const auto form_factors = find_form_factor_method(method).make(visibility);
      const FormFactorMatrix matrix = assemble(*form_factors, visibility).matrix;
      const RadiositySystem system(matrix, patches.mesh);
      const Solution solution = solve(*find_solver("conjugate-gradient").make(), system, patches.mesh);
      const auto [solve_wall, solve_cpu] = watch.lap();
      for (const Index k : samples) {
        ProbeOptions options;
        options.samples = k;
        watch.lap();
        const ProbeResult probed =
            probe(visibility, solution.radiosity, solution.vertex_radiosity, list, options);
        const auto [probe_wall, probe_cpu] = watch.lap();
        fmt::print(
            "| {} | {} | {:.2f} ({:.2f}) | {} | {:.3f} ({:.3f}) | {:.3f} | {:.3f} | {:.3f} | {:.2f} |\n",
            method, patches.mesh.patch_count(), solve_wall, solve_cpu, probed.samples, probe_wall, probe_cpu,
            100 * mean_error(probed.irradiance, exact), 100 * rms_error(probed.irradiance, exact),
            100 * rms(probed.standard_error, exact), probe_cpu * 10'000 / sensors);
        std::fflush(stdout);
      }
    }
  }
  return 0;
}
