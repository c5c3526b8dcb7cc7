// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "text.hpp"

namespace radiosity {
namespace {

enum class Encoding { text, little_endian, big_endian };
enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
  std::string name;
  Type type = Type::float64;
  std::optional<Type> count = {};  ///< of a list: the type of its length
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties = {};

  std::optional<std::size_t> find(std::string_view property, bool list) const {
    for (std::size_t p = 0; p < properties.size(); ++p)
      if (properties[p].name == property && properties[p].count.has_value() == list) return p;
    return {};
  }
};

std::optional<Type> type_named(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  for (std::size_t t = 0; t < kNames.size(); ++t)
    if (name == kNames[t][0] || name == kNames[t][1]) return static_cast<Type>(t);
  return {};
}

template <class Value>
double decoded(const char* bytes, bool swap) {
  std::array<char, sizeof(Value)> raw{};
  std::copy_n(bytes, sizeof(Value), raw.begin());
  if (swap) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<Value>(raw));  // exact: no type has more than 53 bits of mantissa
}

/// Not CGAL's reader, which dereferences null on headers that it does not expect, and not VTK's or assimp's,
/// which keep single precision.
class PlyReader {
 public:
  explicit PlyReader(const std::filesystem::path& file) : file_(file), lines_(file, read_bytes(file)) {}
  MeshFile read();

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw IoError(fmt::format("{}: {}", lines_.here(), what));
  }
  void read_header();
  void read_property();
  void read_elements(const Element& element);
  /// "face 7 (counted from 0)": the element that is being read.
  std::string object() const { return fmt::format("{} {} (counted from 0)", element_->name, number_); }
  bool is_text() const { return encoding_ == Encoding::text; }
  void begin_element();
  void end_element() const;
  double value(Type type);
  std::size_t list_length(Type type);
  void vertex(const std::array<std::size_t, 3>& xyz);
  void face(std::size_t list);
  void strips(std::size_t list);
  Index vertex_number(double given) const;
  void require_vertices() const;

  std::filesystem::path file_;
  TextLines lines_;
  std::optional<Encoding> encoding_;
  std::vector<Element> elements_;
  MeshFile mesh_;
  std::size_t at_ = 0;  ///< the next byte, or the next word of the line
  const Element* element_ = nullptr;
  std::int64_t number_ = 0;
  std::vector<std::vector<double>>
      values_;  ///< of the element: one list per property; scalars have one value
};

void PlyReader::read_header() {
  if (!lines_.next() || trimmed(lines_.text()) != "ply")
    throw IoError(fmt::format("{}: does not begin with the line 'ply': is no ply file", file_.string()));
  for (;;) {
    if (!lines_.next_words()) refuse("the header has no line 'end_header'");
    const auto& words = lines_.words();
    const auto keyword = words.front();
    if (keyword == "end_header") break;
    if (keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "property") {
      read_property();
    } else if (keyword == "format" && words.size() == 3 && words[2] == "1.0") {
      if (words[1] == "ascii") encoding_ = Encoding::text;
      if (words[1] == "binary_little_endian") encoding_ = Encoding::little_endian;
      if (words[1] == "binary_big_endian") encoding_ = Encoding::big_endian;
    } else if (keyword == "element" && words.size() == 3) {
      const auto count = whole_number(words[2]);
      if (!count || *count < 0) refuse(fmt::format("'{}' is not a number of elements", shown(words[2])));
      elements_.push_back({.name = std::string(words[1]), .count = *count});
    } else {
      refuse(fmt::format("'{}' is not a line of a ply header", shown(lines_.text())));
    }
  }
  if (!encoding_)
    refuse("no line 'format' says ascii, binary_little_endian or binary_big_endian, version 1.0");
}

void PlyReader::read_property() {
  const auto& words = lines_.words();
  if (elements_.empty()) refuse("a property stands before the first element");
  const bool list = words.size() == 5 && words[1] == "list";
  if (!list && words.size() != 3)
    refuse("a property is 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  const auto type = [&](std::string_view name) {
    const auto found = type_named(name);
    if (!found) refuse(fmt::format("'{}' is not a type of ply", shown(name)));
    return *found;
  };
  Property property{.name = std::string(words.back()), .type = type(words[words.size() - 2])};
  if (list) property.count = type(words[2]);
  elements_.back().properties.push_back(std::move(property));
}

void PlyReader::begin_element() {
  if (!is_text()) return;
  if (!lines_.next_words())
    throw IoError(fmt::format("{}: ends before {}; the header of this ply file counts {}", file_.string(),
                              object(), element_->count));
  at_ = 0;
}

void PlyReader::end_element() const {
  if (is_text() && at_ != lines_.words().size())
    refuse(fmt::format("{}: the line has {} values, but the header means {}", object(), lines_.words().size(),
                       at_));
}

double PlyReader::value(Type type) {
  if (is_text()) {
    if (at_ >= lines_.words().size())
      refuse(fmt::format("{}: the line ends before its last value", object()));
    const auto word = lines_.words()[at_++];
    const auto number = finite_number(word);
    if (!number)
      throw InputError(fmt::format("{}: {}: '{}' is not a finite number", lines_.here(), object(), word));
    return *number;
  }
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  const std::size_t size = kSizes[static_cast<std::size_t>(type)];
  const std::string& bytes = lines_.bytes();
  if (bytes.size() - at_ < size)
    throw IoError(fmt::format("{}: the data of this ply file end within {}", file_.string(), object()));
  const char* const first = bytes.data() + at_;
  at_ += size;
  const bool swap = (encoding_ == Encoding::little_endian) != (std::endian::native == std::endian::little);
  switch (type) {
    case Type::int8:
      return decoded<std::int8_t>(first, swap);
    case Type::uint8:
      return decoded<std::uint8_t>(first, swap);
    case Type::int16:
      return decoded<std::int16_t>(first, swap);
    case Type::uint16:
      return decoded<std::uint16_t>(first, swap);
    case Type::int32:
      return decoded<std::int32_t>(first, swap);
    case Type::uint32:
      return decoded<std::uint32_t>(first, swap);
    case Type::float32:
      return decoded<float>(first, swap);
    case Type::float64:
      return decoded<double>(first, swap);
  }
  return 0;
}

