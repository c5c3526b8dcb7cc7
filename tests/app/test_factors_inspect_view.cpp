// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "app/program.hpp"

namespace radiosity::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class Factors : public ProgramTest {
 protected:
  // Entries of a Matrix Market file, by (row, column) counted from 1.
  std::map<std::pair<int, int>, double> matrix(const std::string& file) const {
    std::istringstream stream(read(file));
    std::string line;
    while (std::getline(stream, line) && line.starts_with('%')) {
    }
    std::map<std::pair<int, int>, double> entries;
    for (int i = 0, j = 0; stream >> i >> j;) stream >> entries[{i, j}];
    return entries;
  }
  // C-11: opposed unit squares at distance 1, F = 0.1998248957; no material, no lamp.
  void write_squares() const {
    write("squares.obj",
          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "f 1 2 3 4\nf 5 8 7 6\n");
  }
};

TEST_F(Factors, OfTwoOpposedSquares) {
  write_squares();
  const Outcome result =
      run({"factors", "squares.obj", "-o", "F.mtx", "--patch-size", "none", "--report", "out.json"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(read("F.mtx"), ::testing::StartsWith("%%MatrixMarket matrix coordinate real general\n"));
  const auto f = matrix("F.mtx");
  EXPECT_NEAR(f.at({1, 2}), 0.199824895698387, 1e-6);
  EXPECT_NEAR(f.at({2, 1}), 0.199824895698387, 1e-6);
  const json r = json::parse(read("out.json"));
  EXPECT_EQ(r.at("scene").at("patches"), 2);
  EXPECT_NEAR(r.at("form_factors").at("escaped_mean").get<double>(), 1 - 0.199824895698387, 1e-6);
}

TEST_F(Factors, NeedNoDefinitionOfTheMaterialsThatFacesName) {
  write("named.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "usemtl plaster\nf 1 2 3 4\nusemtl steel\nf 5 8 7 6\n");
  ASSERT_EQ(run({"factors", "named.obj", "-o", "F.mtx", "--patch-size", "none"}).status, 0);
  EXPECT_NEAR(matrix("F.mtx").at({1, 2}), 0.199824895698387, 1e-6);
  EXPECT_EQ(run({"inspect", "named.obj"}).status, 0);
  const Outcome solve = run({"solve", "named.obj", "-o", "out.vtp"});
  EXPECT_EQ(solve.status, 1);
  EXPECT_THAT(solve.err, HasSubstr("'plaster'"));
}

TEST_F(Factors, OfPatchesAddUpToThoseOfTheirFaces) {
  write_squares();
  ASSERT_EQ(
      run({"factors", "squares.obj", "-o", "F.mtx", "--patch-size", "0.5", "--method", "analytic"}).status,
      0);
  // F of the faces = Σ_i A_i Σ_j F_ij / A over the four patches i of one and j of the other.
  double sum = 0;
  for (const auto& [place, value] : matrix("F.mtx"))
    if (place.first <= 4 && place.second > 4) sum += 0.25 * value;
  EXPECT_NEAR(sum, 0.199824895698387, 1e-6);
}

TEST_F(Factors, AreLeftUnwrittenWhenInterrupted) {
  write_cube();
  const Outcome result = run({"factors", "cube.toml", "-o", "F.mtx", "--patch-size", "0.02", "--method",
                              "hemisphere", "--samples", "65536"},
                             "method ");
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(files(), ::testing::ElementsAre("cube.obj", "cube.toml"));
}

using Inspect = ProgramTest;

TEST_F(Inspect, TellsWhatIsInTheScene) {
  write_cube(0.25, 0.5, 0.75);
  const Outcome result = run({"inspect", "cube.toml", "--patch-size", "0.25"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  for (const char* fact :
       {"6 faces", "8 vertices", "floor", "ceiling", "wall", "0.25", "0.75", "1 × 1 × 1 m", "96", "estimate",
        "analytic", "hemisphere", "hemicube", "no patch can stand between"})
    EXPECT_THAT(result.out, HasSubstr(fact));
  EXPECT_THAT(files(), ::testing::ElementsAre("cube.obj", "cube.toml"));
}

// 6 · 30² faces, and auto aims at 5,000 patches.
TEST_F(Inspect, KeepsFacesThatAreSomewhatMoreThanAutoAimsAt) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "fine.vtp", "--patch-size", "0.0334", "--method", "hemisphere",
                 "--samples", "64", "--no-error-estimate"})
                .status,
            0);
  EXPECT_THAT(run({"inspect", "fine.vtp", "--samples", "64"}).out, HasSubstr("5400, no edge longer than "));
}

TEST_F(Inspect, NeedsNeitherMaterialsNorALamp) {
  write("dark.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(run({"inspect", "dark.obj"}).status, 0);
}

class ViewCommand : public ProgramTest {
 protected:
  // Width and height as the header of a PNG gives them, big-endian at byte 16.
  static std::pair<unsigned, unsigned> png_size(const std::string& png) {
    const auto number = [&](std::size_t at) {
      unsigned value = 0;
      for (std::size_t k = at; k < at + 4; ++k) value = value << 8 | static_cast<unsigned char>(png.at(k));
      return value;
    };
    return {number(16), number(20)};
  }
};

TEST_F(ViewCommand, MakesAnImageOfASolvedFile) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"}).status, 0);
  const Outcome result = run({"view", "out.vtp", "-o", "a.png", "--width", "40", "--height", "30"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(read("a.png"), ::testing::StartsWith("\x89PNG"));
  EXPECT_EQ(png_size(read("a.png")), std::pair(40U, 30U));
}

TEST_F(ViewCommand, SolvesASceneFirst) {
  write_cube();
  write("cube.toml", read("cube.toml") + "[patches]\nsize = 0.5\n");
  EXPECT_EQ(run({"view", "cube.toml", "-o", "a.png", "--width", "40", "--height", "30"}).status, 0);
  EXPECT_THAT(files(), ::testing::ElementsAre("a.png", "cube.obj", "cube.toml"));
}

TEST_F(ViewCommand, TakesTheCameraOfASceneFileAndOfFlags) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"}).status, 0);
  write("camera.toml", read("cube.toml") +
                           "[camera]\nposition = [0.5, 0.5, 0.5]\ntarget = [0.5, 0.5, 1]\n"
                           "up = [0, 1, 0]\nvertical_fov_deg = 20\n");
  const std::vector<std::string> common = {"view",     "out.vtp", "--width",    "16",
                                           "--height", "16",      "--exposure", "0.5"};
  const auto image = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), common.begin(), common.end());
    arguments.insert(arguments.end(), {"-o", "a.png"});
    EXPECT_EQ(run(arguments).status, 0);
    return read("a.png");
  };
  const std::string up = image({"--scene", "camera.toml"});
  const std::string by_flags = image({"--position", "0.5", "0.5", "0.5", "--target", "0.5", "0.5", "1",
                                      "--up", "0", "1", "0", "--fov-deg", "20"});
  const std::string down = image({"--scene", "camera.toml", "--target", "0.5", "0.5", "0"});
  EXPECT_TRUE(up == by_flags);
  EXPECT_FALSE(up == down);  // the lamp is above, the floor below
}

