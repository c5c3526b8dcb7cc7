// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <numbers>

#include "radiosity/io/nearest_name.hpp"
#include "radiosity/io/refractive_index.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

int line_of(const toml::node& node) {
  return static_cast<int>(node.source().begin.line);
}

/// A table of the scene file, with the words to speak about it.
class Section {
 public:
  Section(const std::filesystem::path& file, const toml::table& table, std::string title)
      : file_(file), table_(table), title_(std::move(title)) {}

  /// "[solver] tolerance", or "mesh" at the top.
  std::string name(std::string_view key) const {
    return title_.empty() ? std::string(key) : fmt::format("[{}] {}", title_, key);
  }

  [[noreturn]] void fail(int line, const std::string& rule) const {
    throw InputError(fmt::format("{}:{}: {}", file_.string(), line, rule));
  }
  [[noreturn]] void fail_type(std::string_view key, const toml::node& node, std::string_view expected) const {
    std::string type;
    node.visit([&](const auto& value) {
      using Node = std::decay_t<decltype(value)>;
      if constexpr (toml::is_string<Node>)
        type = "a string";
      else if constexpr (toml::is_integer<Node>)
        type = "an integer";
      else if constexpr (toml::is_floating_point<Node>)
        type = "a number";
      else if constexpr (toml::is_boolean<Node>)
        type = "a boolean";
      else if constexpr (toml::is_array<Node>)
        type = "an array";
      else if constexpr (toml::is_table<Node>)
        type = "a table";
      else
        type = "a date or time";
    });
    fail(line_of(node), fmt::format("{} is {}, but must be {}", name(key), type, expected));
  }

  [[noreturn]] void fail_unknown(const toml::key& key, const std::vector<std::string>& keys) const {
    const auto nearest = nearest_name(key.str(), keys);
    fail(static_cast<int>(key.source().begin.line),
         fmt::format("unknown key '{}'{}; {}", key.str(),
                     title_.empty() ? "" : fmt::format(" in [{}]", title_),
                     nearest ? fmt::format("the nearest known key is '{}'", *nearest)
                             : fmt::format("known are {}", fmt::join(keys, ", "))));
  }

  void allow_only(const std::vector<std::string>& keys) const {
    for (const auto& [key, node] : table_)
      if (std::find(keys.begin(), keys.end(), key.str()) == keys.end()) fail_unknown(key, keys);
  }

  const toml::node* find(std::string_view key) const { return table_.get(key); }
  int line() const { return line_of(table_); }

