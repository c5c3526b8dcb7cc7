// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/scenes.hpp"

#include <cmath>
#include <map>
#include <optional>

namespace radiosity::test {

PatchMesh::Arrays arrays_of(const PatchMesh& mesh) {
  PatchMesh::Arrays arrays;
  arrays.vertices = mesh.vertices();
  arrays.materials = mesh.materials();
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const auto corners = mesh.corners(i);
    arrays.corners.insert(arrays.corners.end(), corners.begin(), corners.end());
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(mesh.surface(i));
    arrays.patch_material.push_back(mesh.material(i));
  }
  return arrays;
}

Material grey(std::string name, double reflectance, double emission) {
  return {std::move(name), BandValues::Constant(1, reflectance), BandValues::Constant(1, emission)};
}

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -53);
}

MeshBuilder::MeshBuilder() {
  arrays_.materials.push_back(grey("surface", 0.5, 1));
}

MeshBuilder& MeshBuilder::use_material(Material material) {
  if (arrays_.patch_material.empty()) arrays_.materials.clear();
  material_ = static_cast<Index>(arrays_.materials.size());
  arrays_.materials.push_back(std::move(material));
  return *this;
}

void MeshBuilder::add_patch(std::initializer_list<Index> corners) {
  arrays_.corners.insert(arrays_.corners.end(), corners);
  arrays_.patch_start.push_back(static_cast<Index>(arrays_.corners.size()));
  arrays_.patch_surface.push_back(surface_);
  arrays_.patch_material.push_back(material_);
}

MeshBuilder& MeshBuilder::grid(const Vec3& origin, const Vec3& u, const Vec3& v, Index nu, Index nv) {
  const auto first = static_cast<Index>(arrays_.vertices.size());
  for (Index b = 0; b <= nv; ++b)
    for (Index a = 0; a <= nu; ++a)
      arrays_.vertices.push_back(origin + u * (static_cast<double>(a) / nu) +
                                 v * (static_cast<double>(b) / nv));
  for (Index b = 0; b < nv; ++b)
    for (Index a = 0; a < nu; ++a) {
      const Index corner = first + b * (nu + 1) + a;
      add_patch({corner, corner + 1, corner + nu + 2, corner + nu + 1});
    }
  next_surface();
  return *this;
}

MeshBuilder& MeshBuilder::polygon(const std::vector<Vec3>& corners) {
  const auto first = static_cast<Index>(arrays_.vertices.size());
  arrays_.vertices.insert(arrays_.vertices.end(), corners.begin(), corners.end());
  for (Index k = 0; k < static_cast<Index>(corners.size()); ++k) arrays_.corners.push_back(first + k);
  add_patch({});
  next_surface();
  return *this;
}

MeshBuilder& MeshBuilder::box(const Vec3& lower, const Vec3& upper, Index n, Facing facing) {
  const Vec3 size = upper - lower;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 u = Vec3::Unit((axis + 1) % 3) * size[(axis + 1) % 3];
    const Vec3 v = Vec3::Unit((axis + 2) % 3) * size[(axis + 2) % 3];  // u × v points along +axis
    const Vec3 far = lower + Vec3::Unit(axis) * size[axis];
    if (facing == Facing::inward)
      grid(lower, u, v, n, n).grid(far, v, u, n, n);
    else
      grid(lower, v, u, n, n).grid(far, u, v, n, n);
  }
  return *this;
}

