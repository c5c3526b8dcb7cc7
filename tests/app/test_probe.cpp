// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/program.hpp"

namespace radiosity::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Probe : public ProgramTest {
 protected:
  // The lit cube, solved: out.vtp.
  void solve_cube() const {
    write_cube();
    ASSERT_EQ(
        run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.125", "--no-error-estimate"}).status,
        0);
  }
  void expect_refused(const std::string& points, const std::string& part) const {
    write("P.txt", points);
    const auto before = files();
    expect_one_error(run({"probe", "out.vtp", "--points", "P.txt", "-o", "H.csv"}), 1, part);
    EXPECT_EQ(files(), before);
  }
};

// Numbers of a CSV line.
std::vector<double> numbers(const std::string& line) {
  std::vector<double> result;
  std::istringstream fields(line);
  for (std::string field; std::getline(fields, field, ',');) result.push_back(std::stod(field));
  return result;
}

TEST_F(Probe, WritesIrradianceAndStandardErrorOfEverySensor) {
  solve_cube();
  write("P.txt",
        "# floor\n0.5 0.5 0   0 0 5\n\n0.5 0.5 0.4 0 0 1 # table\n  0 0.5 0.5\t1 0 0\r\n0.5 0.5 1 0 0 -1\n");
  const Outcome result =
      run({"probe", "out.vtp", "--points", "P.txt", "-o", "H.csv", "--report", "out.json"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("H.csv"));
  std::istringstream lines(read("H.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x,y,z,nx,ny,nz,irradiance_0,standard_error_0");
  std::vector<std::vector<double>> rows;
  while (std::getline(lines, line)) rows.push_back(numbers(line));
  ASSERT_EQ(rows.size(), 4U);
  // The list has nine digits.
  const auto facts = nlohmann::json::parse(read("out.json"))["probe"];
  EXPECT_EQ(facts["sensors"], 4);
  EXPECT_EQ(facts["samples"], 1152);
  double sum = 0, square = 0;
  for (const auto& row : rows) {
    sum += row[6];
    square += row[7] * row[7];
  }
  EXPECT_NEAR(facts["irradiance_mean"][0], sum / 4, 1e-9);
  EXPECT_NEAR(facts["standard_error_rms"][0], std::sqrt(square / 4), 1e-9);
  const std::vector<double> floor(rows[0].begin(), rows[0].begin() + 6);
  EXPECT_EQ(floor, (std::vector<double>{0.5, 0.5, 0, 0, 0, 1}));
  // Ceiling E = 1, ρ = 0.5. The ceiling's emission alone gives the middle of the floor this [Howell, B-3], and a tenth more by
  // reflection; nearer to the ceiling there is more, and on it only what was reflected, 0.209 in its mean.
  EXPECT_GT(rows[0][6], 1.1 * 0.239456470460774);
  EXPECT_GT(rows[1][6], rows[0][6]);
  EXPECT_GT(rows[3][6], 0.15);
  EXPECT_LT(rows[3][6], 0.25);
  for (const auto& row : rows) {
    ASSERT_EQ(row.size(), 8U);
    EXPECT_GE(row[7], 0);
    EXPECT_LT(row[7], 0.01 * row[6]);
  }
}

TEST_F(Probe, TakesRaysAndSeedAndNoResultDependsOnThreads) {
  solve_cube();
  write("P.txt", "0.3 0.2 0.1 1 2 3\n0.6 0.2 0 0 0 1\n");
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"probe", "out.vtp", "--points", "P.txt", "-o", "H.csv", "--quiet"});
    const Outcome result = run(options);
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.out + result.err, "");
    return read("H.csv");
  };
  const std::string few = with({"--samples", "32", "--seed", "4"});
  EXPECT_EQ(with({"--samples", "32", "--seed", "4", "--threads", "1"}), few);
  EXPECT_NE(with({"--samples", "32", "--seed", "5"}), few);
  EXPECT_NE(with({"--samples", "128", "--seed", "4"}), few);
}

TEST_F(Probe, RefusesLinesThatAreNoSensors) {
  solve_cube();
  const std::string good = "0.5 0.5 0.5 0 0 1\n";
  expect_refused(good + "0.5 0.5 0.5 0 0\n",
                 "P.txt: line 2: '0.5 0.5 0.5 0 0': a sensor is six finite numbers");
  expect_refused(good + "\n# two\n1 2 3 4 5 6 7\n", "P.txt: line 4");
  expect_refused("x y z nx ny nz\n", "P.txt: line 1");
  expect_refused("0.5, 0.5, 0.5, 0, 0, 1\n", "P.txt: line 1");
  expect_refused("0.5 0.5 nan 0 0 1\n", "P.txt: line 1");
  expect_refused("0.5 0.5 1e999 0 0 1\n", "P.txt: line 1");
  expect_refused(good + "0.5 0.5 0.5 0 0 0\n", "P.txt: line 2: '0.5 0.5 0.5 0 0 0': the direction");
  expect_refused("# nothing\n\n", "P.txt: holds no sensor");
}

