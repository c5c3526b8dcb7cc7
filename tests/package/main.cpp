// SPDX-License-Identifier: GPL-3.0-or-later
// A furnace: a closed cube whose walls all emit E and reflect ρ. Light bounces for ever and thins out as
// 1 + ρ + ρ² + …, so B = E/(1 − ρ) on every patch.
#include <array>
#include <cstdlib>
#include <iostream>

#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solution.hpp"

int main() {
  using namespace radiosity;
  const double reflectance = 0.5, emission = 1.0;

  Scene::Arrays cube;  // 1 m edges, fronts face inwards
  cube.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}};
  cube.materials = {{"wall", BandValues::Constant(1, reflectance), BandValues::Constant(1, emission)}};
  const std::array<std::array<Index, 4>, 6> faces{
      {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
  for (const auto& face : faces) cube.add_face(face, 0);

  const Patches patches = make_patches(Scene(cube), PatchSize{0.25});
  const Visibility visibility(patches.mesh);
  const auto method = find_form_factor_method("analytic").make(visibility, {});
  const FormFactorMatrix form_factors = assemble(*method, visibility);
  const RadiositySystem system(form_factors, patches.mesh);
  const Solution solution = solve(*find_solver("gauss-seidel").make(), system, patches.mesh);
  write_solution("furnace.vtp", patches.mesh, solution, {"0.1.0", "furnace", "analytic", "gauss-seidel"},
                 1.0);

  const double expected = emission / (1 - reflectance);
  const double error = (solution.radiosity - expected).abs().maxCoeff() / expected;
  std::cout << patches.mesh.patch_count() << " patches, B = " << solution.radiosity.mean()
            << " W/m², expected " << expected << ", largest relative error " << error << '\n';
  return error < 1e-5 ? EXIT_SUCCESS : EXIT_FAILURE;
}
