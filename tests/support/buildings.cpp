// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/buildings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>
#include <tuple>

#include "cases/scenes.hpp"

namespace radiosity::test {
namespace {

enum Finish : std::size_t { walls, floors, ceiling, furniture, screen, lamp, pane, kFinishes };

/// A rectangle in the plane of a panel: along u from `left` to `right`, along v from `low` to `high`.
struct Opening {
  double left, right, low, high;
};

/// Where a rectangular panel lies; its front is u × v.
struct Frame {
  Vec3 origin, u, v;
  double width, height;
  Vec3 at(double s, double h, double behind = 0) const {
    return origin + s * u + h * v - behind * u.cross(v);
  }
};

class Builder {
 public:
  Builder(const BuildingSettings& settings, const Flaws& flaws)
      : settings_(settings),
        flaws_(flaws),
        split_(flaws.t_junctions || settings.triangles),
        random_(settings.seed) {
    draw_plan();
    for (int j = 0; j < settings.across; ++j)
      for (int i = 0; i < settings.along; ++i) add_room(i, j);
    if (flaws.non_planar) bend();
    if (flaws.flips) flip();
    if (settings.triangles) cut_into_fans();
    if (flaws.duplicates) duplicate();
    turn_and_round();
    if (settings.one_material) {
      result_.materials = {grey("default", 0.5, 1)};
      for (Building::Face& face : result_.faces) face.material = 0;
    }
  }
  Building take() { return std::move(result_); }

 private:
  // Sums of powers of two, so that all contact is exact.
  static constexpr double kWall = 0.1875, kHeight = 2.625, kDoor = 0.875, kDoorHeight = 2.125;

  double between(double low, double high) { return low + (high - low) * uniform(random_); }

  /// In sixteenths of a metre.
  double place(double low, double high) { return std::round(16 * between(low, high)) / 16; }

  void draw_plan() {
    const auto draw = [&](std::vector<double>& starts, std::vector<double>& ends, int count, double size) {
      double at = 0;
      for (int k = 0; k < count; ++k) {
        starts.push_back(at);
        ends.push_back(at += place(size - 0.25, size + 0.25));
        at += kWall;
      }
    };
    draw(x_start_, x_end_, settings_.along, 4);
    draw(y_start_, y_end_, settings_.across, 3.5);
    for (int k = 0; k < settings_.along; ++k) x_door_.push_back(place(0.6, 1.8));
    for (int k = 0; k < settings_.across; ++k) y_door_.push_back(place(1, 1.5));
  }

  void add_room(int i, int j) {
    const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
    const int number = j * settings_.along + i;
    first_material_ = result_.materials.size();
    const auto named = [&](const char* name, double reflectance, double emission) {
      result_.materials.push_back(grey(name + std::to_string(number), reflectance, emission));
    };
    named("walls", 0.7, 0);
    named("floor", 0.3, 0);
    named("ceiling", 0.8, 0);
    named("furniture", 0.5, 0);
    named("screen", 0.6, 0);
    named("lamp", 0, 60);
    named("pane", 0.1, 20);
    const double x0 = x_start_[a], x1 = x_end_[a], y0 = y_start_[b], y1 = y_end_[b], w = x1 - x0, d = y1 - y0;
    const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
    const double dx = x_door_[a], dy = y_door_[b];
    const Opening window{1.125, w - 1, 0.875, 2.25};
    const bool west = i > 0, east = i + 1 < settings_.along, south = j > 0, north = j + 1 < settings_.across;

    // A door is seen from both sides, its frame belongs to the room with the smaller number.
    add_wall({{x1, y0, 0}, -x, z, w, kHeight},
             south ? Opening{w - dx - kDoor, w - dx, 0, kDoorHeight} : window,
             south ? Behind::nothing : Behind::pane);
    add_wall({{x0, y1, 0}, x, z, w, kHeight}, north ? Opening{dx, dx + kDoor, 0, kDoorHeight} : window,
             north ? Behind::passage : Behind::pane);
    if (west)
      add_wall({{x0, y0, 0}, y, z, d, kHeight}, Opening{dy, dy + kDoor, 0, kDoorHeight}, Behind::nothing);
    else
      quad({{x0, y0, 0}, y, z, d, kHeight}, {0, d, 0, kHeight}, walls);
    if (east)
      add_wall({{x1, y1, 0}, -y, z, d, kHeight}, Opening{d - dy - kDoor, d - dy, 0, kDoorHeight},
               Behind::passage);
    else
      quad({{x1, y1, 0}, -y, z, d, kHeight}, {0, d, 0, kHeight}, walls);

    std::vector<Vec3> floor{{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}};
    if (!split_) {
      floor.clear();
      const auto side = [&](const Vec3& corner, bool door, const Vec3& from, const Vec3& to) {
        floor.push_back(corner);
        if (door) floor.insert(floor.end(), {from, to});
      };
      side({x0, y0, 0}, south, {x0 + dx, y0, 0}, {x0 + dx + kDoor, y0, 0});
      side({x1, y0, 0}, east, {x1, y0 + dy, 0}, {x1, y0 + dy + kDoor, 0});
      side({x1, y1, 0}, north, {x0 + dx + kDoor, y1, 0}, {x0 + dx, y1, 0});
      side({x0, y1, 0}, west, {x0, y0 + dy + kDoor, 0}, {x0, y0 + dy, 0});
    }
    add(std::move(floor), floors);

    const Frame above{{x0, y0, kHeight}, y, x, d, w};
    const Opening light{d / 2 - 0.5, d / 2 + 0.5, w / 2 - 0.5, w / 2 + 0.25};
    if (number % 2 == 0) {
      panel(above, light, ceiling);
      quad(above, light, lamp);
    } else {
      quad(above, {0, d, 0, w}, ceiling);
      quad({above.origin - 0.125 * z, y, x, d, w}, light, lamp);
    }
    furnish(x0, y0, w, d);
    moved_[{x0, y0, 0}] = {0, 0, 3e-3};
    moved_[{x0, y1, kHeight}] = {1e-3, 0, 0};
  }

