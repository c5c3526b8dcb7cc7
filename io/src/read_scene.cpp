// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/read_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <variant>

#include "mesh_file.hpp"
#include "name_patterns.hpp"
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

/// "the nearest name there is 'wall'", or some of the names that there are.
std::string names_there(const std::string& wrong, const std::vector<std::string>& names) {
  const auto nearest = nearest_name(wrong, names);
  return nearest ? fmt::format("the nearest name there is '{}'", *nearest)
                 : fmt::format("names there are {}", name_some(names));
}

class SceneBuilder {
 public:
  SceneBuilder(fs::path file, SceneFile scene_file, MeshFile mesh, MissingMaterials missing)
      : file_(std::move(file)), settings_(std::move(scene_file)), mesh_(std::move(mesh)), missing_(missing) {}

  Scene build(const ChordError& chord_error) {
    for (Vec3& x : mesh_.geometry.vertices) x *= settings_.metres_per_unit;
    if (settings_.flip) flip();
    if (settings_.symmetry) mesh_.geometry.symmetry = settings_.symmetry->symmetry;
    for (const auto& [name, shape] : settings_.shapes) add_shape(shape, chord_error);
    assign_settings();
    count_bands();
    for (const MeshMaterial& material : mesh_.materials) mesh_.geometry.materials.push_back(finish(material));
    warn_of_reduced();
    return share_power(make_scene());
  }

  std::vector<std::string>& warnings() { return mesh_.warnings; }

  BandValues wavelengths_nm() const {
    return settings_.wavelengths_nm ? settings_.wavelengths_nm->values : BandValues{};
  }

  /// Once the bands are known, after `build`.
  std::vector<Light> lights() const {
    std::vector<Light> lights;
    for (const auto& [name, setting] : settings_.lights) {
      lights.push_back(setting.light);
      lights.back().intensity = spread(setting.intensity.values);
    }
    return lights;
  }

 private:
  const MaterialSetting* setting(const std::string& name) const {
    const auto found = served_.find(name);
    return found == served_.end() ? nullptr : found->second;
  }

  /// Which table of the scene file serves which material of the mesh.
  void assign_settings() {
    std::vector<std::string> names, keys;
    for (const auto& material : mesh_.materials) names.push_back(material.name);
    for (const auto& [key, values] : settings_.materials) {
      keys.push_back(key);
      const bool fits = std::any_of(names.begin(), names.end(), [&, &pattern = key](const std::string& name) {
        return name == pattern || matches_pattern(pattern, name);
      });
      if (!fits && !(settings_.default_for_undefined && key == kDefaultMaterial))
        throw InputError(fmt::format("{}:{}: no face of {} has the material '{}'; {}", file_.string(),
                                     values.line, settings_.mesh.string(), key, names_there(key, names)));
    }
    for (const auto& material : mesh_.materials) {
      const std::vector<std::string> best = keys_for(material.name, keys);
      if (best.size() > 1)
        throw InputError(fmt::format(
            "{}:{}: material '{}' fits both '{}' and '{}', which are equally long; write one out further",
            file_.string(), settings_.materials.at(best[1]).line, material.name, best[0], best[1]));
      if (!best.empty())
        served_[material.name] = &settings_.materials.at(best[0]);
      else if (!material.undefined.empty())
        serve_undefined(material, keys);
    }
  }

  void serve_undefined(const MeshMaterial& material, const std::vector<std::string>& keys) {
    if (settings_.default_for_undefined) {
      if (const auto found = settings_.materials.find(kDefaultMaterial); found != settings_.materials.end())
        served_[material.name] = &found->second;
      return;
    }
    if (missing_ == MissingMaterials::allow) return;
    std::string cure;
    if (const auto nearest = nearest_name(material.name, keys))
      cure += fmt::format("; the nearest name in {} is '{}'", file_.string(), *nearest);
    if (lower_case_extension(file_) == ".toml")
      cure += "; undefined = \"default\" gives all such names what [materials.default] says";
    throw InputError(material.undefined + cure);
  }