TEST_F(ViewCommand, ShowsMirrorsOfASolvedFileByRayTracing) {
  write_cube();
  write("mirror.toml",
        read("cube.toml") + "[camera]\nposition = [0.5, 0.5, 0.5]\ntarget = [0.5, 0, 0.5]\nup = [0, 0, 1]\n");
  std::string text = read("mirror.toml");
  const std::string wall = "[materials.wall]\n";
  text.replace(text.find(wall), wall.size(), wall + "specular = 0.5\n");
  write("mirror.toml", text);
  const Outcome solved =
      run({"solve", "mirror.toml", "-o", "out.vtp", "--patch-size", "0.5", "--report", "out.json"});
  EXPECT_THAT(solved.out, HasSubstr("left out       mirrors and glass: 'wall', 67 % of the area"));
  EXPECT_THAT(json::parse(read("out.json")).at("modelled").at("left_out").dump(),
              HasSubstr("mirrors and glass"));
  const auto image = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"view",        "out.vtp", "-o", "a.hdr",    "--scene",
                                       "mirror.toml", "--width", "8",  "--height", "8"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome result = run(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    return read("a.hdr");
  };
  const std::string diffuse = image({}), mirrored = image({"--pipeline", "ray-tracing"});
  EXPECT_FALSE(diffuse == mirrored);
  EXPECT_TRUE(image({"--pipeline", "ray-tracing", "--depth", "1"}) == diffuse);
}

TEST_F(ViewCommand, TracesPathsOfASceneWithoutSolvingIt) {
  write_cube();
  const Outcome result = run({"view", "cube.toml", "-o", "a.exr", "--pipeline", "path-tracing", "--samples",
                              "2", "--width", "16", "--height", "8", "--seed", "7"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("noise"));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("solver")));
  EXPECT_THAT(read("a.exr"), ::testing::StartsWith("v/1\x01"));
  EXPECT_THAT(read("a.exr"), HasSubstr("standard_error.band_0"));
}

