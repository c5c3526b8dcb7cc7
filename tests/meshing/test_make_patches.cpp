// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "radiosity/meshing/error.hpp"
#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::HasSubstr;

template <class Act>
std::string message_of(const Act& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(nothing was thrown)";
}

Shape unit_cube() {
  return Shape().box({0, 0, 0}, {1, 1, 1});
}

std::vector<Vec3> regular_polygon(int n, double radius = 1) {
  std::vector<Vec3> corners;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / n;
    corners.push_back(radius * Vec3(std::cos(angle), std::sin(angle), 0));
  }
  return corners;
}

const std::vector<Vec3> kL{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};

std::size_t places(const PatchMesh& mesh) {
  std::set<std::array<double, 3>> found;
  for (const Vec3& x : mesh.vertices()) found.insert({x.x(), x.y(), x.z()});
  return found.size();
}

TEST(MakePatches, CubeOfSixteenths) {
  const Patches patches = make_patches(unit_cube().scene(), PatchSize{1. / 16});
  EXPECT_EQ(patches.mesh.patch_count(), 6 * 16 * 16);
  EXPECT_EQ(patches.patch_size, 1. / 16);
  for (Index p = 0; p < patches.mesh.patch_count(); ++p) {
    EXPECT_EQ(patches.mesh.corners(p).size(), 4U);
    EXPECT_DOUBLE_EQ(patches.mesh.area(p), 1. / 256);
    EXPECT_EQ(patches.mesh.surface(p), p / 256);
  }
  EXPECT_EQ(unmatched_edges(patches.mesh), 0);
  // Euler: V − E + F = 2 with E = 4F/2, by position.
  EXPECT_EQ(places(patches.mesh), 6U * 256 + 2);
  // Creases: 17² vertices of its own for each face.
  EXPECT_EQ(patches.mesh.vertex_count(), 6 * 17 * 17);
  EXPECT_THAT(patches.warnings, testing::IsEmpty());
}

TEST(MakePatches, SizesThatDivideAnEdgeExactlyDoNotGiveOnePieceMore) {
  for (const int n : {3, 7, 10, 49, 1000})
    EXPECT_EQ(make_patches(Shape().face({{0, 0, 0}, {1, 0, 0}, {1, 1. / n, 0}, {0, 1. / n, 0}}).scene(),
                           PatchSize{1. / n})
                  .mesh.patch_count(),
              n);
}

TEST(MakePatches, CountsDoNotChangeWithPlaceAndScale) {
  const Shape shape = Shape(unit_cube())
                          .append(Shape().face(kL).face(wall_round_a_window()).mapped([](const Vec3& x) {
                            return Vec3(x + Vec3(5, 0, 0));
                          }))
                          .box({0.25, 0.25, 1}, {0.5, 0.5, 1.5});
  const Index expected = make_patches(shape.scene(), PatchSize{0.1}).mesh.patch_count();
  const auto count = [&](const Vec3& shift, double scale) {
    const auto moved = shape.mapped([&](const Vec3& x) { return Vec3(scale * x + shift); });
    return make_patches(moved.scene(), PatchSize{0.1 * scale}).mesh.patch_count();
  };
  EXPECT_EQ(count(Vec3(1e7, -1e7, 1e7), 1), expected);
  EXPECT_EQ(count(Vec3::Zero(), 1e6), expected);
  EXPECT_EQ(count(Vec3::Zero(), 1e-6), expected);
  EXPECT_EQ(count(Vec3::Zero(), 0x1p-40), expected);
}

TEST(MakePatches, QuadAndTriangleShareThePointsOfTheirEdge) {
  // A prism: rectangles and equilateral triangles.
  const double h = std::sqrt(0.75);
  const Vec3 a(0, 0, 0), b(1, 0, 0), c(0.5, h, 0), up(0, 0, 2);
  const Shape shape = Shape()
                          .face({a, c, b})
                          .face({a + up, b + up, c + up})
                          .face({a, b, b + up, a + up})
                          .face({b, c, c + up, b + up})
                          .face({c, a, a + up, c + up});
  for (const double size : {0.5, 0.3, 0.07}) {
    const Patches patches = make_patches(shape.scene(), PatchSize{size});
    EXPECT_EQ(unmatched_edges(patches.mesh), 0) << size;
    EXPECT_NEAR(total_area(patches.mesh), 6 + h, 1e-12);
    const auto n = static_cast<Index>(std::ceil(1 / size)), m = static_cast<Index>(std::ceil(2 / size));
    EXPECT_EQ(patches.mesh.patch_count(), 2 * n * n + 3 * n * m);
  }
}

