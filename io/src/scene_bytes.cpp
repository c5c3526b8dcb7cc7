// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/scene_bytes.hpp"

#include <utility>

#include "child_process.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// One list of what there is, written and read alike: each function takes a value to write, or one to fill in.
class SceneWriter {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(const T& value) { packer_.put(value); }
  void operator()(const std::string& text) { packer_.put_all(text.data(), text.size()); }
  void operator()(const BandValues& values) {
    packer_.put_all(values.data(), static_cast<std::size_t>(values.size()));
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    packer_.put(values.size());
    for (const T& value : values) (*this)(value);
  }
  void operator()(const Vec3& x) {
    for (const double c : x) packer_.put(c);
  }
  template <class T>
  void operator()(const std::optional<T>& value) {
    packer_.put(value.has_value());
    if (value) (*this)(*value);
  }
  void operator()(const Material& material);
  void operator()(const LightingSetup& setup);
  void operator()(const Symmetry& symmetry);
  std::string& bytes() { return packer_.bytes(); }

 private:
  Packer packer_;
};

class SceneReader {
 public:
  explicit SceneReader(const std::string& bytes) : unpacker_(bytes) {}

  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(T& value) { value = unpacker_.take<T>(); }
  void operator()(std::string& text) {
    const auto letters = unpacker_.take_all<char>();
    text.assign(letters.begin(), letters.end());
  }
  void operator()(BandValues& values) {
    const auto all = unpacker_.take_all<double>();
    values = Eigen::Map<const BandValues>(all.data(), static_cast<Eigen::Index>(all.size()));
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    for (auto count = unpacker_.take<std::size_t>(); count > 0 && unpacker_.good(); --count) {
      T value{};
      (*this)(value);
      values.push_back(std::move(value));
    }
  }
  void operator()(Vec3& x) {
    for (double& c : x) c = unpacker_.take<double>();
  }
  template <class T>
  void operator()(std::optional<T>& value) {
    if (!unpacker_.take<bool>()) return;
    T held{};
    (*this)(held);
    value = std::move(held);
  }
  void operator()(Material& material);
  void operator()(LightingSetup& setup);
  void operator()(Symmetry& symmetry);
  bool complete() const { return unpacker_.complete(); }

 private:
  Unpacker unpacker_;
};

void each(auto& one, auto& material_) {
  auto& [name, reflectance, emission, sides, absorptance, emits_power, specular, transmission, shininess,
         index, indices] = material_;
  one(name), one(reflectance), one(emission), one(sides), one(absorptance), one(emits_power), one(specular),
      one(transmission), one(shininess), one(index), one(indices);
}

void each_setting(auto& one, auto& s) {
  one(s.patches), one(s.elements), one(s.element_samples), one(s.method), one(s.samples), one(s.resolution);
  one(s.factor_tolerance), one(s.seed), one(s.solver), one(s.tolerance), one(s.max_iterations),
      one(s.relaxation);
  one(s.ambient);
}

void SceneWriter::operator()(const Material& material) {
  each(*this, material);
}
void SceneWriter::operator()(const LightingSetup& setup) {
  (*this)(setup.name);
  (*this)(setup.factors);
}
void SceneWriter::operator()(const Symmetry& symmetry) {
  (*this)(symmetry.planes), (*this)(symmetry.period), (*this)(symmetry.steps);
}
void SceneReader::operator()(Symmetry& symmetry) {
  (*this)(symmetry.planes), (*this)(symmetry.period), (*this)(symmetry.steps);
}
void SceneReader::operator()(Material& material) {
  each(*this, material);
}
void SceneReader::operator()(LightingSetup& setup) {
  (*this)(setup.name);
  (*this)(setup.factors);
}

}  // namespace

std::string scene_bytes(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  Scene::Arrays arrays;
  arrays.vertices = scene.vertices();
  arrays.materials = scene.materials();
  for (Index f = 0; f < scene.face_count(); ++f) {
    arrays.add_face(scene.corners(f), scene.material(f));
    arrays.two_sided.push_back(scene.two_sided(f) ? 1 : 0);
  }
  SceneWriter write;
  write(arrays.vertices), write(arrays.corners), write(arrays.face_start), write(arrays.face_material);
  write(arrays.materials), write(arrays.two_sided), write(loaded.setups), write(scene.symmetry());
  each_setting(write, loaded.settings);
  return std::move(write.bytes());
}

LoadedScene scene_of_bytes(const std::string& bytes) {
  SceneReader read(bytes);
  Scene::Arrays arrays;
  arrays.face_start.clear();
  std::vector<LightingSetup> setups;
  SceneSettings settings;
  read(arrays.vertices), read(arrays.corners), read(arrays.face_start), read(arrays.face_material);
  read(arrays.materials), read(arrays.two_sided), read(setups), read(arrays.symmetry);
  each_setting(read, settings);
  if (!read.complete()) throw InputError("the bytes of a scene are not complete");
  return {Scene(std::move(arrays)), std::move(settings), std::move(setups), {}, {}};
}

}  // namespace radiosity
