// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/program.hpp"
#include "support/sanitized.hpp"

namespace radiosity::testing {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

class Solve : public ProgramTest {
 protected:
  SolvedMesh solved(const std::string& file = "out.vtp") const { return read_solution(folder() / file); }
  json report() const { return json::parse(read("out.json")); }
};

// R10 on the 8 × 8 grid with constant elements and exact factors, evaluated by two other routes. F is held in
// single precision (6e-8 a factor), so six digits are left after the reflections.
TEST_F(Solve, GivesTheExactMeansOfTheUnitCube) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.125", "--method",
                              "analytic", "--tolerance", "1e-9"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  const SolvedMesh mesh = solved();
  EXPECT_EQ(mesh.mesh.patch_count(), 6 * 64);
  EXPECT_NEAR(mean_radiosity(mesh, "floor"), 0.1713732235, 2e-6);
  EXPECT_NEAR(mean_radiosity(mesh, "ceiling"), 1.1038446817, 2e-6);
  EXPECT_NEAR(mean_radiosity(mesh, "wall"), 0.1811955237, 2e-6);
}

// R10 with other reflectances, in the limit of small patches. At 8 × 8 the first cube is off by 1.6e-4 (floor),
// 5.2e-4 (ceiling) and 9e-5 (wall); reflectances of the same size leave errors of the same size.
TEST_F(Solve, GivesTheMeansOfTheUnitCubeWithOtherReflectances) {
  write_cube(0.2, 0.7, 0.5);
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.125"}).status, 0);
  const SolvedMesh mesh = solved();
  EXPECT_NEAR(mean_radiosity(mesh, "floor"), 0.06680166, 3e-4);
  EXPECT_NEAR(mean_radiosity(mesh, "ceiling"), 1.1272218, 1e-3);
  EXPECT_NEAR(mean_radiosity(mesh, "wall"), 0.1695674, 3e-4);
}

// B is proportional to E, so a lamp at a quarter gives a quarter of everything, from the same F.
TEST_F(Solve, SolvesEverySetUpOfTheLampsIntoAFileOfItsOwn) {
  write_cube();
  write("cube.toml", read("cube.toml") + "[setup.dim]\nceiling = 0.25\n");
  const Outcome result =
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.25", "--report", "out.json"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(files().contains("out-dim.vtp"));
  const SolvedMesh whole = solved(), dim = solved("out-dim.vtp");
  EXPECT_LT((whole.patch_radiosity / 4 - dim.patch_radiosity).abs().maxCoeff(), 1e-12);
  EXPECT_LT((whole.mesh.emission() / 4 - dim.mesh.emission()).abs().maxCoeff(), 1e-15);
  EXPECT_NEAR(report()["setups"]["dim"]["energy"]["emitted_w"][0], 0.25, 1e-12);
  EXPECT_NEAR(report()["energy"]["emitted_w"][0], 1, 1e-12);
  EXPECT_EQ(report()["scene"]["bands"], 1);
}

TEST_F(Solve, TakesTheExtensionOfTheResultInAnyCase) {
  write_cube();
  for (const char* result : {"a.VTP", "b.pvtp", "c.PVTP"})
    EXPECT_EQ(run({"solve", "cube.toml", "-o", result}).status, 0) << result;
  expect_one_error(run({"solve", "cube.toml", "-o", "d.csv"}), 1, "the extension must be .vtp or .pvtp");
}

TEST_F(Solve, RefusesToRelaxASolverThatCannotBeforeAnyWork) {
  write_cube();
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--relaxation", "1.2", "--quiet"}), 1,
                   "gauss-seidel");
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--relaxation", "2.5", "--quiet"}), 2,
                   "between 0 and 2");
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--ambient", "--quiet"}), 1, "shooting");
}