std::size_t PlyReader::list_length(Type type) {
  const double length = value(type);
  // A list takes a byte or a word per value at the least.
  const auto left =
      static_cast<double>(is_text() ? lines_.words().size() - at_ : lines_.bytes().size() - at_);
  if (!(length >= 0) || length != std::floor(length) || length > left)
    throw IoError(fmt::format("{}: {}: a list of {} values, but {} {} are left",
                              is_text() ? lines_.here() : file_.string(), object(), length, left,
                              is_text() ? "values of the line" : "bytes"));
  return static_cast<std::size_t>(length);
}

void PlyReader::vertex(const std::array<std::size_t, 3>& xyz) {
  const Vec3 x(values_[xyz[0]][0], values_[xyz[1]][0], values_[xyz[2]][0]);
  if (!x.allFinite())
    throw InputError(
        fmt::format("{}: {}: ({}, {}, {}) is not finite", file_.string(), object(), x[0], x[1], x[2]));
  mesh_.geometry.vertices.push_back(x);
}

/// Vertices may stand behind the faces; whether there are so many is checked at the end.
Index PlyReader::vertex_number(double given) const {
  if (!(given >= 0 && given < std::numeric_limits<Index>::max()) || given != std::floor(given))
    throw InputError(fmt::format("{}: {} refers to vertex {}; vertices are numbered from 0", file_.string(),
                                 object(), given));
  return static_cast<Index>(given);
}

void PlyReader::face(std::size_t list) {
  std::vector<Index> corners;
  for (const double v : values_[list]) corners.push_back(vertex_number(v));
  if (corners.size() < 3)
    throw InputError(fmt::format("{}: {} has {} corners, but needs at least three", file_.string(), object(),
                                 corners.size()));
  mesh_.geometry.add_face(corners, 0);
}

/// Triangles between each three vertices in a row, every other one turned; −1 begins a new strip. Triangles
/// that name a vertex twice join strips and have no area.
void PlyReader::strips(std::size_t list) {
  std::vector<Index> strip;
  for (const double given : values_[list]) {
    if (given == -1) {
      strip.clear();
      continue;
    }
    strip.push_back(vertex_number(given));
    if (strip.size() < 3) continue;
    std::array<Index, 3> triangle{};
    std::copy(strip.end() - 3, strip.end(), triangle.begin());
    if (strip.size() % 2 == 0) std::swap(triangle[0], triangle[1]);
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
      mesh_.geometry.add_face(triangle, 0);
  }
}

void PlyReader::read_elements(const Element& element) {
  const auto list = [&]() -> std::optional<std::size_t> {
    if (const auto found = element.find("vertex_indices", true)) return found;
    return element.find("vertex_index", true);
  }();
  std::array<std::size_t, 3> xyz{};
  const bool is_vertex = element.name == "vertex", is_face = element.name == "face",
             is_strips = element.name == "tristrips";
  if (is_vertex)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string_view name = std::string_view("xyz").substr(k, 1);
      const auto found = element.find(name, false);
      if (!found)
        throw IoError(fmt::format("{}: element 'vertex' has no property '{}'", file_.string(), name));
      xyz[k] = *found;
    }
  if ((is_face || is_strips) && !list)
    throw IoError(fmt::format("{}: element '{}' has no property 'list … vertex_indices' or '… vertex_index'",
                              file_.string(), element.name));
  if (element.properties.empty()) return;
  values_.resize(element.properties.size());
  element_ = &element;
  for (number_ = 0; number_ < element.count; ++number_) {
    begin_element();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      values_[p].resize(property.count ? list_length(*property.count) : 1);
      for (double& v : values_[p]) v = value(property.type);
    }
    end_element();
    if (is_vertex) vertex(xyz);
    if (is_face) face(*list);
    if (is_strips) strips(*list);
  }
  if (element.name == "edge" && element.count > 0)
    mesh_.warnings.push_back(fmt::format("{} edges are not surfaces: left out", element.count));
}

void PlyReader::require_vertices() const {
  const auto& geometry = mesh_.geometry;
  const auto vertices = static_cast<Index>(geometry.vertices.size());
  for (std::size_t f = 0; f + 1 < geometry.face_start.size(); ++f)
    for (Index k = geometry.face_start[f]; k < geometry.face_start[f + 1]; ++k)
      if (const Index v = geometry.corners[k]; v >= vertices)
        throw InputError(
            fmt::format("{}: face {} (counted from 0) refers to vertex {}, but there are only {}",
                        file_.string(), f, v, vertices));
}

MeshFile PlyReader::read() {
  read_header();
  at_ = lines_.end();
  for (const Element& element : elements_) read_elements(element);
  if (is_text() ? lines_.next_words() : at_ != lines_.bytes().size())
    throw IoError(fmt::format("{}: goes on after the last of the elements that the header counts",
                              is_text() ? lines_.here() : file_.string()));
  require_vertices();
  mesh_.materials.push_back({.name = kDefaultMaterial});
  return std::move(mesh_);
}

}  // namespace

MeshFile read_ply(const std::filesystem::path& file) {
  return PlyReader(file).read();
}

}  // namespace radiosity
