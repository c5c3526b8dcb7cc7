// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <fstream>
#include <set>
#include <sstream>

#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const double kSizes[] = {1000, 1, 0.37, 0.11};

/// Each patch of `surface` lies wholly on one side of the line through a and b (in the plane z = const).
void expect_not_crossed(const PatchMesh& mesh, Index surface, const Vec3& a, const Vec3& b) {
  const Vec3 normal = Vec3(0, 0, 1).cross(b - a).normalized();
  const Vec3 along = (b - a).normalized();
  for (Index p = 0; p < mesh.patch_count(); ++p) {
    if (mesh.surface(p) != surface) continue;
    double lowest = 0, highest = 0, least = 1e300, most = -1e300;
    for (const Index v : mesh.corners(p)) {
      const Vec3 x = mesh.vertex(v) - a;
      lowest = std::min(lowest, normal.dot(x));
      highest = std::max(highest, normal.dot(x));
      least = std::min(least, along.dot(x));
      most = std::max(most, along.dot(x));
    }
    const bool beside = most <= 1e-9 || least >= (b - a).norm() - 1e-9;
    EXPECT_TRUE(beside || lowest > -1e-9 || highest < 1e-9) << "patch " << p;
  }
}

/// Every patch of the surface is wholly inside or wholly outside the rectangle.
void expect_in_or_out(const PatchMesh& mesh, Index surface, const Vec3& lower, const Vec3& upper,
                      double inside_area) {
  double area = 0;
  for (Index p = 0; p < mesh.patch_count(); ++p) {
    if (mesh.surface(p) != surface) continue;
    const Vec3 c = mesh.centroid(p);
    if (c.x() < lower.x() || c.x() > upper.x() || c.y() < lower.y() || c.y() > upper.y()) continue;
    area += mesh.area(p);
    for (const Index v : mesh.corners(p)) {
      const Vec3& x = mesh.vertex(v);
      EXPECT_TRUE(x.x() > lower.x() - 1e-9 && x.x() < upper.x() + 1e-9 && x.y() > lower.y() - 1e-9 &&
                  x.y() < upper.y() + 1e-9);
    }
  }
  EXPECT_NEAR(area, inside_area, 1e-9);
}

TEST(Contacts, ABoxOnTheFloorCutsItAlongItsFootprint) {
  for (const bool bottom : {false, true})
    for (const double size : kSizes) {
      const Shape shape = Shape().face(rectangle(0, 0, 4, 3)).box({1, 0.7, 0}, {2.3, 1.9, 1}, false, bottom);
      const Patches patches = make_patches(shape.scene(), PatchSize{size});
      EXPECT_EQ(patches.repairs.cut_faces, 1);
      expect_in_or_out(patches.mesh, 0, {1, 0.7, 0}, {2.3, 1.9, 0}, 1.3 * 1.2);
      EXPECT_NEAR(total_area(patches.mesh), 12 + 2 * (1.3 + 1.2) + 1.56 * (bottom ? 2 : 1), 1e-9);
      if (!bottom) {
        EXPECT_EQ(t_vertices(patches.mesh), 0);
      }
      EXPECT_LE(longest_edge(patches.mesh), size * (1 + 1e-9));
    }
}

// The diagonal is 5.1 m: a gap is narrow up to 1 mm, and only between faces that look at each other.
TEST(Contacts, ABoxCloseOverTheFloorCutsItBelowItsEdges) {
  for (const double gap : {1e-5, 1e-4, 1e-3})
    for (const double tilt : {0.0, 1e-5}) {
      Shape shape = Shape().face(rectangle(0, 0, 4, 3)).box({1, 0.7, gap}, {2.3, 1.9, 1});
      shape = shape.mapped(
          [&](const Vec3& x) { return Vec3(x.x(), x.y(), x.z() > 0 ? x.z() - tilt * (x.x() - 1) : 0); });
      for (const double size : kSizes)
        expect_in_or_out(make_patches(shape.scene(), PatchSize{size}).mesh, 0, {1, 0.7, 0}, {2.3, 1.9, 0},
                         1.3 * 1.2);
      EXPECT_EQ(make_patches(shape.scene(), PatchSize{1}).repairs.cut_faces, 1);
    }
  const Shape wide = Shape().face(rectangle(0, 0, 4, 3)).box({1, 0.7, 1.1e-3}, {2.3, 1.9, 1});
  const Shape same_way = Shape().face(rectangle(0, 0, 4, 3)).face(rectangle(1, 0.7, 2.3, 1.9, 1e-4));
  for (const Shape& shape : {wide, same_way})
    EXPECT_EQ(make_patches(shape.scene(), PatchSize{1}).repairs.cut_faces, 0);
}