TEST(MakePatches, OppositeEdgesOfAChainOfQuadsAgree) {
  // The third quad is twice as wide at its far end; the count wanders back through all three.
  const Shape shape = Shape()
                          .face(rectangle(0, 0, 1, 1))
                          .face(rectangle(1, 0, 2, 1))
                          .face({{2, 0, 0}, {3, 0, 0}, {3, 2, 0}, {2, 1, 0}});
  const Patches patches = make_patches(shape.scene(), PatchSize{0.25});
  // Along the chain 8 pieces; across 4, 4 and ⌈√2 / 0.25⌉ = 6.
  EXPECT_EQ(patches.mesh.patch_count(), 8 * (4 + 4 + 6));
  EXPECT_EQ(t_vertices(patches.mesh), 0);
}

TEST(MakePatches, NonConvexAndKeyholePolygonsAreCoveredExactly) {
  for (const double size : {std::numeric_limits<double>::infinity(), 0.5, 0.11}) {
    const PatchMesh l = make_patches(Shape().face(kL).scene(), PatchSize{size}).mesh;
    EXPECT_NEAR(total_area(l), 3, 1e-12);
    for (Index p = 0; p < l.patch_count(); ++p) {
      EXPECT_FALSE(l.centroid(p).x() > 1 && l.centroid(p).y() > 1);
      EXPECT_EQ(l.normal(p), Vec3(0, 0, 1));
    }
    const Patches keyhole = make_patches(Shape().face(wall_round_a_window()).scene(), PatchSize{size});
    EXPECT_NEAR(total_area(keyhole.mesh), 8, 1e-12);
    EXPECT_EQ(keyhole.repairs.triangulated_faces, 1);
    for (Index p = 0; p < keyhole.mesh.patch_count(); ++p)
      EXPECT_GT((keyhole.mesh.centroid(p) - Vec3(1.5, 1.5, 0)).cwiseAbs().maxCoeff(), 0.5);
    EXPECT_EQ(t_vertices(keyhole.mesh), 0);
    EXPECT_LE(longest_edge(keyhole.mesh), size * (1 + 1e-9));
    EXPECT_LE(longest_edge(l), size * (1 + 1e-9));
  }
}

TEST(MakePatches, TheBridgeOfAKeyholeIsNoCrease) {
  const PatchMesh mesh = make_patches(Shape().face(wall_round_a_window()).scene(), PatchSize{0.2}).mesh;
  // One ring: every place is one vertex.
  EXPECT_EQ(places(mesh), static_cast<std::size_t>(mesh.vertex_count()));
}

TEST(MakePatches, TrianglesOfAFloorAreWellShaped) {
  for (const int n : {3, 5, 6, 7, 8, 12})
    for (const double size : {0.5, 0.31, 0.2, 0.1, 0.05, 0.03}) {
      const PatchMesh mesh = make_patches(Shape().face(regular_polygon(n)).scene(), PatchSize{size}).mesh;
      EXPECT_GT(smallest_angle_deg(mesh), 20) << n << " corners, size " << size;
      EXPECT_LE(longest_edge(mesh), size * (1 + 1e-9));
      EXPECT_NEAR(total_area(mesh), n / 2. * std::sin(2 * std::numbers::pi / n), 1e-12);
    }
  for (const double size : {0.5, 0.31, 0.2, 0.1, 0.05}) {
    EXPECT_GT(smallest_angle_deg(make_patches(Shape().face(kL).scene(), PatchSize{size}).mesh), 20) << size;
    EXPECT_GT(
        smallest_angle_deg(make_patches(Shape().face(wall_round_a_window()).scene(), PatchSize{size}).mesh),
        20)
        << size;
  }
}

