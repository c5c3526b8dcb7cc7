// SPDX-License-Identifier: GPL-3.0-or-later
// Solves the scene file of a cube whose ceiling shines, to 1 %, and holds the floor against its exact mean radiosity.
#include <cmath>
#include <cstdlib>
#include <exception>
#include <iostream>

#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/rendering/tone_map.hpp"
#include "radiosity/simulation/solve_scene.hpp"

int main(int argc, char** argv) try {
  using namespace radiosity;
  if (argc != 2) throw Error("usage: cube cube.toml");
  const LoadedScene loaded = read_scene(argv[1]);
  SolveOptions options;
  options.accuracy = 0.01;
  const SolvedScene solved = solve_scene(loaded.scene, loaded.settings, options, loaded.setups);
  const PatchMesh& mesh = solved.patches.mesh;
  write_solution("cube.vtp", mesh, solved.solution,
                 {"0.1.0", "cube", solved.form_factors.method, solved.solver, solved.converged()},
                 automatic_exposure(mesh, solved.solution.radiosity));

  double power = 0, area = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (mesh.material_of(i).name == "floor") {
      power += mesh.area(i) * solved.solution.radiosity(i, 0);
      area += mesh.area(i);
    }
  const double exact = 0.17121605, error = std::abs(power / area / exact - 1);
  std::cout << mesh.patch_count() << " patches by " << solved.form_factors.method << ": floor "
            << power / area << " W/m², off by " << 100 * error << " %, estimated "
            << 100 * solved.error->known << " %\n";
  return error < 0.01 && solved.accuracy->reached ? EXIT_SUCCESS : EXIT_FAILURE;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return EXIT_FAILURE;
}