TEST(Contacts, ABottomInTheFloorIsReported) {
  const Shape with = Shape().face(rectangle(0, 0, 4, 3)).box({1, 1, 0}, {2, 2, 1});
  EXPECT_THAT(make_patches(with.scene()).warnings,
              Contains(HasSubstr("faces 0 and 5 coincide (1 of 'grey' and 'grey')")));
  const Shape without = Shape().face(rectangle(0, 0, 4, 3)).box({1, 1, 0}, {2, 2, 1}, false, false);
  EXPECT_THAT(make_patches(without.scene()).warnings, Not(Contains(HasSubstr("coincide"))));
}

TEST(Contacts, ABoxThatStandsOnTheFloorIsNotOpen) {
  const Shape room = Shape().box({0, 0, 0}, {4, 3, 3}, true).box({1, 1, 0}, {2, 2, 1}, false, false);
  EXPECT_THAT(make_patches(room.scene()).warnings, testing::IsEmpty());
  EXPECT_THAT(make_patches(room.scene(), KeepFaces{}).warnings, testing::IsEmpty());
}

TEST(Contacts, KeepFacesCutsNothing) {
  const Shape shape = Shape().face(rectangle(0, 0, 4, 3)).box({1, 1, 0}, {2, 2, 1});
  const Patches patches = make_patches(shape.scene(), KeepFaces{});
  EXPECT_EQ(patches.mesh.patch_count(), 7);
  EXPECT_EQ(patches.repairs.cut_faces, 0);
}

TEST(Contacts, NoVertexOfTheFloorIsSharedAcrossItsContactLine) {
  const Shape shape = Shape().face(rectangle(0, 0, 3, 3)).box({1, 1, 0}, {2, 2, 1}, false, false);
  const PatchMesh mesh = make_patches(shape.scene(), PatchSize{0.2}).mesh;
  const auto inside = [&](Index p) {
    return (mesh.centroid(p) - Vec3(1.5, 1.5, 0)).cwiseAbs().maxCoeff() < 0.5;
  };
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    const auto patches = mesh.vertex_patches(v);
    for (const Index p : patches) EXPECT_EQ(inside(p), inside(patches[0]));
  }
}

TEST(Contacts, APartitionFromWallToWallCutsFloorAndWalls) {
  // A room with one sheet at x = 2.1 that touches floor, ceiling and two walls.
  const Shape shape =
      Shape().box({0, 0, 0}, {5, 3, 2}, true).face({{2.1, 0, 0}, {2.1, 3, 0}, {2.1, 3, 2}, {2.1, 0, 2}}, 1);
  for (const double size : kSizes) {
    const Patches patches =
        make_patches(shape.scene({grey("room"), grey("sheet", Sides::both)}), PatchSize{size});
    EXPECT_EQ(patches.repairs.cut_faces, 4);
    EXPECT_EQ(t_vertices(patches.mesh), 0);
    EXPECT_NEAR(total_area(patches.mesh), 2 * (15 + 10 + 6) + 2 * 6, 1e-9);
    expect_not_crossed(patches.mesh, 4, {2.1, 0, 0}, {2.1, 3, 0});
    expect_not_crossed(patches.mesh, 5, {2.1, 0, 2}, {2.1, 3, 2});
    EXPECT_THAT(patches.warnings, testing::IsEmpty());
  }
}