  enum class Behind { nothing, passage, pane };

  void add_wall(const Frame& f, const Opening& o, Behind behind) {
    panel(f, o, walls);
    if (behind == Behind::nothing) return;
    add({f.at(o.left, o.low), f.at(o.right, o.low), f.at(o.right, o.low, kWall), f.at(o.left, o.low, kWall)},
        behind == Behind::pane ? walls : floors);
    add({f.at(o.left, o.high), f.at(o.left, o.high, kWall), f.at(o.right, o.high, kWall),
         f.at(o.right, o.high)},
        walls);
    add({f.at(o.left, o.low), f.at(o.left, o.low, kWall), f.at(o.left, o.high, kWall), f.at(o.left, o.high)},
        walls);
    add({f.at(o.right, o.low), f.at(o.right, o.high), f.at(o.right, o.high, kWall),
         f.at(o.right, o.low, kWall)},
        walls);
    if (behind == Behind::pane && settings_.glazed)
      quad({f.at(0, 0, kWall), f.u, f.v, f.width, f.height}, o, pane);
  }

  void quad(const Frame& f, const Opening& o, Finish finish) {
    add({f.at(o.left, o.low), f.at(o.right, o.low), f.at(o.right, o.high), f.at(o.left, o.high)}, finish);
  }

  /// A panel with an opening: one face, or four (three where the opening is a door) that meet the faces round them in mid-edge.
  void panel(const Frame& f, const Opening& o, Finish finish) {
    if (split_) {
      quad(f, {0, o.left, 0, f.height}, finish);
      quad(f, {o.right, f.width, 0, f.height}, finish);
      quad(f, {o.left, o.right, o.high, f.height}, finish);
      if (o.low > 0) quad(f, {o.left, o.right, 0, o.low}, finish);
    } else if (o.low > 0) {
      add({f.at(0, 0), f.at(f.width, 0), f.at(f.width, f.height), f.at(0, f.height), f.at(0, 0),
           f.at(o.left, o.low), f.at(o.left, o.high), f.at(o.right, o.high), f.at(o.right, o.low),
           f.at(o.left, o.low)},
          finish);
    } else {
      add({f.at(0, 0), f.at(o.left, 0), f.at(o.left, o.high), f.at(o.right, o.high), f.at(o.right, 0),
           f.at(f.width, 0), f.at(f.width, f.height), f.at(0, f.height)},
          finish);
    }
  }

  /// How far off the floor the next piece of furniture stands.
  double next_gap() {
    const int k = pieces_++;
    const double size = std::pow(10, -6 + (k / 2) % 4);
    if (flaws_.gaps && (!flaws_.sunk || k % 2 == 0)) return size;
    return flaws_.sunk ? -size : 0;
  }