// R1: B = E / (1 − ρ) in a closed room of one material, whatever the method and the solver.
// The inside of a ball of facets without any mesh, closed: B = E / (1 − ρ) = 2 all over, of an area that is less than 4π by at most
// 2 · 0.05.
TEST_F(Solve, GivesTheFurnaceOfACurvedShape) {
  write("ball.toml", R"([materials.wall]
reflectance = 0.5
emission = 1
[shapes.ball]
type = "sphere"
centre = [1, 2, 3]
radius = 1
flip = true
chord_error = 0.05
material = "wall"
)");
  ASSERT_EQ(
      run({"solve", "ball.toml", "-o", "out.vtp", "--patch-size", "none", "--report", "out.json"}).status, 0);
  const SolvedMesh mesh = solved();
  EXPECT_NEAR(mesh.patch_radiosity.minCoeff(), 2, 1e-4);
  EXPECT_NEAR(mesh.patch_radiosity.maxCoeff(), 2, 1e-4);
  const double emitted = report().at("energy").at("emitted_w").at(0);
  EXPECT_LT(emitted, 4 * M_PI);
  EXPECT_GT(emitted, 4 * M_PI * 0.9);
}

TEST_F(Solve, GivesTheFurnaceByEveryMethodAndSolver) {
  write_cube();
  write("cube.toml",
        "mesh = \"cube.obj\"\n[materials.floor]\nreflectance = 0.5\nemission = 1.0\n"
        "[materials.ceiling]\nreflectance = 0.5\nemission = 1.0\n"
        "[materials.wall]\nreflectance = 0.5\nemission = 1.0\n");
  for (const char* method : {"analytic", "hemisphere", "hemicube"})
    for (const char* solver : {"gauss-seidel", "jacobi", "progressive", "conjugate-gradient"}) {
      SCOPED_TRACE(std::string(method) + " " + solver);
      const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--method",
                                  method, "--solver", solver, "--tolerance", "1e-7"});
      EXPECT_EQ(result.status, 0) << result.err;
      // Shooting by rows that are not symmetric moves energy between patches by the reciprocity error.
      EXPECT_NEAR(mean_radiosity(solved(), "wall"), 2, std::string(solver) == "progressive" ? 0.1 : 1e-5);
    }
}

