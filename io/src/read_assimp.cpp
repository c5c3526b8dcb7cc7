// SPDX-License-Identifier: GPL-3.0-or-later
#include <assimp/material.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <fstream>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

BandValues rgb(const aiColor4D& c) {
  BandValues values(3);
  values << c.r, c.g, c.b;
  return values;
}

/// Node transforms are chained in double precision: a building's parts may be placed by long chains.
Eigen::Matrix4d matrix(const aiMatrix4x4& m) {
  Eigen::Matrix4d result;
  for (unsigned r = 0; r < 4; ++r)
    for (unsigned c = 0; c < 4; ++c) result(r, c) = m[r][c];
  return result;
}

class AssimpReader {
 public:
  explicit AssimpReader(const aiScene& scene) : scene_(scene) {}

  MeshFile read() {
    visit(*scene_.mRootNode, Eigen::Matrix4d::Identity());
    if (skipped_ > 0)
      mesh_.warnings.push_back(fmt::format("{} points and lines are not surfaces: left out", skipped_));
    return std::move(mesh_);
  }

 private:
  void visit(const aiNode& node, const Eigen::Matrix4d& parent) {
    const Eigen::Matrix4d to_world = parent * matrix(node.mTransformation);
    for (unsigned m = 0; m < node.mNumMeshes; ++m) add(*scene_.mMeshes[node.mMeshes[m]], to_world);
    for (unsigned c = 0; c < node.mNumChildren; ++c) visit(*node.mChildren[c], to_world);
  }

  void add(const aiMesh& part, const Eigen::Matrix4d& to_world) {
    auto& geometry = mesh_.geometry;
    const auto first = static_cast<Index>(geometry.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& x = part.mVertices[v];
      geometry.vertices.push_back((to_world * Eigen::Vector4d(x.x, x.y, x.z, 1)).head<3>());
    }
    // A reflecting transform turns the order of corners, and with it the front, round.
    const bool mirrored = to_world.topLeftCorner<3, 3>().determinant() < 0;
    std::vector<Index> corners;
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices < 3) {
        ++skipped_;
        continue;
      }
      corners.clear();
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        corners.push_back(first + static_cast<Index>(face.mIndices[mirrored ? face.mNumIndices - 1 - k : k]));
      geometry.add_face(corners, material(part.mMaterialIndex));
    }
  }

  Index material(unsigned number) {
    const auto found = numbers_.find(number);
    if (found != numbers_.end()) return found->second;
    const auto result = static_cast<Index>(mesh_.materials.size());
    numbers_.emplace(number, result);

    const aiMaterial& source = *scene_.mMaterials[number];
    MeshMaterial target{.name = source.GetName().C_Str()};
    if (target.name == AI_DEFAULT_MATERIAL_NAME) {
      target.name = kDefaultMaterial;
      mesh_.warnings.push_back(fmt::format("faces without a material get '{}'", kDefaultMaterial));
    } else {
      if (target.name.empty()) target.name = fmt::format("material_{}", number);
      aiColor4D colour;
      if (source.Get(AI_MATKEY_BASE_COLOR, colour) == AI_SUCCESS ||
          source.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS)
        target.reflectance = rgb(colour);
      if (source.Get(AI_MATKEY_COLOR_EMISSIVE, colour) == AI_SUCCESS) target.emission = rgb(colour);
      int two_sided = 0;
      if (source.Get(AI_MATKEY_TWOSIDED, two_sided) == AI_SUCCESS && two_sided != 0)
        mesh_.warnings.push_back(fmt::format(
            "material '{}' is marked double-sided; only its front counts unless a scene file sets "
            "sides = \"both\"",
            target.name));
      if (source.GetTextureCount(aiTextureType_BASE_COLOR) + source.GetTextureCount(aiTextureType_DIFFUSE) +
              source.GetTextureCount(aiTextureType_EMISSIVE) >
          0)
        mesh_.warnings.push_back(fmt::format("material '{}': its texture is ignored", target.name));
    }
    mesh_.materials.push_back(std::move(target));
    return result;
  }

  const aiScene& scene_;
  MeshFile mesh_;
  std::map<unsigned, Index> numbers_;
  std::size_t skipped_ = 0;
};

/// The header of an IFC file says FILE_SCHEMA(('IFC2X3')).
void require_known_schema(const std::filesystem::path& file) {
  constexpr std::size_t kHeader = 100'000;
  std::ifstream stream(file, std::ios::binary);
  std::string header(kHeader, '\0');
  stream.read(header.data(), static_cast<std::streamsize>(header.size()));
  header.resize(stream.gcount());
  std::transform(header.begin(), header.end(), header.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const std::size_t open = header.find('\'', std::min(header.find("FILE_SCHEMA"), header.size()));
  const std::size_t close = header.find('\'', std::min(open, header.size() - 1) + 1);
  if (close == std::string::npos) return;  // the reader will say what is wrong
  const std::string schema = header.substr(open + 1, close - open - 1);
  if (!schema.starts_with("IFC2X3"))
    throw IoError(
        fmt::format("{}: its schema is {}, and only IFC2X3 is read: export it as IFC2x3, glTF or OBJ",
                    file.string(), schema));
}

}  // namespace

bool assimp_reads(const std::string& extension) {
  return !extension.empty() && Assimp::Importer().IsExtensionSupported(extension);
}

MeshFile read_assimp(const std::filesystem::path& file) {
  if (lower_case_extension(file) == ".ifc") require_known_schema(file);
  return read_isolated(file, fmt::format("assimp {}.{}", aiGetVersionMajor(), aiGetVersionMinor()), [&] {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(file.string(), 0);
    // Assimp catches what it does not expect and keeps the words.
    if (!scene && std::string_view(importer.GetErrorString()).find("bad_alloc") != std::string_view::npos)
      throw std::bad_alloc();
    if (!scene || !scene->mRootNode || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0)
      throw IoError(fmt::format("{}: cannot be understood: {}", file.string(),
                                scene ? "it holds no complete scene" : importer.GetErrorString()));
    return AssimpReader(*scene).read();
  });
}

}  // namespace radiosity
