// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "app/program.hpp"

namespace radiosity::testing {
namespace {

// Every way to go wrong: one clear line, exit status 1, and nothing left behind.
class BadInput : public ProgramTest {
 protected:
  void expect_refused(const std::vector<std::string>& arguments, const std::string& part) const {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    const auto before = files();
    expect_one_error(run(arguments), 1, part);
    EXPECT_EQ(files(), before);
  }
  void expect_unsolvable(const std::string& scene, const std::string& part) const {
    expect_refused({"solve", scene, "-o", "out.vtp", "--report", "out.json", "--series", "out.pvd"}, part);
  }
};

constexpr const char* kLamp = "newmtl lamp\nKd 0.5 0.5 0.5\nKe 1 1 1\n";

TEST_F(BadInput, MissingFile) {
  expect_unsolvable("nowhere.obj", "nowhere.obj");
  expect_unsolvable("nowhere.toml", "nowhere.toml");
  expect_unsolvable("nowhere.vtp", "nowhere.vtp");
  expect_refused({"factors", "nowhere.ply", "-o", "F.mtx"}, "nowhere.ply");
  expect_refused({"inspect", "nowhere.stl"}, "nowhere.stl");
  expect_refused({"view", "nowhere.vtp", "-o", "a.png"}, "nowhere.vtp");
}

TEST_F(BadInput, MissingMeshOfASceneFile) {
  write("scene.toml", "mesh = \"nowhere.obj\"\n");
  expect_unsolvable("scene.toml", "nowhere.obj");
}

TEST_F(BadInput, UnknownExtension) {
  write("room.xyz", "0 0 0\n");
  expect_unsolvable("room.xyz", "room.xyz");
}

TEST_F(BadInput, FolderAsScene) {
  expect_unsolvable("/", "/");
}

TEST_F(BadInput, FileThatIsNotWhatItsNameSays) {
  write("room.ply", "this is not a mesh\n");
  write("room.vtp", "this is not a mesh\n");
  write("room.glb", "this is not a mesh\n");
  write("room.toml", "this is not a scene\n");
  for (const char* scene : {"room.ply", "room.vtp", "room.glb", "room.toml"}) expect_unsolvable(scene, scene);
}

TEST_F(BadInput, EmptyMesh) {
  write("empty.obj", "");
  write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expect_unsolvable("empty.obj", "empty.obj");
  expect_unsolvable("points.obj", "points.obj");
}

TEST_F(BadInput, MeshWithoutALamp) {
  write("dark.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_unsolvable("dark.obj", "emi");
  expect_refused({"view", "dark.obj", "-o", "a.png"}, "emi");
}

TEST_F(BadInput, CoordinatesThatAreNotFinite) {
  for (const char* value : {"nan", "inf", "-inf", "1e999"}) {
    write("room.mtl", kLamp);
    write("room.obj",
          std::string("mtllib room.mtl\nusemtl lamp\nv 0 0 ") + value + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    expect_unsolvable("room.obj", "room.obj");
  }
}

TEST_F(BadInput, FaceIndexOutOfRange) {
  write("room.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  expect_unsolvable("room.obj", "4");
  write("room.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  expect_unsolvable("room.off", "room.off");
}

TEST_F(BadInput, MaterialOfTheMeshThatTheSceneFileLacks) {
  write_cube();
  write("cube.toml",
        "mesh = \"cube.obj\"\n[materials.floor]\nreflectance = 0.5\nemission = 1.0\n"
        "[materials.ceiling]\nreflectance = 0.5\n");
  expect_unsolvable("cube.toml", "wall");
}

TEST_F(BadInput, MaterialOfTheSceneFileThatTheMeshLacks) {
  write_cube();
  write("cube.toml", read("cube.toml") + "[materials.flor]\nreflectance = 0.5\n");
  expect_unsolvable("cube.toml", "floor");
}

TEST_F(BadInput, ReflectanceOutsideItsRange) {
  write_cube(1.2);
  expect_unsolvable("cube.toml", "1.2");
  write_cube(-0.1);
  expect_unsolvable("cube.toml", "-0.1");
}

TEST_F(BadInput, NegativeEmission) {
  write_cube();
  write("cube.toml",
        "mesh = \"cube.obj\"\n[materials.floor]\nemission = -3.0\n[materials.ceiling]\n"
        "emission = 1.0\n[materials.wall]\nreflectance = 0.5\n");
  expect_unsolvable("cube.toml", "-3");
}

TEST_F(BadInput, UnknownKeysOfASceneFile) {
  write_cube();
  const std::string good = read("cube.toml");
  write("cube.toml", "msh = 1\n" + good);
  expect_unsolvable("cube.toml", "mesh");
  write("cube.toml", good + "reflectence = 0.3\n");
  expect_unsolvable("cube.toml", "reflectance");
  write("cube.toml", good + "[solver]\ntolerence = 1e-3\n");
  expect_unsolvable("cube.toml", "tolerance");
}

TEST_F(BadInput, UnknownNamesInASceneFile) {
  write_cube();
  const std::string good = read("cube.toml");
  write("cube.toml", good + "[form_factors]\nmethod = \"hemisfere\"\n");
  expect_unsolvable("cube.toml", "hemisphere");
  write("cube.toml", good + "[solver]\nname = \"gauss\"\n");
  expect_unsolvable("cube.toml", "gauss-seidel");
}

TEST_F(BadInput, OutputThatCannotBeWritten) {
  write_cube();
  write("file", "");
  const auto refused = [&](const std::string& out) {
    expect_refused({"solve", "cube.toml", "-o", out}, out);
  };
  refused("nowhere/out.vtp");
  refused("file/out.vtp");
  refused("/proc/out.vtp");
  refused("out.ply");
  expect_refused({"solve", "cube.toml", "-o", "out.vtp", "--report", "nowhere/out.json"}, "nowhere/out.json");
  expect_refused({"solve", "cube.toml", "-o", "out.vtp", "--series", "nowhere/out.pvd"}, "nowhere/out.pvd");
  expect_refused({"factors", "cube.toml", "-o", "nowhere/F.mtx"}, "nowhere/F.mtx");
  expect_refused({"view", "cube.toml", "-o", "nowhere/a.png"}, "nowhere/a.png");
}

TEST_F(BadInput, OutputThatIsTheScene) {
  write_cube();
  ASSERT_EQ(run({"solve", "cube.toml", "-o", "room.vtp", "--patch-size", "none"}).status, 0);
  const std::string before = read("room.vtp");
  expect_refused({"solve", "room.vtp", "-o", "room.vtp"}, "room.vtp");
  EXPECT_EQ(read("room.vtp"), before);
}

TEST_F(BadInput, FormFactorsLargerThanTheMemoryLimit) {
  write_cube();  // 6 · 16² patches have F of 9.4 MB
  expect_refused({"solve", "cube.toml", "-o", "out.vtp", "--patch-size", "0.0625", "--memory-limit", "0.001"},
                 "GB");
}

TEST_F(BadInput, NoSolutionWhereNothingAbsorbs) {
  write_cube(1, 1, 1);
  write("cube.toml", read("cube.toml") + "[patches]\nsize = 0.5\n");
  expect_unsolvable("cube.toml", "reflectance");
}

TEST_F(BadInput, CameraFileWithoutACamera) {
  write_cube();
  expect_refused({"view", "cube.toml", "-o", "a.png", "--scene", "cube.toml"}, "[camera]");
}

}  // namespace
}  // namespace radiosity::testing
