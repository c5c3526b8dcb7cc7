// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <span>
#include <system_error>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {

namespace fs = std::filesystem;

std::string lower_case_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

void require_readable(const fs::path& file) {
  std::error_code error;
  const auto status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found)
    throw IoError(fmt::format("{}: no such file", file.string()));
  if (fs::is_directory(status)) throw IoError(fmt::format("{}: is a directory, not a file", file.string()));
  errno = 0;
  if (error || !std::ifstream(file))
    throw IoError(fmt::format("{}: cannot be opened: {}", file.string(),
                              error ? error.message() : std::generic_category().message(errno)));
}

namespace {

/// How many corners a loop has before it repeats itself to its end; all of them, if it does not.
std::size_t period(std::span<const Index> loop) {
  for (std::size_t p = 3; p <= loop.size() / 2; ++p)
    if (loop.size() % p == 0 &&
        std::equal(loop.begin() + static_cast<std::ptrdiff_t>(p), loop.end(), loop.begin()))
      return p;
  return loop.size();
}

/// A loop that walks round several times (1 2 3 4 1 2 3 4) bounds the face that it bounds in one round.
void unwind_loops(MeshFile& mesh) {
  auto& geometry = mesh.geometry;
  Scene::Arrays unwound;
  Index count = 0;
  for (std::size_t f = 0; f < geometry.face_material.size(); ++f) {
    const Index first = geometry.face_start[f];
    const std::span loop(geometry.corners.data() + first, geometry.face_start[f + 1] - first);
    const std::size_t round = period(loop);
    if (round < loop.size()) ++count;
    unwound.add_face(loop.first(round), geometry.face_material[f]);
  }
  if (count == 0) return;
  geometry.corners = std::move(unwound.corners);
  geometry.face_start = std::move(unwound.face_start);
  mesh.warnings.push_back(fmt::format("{} round more than once: one round is kept",
                                      count == 1 ? "1 face walks" : fmt::format("{} faces walk", count)));
}

}  // namespace

MeshFile read_mesh(const fs::path& file) {
  require_readable(file);
  const std::string extension = lower_case_extension(file);
  MeshFile mesh;
  if (extension == ".obj")
    mesh = read_obj(file);
  else if (extension == ".ply" || extension == ".stl" || extension == ".off")
    mesh = read_soup(file, extension);
  else if (extension == ".vtp" || extension == ".vtu")
    mesh = read_isolated(file, "VTK", [&] { return read_vtk(file, extension); });
  else if (extension == ".gltf" || extension == ".glb")
    mesh = read_gltf(file);
  else if (extension == ".toml")
    throw InputError(fmt::format("{}: a scene file cannot stand for a mesh", file.string()));
  else if (assimp_reads(extension))
    mesh = read_assimp(file);
  else
    throw IoError(
        fmt::format("{}: unknown extension '{}'; known are .toml .obj .ply .stl .off .gltf .glb .dae "
                    ".ifc .vtp .vtu, and .fbx .3ds .x3d and others through assimp",
                    file.string(), extension));
  if (mesh.geometry.face_material.empty())
    throw InputError(fmt::format("{}: the mesh has no faces", file.string()));
  unwind_loops(mesh);
  settle_names(mesh);
  return mesh;
}

}  // namespace radiosity
