// SPDX-License-Identifier: GPL-3.0-or-later
#include "winding_number.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "support/scenes.hpp"

namespace radiosity::test {
namespace {

Vec3 random_point(double half, std::mt19937_64& random) {
  return half * Vec3(2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1);
}

/// A room of side n with a box of side 0.5 on the middle of every unit square of its floor, where `bottom` with a
/// bottom of its own.
PatchMesh room_full_of_boxes(int n, bool bottom) {
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
  return builder.build();
}

TEST(WindingNumber, IsWholeBeforeClosedSurfacesOnly) {
  // 1 in the room, 0 in the box and outside.
  const WindingNumber closed(facets(room_with_floating_box(4, 2)));
  const PatchMesh mesh = room_with_floating_box(4, 2);
  const Vec3 middle = (mesh.lower() + mesh.upper()) / 2;
  EXPECT_NEAR(closed.exact(mesh.lower() + 0.01 * (mesh.upper() - mesh.lower())), 1, 1e-12);
  EXPECT_NEAR(closed.exact(middle), 0, 1e-12);
  EXPECT_NEAR(closed.exact(2 * mesh.upper() - mesh.lower()), 0, 1e-12);
  EXPECT_TRUE(closed.is_whole(middle, closed.approximate(middle)));
  // Before the middle of one of two opposed unit squares at distance 1: Ω / 4π = ½ of the near one, 2/π asin(1/5) … of the far one, never whole.
  const WindingNumber open(facets(opposed_squares(1)));
  const Vec3 x(0.5, 0.5, 0.1);
  EXPECT_FALSE(open.is_whole(x, open.approximate(x)));
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
      EXPECT_NEAR(winding_number.approximate(anywhere), winding_number.exact(anywhere),
                  tolerance::kWindingError);
      const auto i = static_cast<Index>(random() % static_cast<std::uint64_t>(mesh.patch_count()));
      const Vec3 before = mesh.centroid(i) + tolerance::kContact * mesh.diagonal() * mesh.normal(i);
      EXPECT_NEAR(winding_number.approximate(before), winding_number.exact(before), tolerance::kWindingError);
    }
  }
}

TEST(WindingNumber, TellsTheFloorUnderBoxesFromTheRest) {
  const PatchMesh mesh = room_full_of_boxes(12, true);
  const Visibility visibility(mesh);
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const Vec3 c = mesh.centroid(i);
    const auto under = [](double x) { return std::abs(x - std::floor(x) - 0.5) < 0.25; };
    EXPECT_EQ(visibility.covered(i), c.z() == 0 && under(c.x()) && under(c.y())) << c.transpose();
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
