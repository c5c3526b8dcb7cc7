// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "child_process.hpp"
#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

void pack(Packer& packer, const std::string& text) {
  packer.put_all(text.data(), text.size());
}

std::string take_text(Unpacker& unpacker) {
  const auto letters = unpacker.take_all<char>();
  return {letters.begin(), letters.end()};
}

void pack(Packer& packer, const BandValues& values) {
  packer.put_all(values.data(), static_cast<std::size_t>(values.size()));
}

BandValues take_bands(Unpacker& unpacker) {
  const auto values = unpacker.take_all<double>();
  return Eigen::Map<const BandValues>(values.data(), static_cast<Eigen::Index>(values.size()));
}

void pack(Packer& packer, const MeshFile& mesh) {
  const Scene::Arrays& geometry = mesh.geometry;
  packer.put_all(geometry.vertices.empty() ? nullptr : geometry.vertices.front().data(),
                 3 * geometry.vertices.size());
  packer.put_all(geometry.corners.data(), geometry.corners.size());
  packer.put_all(geometry.face_start.data(), geometry.face_start.size());
  packer.put_all(geometry.face_material.data(), geometry.face_material.size());
  packer.put(mesh.materials.size());
  for (const MeshMaterial& material : mesh.materials) {
    pack(packer, material.name);
    pack(packer, material.reflectance);
    pack(packer, material.emission);
    packer.put(material.sides);
    pack(packer, material.specular);
    pack(packer, material.transmission);
    packer.put(material.shininess);
    packer.put(material.refractive_index);
    pack(packer, material.refractive_indices);
    pack(packer, material.undefined);
  }
  packer.put(mesh.warnings.size());
  for (const std::string& warning : mesh.warnings) pack(packer, warning);
}

/// Scene checks all numbers of vertices, corners and materials.
MeshFile take_mesh(Unpacker& unpacker) {
  MeshFile mesh;
  const auto coordinates = unpacker.take_all<double>();
  for (std::size_t k = 0; k + 2 < coordinates.size(); k += 3)
    mesh.geometry.vertices.emplace_back(&coordinates[k]);
  mesh.geometry.corners = unpacker.take_all<Index>();
  mesh.geometry.face_start = unpacker.take_all<Index>();
  mesh.geometry.face_material = unpacker.take_all<Index>();
  for (auto count = unpacker.take<std::size_t>(); count > 0 && unpacker.good(); --count) {
    MeshMaterial material;
    material.name = take_text(unpacker);
    material.reflectance = take_bands(unpacker);
    material.emission = take_bands(unpacker);
    material.sides = unpacker.take<Sides>();
    material.specular = take_bands(unpacker);
    material.transmission = take_bands(unpacker);
    material.shininess = unpacker.take<double>();
    material.refractive_index = unpacker.take<double>();
    material.refractive_indices = take_bands(unpacker);
    material.undefined = take_text(unpacker);
    mesh.materials.push_back(std::move(material));
  }
  for (auto count = unpacker.take<std::size_t>(); count > 0 && unpacker.good(); --count)
    mesh.warnings.push_back(take_text(unpacker));
  return mesh;
}

enum class Answer { mesh, input_error, io_error };

std::string answer(const std::function<MeshFile()>& read) {
  Packer packer;
  try {
    const MeshFile mesh = read();
    packer.put(Answer::mesh);
    pack(packer, mesh);
  } catch (const InputError& error) {
    packer.put(Answer::input_error);
    pack(packer, std::string(error.what()));
  } catch (const IoError& error) {
    packer.put(Answer::io_error);
    pack(packer, std::string(error.what()));
  }
  return std::move(packer.bytes());
}

}  // namespace

MeshFile read_isolated(const std::filesystem::path& file, const std::string& library,
                       const std::function<MeshFile()>& read) {
  const std::string bytes = run_isolated(file, library, [&] { return answer(read); });
  Unpacker unpacker(bytes);
  const auto kind = unpacker.take<Answer>();
  if (kind == Answer::input_error) throw InputError(take_text(unpacker));
  if (kind == Answer::io_error) throw IoError(take_text(unpacker));
  MeshFile mesh = take_mesh(unpacker);
  if (!unpacker.complete()) throw IoError(fmt::format("{}: {} crashed on this file", file.string(), library));
  return mesh;
}

}  // namespace radiosity
