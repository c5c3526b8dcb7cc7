// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "radiosity/io/solution_file.hpp"

namespace radiosity::testing {

/// What a run of the program left.
struct Outcome {
  int status = -1;  ///< exit status; -1: killed
  std::string out, err;
};

/// Runs the program in `folder`. Where `interrupt_at` is given, SIGINT is sent as soon as stdout holds it.
Outcome run_program(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const std::string& interrupt_at = "");

/// Runs the program and kills it, without a chance to clean up, after so many milliseconds. Whether it had ended by then.
bool run_program_and_kill(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                          unsigned milliseconds);

/// A folder of its own for each test, with files in it, gone afterwards.
class ProgramTest : public ::testing::Test {
 protected:
  ProgramTest();
  ~ProgramTest() override;

  const std::filesystem::path& folder() const { return folder_; }
  std::string read(const std::string& file) const;
  void write(const std::string& file, const std::string& text) const;
  std::set<std::string> files() const;

  Outcome run(const std::vector<std::string>& arguments, const std::string& interrupt_at = "") const {
    return run_program(folder_, arguments, interrupt_at);
  }

  /// The closed unit cube, its faces looking in: cube.obj with materials floor, ceiling and wall, and
  /// cube.toml that gives them the reflectances and lets the ceiling emit 1 W/m².
  void write_cube(double floor = 0.5, double ceiling = 0.5, double wall = 0.5) const;

 private:
  std::filesystem::path folder_;
};

/// Area-weighted mean radiosity of a material in band 0, W/m².
double mean_radiosity(const SolvedMesh& solved, const std::string& material);

/// One line "radiosity: error: …" on stderr and this exit status.
void expect_one_error(const Outcome& run, int status, const std::string& part);

}  // namespace radiosity::testing
