// SPDX-License-Identifier: GPL-3.0-or-later
#include "winding_number.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity::test {
namespace {

Vec3 random_point(double half, std::mt19937_64& random) {
  return half * Vec3(2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1);
}

/// A room of side n with a box of side 0.5 on the middle of every unit square of its floor, where `bottom` with a
/// bottom of its own; `lamp`: one face over them.
PatchMesh room_full_of_boxes(int n, bool bottom, bool lamp = false) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  MeshBuilder builder;
  builder.grid({0, 0, 0}, n * x, n * y, 4 * n, 4 * n);  // floor
  builder.grid({0, 0, 2}, n * y, n * x, 1, 1);
  builder.grid({0, 0, 0}, n * y, 2 * z, 1, 1).grid(Vec3(n, 0, 0), 2 * z, n * y, 1, 1);
  builder.grid({0, 0, 0}, 2 * z, n * x, 1, 1).grid(Vec3(0, n, 0), n * x, 2 * z, 1, 1);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 low(i + 0.25, j + 0.25, 0), u = 0.5 * x, v = 0.5 * y, w = z;
      builder.grid(low + w, u, v, 1, 1);
      builder.grid(low, u, w, 1, 1).grid(low + v, w, u, 1, 1).grid(low, w, v, 1, 1).grid(low + u, v, w, 1, 1);
      if (bottom) builder.grid(low, v, u, 1, 1);
    }
  if (lamp) builder.grid({n / 2.0, n / 2.0, 1.5}, y, x, 1, 1);
  return builder.build();
}

/// Σ Ω / 4π over all triangles, with tan Ω/2 = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|) [VanOosterom1983].
double sum_of_solid_angles(const PatchMesh& mesh, const Vec3& q) {
  double total = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    for (const auto& t : mesh.triangles(i)) {
      const Vec3 a = mesh.vertex(t[0]) - q, b = mesh.vertex(t[1]) - q, c = mesh.vertex(t[2]) - q;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      total -=
          2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
  return total / (4 * std::numbers::pi);
}

constexpr double kError = 5e-3;  // of the tree

TEST(WindingNumber, IsWholeBeforeClosedSurfacesOnly) {
  // 1 in the room, 0 in the box and outside.
  const WindingNumber closed(facets(room_with_floating_box(4, 2)));
  const PatchMesh mesh = room_with_floating_box(4, 2);
  const Vec3 middle = (mesh.lower() + mesh.upper()) / 2;
  EXPECT_NEAR(closed(mesh.lower() + 0.01 * (mesh.upper() - mesh.lower())), 1, kError);
  EXPECT_NEAR(closed(middle), 0, kError);
  EXPECT_NEAR(closed(2 * mesh.upper() - mesh.lower()), 0, kError);
  // Over the middles of two opposed unit squares at distance 1: Ω = 4 atan(¼ / (h √(½ + h²))).
  const WindingNumber open(facets(opposed_squares(1)));
  const auto share = [](double h) {
    return std::atan(0.25 / (h * std::sqrt(0.5 + h * h))) / std::numbers::pi;
  };
  EXPECT_NEAR(open({0.5, 0.5, 0.1}), share(0.1) + share(0.9), kError);
}

TEST(WindingNumber, OfTheTreeIsThatOfTheSum) {
  std::mt19937_64 random(17);
  for (const PatchMesh& mesh :
       {room_full_of_boxes(12, true), room_full_of_boxes(12, false), room_with_triangle_soup(6, 300, 3),
        transformed(room_full_of_boxes(8, true), Eigen::Affine3d(Eigen::Translation3d(1e5, -2e5, 3e5)))}) {
    const WindingNumber winding_number(facets(mesh));
    const Vec3 middle = (mesh.lower() + mesh.upper()) / 2;
    for (int k = 0; k < 300; ++k) {
      const Vec3 anywhere = middle + random_point(mesh.diagonal(), random);
      EXPECT_NEAR(winding_number(anywhere), sum_of_solid_angles(mesh, anywhere), kError);
      const auto i = static_cast<Index>(random() % static_cast<std::uint64_t>(mesh.patch_count()));
      const Vec3 before = mesh.centroid(i) + tolerance::kContact * mesh.diagonal() * mesh.normal(i);
      EXPECT_NEAR(winding_number(before), sum_of_solid_angles(mesh, before), kError);
    }
  }
}

TEST(WindingNumber, TellsTheFloorUnderBoxesFromTheRest) {
  // A lamp of one face that hangs in the room takes a share of the sphere of every place.
  for (const bool lamp : {false, true}) {
    const PatchMesh mesh = room_full_of_boxes(12, true, lamp);
    const Visibility visibility(mesh);
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      const Vec3 c = mesh.centroid(i);
      const auto under = [](double x) { return std::abs(x - std::floor(x) - 0.5) < 0.25; };
      EXPECT_EQ(visibility.covered(i), c.z() == 0 && under(c.x()) && under(c.y())) << c.transpose();
    }
  }
}

TEST(WindingNumber, TellsNothingInAnOpenRoom) {
  PatchMesh mesh = MeshBuilder()
                       .grid({0, 0, 0}, Vec3::UnitX(), Vec3::UnitY(), 1, 1)
                       .grid({0, 0, 0}, Vec3::UnitY(), Vec3::UnitX(), 1, 1)
                       .grid({0, 0, 1}, Vec3::UnitX(), Vec3::UnitZ(), 1, 1)
                       .build();
  const Visibility visibility(mesh);
  for (Index i = 0; i < mesh.patch_count(); ++i) EXPECT_FALSE(visibility.covered(i));
}

}  // namespace
}  // namespace radiosity::test