MeshBuilder& MeshBuilder::sphere(const Vec3& centre, double radius, int subdivisions, Facing facing) {
  const double t = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> points{{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                           {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  for (Vec3& p : points) p.normalize();
  std::vector<std::array<Index, 3>> faces{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                          {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                          {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                          {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) {
    std::map<std::pair<Index, Index>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<Index>(points.size()));
      if (fresh) points.push_back((points[a] + points[b]).normalized());
      return at->second;
    };
    std::vector<std::array<Index, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  const auto first = static_cast<Index>(arrays_.vertices.size());
  for (const Vec3& p : points) arrays_.vertices.push_back(centre + radius * p);
  for (const auto& [a, b, c] : faces) {
    if (facing == Facing::outward)
      add_patch({first + a, first + b, first + c});
    else
      add_patch({first + a, first + c, first + b});
  }
  next_surface();
  return *this;
}

PatchMesh cube_room(Index n) {
  return MeshBuilder().box({0, 0, 0}, {1, 1, 1}, n, Facing::inward).build();
}

PatchMesh room_with_floating_box(Index n, Index m) {
  return MeshBuilder()
      .box({0, 0, 0}, {1, 1, 1}, n, Facing::inward)
      .box({0.3, 0.3, 0.4}, {0.6, 0.65, 0.7}, m, Facing::outward)
      .build();
}

PatchMesh opposed_squares(double gap, Index n) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  return MeshBuilder().grid({0, 0, 0}, x, y, n, n).grid({0, 0, gap}, y, x, n, n).build();
}

PatchMesh opposed_squares_with_screen(Index n, double side, Index m) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), corner(0.5 - side / 2, 0.5 - side / 2, 0.5);
  return MeshBuilder()
      .grid({0, 0, 0}, x, y, n, n)
      .grid({0, 0, 1}, y, x, n, n)
      .grid(corner, side * x, side * y, m, m)
      .grid(corner, side * y, side * x, m, m)
      .build();
}

PatchMesh rectangles_sharing_an_edge(double l, double w, double h, double angle) {
  const Vec3 x = Vec3::UnitX() * l, up(0, std::cos(angle) * h, std::sin(angle) * h);
  return MeshBuilder().grid({0, 0, 0}, x, Vec3::UnitY() * w, 1, 1).grid({0, 0, 0}, up, x, 1, 1).build();
}

PatchMesh tetrahedron() {
  const Vec3 a(1, 1, 1), b(1, -1, -1), c(-1, 1, -1), d(-1, -1, 1);
  return MeshBuilder().polygon({a, c, b}).polygon({a, b, d}).polygon({a, d, c}).polygon({b, c, d}).build();
}

PatchMesh concentric_spheres(int inner_subdivisions, int outer_subdivisions, const Material& inner,
                             const Material& outer) {
  return MeshBuilder()
      .use_material(inner)
      .sphere(Vec3::Zero(), 1, inner_subdivisions, Facing::outward)
      .use_material(outer)
      .sphere(Vec3::Zero(), 2, outer_subdivisions, Facing::inward)
      .build();
}

PatchMesh two_rooms(Index k) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const Index n = 3 * k;
  MeshBuilder room;
  room.grid({0, 0, 0}, y, z, n, n)
      .grid({2, 0, 0}, z, y, n, n)
      .grid({0, 0, 0}, z, 2 * x, n, 2 * n)
      .grid({0, 1, 0}, 2 * x, z, 2 * n, n)
      .grid({0, 0, 0}, 2 * x, y, 2 * n, n)
      .grid({0, 0, 1}, y, 2 * x, n, 2 * n);
  const auto wall = [&](double y0, double z0, double dy, double dz, Index ny, Index nz) {
    room.grid({1, y0, z0}, dy * y, dz * z, ny, nz).grid({1, y0, z0}, dz * z, dy * y, nz, ny);
  };
  wall(0, 0, 1.0 / 3, 1, k, n);
  wall(2.0 / 3, 0, 1.0 / 3, 1, k, n);
  wall(1.0 / 3, 2.0 / 3, 1.0 / 3, 1.0 / 3, k, k);
  return room.build();
}

PatchMesh room_with_triangle_soup(Index n, Index count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  MeshBuilder room;
  room.box({0, 0, 0}, {1, 1, 1}, n, Facing::inward);
  const auto point = [&](double low, double high) {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    return Vec3((Vec3(a, b, c) * (high - low)).array() + low);
  };
  for (Index k = 0; k < count; ++k) {
    const Vec3 centre = point(0.25, 0.75);
    const Vec3 a = centre + point(-0.2, 0.2), b = centre + point(-0.2, 0.2), c = centre + point(-0.2, 0.2);
    room.polygon({a, b, c}).polygon({a, c, b});
  }
  return room.build();
}

namespace {

class SceneBuilder {
 public:
  explicit SceneBuilder(std::vector<Material> materials) { arrays_.materials = std::move(materials); }

  /// A box turned about the vertical through its centre. Its bottom may be of another material.
  void box(const Vec3& lower, const Vec3& upper, Index material, Facing facing, double angle = 0,
           std::optional<Index> bottom = {}) {
    const auto first = static_cast<Index>(arrays_.vertices.size());
    const Vec3 centre = (lower + upper) / 2;
    const Eigen::AngleAxisd turn(angle, Vec3::UnitZ());
    for (Index c = 0; c < 8; ++c) {
      const Vec3 corner(c & 1 ? upper.x() : lower.x(), c & 2 ? upper.y() : lower.y(),
                        c & 4 ? upper.z() : lower.z());
      arrays_.vertices.push_back(angle == 0 ? corner : centre + turn * (corner - centre));
      arrays_.vertices.back().z() = corner.z();
    }
    const Index faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (std::size_t k = 0; k < 6; ++k) {
      const auto& f = faces[k];  // counter-clockwise from outside
      const std::array<Index, 4> outward{first + f[0], first + f[1], first + f[2], first + f[3]};
      const std::array<Index, 4> flipped{first + f[3], first + f[2], first + f[1], first + f[0]};
      arrays_.add_face(facing == Facing::inward ? flipped : outward,
                       k == 4 ? bottom.value_or(material) : material);
    }
  }

  /// Four corners, counter-clockwise from the front.
  void quad(const std::array<Vec3, 4>& corners, Index material) {
    const auto first = static_cast<Index>(arrays_.vertices.size());
    arrays_.vertices.insert(arrays_.vertices.end(), corners.begin(), corners.end());
    arrays_.add_face(std::array<Index, 4>{first, first + 1, first + 2, first + 3}, material);
  }

  Scene build() { return Scene(std::move(arrays_)); }

 private:
  Scene::Arrays arrays_;
};

}  // namespace

Scene box_on_floor() {
  SceneBuilder scene({grey("room", 0.5, 1), grey("box", 0.5, 1)});
  scene.box({0, 0, 0}, {1, 1, 1}, 0, Facing::inward);
  scene.box({1.0 / 3, 1.0 / 3, 0}, {2.0 / 3, 2.0 / 3, 0.5}, 1, Facing::outward);
  return scene.build();
}

Scene two_furnished_rooms() {
  SceneBuilder scene(
      {grey("walls", 0.7, 0), grey("floor", 0.3, 0), grey("furniture", 0.5, 0), grey("lamp", 0.0, 100)});
  scene.box({0, 0, 0}, {10, 6, 3}, 0, Facing::inward);
  // The wall between the rooms, 0.2 m thick, with a door of 1 m by 2.1 m.
  scene.box({5.4, 0, 0}, {5.6, 2.2, 3}, 0, Facing::outward);
  scene.box({5.4, 3.2, 0}, {5.6, 6, 3}, 0, Facing::outward);
  scene.box({5.4, 2.2, 2.1}, {5.6, 3.2, 3}, 0, Facing::outward);
  const auto furniture = [&](double x, double y, double z, double dx, double dy, double dz, double angle) {
    scene.box({x, y, z}, {x + dx, y + dy, z + dz}, 2, Facing::outward, angle);
  };
  // First room: a table on four legs, two chairs, a cupboard, a shelf on the wall, a chest.
  furniture(1.8, 2.2, 0.72, 1.6, 0.9, 0.04, 0);
  furniture(1.85, 2.25, 0, 0.06, 0.06, 0.72, 0);
  furniture(3.29, 2.25, 0, 0.06, 0.06, 0.72, 0);
  furniture(1.85, 2.99, 0, 0.06, 0.06, 0.72, 0);
  furniture(3.29, 2.99, 0, 0.06, 0.06, 0.72, 0);
  furniture(2.2, 1.5, 0, 0.45, 0.45, 0.45, 0.3);
  furniture(2.5, 3.5, 0, 0.45, 0.45, 0.45, -0.5);
  furniture(0, 4.5, 0, 0.6, 1.2, 2, 0);
  furniture(4, 0, 1.5, 1, 0.3, 0.04, 0);
  furniture(0.4, 0.5, 0, 1.0, 0.5, 0.5, 0.7);
  // Second room: a bed, a cupboard, a desk of three boxes, a stool, a column.
  furniture(7.9, 3.9, 0, 2, 1.6, 0.5, 0);
  furniture(6.2, 5.4, 0, 1.4, 0.6, 2.2, 0);
  furniture(6.6, 0.2, 0.7, 1.5, 0.7, 0.05, 0);
  furniture(6.65, 0.25, 0, 0.5, 0.6, 0.7, 0);
  furniture(7.2, 1.3, 0, 0.4, 0.4, 0.5, 0.4);
  furniture(8.6, 2, 0, 0.3, 0.3, 3, 0);
  // Lamps of 1 m² under both ceilings.
  scene.box({2.2, 2.4, 2.85}, {3.2, 3.4, 2.9}, 3, Facing::outward);
  scene.box({7.2, 2.4, 2.85}, {8.2, 3.4, 2.9}, 3, Facing::outward);
  return scene.build();
}

Scene office_floor() {
  SceneBuilder scene(
      {grey("walls", 0.7, 0), grey("floor", 0.3, 0), grey("furniture", 0.5, 0), grey("lamp", 0.0, 100)});
  constexpr double width = 4, depth = 5, height = 3, half_wall = 0.05, corridor = 2;
  constexpr int rooms = 6;
  constexpr double far = 2 * depth + 4 * half_wall + corridor;
  scene.box({0, 0, 0}, {rooms * width, far, height}, 0, Facing::inward);
  for (const bool across : {false, true}) {
    // Measured from the outer wall; the rooms across are the mirror image.
    const auto box = [&](const Vec3& lower, const Vec3& upper, Index material) {
      const double y0 = across ? far - upper.y() : lower.y(), y1 = across ? far - lower.y() : upper.y();
      scene.box({lower.x(), y0, lower.z()}, {upper.x(), y1, upper.z()}, material, Facing::outward);
    };
    for (int k = 0; k < rooms; ++k) {
      const double x = k * width;
      if (k > 0) box({x - half_wall, 0, 0}, {x + half_wall, depth, height}, 0);
      // To the corridor, with a door of 0.9 m by 2.1 m.
      box({x, depth, 0}, {x + 1.5, depth + 2 * half_wall, height}, 0);
      box({x + 1.5, depth, 2.1}, {x + 2.4, depth + 2 * half_wall, height}, 0);
      box({x + 2.4, depth, 0}, {x + width, depth + 2 * half_wall, height}, 0);
      box({x + 1, 0.8, 0.7}, {x + 2.6, 1.6, 0.74}, 2);    // desk
      box({x + 3.1, 3.4, 0}, {x + 3.7, 4.6, 1.8}, 2);     // cupboard
      box({x + 1.5, 1.9, 2.85}, {x + 2.5, 2.5, 2.9}, 3);  // lamp
    }
  }
  return scene.build();
}

Scene office_building(int rooms) {
  SceneBuilder scene({grey("walls", 0.7, 0), grey("floor", 0.3, 0), grey("furniture", 0.5, 0),
                      grey("glass", 0.1, 0), grey("fittings", 0.8, 0), grey("lamp", 0.0, 100)});
  enum : Index { walls, floors, furniture, glass, fittings, lamp };
  constexpr double width = 4, depth = 5, height = 3, half_wall = 0.05, corridor = 2;
  constexpr double far = 2 * depth + 4 * half_wall + corridor;
  const int columns = (rooms + 1) / 2;
  const double end = columns * width;
  for (const double z : {0.0, height}) {
    const std::array<Vec3, 4> up{{{0, 0, z}, {end, 0, z}, {end, far, z}, {0, far, z}}};
    scene.quad(z == 0 ? up : std::array<Vec3, 4>{up[3], up[2], up[1], up[0]}, z == 0 ? floors : walls);
  }
  scene.quad({{{0, 0, 0}, {0, 0, height}, {end, 0, height}, {end, 0, 0}}}, walls);
  scene.quad({{{0, far, 0}, {end, far, 0}, {end, far, height}, {0, far, height}}}, walls);
  scene.quad({{{0, 0, 0}, {0, far, 0}, {0, far, height}, {0, 0, height}}}, walls);
  scene.quad({{{end, 0, 0}, {end, 0, height}, {end, far, height}, {end, far, 0}}}, walls);
  for (int room = 0; room < 2 * columns; ++room) {
    const bool across = room % 2 == 1;
    const double x = room / 2 * width;
    // Measured from the outer wall; the rooms across are the mirror image.
    const auto box = [&](const Vec3& lower, const Vec3& size, Index material,
                         std::optional<Index> bottom = {}) {
      const double y0 = across ? far - lower.y() - size.y() : lower.y();
      scene.box({x + lower.x(), y0, lower.z()},
                {x + lower.x() + size.x(), y0 + size.y(), lower.z() + size.z()}, material, Facing::outward, 0,
                bottom);
    };
    const auto legs = [&](const Vec3& corner, const Vec3& size, double thick) {
      for (const double dx : {0.02, size.x() - thick - 0.02})
        for (const double dy : {0.02, size.y() - thick - 0.02})
          box(corner + Vec3(dx, dy, 0), {thick, thick, size.z()}, furniture);
    };
    if (room >= 2) box({-half_wall, 0, 0}, {2 * half_wall, depth, height}, walls);
    // To the corridor, with a door of 0.9 m by 2.1 m.
    box({0, depth, 0}, {1.5, 2 * half_wall, height}, walls);
    box({1.5, depth, 2.1}, {0.9, 2 * half_wall, height - 2.1}, walls);
    box({2.4, depth, 0}, {1.6, 2 * half_wall, height}, walls);
    box({0.8, 0, 0.9}, {2.4, 0.02, 1.4}, glass);
    if (room >= rooms) continue;
    for (const double y : {0.5, 2.6}) {
      box({0.4, y, 0.7}, {1.6, 0.8, 0.04}, furniture);
      legs({0.4, y, 0}, {1.6, 0.8, 0.7}, 0.05);
      const double seat = y + 0.95;
      box({0.95, seat, 0.42}, {0.45, 0.45, 0.04}, furniture);
      legs({0.95, seat, 0}, {0.45, 0.45, 0.42}, 0.04);
      box({0.95, seat + 0.41, 0.46}, {0.45, 0.04, 0.5}, furniture);
    }
    // A shelf that stands away from the wall by as much as its boards are thick.
    for (const double y : {3.0, 4.18}) box({3.55, y, 0}, {0.35, 0.02, 1.9}, furniture);
    for (int k = 0; k < 6; ++k) box({3.55, 3.02, 0.05 + 0.36 * k}, {0.35, 1.16, 0.02}, furniture);
    for (const double lx : {0.9, 2.6})
      for (const double y : {1.1, 3.2}) {
        box({lx, y, 2.7}, {0.3, 1.2, 0.06}, fittings, lamp);
      }
  }
  return scene.build();
}

Scene cube_with_box() {
  SceneBuilder scene({grey("walls", 0.5, 0), grey("box", 0.5, 0), grey("ceiling", 0.5, 1)});
  scene.quad({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}, 0);
  scene.quad({{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}}, 2);
  scene.quad({{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}}, 0);
  scene.quad({{{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}}}, 0);
  scene.quad({{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}}, 0);
  scene.quad({{{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}}, 0);
  scene.box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}, 1, Facing::outward);
  return scene.build();
}

