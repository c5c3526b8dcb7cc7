// SPDX-License-Identifier: GPL-3.0-or-later
// Estimated errors beside true ones: the table of docs/calibration.md.
#include "cases/calibration.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "radiosity/rendering/path_traced.hpp"

int main(int argc, char** argv) {
  using radiosity::test::CalibrationCase;
  using namespace radiosity;
  CLI::App app{"Estimated errors of B beside true ones: prints a Markdown table"};
  int rooms = 20;
  bool smallest = false;
  std::string method;
  app.add_option("--rooms", rooms, "random rooms")->capture_default_str();
  app.add_flag("--smallest", smallest, "no random rooms, larger patches and the analytic method only");
  app.add_option("--method", method, "only this one");
  CLI11_PARSE(app, argc, argv);
  fmt::print(
      "| scene | method | true error | estimate | estimate / truth | by path tracing |\n"
      "|---|---|---|---|---|---|\n");
  const auto all = radiosity::test::calibration(
      smallest ? 0 : rooms, !smallest,
      [](const CalibrationCase& h) {
        fmt::print("| {} | {} | {:.2g} % | {:.2g} % | {:.2g} | {} |\n", h.scene, h.method, 100 * h.truth,
                   100 * h.estimate, h.ratio(),
                   h.traced
                       ? fmt::format("{:.2g} ± {:.2g} %", 100 * h.traced->rms, 100 * h.traced->standard_error)
                       : "");
        std::fflush(stdout);
      },
      smallest ? "analytic" : method,
      [](const auto& mesh, std::span<const Place> places, Index paths, std::uint64_t seed) {
        return path_traced(mesh, places, paths, seed).irradiance;
      });
  std::vector<double> ratios;
  for (const CalibrationCase& h : all) ratios.push_back(h.ratio());
  std::sort(ratios.begin(), ratios.end());
  const auto below = std::count_if(ratios.begin(), ratios.end(), [](double ratio) { return ratio < 0.5; });
  fmt::print(
      "\n{} cases: the truth is below twice the estimate in {:.1f} %; the median estimate is {:.2g} times "
      "the truth, the "
      "middle nine tenths {:.2g} to {:.2g}.\n",
      ratios.size(), 100 - 100.0 * static_cast<double>(below) / static_cast<double>(ratios.size()),
      ratios[ratios.size() / 2], ratios[ratios.size() / 20], ratios[ratios.size() - 1 - ratios.size() / 20]);
  std::size_t traced = 0, agree = 0;
  for (const CalibrationCase& h : all) {
    if (!h.traced) continue;
    ++traced;
    agree += h.traced->rms <= 2 * h.estimate + 2 * h.traced->standard_error;
  }
  fmt::print(
      "By path tracing, too, the error is below twice the estimate, but for two standard errors, in {} of {} "
      "cases.\n",
      agree, traced);
  return 0;
}