  void furnish(double x0, double y0, double w, double d) {
    const auto from_corner = [&](double x, double y, double z) { return Vec3(x0 + x, y0 + y, z); };
    double up = next_gap();  // a cupboard at the wall without a door in its way
    const Vec3 cupboard = from_corner(0, d - 0.75, up);
    box(cupboard, {0.5, 0.75, 1.875}, 0, furniture);
    moved_[{cupboard.x() + 0.5, cupboard.y(), up + 1.875}] = {0, 0, 2e-3};
    up = next_gap();  // a table on two sides
    const double tx = place(1, 1.5), ty = place(0.4, 0.6);
    box(from_corner(tx, ty, 0.6875 + up), {1.25, 0.75, 0.0625}, 0, furniture);
    box(from_corner(tx, ty, up), {0.0625, 0.75, 0.6875}, 0, furniture);
    box(from_corner(tx + 1.125, ty + 0.0625, up), {0.0625, 0.625, 0.6875}, 0, furniture);
    up = next_gap();
    const Vec3 chest = from_corner(w - 1.25, d - 1.125, up);
    box(chest, {0.75, 0.625, 0.5}, between(0.1, 1.4), furniture);
    box(chest + Vec3(0.25, 0.1875, 0.5 + next_gap()), {0.25, 0.25, 0.25}, between(0, 1.4), furniture);
    up = next_gap();
    const Vec3 at = from_corner(w - 0.8125, 0.5, up);
    const double thick = 1.0 / 256, angle = between(-0.3, 0.3);
    if (flaws_.sheets)
      add(turned({at + Vec3(thick / 2, 0, 0), at + Vec3(thick / 2, 1, 0), at + Vec3(thick / 2, 1, 1.5),
                  at + Vec3(thick / 2, 0, 1.5)},
                 at + Vec3(thick / 2, 0.5, 0), angle),
          screen);
    else
      box(at, {thick, 1, 1.5}, angle, screen);
  }

  static std::vector<Vec3> turned(std::vector<Vec3> points, const Vec3& about, double angle) {
    const Eigen::AngleAxisd turn(angle, Vec3::UnitZ());
    if (angle != 0)
      for (Vec3& p : points)
        p = Vec3(about.x(), about.y(), p.z()) + turn * Vec3(p.x() - about.x(), p.y() - about.y(), 0);
    return points;
  }

  void box(const Vec3& lower, const Vec3& size, double angle, Finish finish) {
    std::vector<Vec3> c;
    for (int k = 0; k < 8; ++k)
      c.push_back(lower + Vec3(k & 1 ? size.x() : 0, k & 2 ? size.y() : 0, k & 4 ? size.z() : 0));
    c = turned(std::move(c), lower + size / 2, angle);
    add({c[0], c[4], c[6], c[2]}, finish);
    add({c[1], c[3], c[7], c[5]}, finish);
    add({c[0], c[1], c[5], c[4]}, finish);
    add({c[2], c[6], c[7], c[3]}, finish);
    add({c[0], c[2], c[3], c[1]}, finish);
    add({c[4], c[5], c[7], c[6]}, finish);
  }

  void add(std::vector<Vec3> corners, Finish finish) {
    result_.faces.push_back({std::move(corners), first_material_ + finish});
  }

  Finish finish(const Building::Face& face) const { return static_cast<Finish>(face.material % kFinishes); }

  /// All faces that meet at the corner go with it.
  void bend() {
    for (Building::Face& face : result_.faces)
      for (Vec3& x : face.corners)
        if (const auto found = moved_.find({x.x(), x.y(), x.z()}); found != moved_.end()) x += found->second;
  }

  /// Every seventh face but hanging lamps, which are joined to nothing.
  void flip() {
    for (std::size_t f = 0; f < result_.faces.size(); f += 7)
      if (finish(result_.faces[f]) != lamp)
        std::reverse(result_.faces[f].corners.begin(), result_.faces[f].corners.end());
  }

  /// Every third face once more, from another corner on, and every lamp.
  void duplicate() {
    const std::size_t count = result_.faces.size();
    for (std::size_t f = 0; f < count; ++f) {
      if (f % 3 != 0 && finish(result_.faces[f]) != lamp) continue;
      Building::Face copy = result_.faces[f];
      std::rotate(copy.corners.begin(), copy.corners.begin() + 1, copy.corners.end());
      result_.faces.push_back(std::move(copy));
    }
  }