TEST_F(Solve, SolvesReflectanceOneWhereEnergyCanEscape) {
  write("open.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "usemtl a\nf 1 2 3 4\nusemtl b\nf 5 8 7 6\n");
  write("open.toml",
        "mesh = \"open.obj\"\n[materials.a]\nreflectance = 1.0\nemission = 1.0\n"
        "[materials.b]\nreflectance = 1.0\n");
  ASSERT_EQ(
      run({"solve", "open.toml", "-o", "out.vtp", "--patch-size", "none", "--tolerance", "1e-9"}).status, 0);
  // Two opposed unit squares at distance 1, F = 0.1998248957 (C-11): B1 = 1/(1 − F²), B2 = F·B1.
  constexpr double f = 0.199824895698387;
  EXPECT_NEAR(mean_radiosity(solved(), "a"), 1 / (1 - f * f), 1e-6);
  EXPECT_NEAR(mean_radiosity(solved(), "b"), f / (1 - f * f), 1e-6);
}

TEST_F(Solve, WritesTheStableNamesOfTheReport) {
  write_cube();
  ASSERT_EQ(
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.25", "--report", "out.json"}).status, 0);
  const json r = report();
  EXPECT_EQ(r.at("command"), "radiosity solve cube.toml -o out.vtp --patch-size 0.25 --report out.json");
  EXPECT_FALSE(r.at("version").get<std::string>().empty());
  EXPECT_EQ(r.at("converged"), true);
  EXPECT_EQ(r.at("scene").at("file"), "cube.toml");
  EXPECT_EQ(r.at("scene").at("surfaces"), 6);
  EXPECT_EQ(r.at("scene").at("patches"), 6 * 16);
  EXPECT_EQ(r.at("scene").at("bands"), 1);
  EXPECT_NEAR(r.at("scene").at("area_m2").get<double>(), 6, 1e-12);
  for (const char* name : {"bounds_m", "repairs", "warnings"})
    EXPECT_TRUE(r.at("scene").contains(name)) << name;
  EXPECT_EQ(r.at("modelled").at("bands"), 1);
  EXPECT_EQ(r.at("modelled").at("occlusion"), false);
  // 96 · 95 / 2 pairs: those of one face of 16 patches lie in one plane, all others see each other.
  EXPECT_EQ(r.at("modelled").at("saved"),
            (json{{"visibility_tests", 15 * 16 * 16}, {"pairs_behind", 6 * 16 * 15 / 2}}));
  for (const char* name :
       {"method", "parameters", "storage", "nonzeros", "bytes", "rays", "closure_error_max",
        "closure_error_mean", "reciprocity_error_max", "escaped_mean"})
    EXPECT_TRUE(r.at("form_factors").contains(name)) << name;
  for (const char* name : {"name", "iterations", "residual", "tolerance", "history"})
    EXPECT_TRUE(r.at("solver").contains(name)) << name;
  EXPECT_NEAR(r.at("energy").at("emitted_w").at(0).get<double>(), 1, 1e-12);
  EXPECT_NEAR(r.at("energy").at("absorbed_w").at(0).get<double>(), 1, 1e-5);
  for (const char* name : {"escaped_w", "imbalance"}) EXPECT_TRUE(r.at("energy").contains(name)) << name;
  for (const char* name : {"read", "mesh", "form_factors", "solve", "write", "total"})
    EXPECT_TRUE(r.at("seconds").contains(name)) << name;
  EXPECT_GT(r.at("peak_memory_bytes").get<double>(), 0);
}

TEST_F(Solve, FlagsOverrideTheSceneFile) {
  write_cube();
  write("cube.toml", read("cube.toml") +
                         "[patches]\nsize = 0.5\n[form_factors]\nmethod = \"hemicube\"\n"
                         "resolution = 32\n[solver]\nname = \"jacobi\"\ntolerance = 1e-3\n");
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--report", "out.json"}).status, 0);
  json r = report();
  EXPECT_EQ(r.at("scene").at("patches"), 6 * 4);
  EXPECT_EQ(r.at("form_factors").at("method"), "hemicube");
  EXPECT_EQ(r.at("form_factors").at("parameters").at("resolution"), 32);
  EXPECT_EQ(r.at("solver").at("name"), "jacobi");
  EXPECT_EQ(r.at("solver").at("tolerance"), 1e-3);

  ASSERT_EQ(
      run({"solve", "cube.toml", "-o", "out.vtp", "--report", "out.json", "--patch-size", "0.25", "--method",
           "hemisphere", "--samples", "64", "--solver", "gauss-seidel", "--tolerance", "1e-4"})
          .status,
      0);
  r = report();
  EXPECT_EQ(r.at("scene").at("patches"), 6 * 16);
  EXPECT_EQ(r.at("form_factors").at("method"), "hemisphere");
  EXPECT_EQ(r.at("form_factors").at("parameters").at("samples"), 64);
  EXPECT_EQ(r.at("solver").at("name"), "gauss-seidel");
  EXPECT_EQ(r.at("solver").at("tolerance"), 1e-4);
}

TEST_F(Solve, SaysWhichMethodAutoChoseAndWhy) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"});
  EXPECT_THAT(result.out, HasSubstr("analytic"));
  EXPECT_THAT(result.out, HasSubstr("chosen: "));
}

TEST_F(Solve, KnowsNoTotalErrorWhereTheFacesAreKeptAsTheyAre) {
  write_cube();
  const Outcome result =
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "none", "--report", "out.json"});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("total unknown"), HasSubstr("patches unknown"), Not(HasSubstr("about"))));
  const json error = report().at("error");
  EXPECT_TRUE(error.at("patches").is_null());
  EXPECT_TRUE(error.at("total").is_null());
  EXPECT_EQ(error.at("form_factors"), 0);  // exact in a convex room
  EXPECT_EQ(read("out.vtp").find("radiosity_error"), std::string::npos);
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.25"}).status, 0);
  EXPECT_NE(read("out.vtp").find("radiosity_error"), std::string::npos);
}

TEST_F(Solve, PrintsNothingWhenQuiet) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--quiet"});
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.out + result.err, "");
}

TEST_F(Solve, NamesTheFilesThatItWrote) {
  write_cube();
  const Outcome result =
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--report", "out.json"});
  EXPECT_THAT(result.out, HasSubstr("out.vtp"));
  EXPECT_THAT(result.out, HasSubstr("out.json"));
  EXPECT_THAT(files(), ::testing::ElementsAre("cube.obj", "cube.toml", "out.json", "out.vtp"));
}

