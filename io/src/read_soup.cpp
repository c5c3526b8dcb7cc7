// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/IO/OFF.h>
#include <CGAL/IO/PLY.h>
#include <CGAL/IO/STL.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <array>
#include <compare>
#include <fstream>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

/// CGAL's STL reader joins equal corners through a std::map. Ordered like this, a coordinate that is not a
/// number stays a vertex of its own and is reported, instead of vanishing in another one.
struct StlPoint {
  std::array<double, 3> x{};
  void resize(std::size_t) {}
  double& operator[](std::size_t k) { return x[k]; }
  double operator[](std::size_t k) const { return x[k]; }
  friend bool operator<(const StlPoint& a, const StlPoint& b) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto order = std::weak_order(a.x[k], b.x[k]);
      if (order != 0) return order < 0;
    }
    return false;
  }
};

template <class Point, class Read>
MeshFile read_points_and_polygons(const std::filesystem::path& file, Read&& read) {
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> polygons;
  std::ifstream stream(file, std::ios::binary);
  bool understood = false;
  try {
    understood = read(stream, points, polygons);
  } catch (const std::exception&) {
    // A size in the file that no memory holds, or a rule of the format that CGAL checks.
  }
  if (!understood)
    throw IoError(fmt::format("{}: is damaged, or is not a {} file", file.string(),
                              lower_case_extension(file).substr(1)));
  MeshFile mesh;
  for (const auto& p : points) mesh.geometry.vertices.emplace_back(p[0], p[1], p[2]);
  std::vector<Index> corners;
  for (std::size_t f = 0; f < polygons.size(); ++f) {
    corners.clear();
    for (const std::size_t v : polygons[f]) {
      if (v >= points.size())
        throw InputError(
            fmt::format("{}: face {} (counted from 0) refers to vertex {}, but there are only {}",
                        file.string(), f, v, points.size()));
      corners.push_back(static_cast<Index>(v));
    }
    mesh.geometry.add_face(corners, 0);
  }
  mesh.materials.push_back({.name = kDefaultMaterial});
  return mesh;
}

}  // namespace

MeshFile read_soup(const std::filesystem::path& file, const std::string& extension) {
  using Point = CGAL::Simple_cartesian<double>::Point_3;
  // Said to all three: read_PLY is not silent by default.
  if (extension == ".stl")
    return read_points_and_polygons<StlPoint>(file, [](auto& stream, auto& points, auto& polygons) {
      return CGAL::IO::read_STL(stream, points, polygons, CGAL::parameters::verbose(false));
    });
  if (extension == ".ply")
    return read_points_and_polygons<Point>(file, [](auto& stream, auto& points, auto& polygons) {
      return CGAL::IO::read_PLY(stream, points, polygons, CGAL::parameters::verbose(false));
    });
  return read_points_and_polygons<Point>(file, [](auto& stream, auto& points, auto& polygons) {
    return CGAL::IO::read_OFF(stream, points, polygons, CGAL::parameters::verbose(false));
  });
}

}  // namespace radiosity
