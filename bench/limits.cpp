// SPDX-License-Identifier: GPL-3.0-or-later
// The table of docs/limits.md: what is asked at the extremes, what is right, what comes out.
#include "cases/limits.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

int main(int argc, char** argv) {
  CLI::App app{"Extreme cases with known answers: prints a Markdown table"};
  bool smallest = false;
  app.add_flag("--smallest", smallest, "only the first three");
  CLI11_PARSE(app, argc, argv);
  auto rows = radiosity::test::limits();
  if (smallest) rows.resize(3);
  fmt::print("| asked | with | right | came out |\n|---|---|---|---|\n");
  bool all = true;
  for (const auto& row : rows) {
    const auto outcome = row.run();
    const bool good = outcome.error <= outcome.allowed;
    all = all && good;
    fmt::print("| {} | {} | {} | {}{} |\n", row.asked, row.tried, row.exact, good ? "" : "**WRONG** ",
               outcome.came_out);
    std::fflush(stdout);
  }
  return all ? 0 : 1;
}