TEST(Contacts, PartitionsThatCrossShareTheirCommonLine) {
  const Shape shape = Shape()
                          .box({0, 0, 0}, {5, 3, 2}, true)
                          .face({{2.1, 0, 0}, {2.1, 3, 0}, {2.1, 3, 2}, {2.1, 0, 2}})
                          .face({{0, 1.3, 0}, {5, 1.7, 0}, {5, 1.7, 2}, {0, 1.3, 2}});
  for (const double size : kSizes) {
    const Patches patches = make_patches(shape.scene(), PatchSize{size});
    EXPECT_EQ(patches.repairs.cut_faces, 8);
    EXPECT_EQ(t_vertices(patches.mesh), 0) << size;
    expect_not_crossed(patches.mesh, 4, {2.1, 0, 0}, {2.1, 3, 0});
    expect_not_crossed(patches.mesh, 4, {0, 1.3, 0}, {5, 1.7, 0});
    EXPECT_NEAR(total_area(patches.mesh), 2 * (15 + 10 + 6) + 6 + 2 * std::sqrt(25.16), 1e-9);
  }
}

TEST(Contacts, ABoxSunkThroughTheFloorCutsAndIsCut) {
  const Shape shape = Shape().face(rectangle(0, 0, 4, 3)).box({1, 0.7, -0.4}, {2.3, 1.9, 1});
  for (const double size : kSizes) {
    const Patches patches = make_patches(shape.scene(), PatchSize{size});
    EXPECT_EQ(patches.repairs.cut_faces, 5);
    EXPECT_EQ(t_vertices(patches.mesh), 0);
    expect_in_or_out(patches.mesh, 0, {1, 0.7, 0}, {2.3, 1.9, 0}, 1.3 * 1.2);
    for (Index p = 0; p < patches.mesh.patch_count(); ++p) {
      double lowest = 0, highest = 0;
      for (const Index v : patches.mesh.corners(p)) {
        lowest = std::min(lowest, patches.mesh.vertex(v).z());
        highest = std::max(highest, patches.mesh.vertex(v).z());
      }
      EXPECT_TRUE(lowest > -1e-12 || highest < 1e-12) << "patch " << p << " passes through the floor";
    }
  }
}

TEST(Contacts, TouchingOnlyAtAnEdgeOrACornerCutsNothing) {
  const Shape edge =
      Shape().face(rectangle(0, 0, 2, 2)).face({{0.5, 0, 0}, {0.5, 0, 1}, {1.5, 0, 1}, {1.5, 0, 0}});
  EXPECT_EQ(make_patches(edge.scene(), PatchSize{1}).repairs.cut_faces, 0);
  const Shape tip = Shape().face(rectangle(0, 0, 2, 2)).face({{1, 1, 0}, {1, 2, 1}, {1, 0, 1}});
  EXPECT_EQ(make_patches(tip.scene(), PatchSize{1}).repairs.cut_faces, 0);
  EXPECT_EQ(make_patches(icosphere(3), PatchSize{1}).repairs.cut_faces, 0);
}

TEST(Contacts, AWallOnTheSeamOfTwoTilesIsACrease) {
  const Shape tiles = Shape().face(rectangle(0, 0, 1, 2)).face(rectangle(1, 0, 2, 2));
  EXPECT_EQ(make_patches(tiles.scene(), PatchSize{10}).mesh.vertex_count(), 6);
  // Longer by 0.5 at each end than the seam, so that no edge is shared.
  const Shape wall = Shape(tiles).face({{1, -0.5, 0}, {1, 2.5, 0}, {1, 2.5, 1}, {1, -0.5, 1}});
  EXPECT_EQ(make_patches(wall.scene(), PatchSize{10}).mesh.vertex_count(), 8 + 4);
}

TEST(Contacts, FourLegsOnATriangulatedFloor) {
  Shape shape = Shape().face({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}}).face({{0, 0, 0}, {4, 4, 0}, {0, 4, 0}});
  for (const double x : {1.0, 2.5})
    for (const double y : {1.1, 2.7}) shape.box({x, y, 0}, {x + 0.1, y + 0.1, 0.7}, false, false);
  shape.box({1.7, 1.6, 0}, {2.2, 2.4, 1}, false, false);  // across the seam of the two triangles
  for (const double size : kSizes) {
    const Patches patches = make_patches(shape.scene(), PatchSize{size});
    EXPECT_EQ(t_vertices(patches.mesh), 0) << size;
    for (const Index floor : {0, 1})
      for (Index p = 0; p < patches.mesh.patch_count(); ++p) {
        if (patches.mesh.surface(p) != floor) continue;
        EXPECT_GT(patches.mesh.area(p), 1e-12);
      }
    EXPECT_NEAR(total_area(patches.mesh), 16 + 4 * (0.4 * 0.7 + 0.01) + 2.6 + 0.4, 1e-9);
  }
}

