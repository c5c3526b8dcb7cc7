// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/visibility.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>
#include <new>
#include <numbers>

#include "cases/scenes.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

/// Bytes that this process has mapped.
rlim_t own_address_space() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

/// A point inside the patch's first triangle, away from its border.
Vec3 point_on(const PatchMesh& mesh, Index patch, std::mt19937_64& random) {
  const auto triangles = mesh.triangles(patch);
  const auto& t = triangles[random() % triangles.size()];
  Vec3 weights(uniform(random) + 0.02, uniform(random) + 0.02, uniform(random) + 0.02);
  weights /= weights.sum();
  return weights[0] * mesh.vertex(t[0]) + weights[1] * mesh.vertex(t[1]) + weights[2] * mesh.vertex(t[2]);
}

/// First hits of `count` cosine-distributed rays from random points of the patch.
std::vector<Index> hits_from(const Visibility& visibility, Index patch, int count, std::mt19937_64& random) {
  const PatchMesh& mesh = visibility.mesh();
  const Vec3 n = mesh.normal(patch), u = n.unitOrthogonal(), v = n.cross(u);
  std::vector<Index> hits;
  while (static_cast<int>(hits.size()) < count) {
    Visibility::Packet packet;
    packet.from = patch;
    packet.count = std::min(16, count - static_cast<int>(hits.size()));
    for (std::size_t k = 0; k < static_cast<std::size_t>(packet.count); ++k) {
      const Vec3 x = visibility.scaled(point_on(mesh, patch, random));
      const double r = std::sqrt(uniform(random)), angle = 2 * pi * uniform(random);
      const Vec3 d = r * std::cos(angle) * u + r * std::sin(angle) * v + std::sqrt(1 - r * r) * n;
      packet.x[k] = static_cast<float>(x.x());
      packet.y[k] = static_cast<float>(x.y());
      packet.z[k] = static_cast<float>(x.z());
      packet.dx[k] = static_cast<float>(d.x());
      packet.dy[k] = static_cast<float>(d.y());
      packet.dz[k] = static_cast<float>(d.z());
    }
    visibility.first_hits(packet);
    for (std::size_t k = 0; k < static_cast<std::size_t>(packet.count); ++k) hits.push_back(packet.hit[k]);
  }
  return hits;
}

TEST(Visibility, KnowsConvexScenesFromOthers) {
  const auto convex = [](const PatchMesh& mesh) { return Visibility(mesh).convex(); };
  EXPECT_TRUE(convex(cube_room(3)));
  EXPECT_TRUE(convex(opposed_squares(1e-3, 2)));
  EXPECT_TRUE(convex(tetrahedron()));
  EXPECT_TRUE(convex(rectangles_sharing_an_edge(1, 1, 1, pi / 3)));
  EXPECT_FALSE(convex(room_with_floating_box(1, 1)));
  EXPECT_FALSE(convex(two_rooms(1)));
  EXPECT_FALSE(convex(opposed_squares_with_screen(1, 0.5)));
}

TEST(Visibility, CastsRaysInCoordinatesOfUnitSize) {
  for (const double size : {1e-6, 1.0, 1e6}) {
    const Eigen::Affine3d to = Eigen::Translation3d(3e6 * size, -2e6 * size, 0) * Eigen::Scaling(size);
    const PatchMesh mesh = transformed(cube_room(2), to);
    const Visibility visibility(mesh);
    const Vec3 low = visibility.scaled(mesh.lower()), high = visibility.scaled(mesh.upper());
    EXPECT_LT(low.cwiseAbs().maxCoeff(), 4);
    EXPECT_LT(high.cwiseAbs().maxCoeff(), 4);
    EXPECT_GT((high - low).norm(), 0.1);
  }
}

TEST(Visibility, FindsFrontsBacksAndNothing) {
  // A square at z = 0 looks up at a square at z = 1 that looks up too, so that its back is seen.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, 1}, x, y, 1, 1).build();
  const Visibility visibility(mesh);
  const auto up = visibility.first_hit({0.4, 0.3, 0.5}, {0, 0, 2});
  EXPECT_EQ(up.patch, 1);
  EXPECT_FALSE(up.front);
  EXPECT_NEAR(up.distance, 0.25, 1e-5);  // in lengths of the direction
  const auto down = visibility.first_hit({0.4, 0.3, 0.5}, {0, 0, -2});
  EXPECT_EQ(down.patch, 0);
  EXPECT_TRUE(down.front);
  EXPECT_EQ(visibility.first_hit({0.4, 0.3, 0.5}, {1, 0, 0}).patch, Visibility::kNothing);

  std::mt19937_64 random(1);
  for (const Index hit : hits_from(visibility, 0, 100, random))
    EXPECT_TRUE(hit == Visibility::kNothing || hit == Visibility::kBack) << hit;
  for (const Index hit : hits_from(visibility, 1, 100, random)) EXPECT_EQ(hit, Visibility::kNothing);
}

