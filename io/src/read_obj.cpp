// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "mesh_file.hpp"
#include "radiosity/io/nearest_name.hpp"
#include "radiosity/meshing/error.hpp"
#include "text.hpp"
#include "texture_mean.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

/// Statements that say nothing about surfaces and their materials: attributes of vertices, groups, points and
/// lines, display.
constexpr std::array kWithoutSurfaces{"vt",       "vn",     "vp",     "g",          "o",        "s",
                                      "p",        "l",      "mg",     "lod",        "bevel",    "c_interp",
                                      "d_interp", "maplib", "usemap", "shadow_obj", "trace_obj"};

/// The path of a file that an OBJ or MTL file names, relative to it. Names come from Windows too, and in
/// quotation marks.
fs::path named_file(const fs::path& from, std::string_view name) {
  if (name.size() > 1 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
  std::string path(name);
  std::replace(path.begin(), path.end(), '\\', '/');
  return from.parent_path() / path;
}

bool is_file(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored);
}

/// The file name of a `map_…` statement's arguments: what follows its options.
std::string_view texture_name(std::string_view arguments) {
  struct Option {
    std::string_view name;
    int values;
  };
  // -o, -s and -t take one to three numbers; the others what the table says.
  constexpr std::array kOptions{Option{"-blendu", 1}, Option{"-blendv", 1},  Option{"-boost", 1},
                                Option{"-mm", 2},     Option{"-o", 3},       Option{"-s", 3},
                                Option{"-t", 3},      Option{"-texres", 1},  Option{"-clamp", 1},
                                Option{"-bm", 1},     Option{"-imfchan", 1}, Option{"-type", 1},
                                Option{"-cc", 1}};
  const auto word = [&] { return arguments.substr(0, arguments.find_first_of(" \t")); };
  for (;;) {
    const auto option =
        std::find_if(kOptions.begin(), kOptions.end(), [&](const Option& o) { return o.name == word(); });
    if (option == kOptions.end()) return arguments;
    arguments = after_first_word(arguments);
    for (int k = 0; k < option->values && (option->values < 3 || finite_number(word())); ++k)
      arguments = after_first_word(arguments);
  }
}

struct Finish {
  std::optional<BandValues> kd, ke, ks, tf;
  std::optional<double> ns, ni, d, tr;
  std::optional<std::int64_t> illum;
  std::optional<fs::path> kd_texture;
};

/// Not tinyobjloader: it reads what is no number as 0, a vertex number 1.5 as 1, and does not tell the line.
class ObjReader {
 public:
  explicit ObjReader(const fs::path& file)
      : file_(file), lines_(file, read_bytes(file), TextLines::Continuation::backslash) {}

  MeshFile read();

 private:
  void statement();
  void vertex();
  void face();
  Index corner(std::string_view word) const;
  void libraries(std::string_view names);
  void library(const fs::path& file);
  /// Whether the line says anything about the finish.
  bool read_finish(const TextLines& lines, Finish& finish);
  BandValues colour(const TextLines& lines) const;
  void resolve_faces();
  MeshMaterial material(const std::string& name, Index first_face);
  BandValues reflectance(const std::string& name, const Finish& finish);
  void finish_specular(const Finish& finish, MeshMaterial& material);
  static double number(const TextLines& lines, double least, double most);
  void warn();

  fs::path file_;
  TextLines lines_;
  MeshFile mesh_;
  std::vector<Index> corners_;
  std::vector<Index> face_lines_;
  std::vector<std::string> uses_{""};   ///< the names of all usemtl lines, after the state before the first
  std::vector<std::size_t> face_uses_;  ///< per face, its number in uses_
  std::map<std::string, Finish> finishes_;
  std::vector<std::string> finish_order_;
  std::vector<std::string> without_kd_, invisible_;
  MaterialNumbers numbers_;
  std::set<fs::path> libraries_;
  std::vector<std::string> missing_libraries_;  ///< "'room.mtl' (line 3) does not exist"
  std::map<fs::path, std::optional<BandValues>> textures_;
  std::vector<fs::path> unread_textures_;
  Index unnamed_ = 0;         ///< faces without a material
  Index not_understood_ = 0;  ///< statements
  std::string not_understood_first_;
};