TEST(Contacts, BoxesSideBySideShareTheirFootprints) {
  // The second box is longer; their sides lie in one another.
  const Shape shape = Shape()
                          .face(rectangle(0, 0, 5, 5))
                          .box({1, 1, 0}, {2, 2, 1}, false, false)
                          .box({2, 0.5, 0}, {3, 3, 2}, false, false);
  for (const double size : kSizes) {
    const Patches patches = make_patches(shape.scene(), PatchSize{size});
    EXPECT_EQ(t_vertices(patches.mesh), 0) << size;
    expect_in_or_out(patches.mesh, 0, {1, 1, 0}, {2, 2, 0}, 1);
    expect_in_or_out(patches.mesh, 0, {2, 0.5, 0}, {3, 3, 0}, 2.5);
    EXPECT_THAT(patches.warnings, Contains(HasSubstr("faces 2 and 6 coincide")));
  }
}

TEST(Contacts, AnHoleInAWallFilledByAWindowStaysClosed) {
  // A keyhole wall with a pane of its own vertices in the hole: common edges only, nothing to cut.
  const Shape shape = Shape().face(wall_round_a_window()).face(rectangle(1, 1, 2, 2));
  const Patches patches = make_patches(shape.scene(), PatchSize{0.3});
  EXPECT_EQ(patches.repairs.cut_faces, 0);
  EXPECT_EQ(t_vertices(patches.mesh), 0);
  EXPECT_NEAR(total_area(patches.mesh), 9, 1e-12);
}

TEST(Contacts, CoincidentFacesAreCountedByTheirMaterials) {
  Shape shape = Shape().face(rectangle(0, 0, 9, 9), 0);
  for (const double x : {1.0, 3.0, 5.0}) shape.face(rectangle(x, 1, x + 1, 2), x < 4 ? 1 : 2);
  EXPECT_THAT(make_patches(shape.scene({grey("oak"), grey("rug"), grey("mat")})).warnings,
              Contains(HasSubstr("faces 0 and 1, faces 0 and 2, faces 0 and 3 coincide (2 of 'oak' and "
                                 "'rug', 1 of 'oak' and 'mat')")));
}

TEST(Contacts, AVertexInTheMiddleOfAnEdgeBecomesAPointOfBothFaces) {
  const Shape tiles =
      Shape().face(rectangle(0, -1, 2, 0)).face(rectangle(0, 0, 0.7, 1)).face(rectangle(0.7, 0, 2, 1));
  for (const double size : kSizes) {
    const Patches patches = make_patches(tiles.scene(), PatchSize{size});
    EXPECT_EQ(patches.repairs.split_edges, 1);
    EXPECT_EQ(patches.repairs.cut_faces, 0);
    EXPECT_EQ(t_vertices(patches.mesh), 0) << size;
    EXPECT_NEAR(total_area(patches.mesh), 4, 1e-12);
  }
  // One smooth surface: the seven corners and the one in the middle are there once.
  EXPECT_EQ(make_patches(tiles.scene(), PatchSize{10}).mesh.vertex_count(), 8);
  EXPECT_EQ(make_patches(tiles.scene(), KeepFaces{}).repairs.split_edges, 0);
}

TEST(Contacts, RoundedVerticesOfOthersLeaveAFaceItsOutlineAndItsPlane) {
  // The corners of the smaller tiles are off the edge by 10⁻⁷ of the scene, along and across the plane.
  const Shape tiles = Shape()
                          .face(rectangle(0, -1, 2, 0))
                          .face({{0, 0, 0}, {0.7, 2e-7, 1e-7}, {0.7, 1, 0}, {0, 1, 0}})
                          .face({{0.7, -1e-7, -2e-7}, {2, 0, 0}, {2, 1, 0}, {0.7, 1, 0}})
                          .box({0.3, -0.7, 2e-7}, {0.6, -0.4, 1}, false, false);
  for (const double size : kSizes) {
    const PatchMesh mesh = make_patches(tiles.scene(), PatchSize{size}).mesh;
    double area = 0;
    for (Index p = 0; p < mesh.patch_count(); ++p) {
      if (mesh.surface(p) != 0) continue;
      area += mesh.area(p);
      for (const Index v : mesh.corners(p)) {
        EXPECT_LT(std::abs(mesh.vertex(v).z()), 1e-8);
      }
    }
    EXPECT_NEAR(area, 2, 1e-8);
  }
}