TEST_F(Solve, SolvesGreyLightInOneBand) {
  write_cube();
  write("cube.toml",
        "mesh = \"cube.obj\"\n[materials.floor]\nreflectance = [0.5, 0.5, 0.5]\n"
        "[materials.ceiling]\nreflectance = 0.5\nemission = [1.0, 1.0, 1.0]\n"
        "[materials.wall]\nreflectance = 0.5\n");
  const Outcome result =
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--report", "out.json"});
  ASSERT_EQ(result.status, 0);
  EXPECT_EQ(solved().patch_radiosity.cols(), 1);
  const json r = report();
  EXPECT_EQ(r.at("modelled").at("bands"), 1);
  // Two bands of doubles on 24 patches, and two columns an iteration.
  EXPECT_EQ(r.at("modelled").at("saved").at("radiosity_bytes"), 2 * 24 * 8);
  EXPECT_EQ(r.at("modelled").at("saved").at("band_products"), 2 * r.at("solver").at("iterations").get<int>());
  EXPECT_THAT(result.out, HasSubstr("so one was solved"));
}

TEST_F(Solve, KeepsThreeBandsOfColouredLight) {
  write_cube();
  write("cube.toml",
        "mesh = \"cube.obj\"\n[materials.floor]\nreflectance = [0.5, 0.4, 0.5]\n"
        "[materials.ceiling]\nreflectance = 0.5\nemission = [1.0, 1.0, 1.0]\n"
        "[materials.wall]\nreflectance = 0.5\n");
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5"}).status, 0);
  EXPECT_EQ(solved().patch_radiosity.cols(), 3);
}

TEST_F(Solve, WritesWhatWasReachedWhenTheIterationsRunOut) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.25", "--solver",
                              "jacobi", "--max-iterations", "1", "--report", "out.json"});
  EXPECT_EQ(result.status, 3);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("not converged"));
  EXPECT_EQ(report().at("converged"), false);
  EXPECT_EQ(report().at("solver").at("iterations"), 1);
  // One Jacobi step from B = E: B = E + ρFE, and the floor sees the ceiling with F = 0.1998248957 (C-11).
  EXPECT_NEAR(mean_radiosity(solved(), "floor"), 0.5 * 0.199824895698387, 1e-5);
}

TEST_F(Solve, WritesEveryStepOfAGatheringSolver) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--solver", "jacobi",
                 "--report", "out.json", "--series", "steps.pvd"})
                .status,
            0);
  const auto iterations = report().at("solver").at("iterations").get<std::size_t>();
  const std::string pvd = read("steps.pvd");
  std::size_t steps = 0;
  for (std::size_t at = pvd.find("<DataSet"); at != std::string::npos; at = pvd.find("<DataSet", at + 1))
    ++steps;
  EXPECT_EQ(steps, iterations + 1);  // and B = E
  std::size_t vtps = 0;
  for (const std::string& file : files())
    vtps += file.starts_with("steps/") && file.ends_with(".vtp") ? 1U : 0U;
  EXPECT_EQ(vtps, steps);
}