TEST_F(ViewCommand, StopsWithWhatThereIs) {
  write_cube();
  const std::vector<std::string> slow{"view",       "cube.toml",    "-o",        "a.png",
                                      "--pipeline", "path-tracing", "--samples", "1000000",
                                      "--width",    "32",           "--height",  "32"};
  const Outcome interrupted = run(slow, "image ");
  EXPECT_EQ(interrupted.status, 3) << interrupted.err;
  EXPECT_THAT(interrupted.out, HasSubstr("stopped"));
  EXPECT_EQ(png_size(read("a.png")), std::pair(32U, 32U));
  std::vector<std::string> limited = slow;
  limited.insert(limited.end(), {"--time-limit", "0.01"});
  EXPECT_EQ(run(limited).status, 3);
  EXPECT_EQ(png_size(read("a.png")), std::pair(32U, 32U));
}

TEST_F(ViewCommand, TakesACameraByItsName) {
  write_cube();
  const std::string at = "position = [0.5, 0.5, 0.5]\nup = [0, 1, 0]\n";
  write("cube.toml", read("cube.toml") + "[camera.above]\n" + at +
                         "target = [0.5, 0.6, 1]\n[camera.below]\n" + at + "target = [0.5, 0.6, 0]\n");
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"}).status, 0);
  const auto image = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"view", "out.vtp", "-o", "a.png", "--scene", "cube.toml", "--width", "8", "--height", "8"});
    EXPECT_EQ(run(more).status, 0);
    return read("a.png");
  };
  const std::string above = image({"--camera", "above"}), below = image({"--camera", "below"});
  EXPECT_FALSE(above == below);
  EXPECT_TRUE(image({}) == above);  // the first by name
  expect_one_error(run({"view", "out.vtp", "-o", "a.png", "--scene", "cube.toml", "--camera", "belw"}), 1,
                   "no [camera.belw]; did you mean 'below'?");
}

TEST_F(ViewCommand, WarnsWhereTheCameraSeesNoFront) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"}).status, 0);
  const Outcome behind = run({"view", "out.vtp", "-o", "a.png", "--width", "8", "--height", "8", "--position",
                              "0.5", "0.5", "-0.1", "--target", "0.5", "0.5", "1"});
  EXPECT_EQ(behind.status, 0);
  EXPECT_THAT(behind.out, HasSubstr("warning        the image is black"));
}

TEST_F(ViewCommand, RefusesACameraInsideOfAWall) {
  write_cube();
  write("cube.toml", "flip = true\n" + read("cube.toml") +
                         "[camera.wall]\nposition = [0.5, 0.5, 0.5]\ntarget = [0.5, 0.6, 1]\n");
  for (const char* pipeline : {"phong", "path-tracing", "radiosity"})
    expect_one_error(run({"view", "cube.toml", "-o", "a.png", "--pipeline", pipeline, "--camera", "wall",
                          "--width", "8", "--height", "8"}),
                     1, "camera 'wall': at 0.5 0.5 0.5 it is inside of a wall or a thing");
}

TEST_F(ViewCommand, ShowsLightsThatASolveLeavesOut) {
  write_cube();
  write("lit.toml",
        read("cube.toml") + "[lights.bulb]\ntype = \"point\"\nposition = [0.5, 0.5, 0.5]\npower = 50\n");
  const Outcome solved = run({"solve", "lit.toml", "-o", "out.vtp", "--patch-size", "0.5"});
  EXPECT_EQ(solved.status, 0);
  EXPECT_THAT(solved.out, HasSubstr("warning        [lights.bulb]: no light is taken"));
  EXPECT_THAT(run({"view", "lit.toml", "-o", "a.png", "--width", "8", "--height", "8"}).out,
              HasSubstr("warning        [lights.bulb]: no light is taken"));
  for (const char* pipeline : {"gouraud", "phong", "priority", "ray-tracing", "path-tracing"}) {
    const auto image = [&](const char* scene) {
      EXPECT_EQ(run({"view", scene, "-o", "a.hdr", "--pipeline", pipeline, "--width", "8", "--height", "8",
                     "--samples", "2"})
                    .status,
                0);
      return read("a.hdr");
    };
    EXPECT_FALSE(image("cube.toml") == image("lit.toml")) << pipeline;
  }
}

TEST_F(ViewCommand, DividesShapesByTheirSizeOnTheScreen) {
  write_cube();
  write(
      "ball.toml",
      read("cube.toml") +
          "[shapes.ball]\ntype = \"sphere\"\ncentre = [0.5, 0.4, 0.5]\nradius = 0.2\nmaterial = \"wall\"\n");
  const auto faces = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"view", "ball.toml", "-o", "a.png", "--pipeline", "phong", "--width", "64",
                               "--height", "64", "--samples", "1"});
    const Outcome result = run(more);
    EXPECT_EQ(result.status, 0) << result.err;
    const auto end = result.out.find(" faces");
    return std::stoi(result.out.substr(result.out.rfind(' ', end - 1) + 1));
  };
  const int as_said = faces({}), coarse = faces({"--tessellation", "20"}),
            fine = faces({"--tessellation", "0.02"});
  EXPECT_EQ(coarse, 6 + 80);
  EXPECT_GT(as_said, coarse);
  EXPECT_GT(fine, as_said);
  expect_one_error(run({"view", "ball.toml", "-o", "a.png", "--tessellation", "1"}), 2,
                   "--tessellation has no effect with --pipeline radiosity");
}