  std::optional<std::string> text(std::string_view key) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_string()) fail_type(key, *node, "a string");
    return node->as_string()->get();
  }

  /// A number for which `valid` holds.
  std::optional<double> number(std::string_view key, std::string_view rule,
                               const std::function<bool(double)>& valid) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_number()) fail_type(key, *node, "a number");
    const double value = *node->value<double>();
    if (!valid(value)) fail(line_of(*node), fmt::format("{} = {}: must be {}", name(key), value, rule));
    return value;
  }

  std::optional<std::int64_t> integer(std::string_view key, std::int64_t least, std::int64_t most) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_integer()) fail_type(key, *node, "an integer");
    const std::int64_t value = node->as_integer()->get();
    if (value < least || value > most)
      fail(line_of(*node), fmt::format("{} = {}: must be from {} to {}", name(key), value, least, most));
    return value;
  }

  std::optional<bool> boolean(std::string_view key) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_boolean()) fail_type(key, *node, "true or false");
    return node->as_boolean()->get();
  }

  /// One number or an array of numbers; each in the range that `rule` speaks of.
  std::optional<BandSetting> bands(std::string_view key, const std::string& owner, std::string_view rule,
                                   const std::function<bool(double)>& valid) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    BandSetting setting{.values = {}, .per_band = node->is_array(), .line = line_of(*node)};
    const auto check = [&](const toml::node& item, Eigen::Index band) {
      if (!item.is_number()) fail_type(key, item, "a number or an array with one number per band");
      const double value = *item.value<double>();
      if (!valid(value))
        fail(line_of(item), fmt::format("{}: {} {}{} is {}", owner, key, value,
                                        setting.per_band ? fmt::format(" in band {}", band) : "", rule));
      setting.values[band] = value;
    };
    if (const toml::array* const array = node->as_array()) {
      if (array->empty())
        fail(setting.line, fmt::format("{}: {} has no numbers, but needs one per band", owner, key));
      setting.values.resize(static_cast<Eigen::Index>(array->size()));
      for (std::size_t b = 0; b < array->size(); ++b) check(*array->get(b), static_cast<Eigen::Index>(b));
    } else {
      setting.values.resize(1);
      check(*node, 0);
    }
    return setting;
  }

  std::optional<Vec3> vector(std::string_view key) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    return vector(key, *node);
  }

  /// An array of them; empty where there is none.
  std::vector<Vec3> vectors(std::string_view key) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_array()) fail_type(key, *node, "an array of points, each an array of three finite numbers");
    std::vector<Vec3> result;
    for (const toml::node& item : *node->as_array()) result.push_back(vector(key, item));
    return result;
  }

  /// A table inside this one.
  std::optional<Section> section(std::string_view key, std::string title) const {
    const toml::node* const node = find(key);
    if (!node) return {};
    if (!node->is_table()) fail_type(key, *node, "a table");
    return Section(file_, *node->as_table(), std::move(title));
  }

  const toml::table& table() const { return table_; }

 private:
  Vec3 vector(std::string_view key, const toml::node& node) const {
    constexpr std::string_view kExpected = "an array of three finite numbers";
    const toml::array* const array = node.as_array();
    if (!array) fail_type(key, node, kExpected);
    Vec3 result;
    bool valid = array->size() == 3;
    for (std::size_t k = 0; valid && k < 3; ++k) {
      const auto value = array->get(k)->is_number() ? array->get(k)->value<double>() : std::nullopt;
      valid = value && std::isfinite(*value);
      if (valid) result[static_cast<Eigen::Index>(k)] = *value;
    }
    if (!valid) fail(line_of(node), fmt::format("{} must be {}", name(key), kExpected));
    return result;
  }

  const std::filesystem::path& file_;
  const toml::table& table_;
  std::string title_;
};

bool positive(double value) {
  return value > 0 && std::isfinite(value);
}
constexpr std::string_view kPositive = "positive and finite";

std::optional<Sides> read_sides(const Section& section, const std::string& owner) {
  const auto sides = section.text("sides");
  if (!sides) return {};
  if (*sides == "front") return Sides::front;
  if (*sides == "both") return Sides::both;
  if (*sides == "auto") return Sides::automatic;
  section.fail(line_of(*section.find("sides")),
               fmt::format("{}sides = \"{}\" must be \"front\", \"both\" or \"auto\"", owner, *sides));
}

/// { cauchy = [a0, a1, …] } or { sellmeier = [b1, b2, …, c1, c2, …] }
Dispersion read_dispersion(const Section& section, const std::string& owner) {
  section.allow_only({"cauchy", "sellmeier"});
  const bool sellmeier = section.find("sellmeier") != nullptr;
  const char* const key = sellmeier ? "sellmeier" : "cauchy";
  if (sellmeier == (section.find("cauchy") != nullptr))
    section.fail(section.line(),
                 fmt::format("{}: refractive_index needs one of the keys 'cauchy' and 'sellmeier'", owner));
  const toml::node& node = *section.find(key);
  if (!node.is_array()) section.fail_type(key, node, "an array of numbers");
  const BandSetting numbers =
      *section.bands(key, owner, "not finite", [](double value) { return std::isfinite(value); });
  const auto& values = numbers.values;
  if (!sellmeier) return Cauchy{{values.begin(), values.end()}};
  if (values.size() % 2 != 0)
    section.fail(numbers.line, fmt::format("{}: sellmeier has {} numbers, but needs as many C as B: "
                                           "[B1, B2, B3, C1, C2, C3], C in µm²",
                                           owner, values.size()));
  const auto half = values.begin() + values.size() / 2;
  return Sellmeier{{values.begin(), half}, {half, values.end()}};
}