TEST(MakePatches, ANonPlanarQuadIsCutAlongItsShorterDiagonal) {
  // Diagonals: (0,0,0)–(1,1,0.1) of √2.01 and (1,0,0)–(0,1,0) of √2.
  const Shape shape = Shape().face({{0, 0, 0}, {1, 0, 0}, {1, 1, 0.1}, {0, 1, 0}});
  const Patches patches = make_patches(shape.scene(), PatchSize{std::numeric_limits<double>::infinity()});
  ASSERT_EQ(patches.mesh.patch_count(), 2);
  EXPECT_EQ(patches.repairs.non_planar_faces, 1);
  EXPECT_EQ(patches.repairs.triangulated_faces, 1);
  EXPECT_EQ(patches.patch_size, 0);
  // The halves: ½ and ½ |(−1, 0, −0.1) × (0, −1, −0.1)|.
  EXPECT_NEAR(total_area(patches.mesh), 0.5 + 0.5 * std::sqrt(1 + 0.01 + 0.01), 1e-15);
  const Patches fine = make_patches(shape.scene(), PatchSize{0.1});
  EXPECT_NEAR(total_area(fine.mesh), total_area(patches.mesh), 1e-13);
  EXPECT_EQ(t_vertices(fine.mesh), 0);
  EXPECT_THAT(std::vector<Index>({fine.mesh.surface(0), fine.mesh.surface(fine.mesh.patch_count() - 1)}),
              testing::Each(0));
}

TEST(MakePatches, SinglePrecisionCoordinatesStayPlanar) {
  const double x = static_cast<double>(0.1F), y = static_cast<double>(1.7F);
  const Shape shape =
      Shape().face({{0, 0, 0}, {x, y, 0}, {x, y, 3}, {0, 0, static_cast<double>(3.0000001F)}});
  EXPECT_EQ(make_patches(shape.scene(), PatchSize{1}).repairs.non_planar_faces, 0);
}

TEST(MakePatches, KeepFacesKeepsEveryFaceInOrder) {
  const Shape shape =
      Shape(unit_cube())
          .face(wall_round_a_window())
          .append(Shape().face(kL).mapped([](const Vec3& x) { return Vec3(x + Vec3(0, 0, 9)); }))
          .face({{5, 0, 0}, {6, 0, 0}, {6, 1, 0.5}, {5, 1, 0}});
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  ASSERT_EQ(patches.mesh.patch_count(), 9);
  EXPECT_EQ(patches.patch_size, 0);
  for (Index p = 0; p < 9; ++p) {
    EXPECT_EQ(patches.mesh.surface(p), p);
    const auto corners = patches.mesh.corners(p);
    const auto& face = shape.faces[p];
    ASSERT_EQ(corners.size(), face.size());
    for (std::size_t k = 0; k < face.size(); ++k) EXPECT_EQ(patches.mesh.vertex(corners[k]), face[k]);
  }
}

TEST(MakePatches, BackSidesFollowAtTheEnd) {
  const Shape shape =
      Shape().face(rectangle(0, 0, 1, 1), 1).face(rectangle(2, 0, 3, 1), 0).face(rectangle(4, 0, 5, 1), 1);
  const Patches patches = make_patches(shape.scene({grey("one"), grey("two", Sides::both)}), PatchSize{0.5});
  ASSERT_EQ(patches.mesh.patch_count(), 4 * (3 + 2));
  const std::vector<Index> surfaces{0, 1, 2, 0, 2};
  std::set<Index> front, back;
  for (Index p = 0; p < 20; ++p) {
    EXPECT_EQ(patches.mesh.surface(p), surfaces[p / 4]);
    EXPECT_EQ(patches.mesh.normal(p), Vec3(0, 0, p < 12 ? 1 : -1));
    for (const Index v : patches.mesh.corners(p)) (p < 12 ? front : back).insert(v);
  }
  for (Index p = 0; p < 4; ++p) EXPECT_EQ(patches.mesh.centroid(p), patches.mesh.centroid(p + 12));
  for (const Index v : back) EXPECT_FALSE(front.contains(v));
  EXPECT_EQ(back.size(), 18U);  // smooth within each back, too
}