void ObjReader::statement() {
  const auto keyword = lines_.words().front();
  if (keyword == "v")
    vertex();
  else if (keyword == "f")
    face();
  else if (keyword == "usemtl")
    uses_.emplace_back(after_first_word(lines_.text()));
  else if (keyword == "mtllib")
    libraries(after_first_word(lines_.text()));
  else if (std::find(kWithoutSurfaces.begin(), kWithoutSurfaces.end(), keyword) == kWithoutSurfaces.end() &&
           not_understood_++ == 0)
    not_understood_first_ = fmt::format("{}: '{}'", lines_.here(), shown(lines_.text()));
}

void ObjReader::vertex() {
  mesh_.geometry.vertices.push_back(
      coordinates(lines_, 1, fmt::format("vertex {}", mesh_.geometry.vertices.size() + 1)));
}

Index ObjReader::corner(std::string_view word) const {
  const auto vertices = static_cast<std::int64_t>(mesh_.geometry.vertices.size());
  const auto given = whole_number(word.substr(0, word.find('/')));
  if (!given)
    throw InputError(fmt::format("{}: face {}: corner '{}' does not begin with the number of a vertex",
                                 lines_.here(), face_lines_.size() + 1, shown(word)));
  // Positive numbers may refer to vertices that follow; those are checked at the end.
  const std::int64_t v = *given > 0 ? *given - 1 : *given + vertices;
  if (*given == 0 || v < 0)
    throw InputError(
        fmt::format("{}: face {} refers to vertex {}; vertices are numbered from 1, or counted back from "
                    "the last of the {} before the face with -1, -2, …",
                    lines_.here(), face_lines_.size() + 1, *given, vertices));
  if (v >= std::numeric_limits<Index>::max())
    throw InputError(fmt::format("{}: face {} refers to vertex {}; no scene has that many", lines_.here(),
                                 face_lines_.size() + 1, *given));
  return static_cast<Index>(v);
}

void ObjReader::face() {
  const auto& words = lines_.words();
  if (words.size() < 4)
    throw InputError(fmt::format("{}: face {} has {} corners, but needs at least three", lines_.here(),
                                 face_lines_.size() + 1, words.size() - 1));
  corners_.clear();
  for (std::size_t k = 1; k < words.size(); ++k) corners_.push_back(corner(words[k]));
  mesh_.geometry.add_face(corners_, 0);
  face_lines_.push_back(lines_.number());
  face_uses_.push_back(uses_.size() - 1);
}

/// Names are separated by blanks and may hold blanks: the longest that exists is taken, from left to right.
void ObjReader::libraries(std::string_view names) {
  while (!names.empty()) {
    std::string_view name = names;
    while (!is_file(named_file(file_, name))) {
      const auto blank = name.find_last_of(" \t");
      if (blank == std::string_view::npos) break;
      name = trimmed(name.substr(0, blank));
    }
    if (const fs::path found = named_file(file_, name); is_file(found))
      library(found);
    else
      missing_libraries_.push_back(
          fmt::format("material library '{}' ({}) does not exist", name, lines_.here()));
    names = trimmed(names.substr(name.size()));
  }
}

void ObjReader::library(const fs::path& file) {
  if (!libraries_.insert(file).second) return;
  TextLines lines(file, read_bytes(file));
  Finish* finish = nullptr;
  while (lines.next_words()) {
    if (lines.words().front() != "newmtl") {
      Finish nameless;
      if (read_finish(lines, finish ? *finish : nameless) && !finish)
        mesh_.warnings.push_back(
            fmt::format("{}: '{}' belongs to no material: left out", lines.here(), shown(lines.text())));
      continue;
    }
    const std::string name(after_first_word(lines.text()));
    if (name.empty()) {
      mesh_.warnings.push_back(
          fmt::format("{}: a material without a name: no face can use it", lines.here()));
      finish = nullptr;
      continue;
    }
    const auto [entry, added] = finishes_.try_emplace(name);
    finish = &entry->second;
    if (added)
      finish_order_.push_back(name);
    else
      mesh_.warnings.push_back(
          fmt::format("{}: material '{}' is defined again; the last definition holds", lines.here(), name));
    *finish = {};
  }
}

