// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes as modelling programs write them, with rounded coordinates and things that nearly touch: the light is that of the scene
// that was meant, whatever the method.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/solver/solution.hpp"
#include "support/parameters.hpp"

namespace radiosity::test {
namespace {

/// Area means of B, first band, by material.
Eigen::ArrayXd means(const Scene& scene, const PatchOptions& patches, const FormFactorMethodInfo& method) {
  const MethodSetup setup(make_patches(scene, patches).mesh.with_clusters({}), method);
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  const BandArray b =
      find_solver("conjugate-gradient").make()->solve(RadiositySystem(f, setup.mesh), {}).radiosity;
  Eigen::ArrayXd power = Eigen::ArrayXd::Zero(static_cast<Index>(scene.materials().size())), area = power;
  for (Index i = 0; i < setup.size(); ++i) {
    power[setup.mesh.material(i)] += setup.mesh.area(i) * b(i, 0);
    area[setup.mesh.material(i)] += setup.mesh.area(i);
  }
  return power / area;
}

Scene with_vertices(const Scene& scene, const auto& move) {
  Scene::Arrays arrays;
  arrays.materials = scene.materials();
  for (const Vec3& x : scene.vertices()) arrays.vertices.push_back(move(x));
  for (Index f = 0; f < scene.face_count(); ++f) arrays.add_face(scene.corners(f), scene.material(f));
  return Scene(std::move(arrays));
}

Scene rounded(const Scene& scene, int decimals) {
  const double scale = std::pow(10, decimals);
  return with_vertices(scene, [&](const Vec3& x) { return Vec3((x * scale).array().round() / scale); });
}

Scene turned(const Scene& scene, double angle, const Vec3& axis) {
  return with_vertices(
      scene, [r = Eigen::AngleAxisd(angle, axis.normalized())](const Vec3& x) { return Vec3(r * x); });
}

double largest_change(const Eigen::ArrayXd& b, const Eigen::ArrayXd& exact) {
  return ((b - exact).abs() / exact).maxCoeff();
}

class FilesAsWritten : public testing::TestWithParam<const FormFactorMethodInfo*> {
 protected:
  static bool analytic() { return GetParam()->name == "analytic"; }
};
INSTANTIATE_TEST_SUITE_P(All, FilesAsWritten, testing::ValuesIn(pointers(form_factor_methods())),
                         test_name<FormFactorMethodInfo>);

TEST_P(FilesAsWritten, RoundedCoordinatesOfTurnedScenesGiveTheLightOfTheExactOnes) {
  struct Case {
    const char* name;
    Scene scene;
    PatchSize size;
  };
  const Case cases[] = {{"cube", lit_cube(0.2, 0.7, 0.5), PatchSize{0.3}},
                        {"cube with a box", cube_with_box(), PatchSize{0.35}},
                        {"box on the floor", box_on_floor(), PatchSize{0.5}}};
  std::mt19937_64 random(7);
  for (const auto& [name, scene, size] : cases) {
    const Scene exact = turned(scene, 6 * uniform(random), Vec3::UnitZ());
    const Eigen::ArrayXd meant = means(exact, size, *GetParam());
    EXPECT_LT(largest_change(means(rounded(exact, 6), size, *GetParam()), meant), 1e-3) << name;
    const Scene tilted = turned(exact, 0.7, Vec3(uniform(random), uniform(random), uniform(random)));
    EXPECT_LT(largest_change(means(rounded(tilted, 6), size, *GetParam()), meant), 1e-3)
        << name << ", tilted";
  }
}

TEST_P(FilesAsWritten, AFloorThatIsNotPlaneIsLitAsOneThatNearlyIs) {
  // One corner lifted by up to 3 mm over 4 m turns parts of the floor by less than 10⁻³: B changes by no more.
  const auto lifted = [](double height) {
    return with_vertices(lit_cube(0.2, 0.7, 0.5), [&](const Vec3& x) {
      return Vec3(4 * x.x(), 3 * x.y(), 2.5 * x.z() + (x == Vec3(1, 1, 0) ? height : 0));
    });
  };
  for (const PatchOptions& patches : {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{0.8})}) {
    const Eigen::ArrayXd plane = means(lifted(0), patches, *GetParam());
    for (const double height : {1e-7, 1e-6, 1e-5, 1e-4, 3e-3})
      EXPECT_LT(largest_change(means(lifted(height), patches, *GetParam()), plane), analytic() ? 1e-3 : 5e-3)
          << height;
  }
}

/// A closed or open room of 4 × 3 × 2.5 m, its ceiling the lamp, with a unit cube over the floor: `gap` metres over it at its
/// lower edge, tilted by `tilt` radians.
Scene room_with_cube(double gap, double tilt, bool open) {
  Scene::Arrays arrays;
  arrays.materials = {grey("floor", 0.3, 0), grey("ceiling", 0.7, 10), grey("walls", 0.5, 0),
                      grey("cube", 0.6, 0)};
  for (Index c = 0; c < 8; ++c)
    arrays.vertices.emplace_back(4 * (c & 1), 3 * (c >> 1 & 1), 2.5 * (c >> 2 & 1));
  const Eigen::AngleAxisd turn(0.3, Vec3::UnitZ());
  for (Index c = 0; c < 8; ++c) {
    const Vec3 x = turn * Vec3((c & 1) - 0.5, (c >> 1 & 1) - 0.5, 0);
    arrays.vertices.emplace_back(1.7 + x.x(), 1.5 + x.y(), (c >> 2 & 1) + gap + tilt * (c & 1));
  }
  const std::array<std::array<Index, 4>, 6> faces{
      {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}}};
  for (std::size_t f = 0; f < (open ? 5u : 6u); ++f)
    arrays.add_face(faces[f], static_cast<Index>(std::min<std::size_t>(f, 2)));
  for (const auto& face : faces) {
    std::array<Index, 4> outward{face[3] + 8, face[2] + 8, face[1] + 8, face[0] + 8};
    arrays.add_face(outward, 3);
  }
  return Scene(std::move(arrays));
}

