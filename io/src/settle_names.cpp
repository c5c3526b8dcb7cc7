// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "mesh_file.hpp"
#include "radiosity/io/nearest_name.hpp"

namespace radiosity {
namespace {

bool equal(const BandValues& a, const BandValues& b) {
  return a.size() == b.size() && (a == b).all();
}

bool same_finish(const MeshMaterial& a, const MeshMaterial& b) {
  return equal(a.reflectance, b.reflectance) && equal(a.emission, b.emission) && a.sides == b.sides &&
         equal(a.specular, b.specular) && equal(a.transmission, b.transmission) &&
         a.shininess == b.shininess && a.refractive_index == b.refractive_index &&
         equal(a.refractive_indices, b.refractive_indices) && a.undefined.empty() == b.undefined.empty();
}

}  // namespace

void settle_names(MeshFile& mesh) {
  std::vector<MeshMaterial> settled;
  std::map<std::string, std::vector<Index>> by_name;  // the settled materials of one name in the file
  std::vector<Index> number;                          // per material of the file
  for (MeshMaterial& material : mesh.materials) {
    std::vector<Index>& namesakes = by_name[material.name];
    const auto same = std::find_if(namesakes.begin(), namesakes.end(),
                                   [&](Index m) { return same_finish(settled[m], material); });
    if (same != namesakes.end()) {
      number.push_back(*same);
      continue;
    }
    number.push_back(static_cast<Index>(settled.size()));
    namesakes.push_back(number.back());
    settled.push_back(std::move(material));
  }
  for (Index& material : mesh.geometry.face_material) material = number[material];

  std::set<std::string> taken;
  for (const auto& [name, namesakes] : by_name) taken.insert(name);
  std::vector<std::string> shared;
  for (const auto& [name, namesakes] : by_name) {
    if (namesakes.size() > 1) shared.push_back(name);
    int suffix = 1;
    for (auto m = namesakes.begin() + 1; m < namesakes.end(); ++m) {
      std::string& own = settled[*m].name;
      do own = fmt::format("{}_{}", name, suffix++);
      while (!taken.insert(own).second);
    }
  }
  mesh.materials = std::move(settled);
  if (shared.empty()) return;
  const bool one = shared.size() == 1;
  mesh.warnings.push_back(
      fmt::format("{} {} the name of several materials with different values, which are numbered: {}_1, …; a "
                  "scene file names all of them "
                  "as \"{}*\"",
                  name_some(shared), one ? "is" : "are each", shared[0], shared[0]));
}

}  // namespace radiosity
