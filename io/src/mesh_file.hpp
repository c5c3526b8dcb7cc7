// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "radiosity/meshing/scene.hpp"

namespace radiosity {

/// A material as a mesh file knows it. Values of size 1 hold for every band.
struct MeshMaterial {
  std::string name;
  BandValues reflectance = BandValues::Constant(1, 0.5);
  BandValues emission = BandValues::Zero(1);
  Sides sides = Sides::front;
  BandValues specular = BandValues::Zero(1), transmission = BandValues::Zero(1);
  double shininess = std::numeric_limits<double>::infinity(), refractive_index = 1;
  BandValues refractive_indices = {};
  std::string undefined = {};  ///< not empty: faces use it, nothing defines it; the sentence that says so
};

/// What a reader of one mesh format delivers. Coordinates in the file's own unit.
struct MeshFile {
  Scene::Arrays geometry;  ///< its materials stay empty
  std::vector<MeshMaterial> materials;
  std::vector<std::string> warnings;
};

inline const std::string kDefaultMaterial = "default";

/// One per format. Throw IoError or InputError whose message starts with the file's name.
MeshFile read_obj(const std::filesystem::path& file);
MeshFile read_soup(const std::filesystem::path& file, const std::string& extension);  // .ply .stl .off
MeshFile read_ply(const std::filesystem::path& file);
MeshFile read_vtk(const std::filesystem::path& file, const std::string& extension);  // .vtp .vtu
MeshFile read_gltf(const std::filesystem::path& file);                               // .gltf .glb
MeshFile read_assimp(const std::filesystem::path& file);
bool assimp_reads(const std::string& extension);

/// `read` in a child process, since its library may not survive a damaged file. Throws what `read` throws, and
/// IoError where the library crashes or takes too much memory or time.
MeshFile read_isolated(const std::filesystem::path& file, const std::string& library,
                       const std::function<MeshFile()>& read);

/// Materials with the same name and the same values become one; where only the name is the same, all but the first are numbered,
/// NAME_1, NAME_2, …, with a warning.
void settle_names(MeshFile& mesh);

/// Chooses the reader by the extension. Coordinates are as in the file.
MeshFile read_mesh(const std::filesystem::path& file);

/// Throws IoError unless the file exists, is a file and can be opened.
void require_readable(const std::filesystem::path& file);

std::string lower_case_extension(const std::filesystem::path& file);

/// Numbers materials in the order in which faces first use them.
class MaterialNumbers {
 public:
  /// The number of this key; `added` says whether it is new.
  Index number(const std::string& key, bool& added) {
    const auto [entry, inserted] = numbers_.try_emplace(key, static_cast<Index>(numbers_.size()));
    added = inserted;
    return entry->second;
  }

 private:
  std::map<std::string, Index> numbers_;
};

}  // namespace radiosity
