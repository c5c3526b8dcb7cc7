// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/read_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "mesh_file.hpp"
#include "radiosity/io/nearest_name.hpp"
#include "radiosity/meshing/error.hpp"
#include "scene_file.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

/// Finds the number of bands: that of the first values given per band; all others must agree.
class BandCount {
 public:
  void add(Eigen::Index bands, const std::string& place, const std::string& object) {
    if (count_ == 0) {
      count_ = bands;
      first_ = object;
    } else if (bands != count_) {
      throw InputError(fmt::format("{}: {} has {} values, but {} has {}; all need one value per band", place,
                                   object, bands, first_, count_));
    }
  }
  Eigen::Index count() const { return std::max<Eigen::Index>(count_, 1); }

 private:
  Eigen::Index count_ = 0;
  std::string first_;
};

class SceneBuilder {
 public:
  SceneBuilder(fs::path file, SceneFile scene_file, MeshFile mesh, MissingMaterials missing)
      : file_(std::move(file)), settings_(std::move(scene_file)), mesh_(std::move(mesh)), missing_(missing) {}

  Scene build() {
    check_names();
    count_bands();
    for (Vec3& x : mesh_.geometry.vertices) x *= settings_.metres_per_unit;
    for (const MeshMaterial& material : mesh_.materials) mesh_.geometry.materials.push_back(finish(material));
    Scene scene = make_scene();
    require_lamps_with_area(scene);
    return scene;
  }

 private:
  const MaterialSetting* setting(const std::string& name) const {
    const auto found = settings_.materials.find(name);
    return found == settings_.materials.end() ? nullptr : &found->second;
  }

  void check_names() const {
    std::vector<std::string> names;
    for (const auto& material : mesh_.materials) names.push_back(material.name);
    for (const auto& [name, values] : settings_.materials)
      if (std::find(names.begin(), names.end(), name) == names.end())
        throw InputError(fmt::format(
            "{}:{}: no face of {} has the material '{}'; the nearest name there is '{}'", file_.string(),
            values.line, settings_.mesh.string(), name, nearest_name(name, names)));
    if (missing_ == MissingMaterials::allow) return;
    std::vector<std::string> set;
    for (const auto& [name, values] : settings_.materials) set.push_back(name);
    for (const auto& material : mesh_.materials)
      if (!material.undefined.empty() && !setting(material.name))
        throw InputError(set.empty() ? material.undefined
                                     : fmt::format("{}; the nearest name in {} is '{}'", material.undefined,
                                                   file_.string(), nearest_name(material.name, set)));
  }

  void count_bands() {
    for (const auto& material : mesh_.materials) {
      const MaterialSetting* const own = setting(material.name);
      const auto add = [&](const char* quantity, const BandSetting* set, const BandValues& from_mesh) {
        const std::string object = fmt::format("{} of material '{}'", quantity, material.name);
        if (set && set->per_band)
          bands_.add(set->values.size(), fmt::format("{}:{}", file_.string(), set->line), object);
        else if (!set && from_mesh.size() > 1)
          bands_.add(from_mesh.size(), settings_.mesh.string(), object);
      };
      if (own && own->absorptance)
        add("absorptance", &*own->absorptance, {});
      else
        add("reflectance", own && own->reflectance ? &*own->reflectance : nullptr, material.reflectance);
      if (own && own->power)
        add("power", &*own->power, {});
      else
        add("emission", own && own->emission ? &*own->emission : nullptr, material.emission);
    }
  }

  BandValues spread(const BandValues& values) const {
    return values.size() == 1 ? BandValues::Constant(bands_.count(), values[0]) : values;
  }

  Material finish(const MeshMaterial& source) const {
    const MaterialSetting* const own = setting(source.name);
    Material material;
    material.name = source.name;
    // A material that only the scene file defines absorbs everything unless the file says otherwise.
    const BandValues own_default = BandValues::Zero(1);
    const bool defined = source.undefined.empty();
    material.reflectance = spread(own && own->reflectance ? own->reflectance->values
                                  : defined               ? source.reflectance
                                                          : own_default);
    if (own && own->absorptance) {
      material.absorptance = spread(own->absorptance->values);
      material.reflectance = 1 - material.absorptance;
    }
    material.emits_power = own && own->power;
    material.emission = spread(material.emits_power   ? own->power->values
                               : own && own->emission ? own->emission->values
                                                      : source.emission);
    material.sides = own && own->sides ? *own->sides : source.sides;
    return material;
  }