TEST(MakePatches, ASmoothSphereSharesAllVertices) {
  const Scene scene = icosphere(2);
  for (const PatchOptions& options : {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{10})}) {
    const PatchMesh mesh = make_patches(scene, options).mesh;
    EXPECT_EQ(mesh.patch_count(), 320);
    EXPECT_EQ(mesh.vertex_count(), 162);
    for (Index v = 0; v < mesh.vertex_count(); ++v) EXPECT_FALSE(mesh.on_border(v));
  }
  const PatchMesh fine = make_patches(scene, PatchSize{0.1}).mesh;
  EXPECT_EQ(unmatched_edges(fine), 0);
  // Triangles only: E = 3F/2, so V = 2 + F/2.
  EXPECT_EQ(fine.vertex_count(), 2 + fine.patch_count() / 2);
  double area = 0;
  for (Index f = 0; f < scene.face_count(); ++f) area += scene.area_vector(f).norm();
  EXPECT_NEAR(total_area(fine), area, 1e-12);
}

TEST(MakePatches, VerticesEndWhereTheMaterialChanges) {
  const Shape shape = Shape().face(rectangle(0, 0, 1, 1), 0).face(rectangle(1, 0, 2, 1), 1);
  EXPECT_EQ(make_patches(shape.scene({grey("a"), grey("b")}), PatchSize{0.5}).mesh.vertex_count(), 18);
  EXPECT_EQ(
      make_patches(Shape().face(rectangle(0, 0, 1, 1)).face(rectangle(1, 0, 2, 1)).scene(), PatchSize{0.5})
          .mesh.vertex_count(),
      15);
}

TEST(MakePatches, SurfacesSmoothUpToThirtyDegrees) {
  for (const double degrees : {29.0, 31.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Vec3 slope(std::cos(angle), 0, std::sin(angle));
    const Shape shape = Shape()
                            .face(rectangle(0, 0, 1, 1))
                            .face({{1, 0, 0}, Vec3(1, 0, 0) + slope, Vec3(1, 1, 0) + slope, {1, 1, 0}});
    EXPECT_EQ(make_patches(shape.scene(), PatchSize{10}).mesh.vertex_count(), degrees < 30 ? 6 : 8);
  }
}

TEST(MakePatches, AutoComesCloseToItsTarget) {
  const Shape room = Shape()
                         .box({0, 0, 0}, {5.5, 5.5, 5.6}, true)
                         .box({1, 1, 0}, {2.5, 3, 1.65}, false, false)
                         .box({3, 2, 0}, {4.5, 4, 3.3}, false, false);
  for (const Index target : {500, 5000, 40000}) {
    const Patches patches = make_patches(room.scene(), AutoPatches{target});
    EXPECT_GT(patches.mesh.patch_count(), target / 1.3);
    EXPECT_LT(patches.mesh.patch_count(), target * 1.3);
    EXPECT_EQ(make_patches(room.scene(), PatchSize{patches.patch_size}).mesh.patch_count(),
              patches.mesh.patch_count());
  }
}

TEST(MakePatches, AutoCutsNoFacesWhereTheyAreEnough) {
  const Patches patches = make_patches(icosphere(2), AutoPatches{300});
  EXPECT_EQ(patches.mesh.patch_count(), 320);
  EXPECT_NEAR(patches.mesh.cluster_count(), 300, 20);
}

TEST(MakePatches, GivesTheSameBitsEveryTime) {
  const Scene scene = Shape().box({0, 0, 0}, {3, 3, 3}, true).box({1, 1, 0}, {2, 2.3, 1}).face(kL).scene();
  const PatchMesh a = make_patches(scene, PatchSize{0.13}).mesh,
                  b = make_patches(scene, PatchSize{0.13}).mesh;
  EXPECT_EQ(a.vertices(), b.vertices());
  ASSERT_EQ(a.patch_count(), b.patch_count());
  for (Index p = 0; p < a.patch_count(); ++p)
    EXPECT_TRUE(
        std::equal(a.corners(p).begin(), a.corners(p).end(), b.corners(p).begin(), b.corners(p).end()));
}

TEST(MakePatches, RejectsSizesThatCannotBe) {
  const Scene scene = unit_cube().scene();
  for (const double size : {0.0, -1.0, std::nan(""), 1e-6})
    EXPECT_THROW(make_patches(scene, PatchSize{size}), InputError) << size;
  EXPECT_THROW(make_patches(scene, AutoPatches{0}), InputError);
}

TEST(MakePatches, APowerIsWhatThePatchesEmit) {
  Material lamp = grey("lamp");
  lamp.emission = BandValues::Constant(1, 100);
  lamp.emits_power = true;
  const Shape once = Shape().face(rectangle(0, 0, 2, 1));
  const Shape halves =
      Shape().face({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}}).face({{0, 0, 0}, {2, 1, 0}, {0, 1, 0}});
  Shape twice_round = once;
  twice_round.faces[0].insert(twice_round.faces[0].end(), once.faces[0].begin(), once.faces[0].end());
  const Shape twisted = Shape().face({{0, 0, 0}, {2, 0, 0.4}, {2, 1, 0}, {0, 1, 0.4}});
  const Shape bow_tie = Shape().face({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 2, 0}});
  for (const Sides sides : {Sides::front, Sides::both})
    for (const Shape& shape : {once, Shape(once).append(once), Shape(once).append(once.reversed()),
                               Shape(once).append(halves), twice_round, twisted, bow_tie})
      for (const PatchOptions& options :
           {PatchOptions(KeepFaces{}), PatchOptions(PatchSize{5}), PatchOptions(PatchSize{0.3})}) {
        lamp.sides = sides;
        const PatchMesh mesh = make_patches(shape.scene({lamp}), options).mesh;
        EXPECT_FALSE(mesh.materials()[0].emits_power);
        EXPECT_NEAR((mesh.emission().col(0) * mesh.areas()).sum(), 100, 1e-10);
      }
}