/// A number, one per band, a name of the tables, or a function of the wavelength.
std::optional<IndexSetting> read_refractive_index(const Section& section, const std::string& owner) {
  constexpr std::string_view kKey = "refractive_index";
  const toml::node* const node = section.find(kKey);
  if (node == nullptr) return {};
  IndexSetting setting{.index = {}, .line = line_of(*node)};
  if (node->is_table()) {
    setting.index = read_dispersion(*section.section(kKey, section.name(kKey)), owner);
    return setting;
  }
  if (!node->is_string()) {
    setting.index = *section.bands(kKey, owner, "not positive and finite", positive);
    return setting;
  }
  const std::string& name = node->as_string()->get();
  if (const Glass* const glass = find_glass(name)) {
    setting.index = Dispersion(glass->sellmeier);
    setting.from_nm = glass->from_nm;
    setting.to_nm = glass->to_nm;
    return setting;
  }
  if (const auto value = refractive_index(name)) {
    setting.index = BandSetting{.values = BandValues::Constant(1, *value), .line = setting.line};
    return setting;
  }
  std::vector<std::string> known;
  for (const RefractiveIndex& entry : refractive_indices()) known.emplace_back(entry.name);
  for (const Glass& glass : glasses()) known.emplace_back(glass.name);
  const auto nearest = nearest_name(name, known);
  section.fail(setting.line, fmt::format("{}: no refractive index is known by the name '{}'; {}", owner, name,
                                         nearest ? fmt::format("the nearest known is '{}'", *nearest)
                                                 : "give a number, such as 1.5"));
}

MaterialSetting read_material(const Section& section, const std::string& name) {
  section.allow_only({"reflectance", "absorptance", "emission", "power", "sides", "specular", "shininess",
                      "transmission", "refractive_index"});
  const std::string owner = fmt::format("material '{}'", name);
  const auto not_negative = [](double value) { return value >= 0 && std::isfinite(value); };
  MaterialSetting material;
  material.line = section.line();
  const auto share = [](double value) { return value >= 0 && value <= 1; };
  material.reflectance = section.bands("reflectance", owner, "outside [0, 1]", share);
  material.absorptance = section.bands("absorptance", owner, "outside [0, 1]", share);
  if (material.reflectance && material.absorptance)
    section.fail(std::max(material.reflectance->line, material.absorptance->line),
                 fmt::format("{}: reflectance and absorptance (1 − reflectance) exclude each other", owner));
  material.emission = section.bands("emission", owner, "negative or not finite (W/m²)", not_negative);
  material.power = section.bands("power", owner, "negative or not finite (W)", not_negative);
  if (material.emission && material.power)
    section.fail(std::max(material.emission->line, material.power->line),
                 fmt::format("{}: emission (W/m²) and power (W) exclude each other", owner));
  material.sides = read_sides(section, owner + ": ");
  material.specular = section.bands("specular", owner, "outside [0, 1]", share);
  material.transmission = section.bands("transmission", owner, "outside [0, 1]", share);
  material.shininess =
      section.number("shininess", "at least 0 and finite (left out, it is a mirror)", not_negative);
  material.refractive_index = read_refractive_index(section, owner);
  return material;
}

Vec3 read_direction(const Section& section, const std::string& owner) {
  const auto direction = section.vector("direction");
  if (!direction) section.fail(section.line(), fmt::format("{} needs the key 'direction'", owner));
  if (direction->squaredNorm() == 0)
    section.fail(line_of(*section.find("direction")), fmt::format("{}: direction 0 0 0 is none", owner));
  return direction->normalized();
}