Scene closed_cornell_box() {
  const auto colour = [](const char* name, double red, double green, double blue) {
    Material material = grey(name, 0, 0);
    material.reflectance = Eigen::Array3d(red, green, blue);
    material.emission = Eigen::Array3d::Zero();
    return material;
  };
  Material lamp = colour("lamp", 0.78, 0.78, 0.78);
  lamp.emission = Eigen::Array3d(17, 11.8, 4);
  SceneBuilder scene({colour("white", 0.73, 0.74, 0.71), colour("red", 0.58, 0.09, 0.06),
                      colour("green", 0.13, 0.35, 0.12), lamp});
  constexpr double a = 0.55;
  scene.quad({{{0, 0, 0}, {a, 0, 0}, {a, a, 0}, {0, a, 0}}}, 0);  // floor
  scene.quad({{{0, 0, 0}, {0, a, 0}, {0, a, a}, {0, 0, a}}}, 1);
  scene.quad({{{a, 0, 0}, {a, 0, a}, {a, a, a}, {a, a, 0}}}, 2);
  scene.quad({{{0, 0, 0}, {0, 0, a}, {a, 0, a}, {a, 0, 0}}}, 0);  // front
  scene.quad({{{0, a, 0}, {a, a, 0}, {a, a, a}, {0, a, a}}}, 0);  // back
  const std::array<double, 4> x{0, 0.21, 0.34, a}, y{0, 0.22, 0.33, a};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)  // the ceiling, the lamp in its middle
      scene.quad({{{x[i], y[j], a}, {x[i], y[j + 1], a}, {x[i + 1], y[j + 1], a}, {x[i + 1], y[j], a}}},
                 i == 1 && j == 1 ? 3 : 0);
  scene.box({0.29, 0.08, 0}, {0.455, 0.245, 0.165}, 0, Facing::outward, -0.29);  // short block
  scene.box({0.1, 0.27, 0}, {0.265, 0.435, 0.33}, 0, Facing::outward, 0.3);      // tall block
  return scene.build();
}