TEST(MakePatches, APowerWithoutPatchesIsRefused) {
  Material lamp = grey("lamp");
  lamp.emission = BandValues::Constant(1, 100);
  lamp.emits_power = true;
  const Shape shape = Shape().face(rectangle(0, 0, 2, 1), 0).face({{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, 1);
  EXPECT_THAT(message_of([&] {
                make_patches(shape.scene({grey("floor"), lamp}));
              }),
              HasSubstr("material 'lamp': 100 W have no patch to leave from"));
}

TEST(MakePatches, OneCornerFarAwayNeitherHangsNorFillsTheMemory) {
  Shape room = Shape().box({0, 0, 0}, {4, 2.5, 3}, true).mapped([](const Vec3& x) {
    return x == Vec3(0, 2.5, 3) ? Vec3(0, 2.5, -0x1p31) : x;
  });
  const Patches patches = make_patches(room.scene(), AutoPatches{5000});
  EXPECT_LT(patches.mesh.patch_count(), 10 * 5000);
  const std::string message = message_of([&] { make_patches(room.scene(), PatchSize{100}); });
  EXPECT_THAT(message,
              HasSubstr("with an edge of 2.147e+09 m and a patch size of 100 m it would give about"));
  EXPECT_THAT(message, HasSubstr("at most 4000000 are possible for one face"));
}

TEST(MakePatches, AStripAcrossTheAxesCostsWhatItsAreaAsksFor) {
  // A parallelogram of 4 m · 3 km and the triangle (0, 0), (3000, 3000), (3.5, 4); the square round them has 700 times their
  // area. Equilateral triangles with sides of half the size are 1 / (√3/4 · 0.25²) = 37 on a square metre.
  const Scene scene =
      Shape().face({{0, 0, 0}, {4, 0, 0}, {3004, 3000, 0}, {3000, 3000, 0}, {3.5, 4, 0}}).scene();
  const Patches patches = make_patches(scene, PatchSize{0.5});
  const double area = 4 * 3000. + 3000 * (4 - 3.5) / 2;
  EXPECT_NEAR(patches.mesh.areas().sum(), area, 1e-6 * area);
  EXPECT_LT(patches.mesh.patch_count(), 37 * area);
}

TEST(MakePatches, TrianglesOfAPolygonThatCrossesItselfAreOfItsCorners) {
  std::vector<Vec3> star;
  for (int k = 0; k < 5; ++k)
    star.emplace_back(std::cos(0.8 * std::numbers::pi * k), std::sin(0.8 * std::numbers::pi * k), 0);
  const PatchMesh mesh = make_patches(Shape().face(star).scene(), KeepFaces{}).mesh;
  for (const auto& triangle : mesh.triangles())
    for (const Index v : triangle) EXPECT_LT(v, 5);
}

}  // namespace
}  // namespace radiosity