TEST_F(Solve, WritesAScriptThatShowsTheResultInParaView) {
  write_cube();
  // Every character of a name that means something to Python, and a byte that is not UTF-8.
  const std::string name = "a \"b\\ \xff.vtp";
  ASSERT_EQ(run({"solve", "cube.toml", "-o", name, "--patch-size", "0.5", "--paraview", "show.py"}).status,
            0);
  write("parse.py", R"(import ast, os
script = ast.parse(open('show.py').read())
solution = next(s.value for s in script.body
                if isinstance(s, ast.Assign) and getattr(s.targets[0], 'id', '') == 'solution')
assert os.path.isfile(eval(compile(ast.Expression(solution), 'show.py', 'eval')))
)");
  if (std::system("python3 --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is absent";
  EXPECT_EQ(std::system(("cd " + folder().string() + " && python3 parse.py").c_str()), 0);
}

// The name of the second step is taken by a folder, so that the series cannot be written.
TEST_F(Solve, LeavesAnEarlierSeriesWhereAnotherCannotBeWritten) {
  write_cube();
  write("steps.pvd", "earlier");
  std::filesystem::create_directories(folder() / "steps" / "steps_0001.vtp");
  expect_one_error(
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--series", "steps.pvd", "--quiet"}),
      1, "steps_0001.vtp: is a directory");
  EXPECT_EQ(read("steps.pvd"), "earlier");
  EXPECT_FALSE(files().contains("out.vtp"));
}

// The file of the set-up is the last: its name is taken by a folder.
TEST_F(Solve, RemovesOnlyFilesThatWereNotThereBeforeWhereTheLastCannotBeWritten) {
  write_cube();
  write("cube.toml", read("cube.toml") + "[setup.dim]\nceiling = 0.25\n");
  std::filesystem::create_directory(folder() / "out-dim.vtp");
  const std::vector<std::string> solve{"solve", "cube.toml", "-o",        "out.vtp", "--patch-size",
                                       "0.5",   "--series",  "steps.pvd", "--quiet"};
  expect_one_error(run(solve), 1, "out-dim.vtp: is a directory");
  EXPECT_THAT(files(), ::testing::ElementsAre("cube.obj", "cube.toml", "out-dim.vtp"));
  write("out.vtp", "earlier");
  write("steps.pvd", "earlier");
  expect_one_error(run(solve), 1, "out-dim.vtp: is a directory");
  EXPECT_THAT(files(), IsSupersetOf({"out.vtp", "steps.pvd", "steps/steps_0000.vtp"}));
}

TEST_F(Solve, WritesShotsAtPowersOfTwoAndTheLast) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.5", "--solver", "progressive",
                 "--max-iterations", "11", "--report", "out.json", "--series", "steps.pvd"})
                .status,
            3);
  const std::string pvd = read("steps.pvd");
  std::vector<int> times;
  for (std::size_t at = pvd.find("timestep=\""); at != std::string::npos;
       at = pvd.find("timestep=\"", at + 1))
    times.push_back(std::atoi(pvd.c_str() + at + 10));
  EXPECT_THAT(times, ::testing::ElementsAre(0, 1, 2, 4, 8, 11));
}

TEST_F(Solve, GivesTheSameBitsOnOneAndTwoThreads) {
  write_cube(0.3, 0.6, 0.8);
  for (const char* method : {"analytic", "hemisphere", "hemicube"}) {
    for (const char* threads : {"1", "2"})
      ASSERT_EQ(run({"solve", "cube.toml", "-o", std::string("out") + threads + ".vtp", "--patch-size", "0.2",
                     "--method", method, "--threads", threads})
                    .status,
                0);
    const SolvedMesh one = solved("out1.vtp"), two = solved("out2.vtp");
    EXPECT_TRUE((one.patch_radiosity == two.patch_radiosity).all()) << method;
    EXPECT_TRUE((one.vertex_radiosity == two.vertex_radiosity).all()) << method;
  }
}

TEST_F(Solve, LeavesRowsAsTheyAreWithoutClosure) {
  write_cube();
  const std::vector<std::string> arguments = {"solve",        "cube.toml", "-o",           "out.vtp",
                                              "--report",     "out.json",  "--method",     "hemicube",
                                              "--resolution", "8",         "--patch-size", "0.25"};
  ASSERT_EQ(run(arguments).status, 0);
  const double closed = report().at("form_factors").at("reciprocity_error_max");
  std::vector<std::string> open = arguments;
  open.emplace_back("--no-closure");
  const int status = run(open).status;
  EXPECT_TRUE(status == 0 || status == 3);  // conjugate gradients want a symmetric system
  const double left = report().at("form_factors").at("reciprocity_error_max");
  // Eight cells along an edge see 4 × 4 patches a side with errors of some per cent.
  EXPECT_GT(left, 1e-3);
  EXPECT_LT(closed, left / 10);
}

// The cube is cut so finely, and sampled so often, that its form factors take minutes; the signal comes as they
// begin.
TEST_F(Solve, WritesTheEmissionWhenInterruptedDuringFormFactors) {
  write_cube();
  const Outcome result = run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.02", "--method",
                              "hemisphere", "--samples", "65536", "--report", "out.json"},
                             "method ");
  EXPECT_EQ(result.status, 3);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("nothing was exchanged yet"));
  EXPECT_EQ(report().at("converged"), false);
  EXPECT_EQ(mean_radiosity(solved(), "ceiling"), 1);
  EXPECT_EQ(mean_radiosity(solved(), "floor"), 0);
}

