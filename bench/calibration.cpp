// SPDX-License-Identifier: GPL-3.0-or-later
// Estimated errors beside true ones: the table of docs/calibration.md.
#include "cases/calibration.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

int main(int argc, char** argv) {
  using radiosity::test::CalibrationCase;
  CLI::App app{"Estimated errors of B beside true ones: prints a Markdown table"};
  int rooms = 20;
  bool smallest = false;
  std::string method;
  app.add_option("--rooms", rooms, "random rooms")->capture_default_str();
  app.add_flag("--smallest", smallest, "no random rooms, larger patches and the analytic method only");
  app.add_option("--method", method, "only this one");
  CLI11_PARSE(app, argc, argv);
  fmt::print("| scene | method | true error | estimate | estimate / truth |\n|---|---|---|---|---|\n");
  const auto all = radiosity::test::calibration(
      smallest ? 0 : rooms, !smallest,
      [](const CalibrationCase& h) {
        fmt::print("| {} | {} | {:.2g} % | {:.2g} % | {:.2g} |\n", h.scene, h.method, 100 * h.truth,
                   100 * h.estimate, h.ratio());
        std::fflush(stdout);
      },
      smallest ? "analytic" : method);
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
  return 0;
}