  void cut_into_fans() {
    std::vector<Building::Face> triangles;
    for (const auto& [c, material] : result_.faces)
      for (std::size_t k = 1; k + 1 < c.size(); ++k) triangles.push_back({{c[0], c[k], c[k + 1]}, material});
    result_.faces = std::move(triangles);
  }

  void turn_and_round() {
    const Eigen::AngleAxisd turn(flaws_.angle, Vec3::UnitZ());
    const double scale = std::pow(10, flaws_.decimals.value_or(0));
    for (Building::Face& face : result_.faces)
      for (Vec3& x : face.corners) {
        if (flaws_.angle != 0) x = turn * x;
        if (flaws_.decimals) x = (x * scale).array().round() / scale;
      }
  }

  const BuildingSettings settings_;
  const Flaws flaws_;
  const bool split_;  ///< no face with a hole or a corner on an edge
  std::mt19937_64 random_;
  std::vector<double> x_start_, x_end_, y_start_, y_end_, x_door_, y_door_;  // m
  std::map<std::array<double, 3>, Vec3> moved_;  ///< corners that are to be off their place, by how much
  std::size_t first_material_ = 0;
  int pieces_ = 0;
  Building result_;
};

/// Polygons by vertex numbers; corners at one place are one vertex.
struct Indexed {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::size_t>> faces;

  explicit Indexed(const Building& building) {
    std::map<std::array<double, 3>, std::size_t> number;
    for (const Building::Face& face : building.faces) {
      faces.emplace_back();
      for (const Vec3& x : face.corners) {
        const auto [found, fresh] = number.try_emplace({x.x(), x.y(), x.z()}, vertices.size());
        if (fresh) vertices.push_back(x);
        faces.back().push_back(found->second);
      }
    }
  }
};

std::string text(const Vec3& x) {
  return fmt::format("{} {} {}", x.x(), x.y(), x.z());
}

void write(const std::filesystem::path& file, std::string_view content) {
  std::ofstream out(file, std::ios::binary);
  out << content;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

void write_obj(const Building& building, const std::filesystem::path& file) {
  const Indexed mesh(building);
  std::string mtl, obj = fmt::format("mtllib {}.mtl\n", file.stem().string());
  for (const Material& m : building.materials)
    mtl += fmt::format("newmtl {}\nKd {}\nKe {}\n", m.name, m.reflectance[0], m.emission[0]);
  for (const Vec3& x : mesh.vertices) obj += fmt::format("v {}\n", text(x));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    obj += fmt::format("usemtl {}\nf", building.materials[building.faces[f].material].name);
    for (const std::size_t v : mesh.faces[f]) obj += fmt::format(" {}", v + 1);
    obj += '\n';
  }
  write(std::filesystem::path(file).replace_extension(".mtl"), mtl);
  write(file, obj);
}

void write_ply(const Building& building, const std::filesystem::path& file) {
  const Indexed mesh(building);
  std::string ply = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.faces.size());
  for (const Vec3& x : mesh.vertices) ply += text(x) + '\n';
  for (const auto& face : mesh.faces) ply += fmt::format("{} {}\n", face.size(), fmt::join(face, " "));
  write(file, ply);
}

void write_stl(const Building& building, const std::filesystem::path& file) {
  std::string stl = "solid building\n";
  for (const Building::Face& face : building.faces) {
    stl += "facet normal 0 0 0\nouter loop\n";
    for (const Vec3& x : face.corners) stl += fmt::format("vertex {}\n", text(x));
    stl += "endloop\nendfacet\n";
  }
  write(file, stl + "endsolid building\n");
}

/// Vertex numbers of the faces of each material, one after the other.
std::vector<std::vector<std::size_t>> by_material(const Building& building, const Indexed& mesh) {
  std::vector<std::vector<std::size_t>> corners(building.materials.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    auto& of = corners[building.faces[f].material];
    of.insert(of.end(), mesh.faces[f].begin(), mesh.faces[f].end());
  }
  return corners;
}

void write_gltf(const Building& building, const std::filesystem::path& file) {
  const Indexed mesh(building);
  std::string bytes;
  const auto put = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), 4); };
  Vec3 lower = mesh.vertices[0], upper = lower;
  for (const Vec3& x : mesh.vertices) {
    for (const double c : x) put(static_cast<float>(c));
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
  }
  const std::size_t indices = bytes.size();
  std::vector<std::string> materials, primitives;
  std::vector<std::string> accessors{
      fmt::format(R"({{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[{}],"max":[{}]}})",
                  mesh.vertices.size(), fmt::join(lower, ","), fmt::join(upper, ","))};
  const auto corners = by_material(building, mesh);
  for (std::size_t m = 0; m < corners.size(); ++m) {
    const Material& material = building.materials[m];
    materials.push_back(fmt::format(
        R"({{"name":"{0}","pbrMetallicRoughness":{{"baseColorFactor":[{1},{1},{1},1],"metallicFactor":0}},"emissiveFactor":[1,1,1],"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":{2}}}}}}})",
        material.name, material.reflectance[0], material.emission[0]));
    if (corners[m].empty()) continue;
    accessors.push_back(
        fmt::format(R"({{"bufferView":1,"byteOffset":{},"componentType":5125,"count":{},"type":"SCALAR"}})",
                    bytes.size() - indices, corners[m].size()));
    primitives.push_back(fmt::format(R"({{"attributes":{{"POSITION":0}},"indices":{},"material":{}}})",
                                     accessors.size() - 1, m));
    for (const std::size_t v : corners[m]) put(static_cast<std::uint32_t>(v));
  }
  const std::string buffer = file.stem().string() + ".bin";
  write(file.parent_path() / buffer, bytes);
  write(
      file,
      fmt::format(
          R"({{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_materials_emissive_strength"],"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"buffers":[{{"uri":"{}","byteLength":{}}}],"bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}],"accessors":[{}],"materials":[{}],"meshes":[{{"primitives":[{}]}}]}})",
          buffer, bytes.size(), indices, indices, bytes.size() - indices, fmt::join(accessors, ","),
          fmt::join(materials, ","), fmt::join(primitives, ",")));
}