  Scene make_scene() {
    try {
      return Scene(std::move(mesh_.geometry));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", settings_.mesh.string(), error.what()));
    }
  }

  void require_lamps_with_area(const Scene& scene) const {
    for (std::size_t m = 0; m < scene.materials().size(); ++m) {
      const Material& material = scene.materials()[m];
      if (material.emits_power && !(scene.material_area(static_cast<Index>(m)) > 0))
        throw InputError(fmt::format("{}:{}: material '{}': its faces have no area to spread the power over",
                                     file_.string(), setting(material.name)->power->line, material.name));
    }
  }

  fs::path file_;
  SceneFile settings_;
  MeshFile mesh_;
  MissingMaterials missing_;
  BandCount bands_;
};

std::vector<LightingSetup> lighting_setups(const fs::path& file,
                                           const std::map<std::string, SetupSetting>& settings,
                                           const Scene& scene) {
  std::vector<std::string> names;
  for (const Material& material : scene.materials()) names.push_back(material.name);
  std::vector<LightingSetup> setups;
  for (const auto& [name, setting] : settings) {
    LightingSetup setup{name, std::vector<double>(names.size(), 1)};
    for (const auto& [material, factor] : setting.factors) {
      const auto found = std::find(names.begin(), names.end(), material);
      if (found == names.end())
        throw InputError(
            fmt::format("{}:{}: set-up '{}': no face has the material '{}'; the nearest name is '{}'",
                        file.string(), setting.line, name, material, nearest_name(material, names)));
      setup.factors[static_cast<std::size_t>(found - names.begin())] = factor;
    }
    bool lit = false;
    for (std::size_t m = 0; m < names.size(); ++m)
      lit = lit || (setup.factors[m] > 0 && (scene.materials()[m].emission > 0).any());
    if (!lit)
      throw InputError(
          fmt::format("{}:{}: set-up '{}': every lamp is off", file.string(), setting.line, name));
    setups.push_back(std::move(setup));
  }
  return setups;
}

/// A key as TOML writes it: quoted unless it is made of letters, digits, - and _.
std::string toml_key(const std::string& name) {
  return is_bare_key(name) ? name : fmt::format("\"{}\"", name);
}

}  // namespace

LoadedScene read_scene(const fs::path& file, MissingMaterials missing) {
  require_readable(file);
  SceneFile scene_file;
  if (lower_case_extension(file) == ".toml")
    scene_file = read_scene_file(file);
  else
    scene_file.mesh = file;
  MeshFile mesh = read_mesh(scene_file.mesh);

  SceneSettings settings = scene_file.settings;
  const fs::path mesh_file = scene_file.mesh;
  const std::map<std::string, SetupSetting> setup_settings = scene_file.setups;
  std::vector<std::string> warnings = std::move(mesh.warnings);
  Scene scene = SceneBuilder(file, std::move(scene_file), std::move(mesh), missing).build();
  for (const Material& material : scene.materials())
    for (Eigen::Index b = 0; b < material.reflectance.size(); ++b)
      if (absorptance(material)[b] == 0)
        warnings.push_back(
            fmt::format("material '{}': reflectance is 1 in band {}: the surface absorbs nothing there",
                        material.name, b));
  std::vector<LightingSetup> setups = lighting_setups(file, setup_settings, scene);
  return {std::move(scene), std::move(settings), std::move(setups), mesh_file, std::move(warnings)};
}

void require_emission(const Scene& scene, const fs::path& file) {
  for (Index f = 0; f < scene.face_count(); ++f)
    if ((scene.materials()[static_cast<std::size_t>(scene.material(f))].emission > 0).any()) return;
  const std::string table = fmt::format("  [materials.{}]\n  emission = 10   # W/m², or: power = 100   # W",
                                        toml_key(scene.materials().front().name));
  if (lower_case_extension(file) == ".toml")
    throw InputError(
        fmt::format("{}: nothing emits light, so every radiosity is 0. To add a lamp, give a material an "
                    "emission, such as\n{}",
                    file.string(), table));
  throw InputError(fmt::format(
      "{}: nothing emits light, so every radiosity is 0. To add a lamp, give a material an emission: a line "
      "'Ke 10 10 10' in the .mtl of an OBJ, emissiveFactor in a glTF, a cell array 'emission' in a .vtp or "
      ".vtu, or a "
      "scene file (.toml) with\n  mesh = \"{}\"\n{}",
      file.string(), file.filename().string(), table));
}

}  // namespace radiosity