Scene lit_cube(double floor, double ceiling, double walls) {
  Scene::Arrays arrays;
  arrays.materials = {grey("floor", floor, 0), grey("ceiling", ceiling, 1), grey("walls", walls, 0)};
  for (Index c = 0; c < 8; ++c) arrays.vertices.emplace_back(c & 1, c >> 1 & 1, c >> 2 & 1);
  const std::array<std::array<Index, 4>, 6> faces{
      {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}}};
  for (std::size_t f = 0; f < 6; ++f)
    arrays.add_face(faces[f], static_cast<Index>(std::min<std::size_t>(f, 2)));
  return Scene(std::move(arrays));
}

Scene scene_of(const PatchMesh& mesh) {
  Scene::Arrays arrays;
  arrays.vertices = mesh.vertices();
  arrays.materials = mesh.materials();
  for (Index i = 0; i < mesh.patch_count(); ++i) arrays.add_face(mesh.corners(i), mesh.material(i));
  return Scene(std::move(arrays));
}

Scene random_room(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) { return low + (high - low) * uniform(random); };
  SceneBuilder scene(
      {grey("room", between(0.3, 0.9), 0), grey("boxes", between(0.1, 0.9), 0), grey("lamp", 0, 1)});
  scene.box({0, 0, 0}, {4, 3, 2.5}, 0, Facing::inward);
  // At most one box in each quarter of the floor, so that none meet.
  const auto first = static_cast<int>(4 * uniform(random));
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (quarter != first && uniform(random) < 0.4) continue;
    const Vec3 size(between(0.3, 0.8), between(0.3, 0.7), between(0.2, 1.2));
    const Vec3 centre(1 + 2 * (quarter % 2), 0.75 + 1.5 * (quarter / 2), 0);
    const double height = uniform(random) < 0.5 ? 0 : between(0.1, 0.9);
    const Vec3 lower = centre - Vec3(size.x() / 2, size.y() / 2, -height);
    scene.box(lower, lower + size, 1, Facing::outward, between(0, 1.5));
  }
  const Vec3 lamp(between(0.5, 2.7), between(0.4, 2), 2.44);
  scene.box(lamp, lamp + Vec3(between(0.3, 0.8), between(0.3, 0.6), 0.06), 2, Facing::outward);
  return scene.build();
}

PatchMesh transformed(const PatchMesh& mesh, const Eigen::Affine3d& transform) {
  PatchMesh::Arrays arrays = arrays_of(mesh);
  for (Vec3& v : arrays.vertices) v = transform * v;
  return PatchMesh(std::move(arrays));
}

}  // namespace radiosity::test
