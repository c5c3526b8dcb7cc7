// SPDX-License-Identifier: GPL-3.0-or-later
// The analytic method against closed forms and tabulated values, in convex scenes, where it is exact.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "cases/closed_forms.hpp"
#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

using std::numbers::pi;

Eigen::MatrixXd factors(const PatchMesh& mesh) {
  const MethodSetup setup(mesh, find_form_factor_method("analytic"));
  EXPECT_TRUE(setup.visibility.convex());
  EXPECT_TRUE(setup.method->exact());
  const Eigen::MatrixXd f = setup.raw().f;
  EXPECT_EQ(setup.method->rays(), 0u);
  return f;
}

/// F from patch 0 to patch 1, after a check of reciprocity.
double factor(const PatchMesh& mesh) {
  const Eigen::MatrixXd f = factors(mesh);
  EXPECT_NEAR(mesh.area(0) * f(0, 1), mesh.area(1) * f(1, 0), 1e-12 * mesh.area(0) * f(0, 1));
  return f(0, 1);
}

PatchMesh opposed(double a, double b, double c) {
  const Vec3 x = a * Vec3::UnitX(), y = b * Vec3::UnitY();
  return MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({0, 0, c}, y, x, 1, 1).build();
}

#define EXPECT_RELATIVE(actual, expected, tolerance) \
  EXPECT_NEAR(actual, expected, (tolerance)*std::abs(expected))

TEST(Analytic, GivesOpposedRectangles) {
  EXPECT_RELATIVE(factor(opposed(1, 1, 1)), 0.199824895698387, 1e-7);
  EXPECT_RELATIVE(factor(opposed(1, 1, 0.5)), 0.415253283577147, 1e-7);
  EXPECT_RELATIVE(factor(opposed(1, 1, 2)), 0.0685895888185524, 1e-7);
  EXPECT_RELATIVE(factor(opposed(2, 3, 1)), 0.475576436532953, 1e-7);
  EXPECT_RELATIVE(factor(opposed(1, 4, 0.1)), 0.885262904902343, 1e-6);
  EXPECT_RELATIVE(factor(opposed(10, 10, 1)), 0.826994522397257, 1e-7);
  EXPECT_RELATIVE(factor(opposed(0.01, 0.02, 0.7)), opposed_rectangles(0.01, 0.02, 0.7), 1e-6);
}

TEST(Analytic, FadesWithTheSquareOfALargeDistance) {
  // At distance d ≫ 1 unit squares exchange 1/(πd²) (1 − O(1/d²)).
  for (const double d : {1e3, 1e5})
    EXPECT_RELATIVE(factor(opposed(1, 1, d)), 1 / (pi * d * d), 2 / (d * d) + 1e-6);
}

TEST(Analytic, GivesRectanglesThatShareAnEdge) {
  const auto bent = [](double l, double w, double h, double angle) {
    return factor(rectangles_sharing_an_edge(l, w, h, angle));
  };
  EXPECT_RELATIVE(bent(1, 1, 1, pi / 2), 0.200043776075403, 1e-6);
  EXPECT_RELATIVE(bent(1, 1, 2, pi / 2), 0.232852602795362, 1e-6);
  EXPECT_RELATIVE(bent(1, 0.5, 3, pi / 2), 0.319608956264445, 1e-6);
  EXPECT_RELATIVE(bent(2, 1, 1, pi / 2), 0.240636006176962, 1e-6);
  EXPECT_RELATIVE(bent(1, 1, 1, pi / 3), 0.370905321150051, 1e-6);
  EXPECT_RELATIVE(bent(1, 1, 1, 2 * pi / 3), 0.0866150011182761, 1e-6);
}

TEST(Analytic, GivesRectanglesThatTouchOverPartOfAnEdgeOrAtACorner) {
  // Factor algebra: a floor [0, 2] × [0, 1] and a wall over [0, 2] are two unit squares each, 1 and 2 on the
  // floor and 1', 2' on the wall. F from 1 to 2' is what the whole gives beyond the halves:
  //   2 F(whole) = 2 (F_11' + F_12'),  and a wall over [0, 1] alone takes (F_11' + F_12')/2 from the floor.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const double whole = perpendicular_rectangles(2, 1, 1), half = perpendicular_rectangles(1, 1, 1);
  EXPECT_RELATIVE(factor(MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({1, 0, 0}, z, x, 1, 1).build()),
                  whole - half, 1e-6);
  EXPECT_RELATIVE(factor(MeshBuilder().grid({0, 0, 0}, 2 * x, y, 1, 1).grid({0, 0, 0}, z, x, 1, 1).build()),
                  whole / 2, 1e-6);
}

