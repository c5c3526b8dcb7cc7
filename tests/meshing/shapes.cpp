// SPDX-License-Identifier: GPL-3.0-or-later
#include "shapes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

namespace radiosity {
namespace {

using Key = std::tuple<double, double, double>;
Key key(const Vec3& x) {
  return {x.x() + 0.0, x.y() + 0.0, x.z() + 0.0};
}

template <class Use>
void for_each_edge(const PatchMesh& mesh, const Use& use) {
  for (Index p = 0; p < mesh.patch_count(); ++p) {
    const auto loop = mesh.corners(p);
    for (std::size_t k = 0; k < loop.size(); ++k)
      use(mesh.vertex(loop[k]), mesh.vertex(loop[(k + 1) % loop.size()]));
  }
}

}  // namespace

Material grey(const std::string& name, Sides sides) {
  return {name, BandValues::Constant(1, 0.5), BandValues::Zero(1), sides};
}

Shape& Shape::face(std::vector<Vec3> corners, Index material) {
  faces.push_back(std::move(corners));
  materials.push_back(material);
  return *this;
}

Shape& Shape::box(const Vec3& l, const Vec3& u, bool inward, bool bottom) {
  Shape box;
  box.face({{l.x(), l.y(), l.z()}, {l.x(), l.y(), u.z()}, {l.x(), u.y(), u.z()}, {l.x(), u.y(), l.z()}});
  box.face({{u.x(), l.y(), l.z()}, {u.x(), u.y(), l.z()}, {u.x(), u.y(), u.z()}, {u.x(), l.y(), u.z()}});
  box.face({{l.x(), l.y(), l.z()}, {u.x(), l.y(), l.z()}, {u.x(), l.y(), u.z()}, {l.x(), l.y(), u.z()}});
  box.face({{l.x(), u.y(), l.z()}, {l.x(), u.y(), u.z()}, {u.x(), u.y(), u.z()}, {u.x(), u.y(), l.z()}});
  if (bottom)
    box.face({{l.x(), l.y(), l.z()}, {l.x(), u.y(), l.z()}, {u.x(), u.y(), l.z()}, {u.x(), l.y(), l.z()}});
  box.face({{l.x(), l.y(), u.z()}, {u.x(), l.y(), u.z()}, {u.x(), u.y(), u.z()}, {l.x(), u.y(), u.z()}});
  return append(inward ? box.reversed() : box);
}

Shape& Shape::append(const Shape& other) {
  faces.insert(faces.end(), other.faces.begin(), other.faces.end());
  materials.insert(materials.end(), other.materials.begin(), other.materials.end());
  return *this;
}

Shape Shape::reversed() const {
  Shape result = *this;
  for (auto& corners : result.faces) std::reverse(corners.begin(), corners.end());
  return result;
}

Scene Shape::scene(std::vector<Material> wanted) const {
  Scene::Arrays arrays;
  arrays.materials = std::move(wanted);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    std::vector<Index> loop;
    for (const Vec3& x : faces[f]) {
      loop.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    arrays.add_face(loop, materials[f]);
  }
  return Scene(std::move(arrays));
}

std::vector<Vec3> rectangle(double x0, double y0, double x1, double y1, double z) {
  return {{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}};
}

std::vector<Vec3> wall_round_a_window() {
  return {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {0, 0, 0},
          {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}, {1, 1, 0}};
}

Scene icosphere(int rounds, double radius) {
  const double g = std::numbers::phi;
  Scene::Arrays arrays;
  arrays.materials = {grey()};
  arrays.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<Index, 3>> triangles{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                              {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                              {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                              {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int round = 0; round < rounds; ++round) {
    std::map<std::pair<Index, Index>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [entry, is_new] =
          middles.emplace(std::minmax(a, b), static_cast<Index>(arrays.vertices.size()));
      if (is_new) arrays.vertices.push_back((arrays.vertices[a] + arrays.vertices[b]) / 2);
      return entry->second;
    };
    std::vector<std::array<Index, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
    for (Vec3& x : arrays.vertices) x *= radius / x.norm();
  }
  for (Vec3& x : arrays.vertices) x *= radius / x.norm();
  for (const auto& triangle : triangles) arrays.add_face(triangle, 0);
  return Scene(std::move(arrays));
}

double total_area(const PatchMesh& mesh) {
  return mesh.areas().sum();
}

double smallest_angle_deg(const PatchMesh& mesh) {
  double smallest = 180;
  for (Index p = 0; p < mesh.patch_count(); ++p) {
    const auto loop = mesh.corners(p);
    for (std::size_t k = 0, n = loop.size(); k < n; ++k) {
      const Vec3 in = mesh.vertex(loop[(k + n - 1) % n]) - mesh.vertex(loop[k]);
      const Vec3 out = mesh.vertex(loop[(k + 1) % n]) - mesh.vertex(loop[k]);
      smallest = std::min(smallest, std::atan2(in.cross(out).norm(), in.dot(out)) * 180 / std::numbers::pi);
    }
  }
  return smallest;
}

double longest_edge(const PatchMesh& mesh) {
  double longest = 0;
  for_each_edge(mesh, [&](const Vec3& a, const Vec3& b) { longest = std::max(longest, (b - a).norm()); });
  return longest;
}

int t_vertices(const PatchMesh& mesh) {
  std::map<Key, Vec3> places;
  for (const Vec3& x : mesh.vertices()) places.emplace(key(x), x);
  const double near = 1e-9 * mesh.diagonal();
  int found = 0;
  for_each_edge(mesh, [&](const Vec3& a, const Vec3& b) {
    const Vec3 along = b - a;
    for (auto place = places.lower_bound({std::min(a.x(), b.x()) - near, -1e300, -1e300});
         place != places.end() && place->second.x() <= std::max(a.x(), b.x()) + near; ++place) {
      const Vec3& x = place->second;
      const double t = along.dot(x - a) / along.squaredNorm();
      if (t * along.norm() > near && (1 - t) * along.norm() > near && (x - a - t * along).norm() < near)
        ++found;
    }
  });
  return found;
}

int unmatched_edges(const PatchMesh& mesh) {
  std::map<std::pair<Key, Key>, int> balance;
  for_each_edge(mesh, [&](const Vec3& a, const Vec3& b) {
    ++balance[{key(a), key(b)}];
    --balance[{key(b), key(a)}];
  });
  return static_cast<int>(
      std::count_if(balance.begin(), balance.end(), [](const auto& e) { return e.second > 0; }));
}

}  // namespace radiosity