LightSetting read_light(const Section& section, const std::string& name) {
  const std::string owner = fmt::format("light '{}'", name);
  const auto type = section.text("type");
  if (!type) section.fail(section.line(), fmt::format("{} needs the key 'type'", owner));
  LightSetting setting{.line = section.line(), .light = {.name = name}, .intensity = {}};
  Light& light = setting.light;
  std::vector<std::string> keys{"type"};
  const auto may_have = [&](std::initializer_list<const char*> more) {
    keys.insert(keys.end(), more.begin(), more.end());
  };
  if (*type == "point") {
    may_have({"position", "intensity", "power", "attenuation"});
  } else if (*type == "directional") {
    light.kind = LightKind::directional;
    may_have({"direction", "irradiance"});
  } else if (*type == "spot") {
    light.kind = LightKind::spot;
    may_have({"position", "intensity", "power", "attenuation", "direction", "exponent", "cone_deg",
              "inner_cone_deg"});
  } else {
    section.fail(
        line_of(*section.find("type")),
        fmt::format("{}: type = \"{}\" must be \"point\", \"directional\" or \"spot\"", owner, *type));
  }
  section.allow_only(keys);
  const auto not_negative = [](double value) { return value >= 0 && std::isfinite(value); };
  if (light.kind != LightKind::point) light.direction = read_direction(section, owner);
  if (light.kind == LightKind::directional) {
    const auto irradiance = section.bands("irradiance", owner, "negative or not finite (W/m²)", not_negative);
    if (!irradiance) section.fail(section.line(), fmt::format("{} needs the key 'irradiance'", owner));
    setting.intensity = *irradiance;
    return setting;
  }
  const auto position = section.vector("position");
  if (!position) section.fail(section.line(), fmt::format("{} needs the key 'position'", owner));
  light.position = *position;
  if (const auto attenuation = section.vector("attenuation")) {
    if (attenuation->minCoeff() < 0 || attenuation->sum() == 0)
      section.fail(line_of(*section.find("attenuation")),
                   fmt::format("{}: attenuation {} {} {} must not be negative, and not all 0", owner,
                               attenuation->x(), attenuation->y(), attenuation->z()));
    light.attenuation = {attenuation->x(), attenuation->y(), attenuation->z()};
  }
  if (light.kind == LightKind::spot) {
    const auto radians = [](double degrees) { return degrees * std::numbers::pi / 180; };
    light.exponent = section.number("exponent", "at least 0 and finite", not_negative).value_or(0);
    const double outer = section
                             .number("cone_deg", "a half-angle above 0, at most 90",
                                     [](double value) { return value > 0 && value <= 90; })
                             .value_or(90);
    const double inner = section
                             .number("inner_cone_deg", "a half-angle from 0 to that of the cone",
                                     [&](double value) { return value >= 0 && value <= outer; })
                             .value_or(outer);
    light.cos_outer = outer == 90 ? 0 : std::cos(radians(outer));
    light.cos_inner = inner == 90 ? 0 : std::cos(radians(inner));
  }
  const auto intensity = section.bands("intensity", owner, "negative or not finite (W/sr)", not_negative);
  const auto power = section.bands("power", owner, "negative or not finite (W)", not_negative);
  if (intensity && power)
    section.fail(std::max(intensity->line, power->line),
                 fmt::format("{}: intensity (W/sr) and power (W) exclude each other", owner));
  if (!intensity && !power)
    section.fail(section.line(), fmt::format("{} needs the key 'intensity' (W/sr) or 'power' (W)", owner));
  setting.intensity = intensity ? *intensity : *power;
  if (power) {
    if (light.attenuation != Light{}.attenuation)
      section.fail(power->line, fmt::format("{}: with an attenuation of its own it has no power; give its "
                                            "intensity",
                                            owner));
    setting.intensity.values /= solid_angle(light);
  }
  return setting;
}

Vec3 required_vector(const Section& section, std::string_view key) {
  const auto value = section.vector(key);
  if (!value) section.fail(section.line(), section.name(fmt::format("needs the key '{}'", key)));
  return *value;
}

BezierSurface read_points(const Section& section) {
  const std::vector<Vec3> points = section.vectors("points");
  if (points.empty() || points.size() % 16 != 0)
    section.fail(section.line(),
                 section.name(fmt::format("needs the key 'points' with 16 points for each patch, not {}",
                                          points.size())));
  BezierSurface surface;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k % 16 == 0) surface.patches.emplace_back();
    surface.patches.back()[k % 16] = points[k];
  }
  return surface;
}