TEST(Contacts, AVertexInTheMiddleOfASharpEdgeLeavesTheGridOfTheOtherFace) {
  // Nothing is interpolated over the edge, and the points would make triangles of the floor's quads.
  const Shape shape =
      Shape().face(rectangle(0, 0, 2, 1)).face({{0, 0, 0}, {0.7, 0, 0}, {0.7, 0, 1}, {0, 0, 1}});
  const Patches patches = make_patches(shape.scene(), PatchSize{0.5});
  EXPECT_EQ(patches.repairs.split_edges, 0);
  for (Index p = 0; p < patches.mesh.patch_count(); ++p) EXPECT_EQ(patches.mesh.corners(p).size(), 4U);
}

TEST(Contacts, SplitPointsOnOneAnothersEdgesMakeNoCycle) {
  const Shape shape = Shape()
                          .face({{113.076431, 43.9999657, -819.094666},
                                 {112.898613, 43.9999657, -818.335205},
                                 {112.898613, 43.6999626, -818.335205},
                                 {113.076431, 43.6999626, -819.094666}})
                          .face({{92.8806076, 43.9999657, -782.515686},
                                 {89.3754044, 43.9999657, -783.336365},
                                 {89.3754044, 43.6999626, -783.336365},
                                 {92.8806076, 43.6999626, -782.515686}})
                          .face({{94.4809418, 43.9999657, -789.350769},
                                 {94.4809418, 43.6999626, -789.350769},
                                 {92.8805695, 43.6999626, -782.515625},
                                 {92.8805695, 43.9999657, -782.515625}})
                          .face({{117.499771, 43.6999626, -776.751282},
                                 {118.302238, 43.6999626, -780.178589},
                                 {126.120789, 43.6999626, -778.348022},
                                 {125.318321, 43.6999626, -774.920654}})
                          .face({{96.312767, 43.9999657, -781.712036},
                                 {96.312767, 43.6999626, -781.712036},
                                 {91.785202, 43.6999626, -782.772156},
                                 {91.785202, 43.9999657, -782.772156}});
  const Scene scene = shape.scene();
  double area = 0;
  for (Index f = 0; f < scene.face_count(); ++f) area += scene.area_vector(f).norm();
  for (const double size : kSizes) {
    const PatchMesh mesh = make_patches(scene, PatchSize{size}).mesh;
    EXPECT_NEAR(total_area(mesh), area, 1e-6 * area);
    EXPECT_LE(longest_edge(mesh), size * (1 + 1e-6));
  }
}

TEST(Contacts, TheCornellBoxFileIsCutWhereItsBoxesStand) {
  std::ifstream file(RADIOSITY_SOURCE_DIR "/../shared/scenes/cornell-box-original/CornellBox-Original.obj");
  if (!file) GTEST_SKIP() << "the file is not here";
  // All faces of this file use indices relative to the vertices so far.
  std::vector<Vec3> vertices;
  Shape shape;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v") {
      Vec3 x;
      words >> x.x() >> x.y() >> x.z();
      vertices.push_back(x);
    } else if (keyword == "f") {
      std::vector<Vec3> corners;
      for (int relative; words >> relative;)
        corners.push_back(vertices[vertices.size() - static_cast<std::size_t>(-relative)]);
      shape.face(corners);
    }
  }
  ASSERT_GE(shape.faces.size(), 18U);
  const Patches patches = make_patches(shape.scene());
  EXPECT_GT(patches.mesh.patch_count(), 5000 / 1.3);
  EXPECT_LT(patches.mesh.patch_count(), 5000 * 1.3);
  EXPECT_EQ(t_vertices(patches.mesh), 0);
  // Only the floor, face 0, is stood on.
  EXPECT_EQ(patches.repairs.cut_faces, 1);
  // Relative indices of the file make each box's bottom a second copy of one of its sides.
  EXPECT_EQ(patches.repairs.duplicate_faces, 2);
  // The room's front and the lamp.
  EXPECT_THAT(patches.warnings, Contains(HasSubstr("the surface is open: 8 edges")));
}

}  // namespace
}  // namespace radiosity