TEST_F(Probe, RefusesFilesThatAreMissingOrNotSolved) {
  write_cube();
  write("P.txt", "0.5 0.5 0.5 0 0 1\n");
  const auto refused = [&](const std::string& scene, const std::string& points, const std::string& out,
                           const std::string& part) {
    const auto before = files();
    expect_one_error(run({"probe", scene, "--points", points, "-o", out}), 1, part);
    EXPECT_EQ(files(), before);
  };
  refused("nowhere.vtp", "P.txt", "H.csv", "nowhere.vtp: no such file");
  refused("cube.toml", "P.txt", "H.csv", "radiosity solve writes one");
  write("plain.vtp", R"(<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="3" NumberOfPolys="1"><Points>
<DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray></Polys></Piece></PolyData></VTKFile>)");
  refused(
      "plain.vtp", "P.txt", "H.csv",
      "plain.vtp: is not a solved scene, as radiosity solve writes one: it has no cell array 'radiosity'");
  solve_cube();
  refused("out.vtp", "nowhere.txt", "H.csv", "nowhere.txt: no such file");
  refused("out.vtp", "P.txt", "H.txt", "H.txt: the extension must be .csv");
  refused("out.vtp", "P.txt", "nowhere/H.csv", "nowhere");
}

TEST_F(Probe, MeasuresEitherSideOfAMirror) {
  write_cube();
  // Half of it: the x of all corners of the wall x = 1 are those of the mirror.
  write("half.obj",
        "v 0 0 0\nv 0.5 0 0\nv 0.5 1 0\nv 0 1 0\nv 0 0 1\nv 0.5 0 1\nv 0.5 1 1\nv 0 1 1\n"
        "usemtl floor\nf 1 2 3 4\nusemtl ceiling\nf 5 8 7 6\nusemtl wall\nf 1 4 8 5\nf 1 5 6 2\nf 4 3 7 8\n");
  write("half.toml",
        "mesh = \"half.obj\"\n[symmetry]\nplanes = [\"x = 0.5\"]\n[materials.floor]\nreflectance = 0.5\n"
        "[materials.wall]\nreflectance = 0.5\n[materials.ceiling]\nreflectance = 0.5\nemission = 1\n");
  write("P.txt", "0.25 0.5 0.4 0 0 1\n0.75 0.5 0.4 0 0 1\n0.5 0.5 0 0 0 1\n");
  std::vector<std::string> lists;
  for (const std::string scene : {"cube", "half"}) {
    const Outcome solved = run({"solve", scene + ".toml", "-o", scene + ".vtp", "--patch-size", "0.125",
                                "--report", scene + ".json"});
    ASSERT_EQ(solved.status, 0) << solved.err;
    EXPECT_EQ(solved.out.find("mirrored in x = 0.5: 1 image") != std::string::npos, scene == "half");
    ASSERT_EQ(
        run({"probe", scene + ".vtp", "--points", "P.txt", "-o", scene + ".csv", "--samples", "4096"}).status,
        0);
    lists.push_back(read(scene + ".csv"));
  }
  std::istringstream whole(lists[0]), half(lists[1]);
  std::string a, b;
  std::getline(whole, a), std::getline(half, b);
  for (int k = 0; k < 3; ++k) {
    std::getline(whole, a), std::getline(half, b);
    const std::vector<double> of_whole = numbers(a), of_half = numbers(b);
    EXPECT_NEAR(of_half[6], of_whole[6], 5 * std::hypot(of_half[7], of_whole[7]) + 1e-3 * of_whole[6]) << k;
  }
  const auto report = nlohmann::json::parse(read("half.json"));
  EXPECT_EQ(report["modelled"]["symmetry"]["planes"][0], "x = 0.5");
  EXPECT_EQ(report["modelled"]["symmetry"]["images"], 1);
  const auto of_whole = nlohmann::json::parse(read("cube.json"));
  EXPECT_EQ(2 * report["scene"]["patches"].get<int>(), of_whole["scene"]["patches"].get<int>());
  EXPECT_NEAR(2 * report["energy"]["absorbed_w"][0].get<double>(),
              of_whole["energy"]["absorbed_w"][0].get<double>(), 1e-5);
  EXPECT_FALSE(of_whole["modelled"].contains("symmetry"));
  ASSERT_EQ(run({"view", "half.vtp", "-o", "half.png", "--width", "32", "--height", "32"}).status, 0);
}

}  // namespace
}  // namespace radiosity::testing