ShapeSetting read_shape(const Section& section, const std::string& name) {
  const std::string owner = fmt::format("shape '{}'", name);
  const auto type = section.text("type");
  if (!type) section.fail(section.line(), fmt::format("{} needs the key 'type'", owner));
  std::vector<std::string> keys{"type", "material", "chord_error", "flip"};
  const auto may_have = [&](std::initializer_list<const char*> more) {
    keys.insert(keys.end(), more.begin(), more.end());
    section.allow_only(keys);
  };
  const auto radius = [&] {
    const auto value = section.number("radius", kPositive, positive);
    if (!value) section.fail(section.line(), section.name("needs the key 'radius'"));
    return *value;
  };
  ShapeSetting setting{
      .line = section.line(), .shape = {.name = name, .surface = {}}, .material = {}, .chord_error = {}};
  if (*type == "sphere") {
    may_have({"centre", "radius"});
    setting.shape.surface = Sphere{required_vector(section, "centre"), radius()};
  } else if (*type == "cylinder") {
    may_have({"base", "top", "radius", "caps"});
    setting.shape.surface = Cylinder{required_vector(section, "base"), required_vector(section, "top"),
                                     radius(), section.boolean("caps").value_or(false)};
  } else if (*type == "disk") {
    may_have({"centre", "normal", "radius"});
    setting.shape.surface =
        Disk{required_vector(section, "centre"), required_vector(section, "normal"), radius()};
  } else if (*type == "bezier") {
    may_have({"points"});
    setting.shape.surface = read_points(section);
  } else {
    section.fail(line_of(*section.find("type")),
                 fmt::format("{}: type = \"{}\" must be \"sphere\", \"cylinder\", \"disk\" or \"bezier\"",
                             owner, *type));
  }
  setting.shape.flip = section.boolean("flip").value_or(false);
  setting.chord_error = section.number("chord_error", "positive and finite (m)", positive);
  const auto material = section.text("material");
  if (!material) section.fail(section.line(), fmt::format("{} needs the key 'material'", owner));
  setting.material = *material;
  return setting;
}

SetupSetting read_setup(const Section& section, const std::string& name) {
  if (!is_bare_key(name))  // it becomes part of a file's name
    section.fail(section.line(),
                 fmt::format("set-up '{}': a name is made of letters, digits, - and _", name));
  SetupSetting setup;
  setup.line = section.line();
  for (const auto& [material, node] : section.table())
    setup.factors[std::string(material.str())] =
        *section.number(material.str(), "at least 0 and finite, a factor on the emission",
                        [](double value) { return value >= 0 && std::isfinite(value); });
  return setup;
}

SymmetrySetting read_symmetry(const Section& section) {
  section.allow_only({"planes", "period", "steps"});
  SymmetrySetting setting{.line = section.line(), .symmetry = {}};
  Symmetry& symmetry = setting.symmetry;
  if (const toml::node* const planes = section.find("planes")) {
    constexpr std::string_view kExpected = "an array of planes such as \"x = 0\"";
    if (!planes->is_array()) section.fail_type("planes", *planes, kExpected);
    for (const toml::node& plane : *planes->as_array()) {
      if (!plane.is_string()) section.fail_type("planes", plane, kExpected);
      try {
        symmetry.planes.push_back(plane_of(plane.as_string()->get()));
      } catch (const InputError& error) {
        section.fail(line_of(plane), section.name(fmt::format("planes: {}", error.what())));
      }
    }
  }
  if (const auto period = section.vector("period")) {
    if (period->isZero(0)) section.fail(line_of(*section.find("period")), "[symmetry] period 0 0 0 is none");
    symmetry.period = *period;
  }
  if (const auto steps = section.integer("steps", 1, 1'000'000)) {
    if (!symmetry.periodic())
      section.fail(line_of(*section.find("steps")), "[symmetry] steps needs the key 'period'");
    symmetry.steps = static_cast<Index>(*steps);
  }
  if (symmetry.none()) section.fail(section.line(), "[symmetry] needs the key 'planes' or 'period'");
  return setting;
}