  void add_shape(const ShapeSetting& setting, const ChordError& chord_error) {
    constexpr double kDefaultChordError = 0.01;  // of its size
    auto& materials = mesh_.materials;
    auto material = std::find_if(materials.begin(), materials.end(),
                                 [&](const MeshMaterial& known) { return known.name == setting.material; });
    if (material == materials.end()) {
      MeshMaterial added{.name = setting.material};
      added.undefined = fmt::format("{}:{}: shape '{}': nothing defines its material '{}'", file_.string(),
                                    setting.line, setting.shape.name, setting.material);
      material = materials.insert(materials.end(), std::move(added));
    }
    const double chord = chord_error ? chord_error(setting.shape)
                                     : setting.chord_error.value_or(kDefaultChordError * size(setting.shape));
    try {
      tessellate(setting.shape, chord, static_cast<Index>(material - materials.begin()), mesh_.geometry);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}:{}: {}", file_.string(), setting.line, error.what()));
    }
  }

  void flip() {
    auto& [vertices, corners, face_start, face_material, materials, two_sided, symmetry] = mesh_.geometry;
    for (std::size_t f = 0; f < face_material.size(); ++f)
      std::reverse(corners.begin() + face_start[f], corners.begin() + face_start[f + 1]);
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
      add("specular", own && own->specular ? &*own->specular : nullptr, material.specular);
      add("transmission", own && own->transmission ? &*own->transmission : nullptr, material.transmission);
      if (own && own->refractive_index)
        add("refractive_index", std::get_if<BandSetting>(&own->refractive_index->index), {});
      else
        add("refractive_index", nullptr, material.refractive_indices);
    }
    if (const auto& wavelengths = settings_.wavelengths_nm)
      bands_.add(wavelengths->values.size(), fmt::format("{}:{}", file_.string(), wavelengths->line),
                 "wavelength_nm of [bands]");
    for (const auto& [name, setting] : settings_.lights)
      if (setting.intensity.per_band)
        bands_.add(setting.intensity.values.size(),
                   fmt::format("{}:{}", file_.string(), setting.intensity.line),
                   fmt::format("light '{}'", name));
  }

  BandValues spread(const BandValues& values) const {
    return values.size() == 1 ? BandValues::Constant(bands_.count(), values[0]) : values;
  }

  /// Mirrors and glass. What the scene file says is taken as it is; of the mesh, as much as the reflectance (and the transmission)
  /// leaves: many files give every material a gloss by habit, and its diffuse light can be solved all the same.
  void finish_specular(const MeshMaterial& source, const MaterialSetting* own, Material& material) {
    material.shininess = own && own->shininess ? *own->shininess : source.shininess;
    material.refractive_index = source.refractive_index;
    material.refractive_indices = source.refractive_indices;
    if (own && own->refractive_index) set_index(*own->refractive_index, material);
    BandValues left = 1 - material.reflectance;
    const auto take = [&](const std::optional<BandSetting>* set, const BandValues& from_mesh,
                          BandValues& to) {
      const BandValues values = spread(set && *set ? (*set)->values : from_mesh);
      if ((values == 0).all()) return;
      to = set && *set ? values : BandValues(values.min(left));
      if ((to != values).any() && (reduced_.empty() || reduced_.back() != material.name))
        reduced_.push_back(material.name);
      if ((to == 0).all()) to = {};
      if (to.size() > 0) left = (left - to).max(0);
    };
    take(own ? &own->transmission : nullptr, source.transmission, material.transmission);
    take(own ? &own->specular : nullptr, source.specular, material.specular);
  }

  void set_index(const IndexSetting& setting, Material& material) const {
    BandValues indices;
    if (const auto* const numbers = std::get_if<BandSetting>(&setting.index)) {
      indices = spread(numbers->values);
    } else {
      const auto& dispersion = std::get<Dispersion>(setting.index);
      // The bands of a scene without wavelengths are all alike.
      const BandValues wavelengths = spread(settings_.wavelengths_nm ? settings_.wavelengths_nm->values
                                                                     : BandValues::Constant(1, kDLine_nm));
      indices = wavelengths.unaryExpr([&](double nm) { return radiosity::refractive_index(dispersion, nm); });
      for (Eigen::Index b = 0; b < indices.size(); ++b) {
        const auto fail = [&](const std::string& rule) {
          throw InputError(fmt::format("{}:{}: material '{}': refractive index in band {}, at {} nm, {}",
                                       file_.string(), setting.line, material.name, b, wavelengths[b], rule));
        };
        if (wavelengths[b] < setting.from_nm || wavelengths[b] > setting.to_nm)
          fail(fmt::format("is outside of what is known, {} to {} nm", setting.from_nm, setting.to_nm));
        if (!(indices[b] > 0 && std::isfinite(indices[b])))
          fail(fmt::format("is {}, but must be positive and finite", indices[b]));
      }
    }
    const bool equal = (indices == indices[0]).all();
    material.refractive_index = equal ? indices[0] : indices.mean();
    material.refractive_indices = equal ? BandValues{} : indices;
  }

  Material finish(const MeshMaterial& source) {
    const MaterialSetting* const own = setting(source.name);
    Material material;
    material.name = source.name;
    // A material that only the scene file defines absorbs everything unless the file says otherwise.
    const BandValues own_default = BandValues::Zero(1);
    const bool defined = source.undefined.empty() || settings_.default_for_undefined;
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
    material.sides = own && own->sides ? *own->sides : settings_.sides.value_or(source.sides);
    // The back of a lamp glows only if somebody says so.
    if (material.sides == Sides::automatic && (material.emission > 0).any()) material.sides = Sides::front;
    finish_specular(source, own, material);
    if (own && (own->specular || own->transmission)) {
      const int line = own->specular ? own->specular->line : own->transmission->line;
      try {
        validate(material);
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}:{}: {}", file_.string(), line, error.what()));
      }
    }
    return material;
  }

  void warn_of_reduced() {
    if (!reduced_.empty())
      mesh_.warnings.push_back(fmt::format(
          "{}: what the mesh says of mirrors and glass would give back more light than arrives beside "
          "the reflectance, which stays as it is: they are reduced to what it leaves",
          name_some(reduced_)));
  }

  Scene make_scene() {
    try {
      return Scene(std::move(mesh_.geometry));
    } catch (const InputError& error) {
      if (std::string_view(error.what()).starts_with("symmetry"))
        throw InputError(fmt::format("{}:{}: {}", file_.string(), settings_.symmetry->line, error.what()));
      throw InputError(fmt::format("{}: {}", settings_.mesh.string(), error.what()));
    }
  }

  /// A table's power is that of all materials that it serves: each has the share of its area.
  Scene share_power(const Scene& scene) const {
    std::vector<Material> materials = scene.materials();
    std::map<const MaterialSetting*, double> areas;
    const auto area = [&](std::size_t m) { return scene.material_area(static_cast<Index>(m)); };
    for (std::size_t m = 0; m < materials.size(); ++m)
      if (materials[m].emits_power) areas[setting(materials[m].name)] += area(m);
    for (std::size_t m = 0; m < materials.size(); ++m) {
      if (!materials[m].emits_power) continue;
      const MaterialSetting* const own = setting(materials[m].name);
      if (!(areas[own] > 0))
        throw InputError(fmt::format("{}:{}: material '{}': its faces have no area to spread the power over",
                                     file_.string(), own->power->line, materials[m].name));
      materials[m].emission *= area(m) / areas[own];
    }
    return scene.with_materials(std::move(materials));
  }

  fs::path file_;
  SceneFile settings_;
  MeshFile mesh_;
  MissingMaterials missing_;
  std::map<std::string, const MaterialSetting*> served_;  ///< by material of the mesh
  BandCount bands_;
  std::vector<std::string> reduced_;  ///< materials of which not all is kept that is not diffuse
};