BandValues ObjReader::colour(const TextLines& lines) const {
  const auto& words = lines.words();
  // One number stands for all three.
  const std::size_t given = words.size() - 1;
  BandValues rgb(3);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = given == 1 || given >= 3 ? finite_number(words[given == 1 ? 1 : k + 1]) : std::nullopt;
    if (!value)
      throw InputError(fmt::format("{}: '{}' must be followed by three numbers (or one for all three)",
                                   lines.here(), shown(lines.text())));
    rgb[static_cast<Eigen::Index>(k)] = *value;
  }
  return rgb;
}

double ObjReader::number(const TextLines& lines, double least, double most) {
  const auto& words = lines.words();
  // "d -halo 0.5" thins out towards the edges of a thing; what is in the middle is taken.
  const auto value = words.size() > 1 ? finite_number(words.back()) : std::nullopt;
  if (!value || *value < least || *value > most)
    throw InputError(fmt::format("{}: '{}' must be followed by a number {}", lines.here(),
                                 shown(lines.text()), most > 1 ? "that is at least 0" : "from 0 to 1"));
  return *value;
}

bool ObjReader::read_finish(const TextLines& lines, Finish& finish) {
  const auto keyword = lines.words().front();
  if (keyword == "Kd")
    finish.kd = colour(lines);
  else if (keyword == "Ke")
    finish.ke = colour(lines);
  else if (keyword == "Ks")
    finish.ks = colour(lines);
  else if (keyword == "Tf")
    finish.tf = colour(lines);
  else if (keyword == "Ns")
    finish.ns = number(lines, 0, std::numeric_limits<double>::max());
  else if (keyword == "Ni")
    finish.ni = number(lines, 0, std::numeric_limits<double>::max());
  else if (keyword == "d")
    finish.d = number(lines, 0, 1);
  else if (keyword == "Tr")
    finish.tr = number(lines, 0, 1);
  else if (keyword == "illum")
    finish.illum = lines.words().size() > 1 ? whole_number(lines.words()[1]) : std::nullopt;
  else if (keyword == "map_Kd")
    finish.kd_texture = named_file(lines.file(), texture_name(after_first_word(lines.text())));
  else
    return false;
  return true;
}

/// Kd times the mean of its texture; either alone where the other is not there.
BandValues ObjReader::reflectance(const std::string& name, const Finish& finish) {
  std::optional<BandValues> texture;
  if (finish.kd_texture) {
    const auto [entry, added] = textures_.try_emplace(*finish.kd_texture);
    if (added) {
      entry->second = texture_mean(*finish.kd_texture);
      if (!entry->second) unread_textures_.push_back(*finish.kd_texture);
    }
    texture = entry->second;
  }
  if (finish.kd && texture) return *finish.kd * *texture;
  if (finish.kd) return *finish.kd;
  if (texture) return *texture;
  without_kd_.push_back(name);
  return BandValues::Zero(1);
}

MeshMaterial ObjReader::material(const std::string& name, Index first_face) {
  MeshMaterial result{.name = name};
  const auto found = finishes_.find(name);
  if (found == finishes_.end()) {
    if (!uses_[face_uses_[first_face]].empty())
      result.undefined = fmt::format(
          "{}:{}: face {} uses material '{}', which nothing defines{}{}", file_.string(),
          face_lines_[first_face], first_face + 1, name,
          missing_libraries_.empty() ? "; define it in a material library (mtllib) or a scene file" : "; ",
          fmt::join(missing_libraries_, "; "));
    return result;
  }
  const Finish& finish = found->second;
  result.reflectance = reflectance(name, finish);
  if (finish.ke) result.emission = *finish.ke;
  finish_specular(finish, result);
  return result;
}