// A room whose faces all look outwards: nothing sees anything. Turned over it is closed and balanced.
TEST_F(Solve, TellsThatFrontsLookOutwardsAndHowToTurnThem) {
  write("room.mtl", "newmtl w\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0.5 0.5 0.5\nKe 10 10 10\n");
  write("room.obj", R"(mtllib room.mtl
v 0 0 0
v 4 0 0
v 4 0 3
v 0 0 3
v 0 2.5 0
v 4 2.5 0
v 4 2.5 3
v 0 2.5 3
usemtl w
f 2 3 4 1
f 5 6 2 1
f 6 7 3 2
f 7 8 4 3
f 8 5 1 4
usemtl lamp
f 8 7 6 5
)");
  const std::vector<std::string> solve{"solve",        "room.obj", "-o",       "out.vtp",
                                       "--patch-size", "1",        "--report", "out.json"};
  const Outcome outwards = run(solve);
  EXPECT_EQ(outwards.status, 0) << outwards.err;
  EXPECT_THAT(outwards.out, AllOf(HasSubstr("the fronts look outwards"), HasSubstr("flip = true"),
                                  Not(HasSubstr("see no other")), Not(HasSubstr("reaches no patch"))));
  EXPECT_THAT(run({"inspect", "room.obj"}).out, HasSubstr("flip = true"));

  write("room.toml", "mesh = \"room.obj\"\nflip = true\n");
  std::vector<std::string> flipped = solve;
  flipped[1] = "room.toml";
  const Outcome inwards = run(flipped);
  EXPECT_EQ(inwards.status, 0) << inwards.err;
  EXPECT_THAT(inwards.out, AllOf(Not(HasSubstr("warning")), Not(HasSubstr("reaches no patch"))));
  EXPECT_NEAR(report().at("energy").at("absorbed_w")[0], 120, 1e-3);  // 10 W/m² from 12 m²
}

// The sheet halves the cube, its front to the lamp; what is behind it has no lamp.
TEST_F(Solve, TellsThatLightMeetsBacksAndGivesThemASideWhereAsked) {
  write_cube();
  write("cube.obj",
        read("cube.obj") +
            "v 0.2 0.2 0.5\nv 0.8 0.2 0.5\nv 0.8 0.8 0.5\nv 0.2 0.8 0.5\nusemtl sheet\nf 9 10 11 12\n");
  const std::string scene = read("cube.toml") + "[materials.sheet]\nreflectance = 0.5\n";
  write("cube.toml", scene);
  const std::vector<std::string> solve{"solve",        "cube.toml", "-o",       "out.vtp",
                                       "--patch-size", "0.2",       "--report", "out.json"};
  // By reciprocity the sheet's back of 0.36 m² gets 0.36 of what leaves 6.36 m²: 5.7 %.
  EXPECT_THAT(
      run(solve).out,
      ContainsRegex(
          "5\\.[67] % of what leaves the patches ends on backs, which are black: 'sheet' 5\\.[67] %"));

  write("cube.toml", scene + "sides = \"auto\"\n");
  const Outcome decided = run(solve);
  EXPECT_THAT(decided.out,
              AllOf(HasSubstr("1 open sheet seen from behind, with backs of their own (1 face, 0.36 m²)"),
                    Not(HasSubstr("ends on backs"))));
  EXPECT_EQ(report().at("scene").at("auto_sides").at("sheets"), 1);
  EXPECT_NEAR(report().at("scene").at("area_m2").get<double>(), 6 + 2 * 0.36, 1e-12);
}

// At ρ = 0.999999 Jacobi needs some ten million passes.
TEST_F(Solve, WritesWhatWasReachedWhenInterruptedDuringTheSolve) {
  write_cube(0.999999, 0.999999, 0.999999);
  const Outcome result =
      run({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.1", "--method", "analytic", "--solver",
           "jacobi", "--max-iterations", "2000000000", "--report", "out.json"},
          "reciprocity error");
  EXPECT_EQ(result.status, 3);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(report().at("converged"), false);
  // The signal may come before the first pass is done; then the floor is still dark.
  EXPECT_EQ(mean_radiosity(solved(), "floor") > 0, report().at("solver").at("iterations").get<int>() > 0);
}