TEST_F(ViewCommand, RefusesWhatWouldHaveNoEffect) {
  write_cube();
  const auto view = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"view", "cube.toml", "-o", "a.png"});
    return run(more);
  };
  expect_one_error(view({"--seed", "1"}), 2, "--seed has no effect with --pipeline radiosity; it belongs to");
  expect_one_error(view({"--pipeline", "path-tracing", "--depth", "3"}), 2, "it belongs to ray-tracing");
  expect_one_error(view({"--attenuation-length", "3"}), 2, "it belongs to gouraud, phong, priority");
  expect_one_error(view({"--pipeline", "ray-traicng"}), 2, "did you mean 'ray-tracing'?");
  expect_one_error(run({"view", "cube.toml", "-o", "a.tif"}), 1, ".png, .exr or .hdr");
}

TEST_F(ViewCommand, ShowsAnArrayInFalseColours) {
  write_cube();
  write("cube.toml", read("cube.toml") +
                         "[camera]\nposition = [0.5, 0.5, 0.5]\ntarget = [0.5, 0.5, 1]\n"
                         "up = [0, 1, 0]\nvertical_fov_deg = 120\n");
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.25"}).status, 0);
  const auto view = [&](const std::string& output, std::vector<std::string> more) {
    more.insert(more.begin(), {"view", "out.vtp", "-o", output, "--scene", "cube.toml", "--width", "60",
                               "--height", "150", "--false-colour"});
    return run(more);
  };
  for (const char* array :
       {"radiosity", "irradiance", "emission", "reflectance", "radiosity_error", "area"}) {
    const Outcome result = view("a.png", {array});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(array));
    const auto [width, height] = png_size(read("a.png"));
    EXPECT_GT(width, 80U);  // a legend beside it
    EXPECT_EQ(height, 150U);
  }
  const Outcome result = view(
      "a.png", {"irradiance", "--scale", "log", "--range", "0.01,0.3", "--isolines", "4", "--band", "0"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("from 0.01 to 0.3 W/m2, logarithmic"));
  EXPECT_THAT(result.out, HasSubstr("% above"));
  EXPECT_EQ(view("a.exr", {"irradiance"}).status, 0);
  EXPECT_EQ(view("a.hdr", {"reflectance"}).status, 0);

  expect_one_error(view("a.png", {"iradiance"}), 1,
                   "no array 'iradiance'; did you mean 'irradiance'? It has");
  expect_one_error(view("a.png", {"emission", "--scale", "log"}), 1, "a logarithm needs values above 0");
  expect_one_error(view("a.png", {"emission", "--scale", "log", "--range", "0,1"}), 1,
                   "a logarithmic scale from 0 to 1: it must begin above 0");
  expect_one_error(view("a.png", {"emission", "--band", "1"}), 1,
                   "has no band '1'; give a number from 0 to 0");
  expect_one_error(view("a.png", {"emission", "--range", "2,1"}), 2, "the second above the first");
  expect_one_error(view("a.png", {"emission", "--isolines", "1,x"}), 2, "'1,x' is neither a whole number");
  expect_one_error(view("a.png", {"emission", "--exposure", "1"}), 2, "no effect with --false-colour");
  expect_one_error(view("a.exr", {"emission", "--range", "0,1"}), 2, "no effect on .exr");
  expect_one_error(run({"view", "out.vtp", "-o", "a.png", "--scale", "log"}), 2, "--false-colour");
  expect_one_error(run({"view", "cube.toml", "-o", "a.png", "--false-colour", "radiosity"}), 1,
                   "--false-colour shows an array of a solved .vtp; radiosity solve cube.toml");
}

TEST_F(ViewCommand, TakesAMeshWithoutRadiosityForAScene) {
  write("mesh.vtp", R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
 <PolyData><Piece NumberOfPoints="3" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="1">
  <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points>
  <Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2</DataArray>
   <DataArray type="Int32" Name="offsets" format="ascii">3</DataArray></Polys>
  <CellData><DataArray type="Float64" Name="emission" format="ascii">1</DataArray></CellData>
 </Piece></PolyData>
</VTKFile>
)");
  const Outcome result = run({"view", "mesh.vtp", "-o", "a.png", "--width", "8", "--height", "8"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("solver"));
}

}  // namespace
}  // namespace radiosity::testing