TEST(Analytic, GivesOffsetSquares) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  EXPECT_RELATIVE(factor(MeshBuilder().grid({0, 0, 0}, x, y, 1, 1).grid({2, 0, 1}, y, x, 1, 1).build()),
                  0.0152754500880168, 1e-6);
}

TEST(Analytic, GivesTrianglesInGeneralPosition) {
  const std::vector<Vec3> low{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const PatchMesh near =
      MeshBuilder().polygon(low).polygon({{0.5, 0.25, 1}, {0.25, 1.5, 1.5}, {1.5, 0.5, 1.25}}).build();
  EXPECT_RELATIVE(factor(near), 0.06708247813394, 1e-6);
  const PatchMesh far =
      MeshBuilder().polygon(low).polygon({{4, 3, 5}, {4.1, 3.3, 4.9}, {4.2, 3.1, 5}}).build();
  EXPECT_RELATIVE(factor(far), 9.654689677e-5, 1e-6);
}

TEST(Analytic, GivesAThirdBetweenFacesOfATetrahedron) {
  Eigen::MatrixXd expected = Eigen::MatrixXd::Constant(4, 4, 1.0 / 3);
  expected.diagonal().setZero();
  EXPECT_LT((factors(tetrahedron()) - expected).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Analytic, ClosesTheRowsOfASubdividedCube) {
  const Eigen::MatrixXd f = factors(cube_room(6));
  EXPECT_LT((f.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-6);
}

TEST(Analytic, AddsUpToTheWholeWhenPatchesAreCut) {
  const PatchMesh whole = rectangles_sharing_an_edge(1, 1, 1, pi / 2);
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const PatchMesh cut = MeshBuilder().grid({0, 0, 0}, x, y, 3, 2).grid({0, 0, 0}, z, x, 4, 5).build();
  const Eigen::MatrixXd f = factors(cut);
  double sum = 0;
  for (Index i = 0; i < 6; ++i) sum += cut.area(i) * f.row(i).segment(6, 20).sum();
  EXPECT_RELATIVE(sum, factor(whole), 1e-6);
}

TEST(Analytic, StaysAccurateAtNarrowGaps) {
  EXPECT_RELATIVE(factor(opposed_squares(0.1)), opposed_rectangles(1, 1, 0.1), 1e-6);
  EXPECT_RELATIVE(factor(opposed_squares(1e-3)), 0.998005631908, 1e-6);
  const double touching = factor(opposed_squares(1e-6));
  EXPECT_GE(touching, 0.99);
  EXPECT_LE(touching, 1);
}

TEST(Analytic, StaysAccurateInThinWedges) {
  // Two equal rectangles, long along the common edge, that open by the angle α: for the infinitely long wedge
  // F = 1 − sin(α/2) (crossed strings); the ends of one of length L take of the order of 1/L more.
  const double angle = 0.02;
  const double f = factor(rectangles_sharing_an_edge(1000, 1, 1, angle));
  EXPECT_NEAR(f, 1 - std::sin(angle / 2), 1e-4);
}

TEST(Analytic, TendsToDisksAndToACylinder) {
  // Regular n-gons inscribed in the circles: the error falls as 1/n², so (4 F_2n − F_n)/3 leaves 1/n⁴ of it,
  // about 20/n⁴ for circles of ordinary proportions.
  const auto ring = [](double r, double z, int n, bool up) {
    std::vector<Vec3> corners;
    for (int k = 0; k < n; ++k) {
      const double angle = (up ? 2 : -2) * pi * k / n;
      corners.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
    return corners;
  };
  const auto disks = [&](int n) {
    return factor(MeshBuilder().polygon(ring(1, 0, n, true)).polygon(ring(0.6, 0.8, n, false)).build());
  };
  EXPECT_NEAR((4 * disks(32) - disks(16)) / 3, coaxial_disks(1, 0.6, 0.8), 20 / std::pow(16, 4));

  const auto cylinder = [&](int n) {
    MeshBuilder side;
    const std::vector<Vec3> base = ring(1, 0, n, true);
    for (std::size_t k = 0; k < base.size(); ++k) {
      const Vec3 &a = base[k], &b = base[(k + 1) % base.size()], up = 1.5 * Vec3::UnitZ();
      side.polygon({b, a, a + up, b + up});
    }
    return factors(side.build()).row(0).sum();
  };
  EXPECT_NEAR((4 * cylinder(32) - cylinder(16)) / 3, cylinder_side_to_itself(1, 1.5), 20 / std::pow(16, 4));
}

TEST(Analytic, TendsToTheAreaRuleInsideASphere) {
  // F_ij = A_j / (4πR²), whatever i. Halving the facets quarters the part of a row that differs (facets of a
  // fixed number of neighbours, each a quarter of the size); a gain of 2.5 is asked for.
  const auto error = [](int subdivisions) {
    const PatchMesh ball = MeshBuilder().sphere({1, 2, 3}, 2, subdivisions, Facing::inward).build();
    const Eigen::MatrixXd f = factors(ball);
    double sum = 0;
    for (Index i = 0; i < ball.patch_count(); ++i)
      for (Index j = 0; j < ball.patch_count(); ++j)
        sum += ball.area(i) * std::abs(f(i, j) - inside_sphere(ball.area(j), 2));
    return sum / ball.areas().sum();
  };
  const double coarse = error(0), medium = error(1), fine = error(2);
  EXPECT_LT(medium, coarse / 2.5);
  EXPECT_LT(fine, medium / 2.5);
}

/// From an element to a disc of radius r in a parallel plane at height h, its axis at distance a [Howell, B-13 of the catalogue]:
///   F = ½ (1 − (a² + h² − r²) / √((a² + h² + r²)² − 4 r² a²))
double element_to_disc(double a, double h, double r) {
  const double sum = a * a + h * h + r * r;
  return (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * r * r * a * a)) / 2;
}

TEST(Analytic, SeesPastARoundScreenOfManyCorners) {
  // Above a small patch at z = 0 a screen of radius r at z = 1, above that 8 × 8 patches of a square of side 8 at z = 2, whose
  // middle it hides: from the origin a disc of twice the radius, displaced by twice the way. At z = 1.5 a second screen
  // of few corners lies in the shadow of the first.
  for (const double r : {0.2, 0.9})
    for (const double a : {0.0, 0.1, 0.95}) {
      constexpr double kSide = 1e-4;
      MeshBuilder builder;
      builder.grid({-kSide / 2, -kSide / 2, 0}, kSide * Vec3::UnitX(), kSide * Vec3::UnitY(), 1, 1);
      for (const auto& [scale, corners] : {std::pair(1.0, 720), std::pair(1.5, 12)}) {
        std::vector<Vec3> ring;
        for (int k = 0; k < corners; ++k)
          ring.emplace_back(
              scale * Vec3(a + r * std::cos(2 * pi * k / corners), -r * std::sin(2 * pi * k / corners), 1));
        builder.polygon(ring);
      }
      builder.grid({-4, -4, 2}, 8 * Vec3::UnitY(), 8 * Vec3::UnitX(), 8, 8);
      const PatchMesh mesh = builder.build();
      const Eigen::MatrixXd f = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f;
      const double to_square = 4 * [] {  // from the corner of a square of side 4 at 2 m
        const double c = 4 / std::sqrt(4 * 4 + 2 * 2);
        return c * std::atan(c) / pi;
      }();
      const double to_screen = element_to_disc(a, 1, r);
      EXPECT_NEAR(f(0, 1), to_screen, 1e-4 * to_screen);
      EXPECT_NEAR(f(0, 2), 0, 1e-4 * to_screen);
      EXPECT_NEAR(f.row(0).tail(64).sum(), to_square - to_screen, 1e-4 * to_square)
          << "r " << r << ", a " << a;
    }
}

TEST(Analytic, SeesPastScreensOfManyCornersThatAreLongOrHaveStraightSides) {
  // As above. What goes from the small patch to the screen is known without occlusion, and the square beyond gets the rest.
  constexpr int kCorners = 400;
  const auto ellipse = [](double t) {
    return Eigen::Vector2d(std::cos(2 * pi * t), -0.1 * std::sin(2 * pi * t));
  };
  const auto rectangle = [](double t) {  // clockwise, 100 corners on each side
    const Eigen::Vector2d corners[] = {{-1, 0.3}, {1, 0.3}, {1, -0.3}, {-1, -0.3}, {-1, 0.3}};
    const auto side = static_cast<std::size_t>(4 * t);
    return Eigen::Vector2d(corners[side] +
                           (4 * t - static_cast<double>(side)) * (corners[side + 1] - corners[side]));
  };
  const double to_square = 4 * [] {
    const double c = 4 / std::sqrt(4 * 4 + 2 * 2);
    return c * std::atan(c) / pi;
  }();
  for (const auto& at :
       {std::function<Eigen::Vector2d(double)>(ellipse), std::function<Eigen::Vector2d(double)>(rectangle)})
    for (const double turn : {0.0, 0.7, 2.5})
      for (const double away : {0.0, 0.5}) {
        constexpr double kSide = 1e-4;
        std::vector<Vec3> ring;
        for (int k = 0; k < kCorners; ++k) {
          const Eigen::Vector2d x = Eigen::Rotation2Dd(turn) * at(static_cast<double>(k) / kCorners);
          ring.emplace_back(x.x() + away, x.y(), 1);
        }
        const PatchMesh mesh =
            MeshBuilder()
                .grid({-kSide / 2, -kSide / 2, 0}, kSide * Vec3::UnitX(), kSide * Vec3::UnitY(), 1, 1)
                .polygon(ring)
                .grid({-4, -4, 2}, 8 * Vec3::UnitY(), 8 * Vec3::UnitX(), 8, 8)
                .build();
        const Eigen::MatrixXd f = MethodSetup(mesh, find_form_factor_method("analytic")).raw().f;
        EXPECT_GT(f(0, 1), 0.01);
        EXPECT_NEAR(f.row(0).sum(), to_square, 1e-4 * to_square) << "turn " << turn << ", away " << away;
      }
}

// Root mean square over all pairs of the relative error; contours tell nearly all at the finest setting.
TEST(Analytic, KeepsToTheFactorTolerance) {
  const FormFactorMethodInfo& analytic = find_form_factor_method("analytic");
  const auto matrix = [&](const PatchMesh& mesh, double tolerance) {
    return MethodSetup(mesh, analytic, {.tolerance = tolerance}).raw().f;
  };
  for (const PatchMesh& mesh :
       {cube_room(6), MeshBuilder().sphere({1, 2, 3}, 1, 2, Facing::inward).build()}) {
    const Eigen::MatrixXd exact = matrix(mesh, 1e-9);
    double before = 1;
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
      const Eigen::ArrayXXd f = matrix(mesh, tolerance);
      const auto pairs = static_cast<double>((exact.array() > 0).count());
      const double error =
          std::sqrt((exact.array() > 0).select(f / exact.array() - 1, 0.0).square().sum() / pairs);
      EXPECT_LT(error, tolerance);
      EXPECT_LE(error, before);
      before = error;
    }
  }
  for (const double refused : {-1e-6, 1e-10, 0.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(matrix(cube_room(1), refused), InputError);
}

// Pairs of patches that see nothing of each other, and of those of which that is told without looking from points.
void expect_hidden(const PatchMesh& mesh) {
  const MethodSetup setup(mesh, find_form_factor_method("analytic"));
  const auto [f, report] = assemble(*setup.method, setup.visibility);
  EXPECT_EQ(f(0, 1), 0);
  EXPECT_EQ(f(1, 0), 0);
  EXPECT_EQ(report.pairs.hidden, 1U);
  EXPECT_EQ(report.pairs.partial, 0U);
}

TEST(Analytic, TellsWhatTwoSidesOfABoxHideTogether) {
  // An edge of the box is in the middle between two small squares: no side alone hides them from each other.
  const Vec3 across = Vec3(-0.1, 0.1, 0), up(0, 0, 0.2);
  expect_hidden(MeshBuilder()
                    .grid({-4, -4, 0}, across, up, 1, 1)
                    .grid({4, 4, 0}, up, across, 1, 1)
                    .box({-1, -1, -1}, {1, 1, 1}, 1, Facing::outward)
                    .build());
}

TEST(Analytic, TellsWhatPiecesOfAWallHideTogether) {
  // A wall of y, z within [−3, 3] but for a door. However it is cut into convex pieces, one of them does not have both all
  // that is over the door and all that is beside it.
  const auto with_wall = [](double y0, double y1, double z0, double z1) {
    const Vec3 y(0, y1 - y0, 0), z(0, 0, z1 - z0);
    MeshBuilder builder;
    builder.grid({-1, y0, z0}, y, z, 1, 1).grid({1, y0, z0}, z, y, 1, 1);
    for (const auto& [from, to] : {std::pair{Vec3(0, -3, -3), Vec3(0, -1, 0)},
                                   {Vec3(0, -3, 0), Vec3(0, -1, 3)},
                                   {Vec3(0, -1, 0), Vec3(0, 1, 3)},
                                   {Vec3(0, 1, 0), Vec3(0, 3, 3)},
                                   {Vec3(0, 1, -3), Vec3(0, 3, 0)}})
      builder.grid(from, {0, to.y() - from.y(), 0}, {0, 0, to.z() - from.z()}, 1, 1);
    return builder.build();
  };
  expect_hidden(with_wall(-2.8, 2.8, 0.2, 2.8));
  expect_hidden(with_wall(1.2, 2.8, -2.8, 2.8));
  const PatchMesh past_the_door = with_wall(0.8, 2.8, -2.8, 2.8);
  const MethodSetup setup(past_the_door, find_form_factor_method("analytic"));
  EXPECT_GT(setup.raw().f(0, 1), 0);
}

}  // namespace
}  // namespace radiosity::test