TEST_F(Solve, SolvesTheCornellBox) {
  const std::filesystem::path box =
      RADIOSITY_SOURCE_DIR "/../shared/scenes/cornell-box-original/CornellBox-Original.obj";
  if (!std::filesystem::exists(box)) GTEST_SKIP() << box << " is absent";
  const Outcome result =
      run({"solve", box.string(), "-o", "out.vtp", "--patch-size", "0.4", "--report", "out.json"});
  EXPECT_EQ(result.status, 0) << result.err;
  const json r = report();
  EXPECT_EQ(r.at("scene").at("bands"), 3);
  for (std::size_t band = 0; band < 3; ++band)
    EXPECT_NEAR(r.at("energy").at("imbalance").at(band).get<double>(), 0, 1e-4);
  EXPECT_GE(solved().patch_radiosity.minCoeff(), 0);
}

// In a closed cube of ρ = ½ whose ceiling shines the light of elements is that of patches, on more places.
TEST_F(Solve, TellsLightOfElements) {
  write_cube();
  const auto words = [](std::vector<std::string> more) {
    std::vector<std::string> all{"solve",        "cube.toml", "-o",       "out.vtp",
                                 "--patch-size", "0.25",      "--method", "analytic",
                                 "--tolerance",  "1e-9",      "--report", "out.json"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  ASSERT_EQ(run(words({})).status, 0);
  const SolvedMesh patches = solved();
  EXPECT_FALSE(report().contains("elements"));
  EXPECT_TRUE(report().at("error").at("gather").is_null());
  const Outcome result = run(words({"--element-size", "0.125", "--element-samples", "512"}));
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("elements       336, no edge longer than 0.125 m; 512 rays each"));
  const SolvedMesh elements = solved();
  EXPECT_EQ(elements.mesh.patch_count(), 16 + 5 * 64);  // the lamp stays as it is
  const json r = report();
  EXPECT_EQ(r.at("scene").at("patches"), 96);
  EXPECT_EQ(r.at("elements").at("count"), 336);
  EXPECT_EQ(r.at("elements").at("samples"), 512);
  EXPECT_EQ(r.at("elements").at("size_m"), 0.125);
  EXPECT_EQ(r.at("elements").at("noise"), r.at("error").at("gather"));
  EXPECT_GT(r.at("seconds").at("elements"), 0);
  for (const std::string material : {"floor", "wall"})
    EXPECT_NEAR(mean_radiosity(elements, material), mean_radiosity(patches, material),
                0.01 * mean_radiosity(patches, material));
  // A scene file may ask for them, and a flag may take that back.
  write("small.toml", read("cube.toml") + "[elements]\nsize = 0.125\nsamples = 32\n");
  ASSERT_EQ(run({"solve", "small.toml", "-o", "out.vtp", "--patch-size", "0.25", "--quiet"}).status, 0);
  EXPECT_EQ(solved().mesh.patch_count(), 336);
  ASSERT_EQ(run({"solve", "small.toml", "-o", "out.vtp", "--patch-size", "0.25", "--element-size", "none",
                 "--quiet"})
                .status,
            0);
  EXPECT_EQ(solved().mesh.patch_count(), 96);
}

TEST_F(Solve, KeepsToTheMemoryThatItSaysItMayNeed) {
  if (test::kSanitized) GTEST_SKIP() << "sanitizers need memory of their own";
  write_cube();
  const auto peak = [&](const std::vector<std::string>& more) {
    std::vector<std::string> command{"solve", "cube.toml", "-o", "out.vtp", "--report", "out.json"};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome result = run(command);
    EXPECT_EQ(result.status, 0) << result.err;
    return report().at("peak_memory_bytes").get<double>();
  };
  for (const auto& [method, size] :
       {std::pair{"analytic", "0.04"}, std::pair{"hemicube", "0.05"}, std::pair{"hemisphere", "0.02"}}) {
    const double base = peak({"--method", method, "--patch-size", "0.5"});
    const Outcome refused = run({"solve", "cube.toml", "-o", "out.vtp", "--method", method, "--patch-size",
                                 size, "--memory-limit", "0.01"});
    EXPECT_EQ(refused.status, 1);
    const std::string may_need = "may need ";
    const auto at = refused.err.find(may_need);
    ASSERT_NE(at, std::string::npos) << refused.err;
    const double gigabytes = std::stod(refused.err.substr(at + may_need.size()));
    EXPECT_GT(gigabytes, 0.05);
    // With what was said, it works, the error estimate included, and takes no more.
    EXPECT_LT(
        peak({"--method", method, "--patch-size", size, "--memory-limit", std::to_string(1.01 * gigabytes)}),
        base + 1.01e9 * gigabytes)
        << method;
  }
}

TEST_F(Solve, ChoosesElementsWhereLightChanges) {
  write_cube();
  write("auto.toml", read("cube.toml") + "[elements]\nsize = \"auto\"\n");
  const Outcome result =
      run({"solve", "auto.toml", "-o", "out.vtp", "--report", "out.json", "--patch-size", "0.25"});
  ASSERT_EQ(result.status, 0) << result.err;
  const SolvedMesh solution = solved();
  const json r = report();
  EXPECT_EQ(r.at("elements").at("count"), solution.mesh.patch_count());
  // Each of 80 patches in four at least, the 16 of the lamp whole.
  EXPECT_GE(solution.mesh.patch_count(), 80 * 4 + 16);
  EXPECT_LE(r.at("elements").at("size_m").get<double>(), 0.125);
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "flag.vtp", "--patch-size", "0.25", "--element-size", "auto",
                 "--quiet"})
                .status,
            0);
  EXPECT_EQ(solved("flag.vtp").mesh.patch_count(), solution.mesh.patch_count());
}