std::vector<LightingSetup> lighting_setups(const fs::path& file,
                                           const std::map<std::string, SetupSetting>& settings,
                                           const Scene& scene) {
  std::vector<std::string> names;
  for (const Material& material : scene.materials()) names.push_back(material.name);
  std::vector<LightingSetup> setups;
  for (const auto& [name, setting] : settings) {
    LightingSetup setup{name, std::vector<double>(names.size(), 1)};
    std::vector<std::string> keys;
    for (const auto& [key, factor] : setting.factors) {
      keys.push_back(key);
      if (std::none_of(names.begin(), names.end(), [&, &pattern = key](const std::string& material) {
            return material == pattern || matches_pattern(pattern, material);
          }))
        throw InputError(fmt::format("{}:{}: set-up '{}': no face has the material '{}'; {}", file.string(),
                                     setting.line, name, key, names_there(key, names)));
    }
    for (std::size_t m = 0; m < names.size(); ++m) {
      const std::vector<std::string> best = keys_for(names[m], keys);
      if (best.size() > 1)
        throw InputError(
            fmt::format("{}:{}: set-up '{}': material '{}' fits both '{}' and '{}', which are equally long; "
                        "write one out further",
                        file.string(), setting.line, name, names[m], best[0], best[1]));
      if (!best.empty()) setup.factors[m] = setting.factors.at(best[0]);
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

/// Materials of which some band absorbs nothing.
std::vector<std::string> white_materials(const Scene& scene) {
  std::vector<std::string> names;
  for (const Material& material : scene.materials())
    if ((absorptance(material) == 0).any()) names.push_back(material.name);
  return names;
}

std::string length_text(double metres) {
  if (metres < 0.01) return fmt::format("{:.3g} mm", 1000 * metres);
  if (metres < 1) return fmt::format("{:.3g} cm", 100 * metres);
  if (metres < 1000) return fmt::format("{:.3g} m", metres);
  return fmt::format("{:.3g} km", metres / 1000);
}

/// Empty, or what a size that no building has suggests about the unit.
std::string doubt_size(const Scene& scene, double metres_per_unit) {
  constexpr double kLeast = 0.05, kMost = 2000;  // m: a model on a desk, a district
  constexpr double kTypical = 20;                // m: a building
  const double size = (scene.upper() - scene.lower()).norm();
  if (size >= kLeast && size <= kMost) return {};
  const double in_file = size / metres_per_unit;
  // Of the units that make it a building, the one that comes closest to a common size; feet and inches only where nothing else does.
  std::string_view best;
  double best_off = std::numeric_limits<double>::infinity(), best_size = 0;
  for (const bool metric : {true, false}) {
    for (const LengthUnit& unit : length_units()) {
      const double then = in_file * unit.metres;
      const double off = std::abs(std::log(then / kTypical));
      if (unit.metric != metric || then < 1 || then > 300 || off >= best_off) continue;
      best = unit.name;
      best_off = off;
      best_size = then;
    }
    if (!best.empty()) break;
  }
  std::string text = fmt::format("the scene is {} across, which no building is", length_text(size));
  if (!best.empty())
    text += fmt::format("; units = \"{}\" in a scene file would make it {}", best, length_text(best_size));
  return text;
}

/// A key as TOML writes it: quoted unless it is made of letters, digits, - and _.
std::string toml_key(const std::string& name) {
  return is_bare_key(name) ? name : fmt::format("\"{}\"", name);
}

}  // namespace

LoadedScene read_scene(const fs::path& file, MissingMaterials missing, const ChordError& chord_error) {
  require_readable(file);
  SceneFile scene_file;
  if (lower_case_extension(file) == ".toml")
    scene_file = read_scene_file(file);
  else
    scene_file.mesh = file;
  MeshFile mesh;
  if (scene_file.mesh.empty())
    scene_file.mesh = file;  // all that there is to name
  else
    mesh = read_mesh(scene_file.mesh);

  SceneSettings settings = scene_file.settings;
  const fs::path mesh_file = scene_file.mesh;
  const double metres_per_unit = scene_file.metres_per_unit;
  const std::map<std::string, SetupSetting> setup_settings = scene_file.setups;
  SceneBuilder builder(file, std::move(scene_file), std::move(mesh), missing);
  Scene scene = builder.build(chord_error);
  std::vector<std::string> warnings = std::move(builder.warnings());
  if (std::string doubt = doubt_size(scene, metres_per_unit); !doubt.empty())
    warnings.push_back(std::move(doubt));
  if (const auto white = white_materials(scene); !white.empty())
    warnings.push_back(
        fmt::format("the reflectance of {} is 1 in some band: nothing is absorbed there", name_some(white)));
  std::vector<LightingSetup> setups = lighting_setups(file, setup_settings, scene);
  return {std::move(scene),    std::move(settings), std::move(setups),       mesh_file,
          std::move(warnings), builder.lights(),    builder.wavelengths_nm()};
}

void require_emission(const Scene& scene, const fs::path& file) {
  if (emits(scene)) return;
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
