// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <streambuf>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

/// Passes characters on and remembers the line they belong to: tinyobjloader's callbacks do not say where they
/// are.
class LineRecorder : public std::streambuf {
 public:
  explicit LineRecorder(std::streambuf& source) : source_(source) {}
  Index number() const { return number_; }
  const std::string& text() const { return text_; }

 protected:
  int_type underflow() override { return source_.sgetc(); }
  int_type uflow() override {
    const int_type next = source_.sbumpc();
    if (next == traits_type::eof()) return next;
    const char c = traits_type::to_char_type(next);
    if (c == '\n' && previous_ == '\r') {  // one end of line
      previous_ = c;
      return next;
    }
    if (previous_ == '\n' || previous_ == '\r') {
      ++number_;
      text_.clear();
    }
    if (c != '\n' && c != '\r') text_ += c;
    previous_ = c;
    return next;
  }

 private:
  std::streambuf& source_;
  Index number_ = 0;
  std::string text_;
  char previous_ = '\n';
};

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  for (std::size_t end = 0;;) {
    const auto first = line.find_first_not_of(" \t\r", end);
    if (first == std::string_view::npos) return result;
    end = std::min(line.find_first_of(" \t\r", first), line.size());
    result.push_back(line.substr(first, end - first));
  }
}

/// tinyobjloader reads what is not a number as 0 and is off by some units in the last place; so every number
/// that matters is read again, correctly rounded.
std::optional<double> finite_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return {};
  return value;
}

struct Finish {
  std::optional<BandValues> kd, ke;
};

class ObjReader : public tinyobj::MaterialReader {
 public:
  explicit ObjReader(const fs::path& file) : file_(file), stream_(file), lines_(*stream_.rdbuf()) {}

  MeshFile read();

  /// A material library: called by tinyobjloader for each name of a `mtllib` line.
  bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                  std::map<std::string, int>* numbers, std::string* warning, std::string* error) override;

 private:
  std::string here() const { return fmt::format("{}:{}", file_.string(), lines_.number()); }
  void vertex();
  void face(const tinyobj::index_t* indices, int count);
  void read_finishes(const fs::path& library, std::istream& stream);
  MeshMaterial material(const std::string& name, Index first_face);

  fs::path file_;
  std::ifstream stream_;
  LineRecorder lines_;
  MeshFile mesh_;
  std::vector<Index> face_lines_;
  std::vector<std::string> uses_{""};   ///< the names of all usemtl lines, after the state before the first
  std::vector<std::size_t> face_uses_;  ///< per face, its number in uses_
  std::map<std::string, Finish> finishes_;
  std::vector<std::string> finish_order_;
  std::vector<std::string> missing_libraries_;  ///< "'room.mtl' (line 3) does not exist"
};

void ObjReader::vertex() {
  const auto parts = words(lines_.text());
  Vec3 x;
  for (std::size_t k = 0; k < 3; ++k) {
    if (k + 1 >= parts.size())
      throw InputError(fmt::format("{}: vertex {} has {} coordinates, but needs three", here(),
                                   mesh_.geometry.vertices.size() + 1, parts.size() - 1));
    const auto value = finite_number(parts[k + 1]);
    if (!value)
      throw InputError(fmt::format("{}: vertex {}: coordinate '{}' is not a finite number", here(),
                                   mesh_.geometry.vertices.size() + 1, parts[k + 1]));
    x[static_cast<Eigen::Index>(k)] = *value;
  }
  mesh_.geometry.vertices.push_back(x);
}

void ObjReader::face(const tinyobj::index_t* indices, int count) {
  if (count < 3)
    throw InputError(fmt::format("{}: face {} has {} corners, but needs at least three", here(),
                                 face_lines_.size() + 1, count));
  const auto vertices = static_cast<Index>(mesh_.geometry.vertices.size());
  std::vector<Index> corners;
  for (int k = 0; k < count; ++k) {
    const Index given = indices[k].vertex_index;
    // Positive numbers may refer to vertices that follow; those are checked at the end.
    const Index v = given > 0 ? given - 1 : given + vertices;
    if (given == 0 || v < 0)
      throw InputError(
          fmt::format("{}: face {} refers to vertex {}; vertices are numbered from 1, or counted back from "
                      "the last of the {} before the face with -1, -2, …",
                      here(), face_lines_.size() + 1, given, vertices));
    corners.push_back(v);
  }
  mesh_.geometry.add_face(corners, 0);
  face_lines_.push_back(lines_.number());
  face_uses_.push_back(uses_.size() - 1);
}

bool ObjReader::operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                           std::map<std::string, int>* numbers, std::string* warning, std::string* error) {
  // tinyobjloader splits names at blanks; a name that holds one is tried as a whole first.
  std::string whole = trimmed(std::string_view(trimmed(lines_.text())).substr(6));
  for (std::string candidate : {whole, name}) {
    for (char& c : candidate)
      if (c == '\\') c = '/';
    const fs::path library = file_.parent_path() / candidate;
    std::error_code ignored;
    if (!fs::is_regular_file(library, ignored)) continue;
    std::ifstream stream(library);
    if (!stream) throw IoError(fmt::format("{}: cannot be opened", library.string()));
    read_finishes(library, stream);
    stream.clear();
    stream.seekg(0);
    tinyobj::LoadMtl(numbers, materials, &stream, warning, error);
    return true;
  }
  missing_libraries_.push_back(fmt::format("material library '{}' ({}) does not exist", name, here()));
  return false;
}