TEST(Visibility, LetsNoRayOutThroughTheSeamsOfAClosedRoom) {
  const MeshBuilder ball = MeshBuilder().sphere({5, 1, 2}, 0.3, 2, Facing::inward);
  const Eigen::Affine3d askew =
      Eigen::Translation3d(1e6, -1e6, 1e6) * Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized());
  for (const PatchMesh& mesh : {cube_room(5), ball.build(), two_rooms(1), transformed(cube_room(5), askew)}) {
    const Visibility visibility(mesh);
    std::mt19937_64 random(7);
    int lost = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      for (const Index hit : hits_from(visibility, i, 256, random)) lost += hit < 0;
    EXPECT_EQ(lost, 0);
  }
}

TEST(Visibility, LetsNoRayOutBesideAWallThatLeansOverTheFloor) {
  // A wedge of 20°. Rays start from the floor so near its edge that a few roundings higher is behind the slope.
  const double height = std::tan(20 * pi / 180);
  const std::array<Vec3, 6> x{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 0, height),
                              Vec3(0, 1, 0), Vec3(1, 1, 0), Vec3(1, 1, height)};
  const PatchMesh mesh = MeshBuilder()
                             .polygon({x[0], x[1], x[4], x[3]})
                             .polygon({x[0], x[3], x[5], x[2]})
                             .polygon({x[1], x[2], x[5], x[4]})
                             .polygon({x[0], x[2], x[1]})
                             .polygon({x[3], x[4], x[5]})
                             .build();
  const Visibility visibility(mesh);
  std::mt19937_64 random(17);
  for (int k = 0; k < 500; ++k) {
    Visibility::Packet packet;
    packet.from = 0;
    packet.count = 16;
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const Vec3 start =
          visibility.scaled({1e-6 * (1 + 4 * uniform(random)), 0.1 + 0.8 * uniform(random), 0});
      packet.x[lane] = static_cast<float>(start.x());
      packet.y[lane] = static_cast<float>(start.y());
      packet.z[lane] = static_cast<float>(start.z());
      const double r = std::sqrt(uniform(random)), angle = 2 * pi * uniform(random);
      packet.dx[lane] = static_cast<float>(r * std::cos(angle));
      packet.dy[lane] = static_cast<float>(r * std::sin(angle));
      packet.dz[lane] = static_cast<float>(std::sqrt(1 - r * r));
    }
    visibility.first_hits(packet);
    for (const Index hit : packet.hit) ASSERT_GT(hit, 0);
  }
}

TEST(Visibility, KnowsWhichPatchOfAWallARayMeets) {
  for (const double size : {2.0, 0.5, 0.2}) {
    const PatchMesh mesh = make_patches(two_furnished_rooms(), PatchSize{size}).mesh.with_clusters({});
    const Visibility visibility(mesh);
    std::mt19937_64 random(19);
    int wrong = 0, asked = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      if (visibility.covered(i)) continue;
      const Vec3 x = point_on(mesh, i, random);
      const Visibility::Hit hit = visibility.first_hit(x + 1e-4 * mesh.normal(i), -mesh.normal(i));
      if (!hit.front) continue;  // from within the furniture
      ++asked;
      wrong += hit.patch != i;
    }
    EXPECT_EQ(wrong, 0) << size;
    EXPECT_GT(asked, mesh.patch_count() / 2);
  }
}

TEST(Visibility, SeesTheSideOfATwoSidedFaceThatTheRayComesFrom) {
  const PatchMesh mesh = opposed_squares_with_screen(1, 1);  // 2 looks up, 3 looks down, at the same place
  const Visibility visibility(mesh);
  std::mt19937_64 random(3);
  for (const Index hit : hits_from(visibility, 0, 200, random))
    EXPECT_TRUE(hit == 3 || hit == 1 || hit == Visibility::kNothing) << hit;
  for (const Index hit : hits_from(visibility, 1, 200, random))
    EXPECT_TRUE(hit == 2 || hit == 0 || hit == Visibility::kNothing) << hit;
  for (const Index hit : hits_from(visibility, 2, 200, random))
    EXPECT_TRUE(hit == 1 || hit == Visibility::kNothing) << hit;
  for (const Index hit : hits_from(visibility, 3, 200, random))
    EXPECT_TRUE(hit == 0 || hit == Visibility::kNothing) << hit;
}