TEST_F(Solve, RefusesElementsOfNoSize) {
  write_cube();
  for (const std::string size : {"0", "-1", "small", "nan"})
    expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--element-size", size}), 2,
                     "--element-size");
  expect_one_error(
      run({"solve", "cube.toml", "-o", "out.vtp", "--element-size", "0.1", "--element-samples", "0"}), 2,
      "--element-samples");
  for (const auto& [text, rule] : {std::pair{"size = 0", "positive"},
                                   {"size = \"small\"", "\"none\" or \"auto\""},
                                   {"samples = 0", "samples"},
                                   {"sise = 1", "size"}}) {
    write("bad.toml", read("cube.toml") + "[elements]\n" + text + "\n");
    expect_one_error(run({"solve", "bad.toml", "-o", "out.vtp"}), 1, rule);
  }
  expect_one_error(run({"solve", "cube.toml", "-o", "out.vtp", "--element-size", "1e-9", "--quiet"}), 1,
                   "elements");
}

TEST_F(Solve, SolvesTheAtriumOfSponza) {
  const std::filesystem::path atrium = RADIOSITY_SOURCE_DIR "/../shared/scenes/sponza/sponza.obj";
  if (!std::filesystem::exists(atrium)) GTEST_SKIP() << atrium << " is absent";
  write("sponza.toml",
        "mesh = \"" + std::filesystem::canonical(atrium).string() +
            "\"\nunits = \"cm\"\nundefined = \"default\"\n[materials.ceiling]\nemission = 100\n");
  const Outcome result = run({"solve", "sponza.toml", "-o", "out.vtp", "--report", "out.json", "--samples",
                              "64", "--no-error-estimate"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_GE(solved().patch_radiosity.minCoeff(), 0);
  const json r = report();
  for (const double imbalance : r.at("energy").at("imbalance")) EXPECT_NEAR(imbalance, 0, 1e-6);
  // Nothing is said but what is so: the copy has no textures, is open to the sky, and holds 16 pairs of coincident faces.
  const auto known = AnyOf(
      HasSubstr("10 of 10 textures (map_Kd) cannot be read"), HasSubstr("are defined, but no face uses them"),
      HasSubstr("coincide (16 of 'bricks' and 'bricks')"), HasSubstr("the surface is open"),
      HasSubstr("ends on backs, which are black: 'bricks'"), HasSubstr("see no other patch"),
      HasSubstr("the surfaces that emit, of 1 of 1 materials"),
      HasSubstr("what is in such gaps counts as seeing nothing"),
      HasSubstr("see so little that their factors are noise"),
      HasSubstr("patches do not agree on what they exchange"), HasSubstr("taken for opaque"));
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("warning")) {
      EXPECT_THAT(line, known);
    }
}

}  // namespace
}  // namespace radiosity::testing
