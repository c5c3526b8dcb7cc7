// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/surface_parts.hpp"

#include <gmock/gmock.h>

#include "shapes.hpp"

namespace radiosity {
namespace {

using testing::Each;
using testing::ElementsAre;

TEST(SurfaceParts, ABoxIsClosedAndWithoutItsBottomOpen) {
  Shape shape = Shape().box({0, 0, 0}, {1, 1, 1});
  shape.box({2, 0, 0}, {3, 1, 1}, false, false);
  const SurfaceParts parts = surface_parts(shape.scene());
  EXPECT_THAT(parts.part, ElementsAre(0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1));
  EXPECT_THAT(parts.closed, ElementsAre(1, 0));
}

TEST(SurfaceParts, ASheetIsOpenHoweverOftenItIsGivenTheSameWayRound) {
  Shape shape;
  for (int k = 0; k < 2; ++k) shape.face(rectangle(0, 0, 1, 1)).face(rectangle(1, 0, 2, 1));
  const SurfaceParts parts = surface_parts(shape.scene());
  EXPECT_THAT(parts.part, ElementsAre(0, 0, -1, -1));
  EXPECT_THAT(parts.closed, ElementsAre(0));
}

TEST(SurfaceParts, ASheetGivenBothWaysRoundIsClosed) {
  Shape shape = Shape().face(rectangle(0, 0, 1, 1));
  shape.append(shape.reversed());
  const SurfaceParts parts = surface_parts(shape.scene());
  EXPECT_THAT(parts.part, ElementsAre(0, 0));
  EXPECT_THAT(parts.closed, ElementsAre(1));
}

TEST(SurfaceParts, ABoxWhoseLidIsInTwoHalvesIsClosed) {
  Shape shape = Shape().box({0, 0, 0}, {1, 1, 1});
  shape.faces.back() = rectangle(0, 0, 0.5, 1, 1);
  shape.face(rectangle(0.5, 0, 1, 1, 1));
  const SurfaceParts parts = surface_parts(shape.scene());
  EXPECT_THAT(parts.part, Each(0));
  EXPECT_THAT(parts.closed, ElementsAre(1));
}

// Where a partition meets walls, each edge belongs to three faces.
TEST(SurfaceParts, APartitionBetweenTwoRoomsIsAPartOfItsOwn) {
  Shape shape;
  for (const double x : {0.0, 1.0}) {
    Shape room = Shape().box({x, 0, 0}, {x + 1, 1, 1}, true);
    room.faces.erase(room.faces.begin() + (x == 0 ? 1 : 0));  // the side to the other room
    room.materials.pop_back();
    shape.append(room);
  }
  shape.face({{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}});
  const SurfaceParts parts = surface_parts(shape.scene());
  EXPECT_THAT(parts.part, ElementsAre(0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2));
  EXPECT_THAT(parts.closed, Each(0));
}

// Four faces on the common edge of two cubes.
TEST(SurfaceParts, SolidsThatShareAnEdgeStayClosed) {
  Shape shape = Shape().box({0, 0, 0}, {1, 1, 1});
  shape.box({1, 1, 0}, {2, 2, 1});
  EXPECT_THAT(surface_parts(shape.scene()).closed, ElementsAre(1, 1));
}

}  // namespace
}  // namespace radiosity