TEST(Visibility, PassesRaysThroughWhatLiesInThePlaneTheyStartFrom) {
  // A tile on the floor, face down on it: the floor under the tile sees the ceiling all the same, because what
  // lies in a plane is never in front of it.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const PatchMesh mesh = MeshBuilder()
                             .grid({0, 0, 0}, x, y, 1, 1)
                             .grid({-50, -50, 1}, 100 * y, 100 * x, 1, 1)
                             .grid({0, 0, 0}, y, x, 1, 1)
                             .build();
  const Visibility visibility(mesh);
  std::mt19937_64 random(5);
  int ceiling = 0;
  for (const Index hit : hits_from(visibility, 0, 1000, random)) {
    EXPECT_NE(hit, 2);
    EXPECT_NE(hit, Visibility::kBack);
    ceiling += hit == 1;
  }
  EXPECT_GT(ceiling, 980);  // F = 0.9996 and no less
  EXPECT_TRUE(visibility.visible({0.5, 0.4, 0}, 0, {0.3, 0.2, 1}, 1));
}

TEST(Visibility, IsTheSameFromBothEnds) {
  const PatchMesh mesh = room_with_triangle_soup(1, 8, 11);
  const Visibility visibility(mesh);
  std::mt19937_64 random(13);
  int seen = 0;
  for (int k = 0; k < 4000; ++k) {
    const auto i = static_cast<Index>(random() % static_cast<std::uint64_t>(mesh.patch_count()));
    const auto j = static_cast<Index>(random() % static_cast<std::uint64_t>(mesh.patch_count()));
    const Vec3 x = point_on(mesh, i, random), y = point_on(mesh, j, random);
    const bool forth = visibility.visible(x, i, y, j);
    EXPECT_EQ(forth, visibility.visible(y, j, x, i));
    seen += forth;
  }
  EXPECT_GT(seen, 100);
  EXPECT_LT(seen, 3900);
}

TEST(Visibility, NeedsBothPatchesInFrontOfEachOtherAndNothingBetween) {
  const PatchMesh mesh = opposed_squares_with_screen(1, 0.5);
  const Visibility visibility(mesh);
  EXPECT_TRUE(visibility.visible({0.1, 0.1, 0}, 0, {0.1, 0.1, 1}, 1));
  EXPECT_FALSE(visibility.visible({0.5, 0.5, 0}, 0, {0.5, 0.5, 1}, 1)) << "the screen is between";
  EXPECT_TRUE(visibility.visible({0.5, 0.5, 0}, 0, {0.5, 0.5, 0.5}, 3)) << "the screen's lower side";
  EXPECT_FALSE(visibility.visible({0.5, 0.5, 0}, 0, {0.5, 0.5, 0.5}, 2)) << "the screen's upper side";
  EXPECT_FALSE(visibility.visible({0.1, 0.1, 0}, 0, {0.9, 0.9, 0}, 0)) << "in one plane";
}

TEST(Visibility, SeesThroughADoorAndNotThroughTheWallBesideIt) {
  const PatchMesh mesh = two_rooms(1);
  const Visibility visibility(mesh);
  const auto patch_at = [&](const Vec3& x) {
    Index best = 0;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if ((mesh.centroid(i) - x).norm() < (mesh.centroid(best) - x).norm()) best = i;
    return best;
  };
  const Index left = patch_at({0, 0.5, 0.5}), right = patch_at({2, 0.5, 0.5});
  EXPECT_TRUE(visibility.visible(mesh.centroid(left), left, mesh.centroid(right), right));
  const Index high = patch_at({0, 0.5, 0.9}), far = patch_at({2, 0.5, 0.9});
  EXPECT_FALSE(visibility.visible(mesh.centroid(high), high, mesh.centroid(far), far));
}

// Address spaces of more and more memory, until it is enough; Embree's buffers take 1.6 and 0.5 MB.
TEST(Visibility, SaysThatItIsOutOfMemoryWhereverThatHappens) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers' own memory is not to be limited";
#endif
  const PatchMesh mesh = cube_room(60);  // 43,200 triangles
  constexpr int kDone = 0, kOutOfMemory = 1, kOther = 2;
  int out_of_memory = 0, status = kOutOfMemory;
  for (rlim_t more = 1'000'000; status == kOutOfMemory; more += 1'000'000) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const rlimit limit{own_address_space() + more, RLIM_INFINITY};
      setrlimit(RLIMIT_AS, &limit);
      try {
        const Visibility visibility(mesh);
        _exit(kDone);
      } catch (const std::bad_alloc&) {
        _exit(kOutOfMemory);
      } catch (...) {
        _exit(kOther);
      }
    }
    int ended = 0;
    waitpid(child, &ended, 0);
    ASSERT_TRUE(WIFEXITED(ended)) << more << " bytes, signal " << WTERMSIG(ended);
    status = WEXITSTATUS(ended);
    out_of_memory += status == kOutOfMemory ? 1 : 0;
  }
  EXPECT_EQ(status, kDone);
  EXPECT_GT(out_of_memory, 5);
}

}  // namespace
}  // namespace radiosity::test
