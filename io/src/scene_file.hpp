// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/refractive_index.hpp"
#include "radiosity/meshing/curved_shape.hpp"
#include "radiosity/meshing/light.hpp"
#include "radiosity/meshing/symmetry.hpp"

namespace radiosity {

/// A number that holds for every band, or an array with one number per band, and where it stands.
struct BandSetting {
  BandValues values;
  bool per_band = false;
  int line = 0;
};

/// A number for every band, one per band, or a function of the wavelength that holds from `from_nm` to `to_nm`.
struct IndexSetting {
  std::variant<BandSetting, Dispersion> index;
  double from_nm = 0, to_nm = std::numeric_limits<double>::infinity();
  int line = 0;
};

/// [materials.NAME], where NAME may be a pattern
struct MaterialSetting {
  int line = 0;
  std::optional<BandSetting> reflectance, absorptance;  ///< at most one of the two
  std::optional<BandSetting> emission, power;           ///< the same; power in W, over the material's area
  std::optional<Sides> sides;
  std::optional<BandSetting> specular, transmission;
  std::optional<double> shininess;
  std::optional<IndexSetting> refractive_index;
};

/// [lights.NAME], all but the bands of its intensity
struct LightSetting {
  int line = 0;
  Light light;
  BandSetting intensity;
};

/// [shapes.NAME]
struct ShapeSetting {
  int line = 0;
  CurvedShape shape;
  std::string material;
  std::optional<double> chord_error;  ///< m
};

/// [setup.NAME]: a factor on the emission of each material that is named, or fits a pattern
struct SetupSetting {
  int line = 0;
  std::map<std::string, double> factors;
};

/// [symmetry]
struct SymmetrySetting {
  int line = 0;
  Symmetry symmetry;
};

struct SceneFile {
  std::filesystem::path mesh;  ///< empty: there are shapes alone
  double metres_per_unit = 1;
  bool flip = false;                          ///< all faces are turned over
  bool default_for_undefined = false;         ///< [materials.default] serves names that nothing defines
  std::optional<Sides> sides;                 ///< of materials that do not say
  std::optional<BandSetting> wavelengths_nm;  ///< of the bands
  std::map<std::string, MaterialSetting> materials;
  std::map<std::string, LightSetting> lights;
  std::map<std::string, ShapeSetting> shapes;
  std::map<std::string, SetupSetting> setups;
  std::optional<SymmetrySetting> symmetry;
  SceneSettings settings;
};

/// A value of `units`.
struct LengthUnit {
  std::string_view name;
  double metres;
  bool metric;
};
std::span<const LengthUnit> length_units();

/// Letters, digits, - and _, which TOML takes for a key without quotes.
bool is_bare_key(const std::string& name);

/// Reads a scene file by itself; the mesh is not opened. Throws IoError where it is not TOML, InputError naming
/// file, line, key and rule.
SceneFile read_scene_file(const std::filesystem::path& file);

}  // namespace radiosity
