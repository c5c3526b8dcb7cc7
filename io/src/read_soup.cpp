// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>
#include <map>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "text.hpp"

namespace radiosity {
namespace {

/// Not CGAL's readers: they do not tell what is wrong where, take letters for numbers, and guess whether an
/// STL file is text.
class OffReader {
 public:
  explicit OffReader(const std::filesystem::path& file) : lines_(file, read_bytes(file)) {}

  MeshFile read() {
    read_header();
    for (std::int64_t v = 0; v < vertices_; ++v) {
      next_line("vertex", v, vertices_);
      vertex(v);
    }
    for (std::int64_t f = 0; f < faces_; ++f) {
      next_line("face", f, faces_);
      face(f);
    }
    if (lines_.next_words())
      refuse(fmt::format("goes on after the {} vertices and {} faces that its header counts", vertices_,
                         faces_));
    mesh_.materials.push_back({.name = kDefaultMaterial});
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw IoError(fmt::format("{}: {}", lines_.here(), what));
  }

  void next_line(std::string_view object, std::int64_t number, std::int64_t count) {
    if (!lines_.next_words())
      throw IoError(
          fmt::format("{}: ends before {} {} (counted from 0); the header of this off file counts {}",
                      lines_.file().string(), object, number, count));
  }

  /// Values of a vertex after its coordinates: [ST][C][N]OFF. Binary files, and dimensions other than three
  /// (4OFF, nOFF), are refused.
  void read_keyword(std::string_view keyword) {
    if (keyword.starts_with("ST")) {
      most_extra_ += 2;
      keyword.remove_prefix(2);
    }
    const bool has_colours = keyword.starts_with('C');
    if (has_colours) {
      most_extra_ += 4;
      keyword.remove_prefix(1);
    }
    if (keyword.starts_with('N')) {
      most_extra_ += 3;
      keyword.remove_prefix(1);
    }
    if (keyword != "OFF")
      refuse(
          "does not begin with OFF, or COFF, NOFF, CNOFF, STOFF …: no off file, or one of a kind that is not "
          "read");
  }

  /// "OFF", then "8 6 12" in the same line or the next. The number of edges may be missing, and the first
  /// number may stick to the keyword, as in the ModelNet files.
  void read_header() {
    if (!lines_.next_words()) throw IoError(fmt::format("{}: is empty, no off file", lines_.file().string()));
    std::vector<std::string_view> counts = lines_.words();
    const std::size_t letters = std::min(counts[0].find_first_of("0123456789", 1), counts[0].size());
    read_keyword(counts[0].substr(0, letters));
    counts[0].remove_prefix(letters);
    if (counts[0].empty()) counts.erase(counts.begin());
    if (counts.empty()) {
      if (!lines_.next_words())
        throw IoError(fmt::format("{}: ends within the header", lines_.file().string()));
      counts = lines_.words();
    }
    if (counts[0] == "BINARY") refuse("binary off files are not read");
    if (counts.size() < 2 || counts.size() > 3)
      refuse("expected the numbers of vertices, faces and, if given, edges");
    for (const auto count : counts)
      if (const auto value = whole_number(count); !value || *value < 0)
        refuse(fmt::format("'{}' is not a number of vertices, faces or edges", shown(count)));
    vertices_ = *whole_number(counts[0]);
    faces_ = *whole_number(counts[1]);
  }

  void vertex(std::int64_t number) {
    const std::string object = fmt::format("vertex {} (counted from 0)", number);
    mesh_.geometry.vertices.push_back(coordinates(lines_, 0, object));
    if (lines_.words().size() > 3 + most_extra_)
      refuse(fmt::format("{} has {} values, but at most {} belong to it", object, lines_.words().size(),
                         3 + most_extra_));
  }

  /// Number of corners, corners, and a colour of up to four numbers, which is not read.
  void face(std::int64_t number) {
    const auto& words = lines_.words();
    const std::string object = fmt::format("face {} (counted from 0)", number);
    const auto count = whole_number(words[0]);
    if (!count || *count < 0)
      refuse(fmt::format("{}: '{}' is not a number of corners", object, shown(words[0])));
    const auto given = static_cast<std::int64_t>(words.size()) - 1;
    if (*count > given || given > *count + 4)
      refuse(fmt::format("{} has {} corners, but the line goes on with {} values", object, *count, given));
    if (*count < 3)
      throw InputError(
          fmt::format("{}: {} has {} corners, but needs at least three", lines_.here(), object, *count));
    std::vector<Index> corners;
    for (std::size_t k = 1; k <= static_cast<std::size_t>(*count); ++k) {
      const auto v = whole_number(words[k]);
      if (!v || *v < 0 || *v >= vertices_)
        throw InputError(fmt::format("{}: {} refers to vertex {}, but there are only {}, numbered from 0",
                                     lines_.here(), object, shown(words[k]), vertices_));
      corners.push_back(static_cast<Index>(*v));
    }
    mesh_.geometry.add_face(corners, 0);
  }

  TextLines lines_;
  std::size_t most_extra_ = 0;
  std::int64_t vertices_ = 0, faces_ = 0;
  MeshFile mesh_;
};

/// Triangles whose equal corners are one vertex.
class StlMesh {
 public:
  void add(const std::array<Vec3, 3>& triangle) {
    std::array<Index, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x = triangle[k];
      const auto [entry, added] =
          numbers_.try_emplace({x[0], x[1], x[2]}, static_cast<Index>(numbers_.size()));
      if (added) mesh_.geometry.vertices.push_back(x);
      corners[k] = entry->second;
    }
    mesh_.geometry.add_face(corners, 0);
  }
  std::size_t size() const { return mesh_.geometry.face_material.size(); }
  MeshFile take() {
    mesh_.materials.push_back({.name = kDefaultMaterial});
    return std::move(mesh_);
  }