// A number of metres or a word, of [patches] or [elements].
template <class Options, class None, class Auto, class Size>
Options read_size(const Section& section, std::string_view name) {
  constexpr std::string_view kExpected = "a number of metres, \"none\" or \"auto\"";
  const toml::node& node = *section.find("size");
  if (const auto* const word = node.as_string()) {
    if (word->get() == "none") return None{};
    if (word->get() == "auto") return Auto{};
    section.fail(line_of(node), fmt::format("[{}] size = \"{}\" must be {}", name, word->get(), kExpected));
  }
  if (!node.is_number()) section.fail_type("size", node, kExpected);
  return Size{*section.number("size", kPositive, positive)};
}

const std::vector<std::string> kCameraKeys{"position", "target", "up", "vertical_fov_deg"};

Camera read_camera(const Section& section) {
  Camera camera;
  for (const auto& [key, field] :
       {std::pair{"position", &camera.position}, std::pair{"target", &camera.target}}) {
    const auto value = section.vector(key);
    if (!value) section.fail(section.line(), section.name(fmt::format("needs the key '{}'", key)));
    *field = *value;
  }
  if (const auto up = section.vector("up")) camera.up = *up;
  if (const auto angle = section.number("vertical_fov_deg", "between 0 and 180",
                                        [](double value) { return value > 0 && value < 180; }))
    camera.vertical_fov_deg = *angle;
  return camera;
}

/// [camera], and [camera.NAME]
void read_cameras(const Section& section, SceneSettings& settings) {
  bool own = false;
  for (const auto& [key, node] : section.table()) {
    const std::string name(key.str());
    const bool known = std::find(kCameraKeys.begin(), kCameraKeys.end(), name) != kCameraKeys.end();
    own = own || known;
    if (known) continue;
    if (!node.is_table()) section.fail_unknown(key, kCameraKeys);
    const Section named = *section.section(name, "camera." + name);
    named.allow_only(kCameraKeys);
    settings.cameras[name] = read_camera(named);
    settings.cameras[name].name = name;
  }
  if (own || settings.cameras.empty()) settings.camera = read_camera(section);
}

double read_unit(const Section& top) {
  const auto name = top.text("units");
  if (!name) return 1;
  std::vector<std::string> names;
  for (const LengthUnit& unit : length_units()) {
    if (unit.name == *name) return unit.metres;
    names.push_back(fmt::format("\"{}\"", unit.name));
  }
  top.fail(line_of(*top.find("units")),
           fmt::format("units = \"{}\" must be one of {}", *name, fmt::join(names, ", ")));
}

bool read_undefined(const Section& top) {
  const auto undefined = top.text("undefined");
  if (!undefined || *undefined == "error") return false;
  if (*undefined == "default") return true;
  top.fail(line_of(*top.find("undefined")),
           fmt::format("undefined = \"{}\" must be \"error\" or \"default\"", *undefined));
}

}  // namespace

std::span<const LengthUnit> length_units() {
  static constexpr std::array kUnits{LengthUnit{"m", 1, true}, LengthUnit{"cm", 0.01, true},
                                     LengthUnit{"mm", 0.001, true}, LengthUnit{"in", 0.0254, false},
                                     LengthUnit{"ft", 0.3048, false}};
  return kUnits;
}

bool is_bare_key(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return (c < 128 && std::isalnum(c)) || c == '-' || c == '_';
  });
}