void write_collada(const Building& building, const std::filesystem::path& file) {
  const Indexed mesh(building);
  std::string positions, effects, materials, triangles, bindings;
  for (const Vec3& x : mesh.vertices) positions += text(x) + ' ';
  const auto corners = by_material(building, mesh);
  for (std::size_t m = 0; m < corners.size(); ++m) {
    const Material& material = building.materials[m];
    effects += fmt::format(
        "<effect id=\"{0}-fx\"><profile_COMMON><technique sid=\"common\"><lambert>"
        "<emission><color>{2} {2} {2} 1</color></emission><diffuse><color>{1} {1} {1} 1</color></diffuse>"
        "</lambert></technique></profile_COMMON></effect>\n",
        material.name, material.reflectance[0], material.emission[0]);
    materials += fmt::format(
        "<material id=\"{0}\" name=\"{0}\"><instance_effect url=\"#{0}-fx\"/></material>\n", material.name);
    if (corners[m].empty()) continue;
    triangles += fmt::format(
        "<triangles material=\"{}\" count=\"{}\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
        "<p>{}</p></triangles>\n",
        material.name, corners[m].size() / 3, fmt::join(corners[m], " "));
    bindings += fmt::format("<instance_material symbol=\"{0}\" target=\"#{0}\"/>", material.name);
  }
  write(
      file,
      fmt::format(
          "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
          "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
          "<asset><unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n"
          "<library_effects>{0}</library_effects>\n<library_materials>{1}</library_materials>\n"
          "<library_geometries><geometry id=\"g\"><mesh>\n"
          "<source id=\"p\"><float_array id=\"a\" count=\"{2}\">{3}</float_array><technique_common>"
          "<accessor source=\"#a\" count=\"{4}\" stride=\"3\"><param name=\"X\" type=\"float\"/>"
          "<param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor>"
          "</technique_common></source>\n"
          "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>\n{5}"
          "</mesh></geometry></library_geometries>\n"
          "<library_visual_scenes><visual_scene id=\"s\"><node><instance_geometry url=\"#g\"><bind_material>"
          "<technique_common>{6}</technique_common></bind_material></instance_geometry></node></visual_scene>"
          "</library_visual_scenes>\n<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n",
          effects, materials, 3 * mesh.vertices.size(), positions, mesh.vertices.size(), triangles,
          bindings));
}

}  // namespace

Building building(const BuildingSettings& settings, const Flaws& flaws) {
  return Builder(settings, flaws).take();
}

void write_building(const Building& building, const std::filesystem::path& file) {
  const std::map<std::string, void (*)(const Building&, const std::filesystem::path&)> writers{
      {".obj", write_obj},
      {".ply", write_ply},
      {".stl", write_stl},
      {".gltf", write_gltf},
      {".dae", write_collada}};
  writers.at(file.extension().string())(building, file);
}

}  // namespace radiosity::test