 private:
  std::map<std::array<double, 3>, Index> numbers_;
  MeshFile mesh_;
};

/// solid NAME { facet normal I J K outer loop { vertex X Y Z } × 3 endloop endfacet } endsolid NAME, in upper
/// or lower case, with any blanks and ends of line between the words; any number of solids. Normals are not
/// read: the order of the corners says which side is the front.
class StlTextReader {
 public:
  StlTextReader(const std::filesystem::path& file, std::string bytes) : lines_(file, std::move(bytes)) {}

  MeshFile read() {
    while (next_word()) {
      if (word_ != "solid") refuse("'solid'");
      word_at_ = lines_.words().size();  // the rest of the line is a name
      for (require_word("'facet' or 'endsolid'"); word_ == "facet"; require_word("'facet' or 'endsolid'"))
        facet();
      if (word_ != "endsolid") refuse("'facet' or 'endsolid'");
      word_at_ = lines_.words().size();
    }
    return mesh_.take();
  }

 private:
  [[noreturn]] void refuse(std::string_view expected) const {
    throw IoError(fmt::format("{}: expected {}, found '{}'", lines_.here(), expected, shown(word_)));
  }

  bool next_word() {
    if (word_at_ >= lines_.words().size()) {
      if (!lines_.next_words()) return false;
      word_at_ = 0;
    }
    word_ = lower_case(lines_.words()[word_at_++]);
    return true;
  }

  void require_word(std::string_view expected) {
    if (!next_word())
      throw IoError(fmt::format("{}: this stl file ends after {} facets where {} should follow",
                                lines_.file().string(), mesh_.size(), expected));
  }

  void expect(std::string_view word) {
    const std::string quoted = fmt::format("'{}'", word);
    require_word(quoted);
    if (word_ != word) refuse(quoted);
  }

  void facet() {
    expect("normal");
    // Some programs write 'nan', or none.
    for (int k = 0; k < 4 && word_ != "outer"; ++k) require_word("'outer'");
    if (word_ != "outer") refuse("'outer'");
    expect("loop");
    std::array<Vec3, 3> triangle;
    for (Vec3& x : triangle) {
      expect("vertex");
      for (double& coordinate : x) {
        require_word("a coordinate");
        const auto value = finite_number(word_);
        if (!value)
          throw InputError(
              fmt::format("{}: facet {} (counted from 0): coordinate '{}' is not a finite number",
                          lines_.here(), mesh_.size(), shown(word_)));
        coordinate = *value;
      }
    }
    expect("endloop");
    expect("endfacet");
    mesh_.add(triangle);
  }

  TextLines lines_;
  std::size_t word_at_ = 0;
  std::string word_;
  StlMesh mesh_;
};

/// 80 bytes, the number of triangles, and 50 bytes for each: normal, corners, two bytes without a meaning.
constexpr std::size_t kStlHeader = 84, kStlTriangle = 50;

/// The number of triangles according to the header; the file has kStlHeader bytes at least.
std::size_t stl_count(const std::string& bytes) {
  std::size_t count = 0;
  for (std::size_t k = 4; k-- > 0;) count = count << 8 | static_cast<unsigned char>(bytes[80 + k]);
  return count;
}

MeshFile read_stl_binary(const std::filesystem::path& file, const std::string& bytes) {
  StlMesh mesh;
  for (std::size_t t = 0; t < stl_count(bytes); ++t) {
    std::array<Vec3, 3> triangle;
    for (std::size_t k = 0; k < 9; ++k) {
      std::array<char, 4> raw{};
      std::copy_n(bytes.data() + kStlHeader + t * kStlTriangle + 12 + 4 * k, 4, raw.begin());
      if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
      triangle[k / 3][static_cast<Eigen::Index>(k % 3)] = static_cast<double>(std::bit_cast<float>(raw));
    }
    for (const Vec3& x : triangle)
      if (!x.allFinite())
        throw InputError(fmt::format("{}: facet {} (counted from 0): corner ({}, {}, {}) is not finite",
                                     file.string(), t, x[0], x[1], x[2]));
    mesh.add(triangle);
  }
  return mesh.take();
}

/// Binary files may begin with "solid" too; their size tells them from text, or else the zeros in their data.
MeshFile read_stl(const std::filesystem::path& file) {
  std::string bytes = read_bytes(file);
  const bool has_header = bytes.size() >= kStlHeader;
  const std::size_t needed = has_header ? kStlHeader + stl_count(bytes) * kStlTriangle : 0;
  if (has_header && bytes.size() == needed) return read_stl_binary(file, bytes);
  if (bytes.find('\0') == std::string::npos) return StlTextReader(file, std::move(bytes)).read();
  if (!has_header)
    throw IoError(
        fmt::format("{}: is no stl file: binary ones have {} bytes at least", file.string(), kStlHeader));
  throw IoError(fmt::format(
      "{}: the header of this binary stl file counts {} triangles, that is {} bytes, but the file has {}: "
      "{}",
      file.string(), stl_count(bytes), needed, bytes.size(),
      bytes.size() < needed ? "it is cut off" : "it holds more than its header counts"));
}

}  // namespace

MeshFile read_soup(const std::filesystem::path& file, const std::string& extension) {
  if (extension == ".ply") return read_ply(file);
  if (extension == ".stl") return read_stl(file);
  return OffReader(file).read();
}

}  // namespace radiosity