SceneFile read_scene_file(const std::filesystem::path& file) {
  toml::table table;
  try {
    table = toml::parse_file(file.string());
  } catch (const toml::parse_error& error) {
    throw IoError(
        fmt::format("{}:{}: is not TOML: {}", file.string(), error.source().begin.line, error.description()));
  }
  const Section top(file, table, "");
  top.allow_only({"mesh", "units", "flip", "sides", "undefined", "materials", "patches", "elements",
                  "form_factors", "solver", "camera", "setup", "lights", "bands", "shapes", "symmetry"});

  SceneFile scene;
  if (const auto shapes = top.section("shapes", "shapes"))
    for (const auto& [key, node] : shapes->table()) {
      const std::string name(key.str());
      scene.shapes[name] = read_shape(*shapes->section(name, "shapes." + name), name);
    }
  if (const auto mesh = top.text("mesh"))
    scene.mesh = file.parent_path() / *mesh;
  else if (scene.shapes.empty())
    throw InputError(fmt::format("{}: the key 'mesh' is missing, and there are no [shapes]: mesh = \"FILE\"",
                                 file.string()));
  scene.metres_per_unit = read_unit(top);
  scene.flip = top.boolean("flip").value_or(false);
  scene.sides = read_sides(top, "");
  scene.default_for_undefined = read_undefined(top);

  if (const auto bands = top.section("bands", "bands")) {
    bands->allow_only({"wavelength_nm"});
    scene.wavelengths_nm = bands->bands("wavelength_nm", "[bands]", "not positive and finite (nm)", positive);
    if (scene.wavelengths_nm && !scene.wavelengths_nm->per_band)
      bands->fail_type("wavelength_nm", *bands->find("wavelength_nm"), "an array with one number per band");
  }

  if (const auto materials = top.section("materials", "materials"))
    for (const auto& [key, node] : materials->table()) {
      const std::string name(key.str());
      scene.materials[name] = read_material(*materials->section(name, "materials." + name), name);
    }

  if (const auto lights = top.section("lights", "lights"))
    for (const auto& [key, node] : lights->table()) {
      const std::string name(key.str());
      scene.lights[name] = read_light(*lights->section(name, "lights." + name), name);
    }

  if (const auto setups = top.section("setup", "setup"))
    for (const auto& [key, node] : setups->table()) {
      const std::string name(key.str());
      scene.setups[name] = read_setup(*setups->section(name, "setup." + name), name);
    }

  if (const auto symmetry = top.section("symmetry", "symmetry")) scene.symmetry = read_symmetry(*symmetry);

  constexpr std::int64_t kMost = std::numeric_limits<Index>::max();
  const auto index = [](std::optional<std::int64_t> value) -> std::optional<Index> {
    if (!value) return {};
    return static_cast<Index>(*value);
  };
  SceneSettings& settings = scene.settings;
  if (const auto patches = top.section("patches", "patches")) {
    patches->allow_only({"size"});
    if (patches->find("size"))
      settings.patches = read_size<PatchOptions, KeepFaces, AutoPatches, PatchSize>(*patches, "patches");
  }
  if (const auto elements = top.section("elements", "elements")) {
    elements->allow_only({"size", "samples"});
    if (elements->find("size"))
      settings.elements =
          read_size<ElementOptions, NoElements, AutoElements, ElementSize>(*elements, "elements");
    settings.element_samples = index(elements->integer("samples", 1, 1 << 20));
  }
  if (const auto factors = top.section("form_factors", "form_factors")) {
    factors->allow_only({"method", "samples", "resolution", "factor_tolerance", "seed"});
    settings.method = factors->text("method");
    settings.samples = index(factors->integer("samples", 1, kMost));
    settings.resolution = index(factors->integer("resolution", 1, kMost));
    settings.factor_tolerance = factors->number("factor_tolerance", kPositive, positive);
    if (const auto seed = factors->integer("seed", 0, std::numeric_limits<std::int64_t>::max()))
      settings.seed = static_cast<std::uint64_t>(*seed);
  }
  if (const auto solver = top.section("solver", "solver")) {
    solver->allow_only({"name", "tolerance", "max_iterations", "relaxation", "ambient"});
    settings.solver = solver->text("name");
    settings.tolerance = solver->number("tolerance", kPositive, positive);
    settings.max_iterations = index(solver->integer("max_iterations", 1, kMost));
    settings.relaxation =
        solver->number("relaxation", "between 0 and 2", [](double value) { return value > 0 && value < 2; });
    settings.ambient = solver->boolean("ambient");
  }
  if (const auto camera = top.section("camera", "camera")) read_cameras(*camera, settings);
  return scene;
}

}  // namespace radiosity