TEST_P(FilesAsWritten, ThinGapsGiveTheLightOfContact) {
  const double diagonal = std::sqrt(16 + 9 + 6.25);
  for (const bool open : {false, true}) {
    const Eigen::ArrayXd contact = means(room_with_cube(0, 0, open), PatchSize{0.8}, *GetParam());
    for (const double gap : {1e-9, 1e-6, 1e-4, -1e-7}) {
      const Eigen::ArrayXd b = means(room_with_cube(gap * diagonal, 0, open), PatchSize{0.8}, *GetParam());
      EXPECT_LT(largest_change(b.head(3), contact.head(3)), 1e-2)
          << (open ? "open, " : "closed, ") << gap << " of the diagonal";
    }
    for (const double tilt : {1e-4}) {
      const Eigen::ArrayXd b = means(room_with_cube(0, tilt, open), PatchSize{0.8}, *GetParam());
      EXPECT_LT(largest_change(b.head(3), contact.head(3)), 1e-2)
          << (open ? "open, " : "closed, ") << "tilted by " << tilt;
    }
  }
}

TEST(Light, IsNeverNegativeHoweverEarlyTheSolverStops) {
  // One of two rooms has no lamp: far from the door B is a small part of what the solver may err by.
  const Scene both = two_furnished_rooms();
  const Scene one = both.with_materials([&] {
    std::vector<Material> materials = both.materials();
    materials[3].emission.setZero();
    materials[2].emission.setConstant(1e-9);
    return materials;
  }());
  const MethodSetup setup(make_patches(one, PatchSize{3}).mesh.with_clusters({}),
                          find_form_factor_method("hemisphere"));
  const FormFactorMatrix f = assemble(*setup.method, setup.visibility).matrix;
  BandArray emission = BandArray::Zero(setup.size(), 1);
  for (Index i = 0; i < setup.size(); ++i)
    if (setup.mesh.material(i) == 3 && setup.mesh.centroid(i).x() < 5) emission(i, 0) = 1e4;
  const BandArray reflectance = BandArray::Constant(setup.size(), 1, 0.1);
  for (const SolverInfo& solver : solvers())
    for (const double tolerance : {0.1, 1e-2, 1e-3, 1e-4}) {
      SolverOptions options;
      options.tolerance = tolerance;
      const SolveResult result = solver.make()->solve(
          RadiositySystem(f, setup.mesh).with_bands(reflectance, emission, 1 - reflectance), options);
      EXPECT_GE(result.radiosity.minCoeff(), 0) << solver.name << ", tolerance " << tolerance;
    }
}

}  // namespace
}  // namespace radiosity::test