void ObjReader::read_finishes(const fs::path& library, std::istream& stream) {
  std::string line;
  Finish* finish = nullptr;
  for (Index number = 1; std::getline(stream, line); ++number) {
    const auto parts = words(line);
    if (parts.empty()) continue;
    if (parts[0] == "newmtl") {
      const std::string name = trimmed(std::string_view(trimmed(line)).substr(6));
      const auto [entry, added] = finishes_.try_emplace(name);
      finish = &entry->second;
      if (added)
        finish_order_.push_back(name);
      else
        mesh_.warnings.push_back(
            fmt::format("{}:{}: material '{}' is defined again; the last definition holds", library.string(),
                        number, name));
      *finish = {};
    } else if (finish && (parts[0] == "Kd" || parts[0] == "Ke")) {
      BandValues rgb(3);
      // One number stands for all three.
      const std::size_t given = parts.size() - 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto value =
            given == 1 || given >= 3 ? finite_number(parts[given == 1 ? 1 : k + 1]) : std::nullopt;
        if (!value)
          throw InputError(fmt::format("{}:{}: '{}' must be followed by three numbers (or one for all three)",
                                       library.string(), number, trimmed(line)));
        rgb[static_cast<Eigen::Index>(k)] = *value;
      }
      (parts[0] == "Kd" ? finish->kd : finish->ke) = rgb;
    }
  }
}

MeshMaterial ObjReader::material(const std::string& name, Index first_face) {
  MeshMaterial result{.name = name};
  const auto found = finishes_.find(name);
  if (found == finishes_.end()) {
    if (!uses_[face_uses_[static_cast<std::size_t>(first_face)]].empty())
      result.undefined = fmt::format(
          "{}:{}: face {} uses material '{}', which nothing defines{}{}", file_.string(),
          face_lines_[static_cast<std::size_t>(first_face)], first_face + 1, name,
          missing_libraries_.empty() ? "; define it in a material library (mtllib) or a scene file" : "; ",
          fmt::join(missing_libraries_, "; "));
    return result;
  }
  if (found->second.kd) {
    result.reflectance = *found->second.kd;
  } else {
    result.reflectance = BandValues::Zero(1);
    mesh_.warnings.push_back(fmt::format("material '{}' has no Kd: its reflectance is 0", name));
  }
  if (found->second.ke) result.emission = *found->second.ke;
  return result;
}

MeshFile ObjReader::read() {
  tinyobj::callback_t callbacks;
  callbacks.vertex_cb = [](void* self, tinyobj::real_t, tinyobj::real_t, tinyobj::real_t, tinyobj::real_t) {
    static_cast<ObjReader*>(self)->vertex();
  };
  callbacks.index_cb = [](void* self, tinyobj::index_t* indices, int count) {
    static_cast<ObjReader*>(self)->face(indices, count);
  };
  callbacks.usemtl_cb = [](void* self, const char* name, int) {
    static_cast<ObjReader*>(self)->uses_.push_back(trimmed(name));
  };
  std::istream numbered(&lines_);
  std::string warning, error;
  const bool parsed = tinyobj::LoadObjWithCallback(numbered, callbacks, this, this, &warning, &error);
  if (!parsed) throw IoError(fmt::format("{}: {}", here(), trimmed(error)));
  if (stream_.bad()) throw IoError(fmt::format("{}: cannot be read to its end", file_.string()));

  auto& geometry = mesh_.geometry;
  const auto vertices = static_cast<Index>(geometry.vertices.size());
  Index unnamed = 0;
  MaterialNumbers numbers;
  for (std::size_t f = 0; f < face_lines_.size(); ++f) {
    for (Index k = geometry.face_start[f]; k < geometry.face_start[f + 1]; ++k) {
      const Index v = geometry.corners[static_cast<std::size_t>(k)];
      if (v >= vertices)
        throw InputError(fmt::format("{}:{}: face {} refers to vertex {}, but the file has only {}",
                                     file_.string(), face_lines_[f], f + 1, v + 1, vertices));
    }
    const std::string& use = uses_[face_uses_[f]];
    if (use.empty()) ++unnamed;
    const std::string& name = use.empty() ? kDefaultMaterial : use;
    bool added = false;
    geometry.face_material[f] = numbers.number(name, added);
    if (added) mesh_.materials.push_back(material(name, static_cast<Index>(f)));
  }
  if (unnamed > 0)
    mesh_.warnings.push_back(fmt::format("{} of {} faces have no material: they get '{}'", unnamed,
                                         face_lines_.size(), kDefaultMaterial));
  for (const auto& library : missing_libraries_) mesh_.warnings.push_back(library);
  for (const auto& name : finish_order_) {
    bool added = false;
    numbers.number(name, added);
    if (added) mesh_.warnings.push_back(fmt::format("material '{}' is defined, but no face uses it", name));
  }
  return std::move(mesh_);
}

}  // namespace

MeshFile read_obj(const fs::path& file) {
  return ObjReader(file).read();
}

}  // namespace radiosity