/// A dissolve leaves the share d of the surface as it is; through the rest light goes, coloured by Tf, which alone makes glass of the
/// models of illumination that refract (4, 6, 7 and 9). In the others d 0 is taken for opaque: nobody models what cannot be seen, and
/// some exporters mean Tr by d. Models 0 and 1 have no gloss; from 3 on, mirrors need no exponent.
void ObjReader::finish_specular(const Finish& finish, MeshMaterial& material) {
  const std::int64_t model = finish.illum.value_or(2);
  const bool glass = model == 4 || model == 6 || model == 7 || model == 9;
  const BandValues filter = finish.tf.value_or(BandValues::Ones(1));
  const double dissolve = finish.d.value_or(1 - finish.tr.value_or(0));  // some mean d by Tr, but say d, too
  if (dissolve == 0 && !glass) {
    invisible_.push_back(material.name);
  } else if (dissolve < 1) {
    material.reflectance *= dissolve;
    material.transmission = (1 - dissolve) * filter;
  } else if (glass && finish.tf) {
    material.transmission = filter;
  }
  if (finish.ks && model >= 2) {
    material.specular = *finish.ks;
    if (finish.ns || model < 3) material.shininess = finish.ns.value_or(0);
  }
  material.refractive_index = finish.ni && *finish.ni > 0 ? *finish.ni : 1;
}

void ObjReader::resolve_faces() {
  auto& geometry = mesh_.geometry;
  const auto vertices = static_cast<Index>(geometry.vertices.size());
  for (std::size_t f = 0; f < face_lines_.size(); ++f) {
    for (Index k = geometry.face_start[f]; k < geometry.face_start[f + 1]; ++k) {
      const Index v = geometry.corners[k];
      if (v >= vertices)
        throw InputError(fmt::format("{}:{}: face {} refers to vertex {}, but the file has only {}",
                                     file_.string(), face_lines_[f], f + 1, v + 1, vertices));
    }
    const std::string& use = uses_[face_uses_[f]];
    if (use.empty()) ++unnamed_;
    const std::string& name = use.empty() ? kDefaultMaterial : use;
    bool added = false;
    geometry.face_material[f] = numbers_.number(name, added);
    if (added) mesh_.materials.push_back(material(name, static_cast<Index>(f)));
  }
}

void ObjReader::warn() {
  auto& warnings = mesh_.warnings;
  if (unnamed_ > 0)
    warnings.push_back(fmt::format("{} of {} faces have no material: they get '{}'", unnamed_,
                                   face_lines_.size(), kDefaultMaterial));
  for (const auto& library : missing_libraries_) warnings.push_back(library);
  if (without_kd_.size() == 1)
    warnings.push_back(fmt::format("material '{}' has no Kd: its reflectance is 0", without_kd_[0]));
  else if (!without_kd_.empty())
    warnings.push_back(fmt::format("{} materials have no Kd: their reflectance is 0: {}", without_kd_.size(),
                                   name_some(without_kd_)));
  if (!invisible_.empty())
    warnings.push_back(
        fmt::format("d is 0 (or Tr 1), nothing to be seen, for {}: taken for opaque", name_some(invisible_)));
  if (!unread_textures_.empty())
    warnings.push_back(fmt::format(
        "{} of {} textures (map_Kd) cannot be read: reflectances are Kd alone there; the first is '{}'{}",
        unread_textures_.size(), textures_.size(), unread_textures_.front().string(),
        is_file(unread_textures_.front()) ? "" : ", which does not exist"));
  if (not_understood_ > 0)
    warnings.push_back(fmt::format("{} statements are not understood and left out; the first is {}",
                                   not_understood_, not_understood_first_));
  std::vector<std::string> unused;
  for (const auto& name : finish_order_) {
    bool added = false;
    numbers_.number(name, added);
    if (added) unused.push_back(name);
  }
  if (unused.size() == 1)
    warnings.push_back(fmt::format("material '{}' is defined, but no face uses it", unused[0]));
  else if (!unused.empty())
    warnings.push_back(
        fmt::format("{} materials are defined, but no face uses them: {}", unused.size(), name_some(unused)));
}

MeshFile ObjReader::read() {
  while (lines_.next_words()) statement();
  resolve_faces();
  warn();
  return std::move(mesh_);
}

}  // namespace

MeshFile read_obj(const fs::path& file) {
  return ObjReader(file).read();
}

}  // namespace radiosity
