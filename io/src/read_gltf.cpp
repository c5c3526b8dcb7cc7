// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "gltf_file.hpp"
#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "texture_mean.hpp"

namespace radiosity {
namespace {

/// Extensions that are read, or that change neither a shape nor its diffuse reflectance.
constexpr std::array<std::string_view, 17> kUnderstood{"KHR_mesh_quantization",
                                                       "EXT_mesh_gpu_instancing",
                                                       "KHR_materials_emissive_strength",
                                                       "KHR_materials_pbrSpecularGlossiness",
                                                       "KHR_materials_unlit",
                                                       "KHR_materials_anisotropy",
                                                       "KHR_materials_clearcoat",
                                                       "KHR_materials_ior",
                                                       "KHR_materials_iridescence",
                                                       "KHR_materials_sheen",
                                                       "KHR_materials_specular",
                                                       "KHR_materials_transmission",
                                                       "KHR_materials_variants",
                                                       "KHR_texture_transform",
                                                       "KHR_texture_basisu",
                                                       "EXT_texture_webp",
                                                       "MSFT_texture_dds"};

using Transform = Eigen::Affine3d;

std::vector<Vec3> points(const std::vector<double>& numbers) {
  std::vector<Vec3> result(numbers.size() / 3);
  for (std::size_t k = 0; k < result.size(); ++k) result[k] = Vec3(&numbers[3 * k]);
  return result;
}

Transform transform(const std::vector<double>& column_major, const GltfItem& item) {
  const Eigen::Matrix4d matrix(column_major.data());
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1)))
    item.fail("the last row of its matrix is not 0 0 0 1");
  return Transform(matrix);
}

/// Quaternions are x, y, z, w. Rounded ones are brought back to length 1, or the part would be scaled.
Transform transform(const double* translation, const double* rotation, const double* scale,
                    const GltfItem& item) {
  const Eigen::Quaterniond turn(rotation[3], rotation[0], rotation[1], rotation[2]);
  if (!(std::abs(turn.norm() - 1) < 0.05))
    item.fail(fmt::format("its rotation is a quaternion of length {:.4g}, not 1", turn.norm()));
  return Eigen::Translation3d(Vec3(translation)) * turn.normalized() * Eigen::Scaling(Vec3(scale));
}

BandValues rgb(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::Array3d>(values.data());
}

class GltfReader {
 public:
  explicit GltfReader(const std::filesystem::path& file) : file_(file), root_(file_.root()) {}

  MeshFile read() {
    check_extensions();
    const std::vector<std::size_t> nodes = place_nodes();
    for (const std::size_t node : nodes)
      if (root_.element("nodes", node).has("mesh")) add_node(node);
    if (left_out_ > 0)
      mesh_.warnings.push_back(
          fmt::format("{} sets of points and lines are not surfaces: left out", left_out_));
    if (!transparent_.empty())
      mesh_.warnings.push_back(
          fmt::format("blending by alpha is not read: opaque here: '{}'", fmt::join(transparent_, "', '")));
    if (!unread_images_.empty())
      mesh_.warnings.push_back(fmt::format(
          "{} images of textures cannot be read (the first: {}): reflectance and emission without them",
          unread_images_.size(), *unread_images_.begin()));
    return std::move(mesh_);
  }

 private:
  void check_extensions() {
    std::vector<std::string> unknown;
    for (const std::string& name : root_.texts("extensionsRequired"))
      if (std::find(kUnderstood.begin(), kUnderstood.end(), name) == kUnderstood.end())
        unknown.push_back(name);
    if (!unknown.empty())
      root_.fail(
          fmt::format("it needs {}, which is not read; export it without", fmt::join(unknown, " and ")));
    if (root_.extension("KHR_lights_punctual").size("lights") > 0)
      mesh_.warnings.push_back(
          "KHR_lights_punctual is not read: its lamps are left out; give surfaces an emission");
  }

  /// The nodes of the scene, each after its parent, and their transforms to it.
  std::vector<std::size_t> place_nodes() {
    const std::size_t count = root_.size("nodes");
    to_world_.assign(count, Transform::Identity());
    placed_.assign(count, false);
    std::vector<std::size_t> waiting = root_nodes(), order;
    std::reverse(waiting.begin(), waiting.end());
    while (!waiting.empty()) {
      const std::size_t node = waiting.back();
      waiting.pop_back();
      const GltfItem item = root_.element("nodes", node);
      if (placed_[node]) item.fail("it is in the scene twice: the nodes are not a tree");
      placed_[node] = true;
      order.push_back(node);
      to_world_[node] = to_world_[node] * local(item);
      std::vector<std::size_t> children = item.wholes("children");
      std::reverse(children.begin(), children.end());
      for (const std::size_t child : children) {
        if (child >= count) item.fail(fmt::format("child {} is not one of the {} nodes", child, count));
        to_world_[child] = to_world_[node];
        waiting.push_back(child);
      }
    }
    return order;
  }

  /// Of the scene that the file shows; without scenes, all that are no node's children.
  std::vector<std::size_t> root_nodes() const {
    if (root_.size("scenes") > 0) return root_.element("scenes", root_.whole("scene", 0)).wholes("nodes");
    std::set<std::size_t> children;
    for (std::size_t n = 0; n < root_.size("nodes"); ++n)
      for (const std::size_t child : root_.element("nodes", n).wholes("children")) children.insert(child);
    std::vector<std::size_t> result;
    for (std::size_t n = 0; n < root_.size("nodes"); ++n)
      if (!children.contains(n)) result.push_back(n);
    return result;
  }

  static Transform local(const GltfItem& node) {
    if (node.has("matrix")) return transform(node.numbers("matrix", 16), node);
    return transform(node.numbers("translation", {0, 0, 0}).data(),
                     node.numbers("rotation", {0, 0, 0, 1}).data(), node.numbers("scale", {1, 1, 1}).data(),
                     node);
  }

  void add_node(std::size_t node) {
    const GltfItem item = root_.element("nodes", node);
    const GltfItem mesh = root_.element("meshes", item.whole("mesh"));
    const std::vector<double> weights = (item.has("weights") ? item : mesh).numbers("weights", 0);
    const std::vector<Transform> joints = joint_transforms(item);
    for (const Transform& instance : instances(item)) {
      // Primitives that differ in material alone often share their vertices.
      std::map<std::string, Index> first_vertices;
      for (std::size_t p = 0; p < mesh.size("primitives"); ++p) {
        const GltfItem primitive = mesh.element("primitives", p);
        const std::size_t mode = primitive.whole("mode", 4);
        if (mode < 4)
          ++left_out_;
        else
          add_primitive(primitive, mode, weights, to_world_[node] * instance, joints, first_vertices);
      }
    }
  }

  /// A node's transform, or EXT_mesh_gpu_instancing's transforms of its copies.
  std::vector<Transform> instances(const GltfItem& node) {
    if (!node.object("extensions").has("EXT_mesh_gpu_instancing")) return {Transform::Identity()};
    const GltfItem copies = node.extension("EXT_mesh_gpu_instancing").object("attributes");
    std::size_t count = 0;
    const auto attribute = [&](const char* name, std::size_t components) {
      std::vector<double> values;
      if (!copies.has(name)) return values;
      values = file_.numbers(copies.whole(name), components);
      const std::size_t own = values.size() / components;
      if (count != 0 && own != count)
        copies.fail(fmt::format("{} has {} values, others {}", name, own, count));
      count = own;
      return values;
    };
    const std::vector<double> translations = attribute("TRANSLATION", 3),
                              rotations = attribute("ROTATION", 4), scales = attribute("SCALE", 3);
    constexpr std::array<double, 3> kNoMove{0, 0, 0}, kNoScale{1, 1, 1};
    constexpr std::array<double, 4> kNoTurn{0, 0, 0, 1};
    std::vector<Transform> result;
    for (std::size_t k = 0; k < count; ++k)
      result.push_back(transform(translations.empty() ? kNoMove.data() : &translations[3 * k],
                                 rotations.empty() ? kNoTurn.data() : &rotations[4 * k],
                                 scales.empty() ? kNoScale.data() : &scales[3 * k], copies));
    return result;
  }

  /// Of a skinned node: from the mesh as it was bound to the joints to the scene. Its own transform does not count.
  std::vector<Transform> joint_transforms(const GltfItem& node) {
    std::vector<Transform> result;
    if (!node.has("skin")) return result;
    const GltfItem skin = root_.element("skins", node.whole("skin"));
    const std::vector<std::size_t> joints = skin.wholes("joints");
    if (joints.empty()) skin.fail("it has no joints");
    std::vector<double> bind;
    if (skin.has("inverseBindMatrices")) bind = file_.numbers(skin.whole("inverseBindMatrices"), 16);
    if (!bind.empty() && bind.size() < 16 * joints.size())
      skin.fail(fmt::format("it has {} inverseBindMatrices for {} joints", bind.size() / 16, joints.size()));
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (joints[j] >= placed_.size() || !placed_[joints[j]])
        skin.fail(fmt::format("joint {} is not a node of the scene", joints[j]));
      result.push_back(to_world_[joints[j]]);
      if (!bind.empty())
        result.back() = result.back() * transform({bind.begin() + static_cast<std::ptrdiff_t>(16 * j),
                                                   bind.begin() + static_cast<std::ptrdiff_t>(16 * j + 16)},
                                                  skin);
    }
    return result;
  }

  void add_primitive(const GltfItem& primitive, std::size_t mode, const std::vector<double>& weights,
                     const Transform& to_world, const std::vector<Transform>& joints,
                     std::map<std::string, Index>& first_vertices) {
    if (primitive.object("extensions").has("KHR_draco_mesh_compression"))
      primitive.fail("KHR_draco_mesh_compression is not read; export it without");
    const GltfItem attributes = primitive.object("attributes");
    if (!attributes.has("POSITION")) attributes.fail("'POSITION' is missing");
    const std::size_t count = root_.element("accessors", attributes.whole("POSITION")).whole("count");

    auto& vertices = mesh_.geometry.vertices;
    const bool morphed = std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
    const std::string key = morphed ? primitive.key() : attributes.key();
    const auto [first, added] = first_vertices.try_emplace(key, static_cast<Index>(vertices.size()));
    if (added) {
      std::vector<Vec3> own = points(file_.numbers(attributes.whole("POSITION"), 3));
      if (vertices.size() + own.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
        primitive.fail(fmt::format("there are more than {} vertices", std::numeric_limits<Index>::max()));
      if (morphed) morph(primitive, weights, own);
      if (joints.empty())
        for (Vec3& x : own) x = to_world * x;
      else
        skin(attributes, joints, own);
      vertices.insert(vertices.end(), own.begin(), own.end());
    }
    // A reflecting transform turns the order of corners, and with it the front, round.
    const bool mirrored = (joints.empty() ? to_world : joints.front()).linear().determinant() < 0;
    add_triangles(primitive, mode, corners(primitive, count), first->second, mirrored);
  }

  void morph(const GltfItem& primitive, const std::vector<double>& weights, std::vector<Vec3>& vertices) {
    for (std::size_t t = 0; t < weights.size(); ++t) {
      if (weights[t] == 0) continue;
      const GltfItem target = primitive.element("targets", t);
      if (!target.has("POSITION")) continue;  // moves nothing but normals
      const std::vector<Vec3> moves = points(file_.numbers(target.whole("POSITION"), 3));
      if (moves.size() != vertices.size())
        target.fail(fmt::format("it moves {} vertices of {}", moves.size(), vertices.size()));
      for (std::size_t v = 0; v < moves.size(); ++v) vertices[v] += weights[t] * moves[v];
    }
  }

  /// x = Σ w_j T_j x / Σ w_j over the joints of each vertex.
  void skin(const GltfItem& attributes, const std::vector<Transform>& joints, std::vector<Vec3>& vertices) {
    if (!attributes.has("JOINTS_0") || !attributes.has("WEIGHTS_0"))
      attributes.fail("its node has a skin, but JOINTS_0 and WEIGHTS_0 do not say which joints move it");
    if (attributes.has("JOINTS_1")) attributes.fail("more than four joints move a vertex, which is not read");
    const std::vector<double> numbers = file_.numbers(attributes.whole("JOINTS_0"), 4);
    const std::vector<double> weights = file_.numbers(attributes.whole("WEIGHTS_0"), 4);
    if (numbers.size() != 4 * vertices.size() || weights.size() != numbers.size())
      attributes.fail(fmt::format("{} vertices have {} JOINTS_0 and {} WEIGHTS_0", vertices.size(),
                                  numbers.size() / 4, weights.size() / 4));
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      Vec3 moved = Vec3::Zero();
      double sum = 0;
      for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
        if (weights[k] == 0) continue;
        if (!(numbers[k] >= 0 && numbers[k] < static_cast<double>(joints.size())))
          attributes.fail(
              fmt::format("joint {} of vertex {} is not one of the skin's {}", numbers[k], v, joints.size()));
        moved += weights[k] * (joints[static_cast<std::size_t>(numbers[k])] * vertices[v]);
        sum += weights[k];
      }
      if (!(sum > 0)) attributes.fail(fmt::format("the weights of vertex {} are all 0", v));
      vertices[v] = moved / sum;
    }
  }

  /// Vertex numbers of the primitive's corners.
  std::vector<Index> corners(const GltfItem& primitive, std::size_t vertex_count) {
    std::vector<Index> result;
    if (!primitive.has("indices")) {
      for (std::size_t v = 0; v < vertex_count; ++v) result.push_back(static_cast<Index>(v));
      return result;
    }
    const std::size_t accessor = primitive.whole("indices");
    for (const double index : file_.numbers(accessor, 1)) {
      if (!(index >= 0 && index < static_cast<double>(vertex_count) && index == std::floor(index)))
        root_.element("accessors", accessor)
            .fail(fmt::format("index {} is not one of the {} vertices", index, vertex_count));
      result.push_back(static_cast<Index>(index));
    }
    return result;
  }

  void add_triangles(const GltfItem& primitive, std::size_t mode, const std::vector<Index>& corners,
                     Index first, bool mirrored) {
    constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;
    if (mode > kFan) primitive.fail(fmt::format("'mode' is {}; 0 to 6 are possible", mode));
    if (corners.size() < 3 || (mode == kTriangles && corners.size() % 3 != 0))
      primitive.fail(fmt::format("{} corners do not make triangles", corners.size()));
    const Index number = material(primitive);
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (mirrored) std::swap(b, c);
      mesh_.geometry.add_face(std::array{first + corners[a], first + corners[b], first + corners[c]}, number);
    };
    const std::size_t step = mode == kTriangles ? 3 : 1;
    for (std::size_t k = 0; k + 2 < corners.size(); k += step) {
      if (mode == kFan)
        add(0, k + 1, k + 2);
      else if (mode == kStrip && k % 2 == 1)
        add(k, k + 2, k + 1);
      else
        add(k, k + 1, k + 2);
    }
  }

  Index material(const GltfItem& primitive) {
    const bool defined = primitive.has("material");
    const std::size_t source =
        defined ? primitive.whole("material") : std::numeric_limits<std::size_t>::max();
    const auto [entry, added] = numbers_.try_emplace(source, static_cast<Index>(mesh_.materials.size()));
    if (!added) return entry->second;
    MeshMaterial result;
    if (defined) {
      result = convert(root_.element("materials", source), source);
    } else {
      result.name = kDefaultMaterial;
      mesh_.warnings.push_back(fmt::format("faces without a material get '{}'", kDefaultMaterial));
    }
    mesh_.materials.push_back(std::move(result));
    return entry->second;
  }

  MeshMaterial convert(const GltfItem& source, std::size_t number) {
    MeshMaterial result{.name = source.text("name", "")};
    if (result.name.empty()) result.name = fmt::format("material_{}", number);
    const bool specular = source.object("extensions").has("KHR_materials_pbrSpecularGlossiness");
    const GltfItem surface = specular ? source.extension("KHR_materials_pbrSpecularGlossiness")
                                      : source.object("pbrMetallicRoughness");
    const auto colour = surface.numbers(specular ? "diffuseFactor" : "baseColorFactor", {1, 1, 1, 1});
    result.reflectance = rgb(colour) * texture(surface, specular ? "diffuseTexture" : "baseColorTexture");
    result.emission = rgb(source.numbers("emissiveFactor", {0, 0, 0})) *
                      source.extension("KHR_materials_emissive_strength").number("emissiveStrength", 1);
    if ((result.emission != 0).any()) result.emission *= texture(source, "emissiveTexture");
    if (source.flag("doubleSided")) result.sides = Sides::both;
    const double transmitted = source.extension("KHR_materials_transmission").number("transmissionFactor", 0);
    if (transmitted < 0 || transmitted > 1)
      source.fail(fmt::format("'transmissionFactor' is {}, which is outside [0, 1]", transmitted));
    if (transmitted > 0) {  // in the place of diffuse light, in the same colour
      result.transmission = transmitted * result.reflectance;
      result.reflectance *= 1 - transmitted;
      result.refractive_index = source.extension("KHR_materials_ior").number("ior", 1.5);
    }
    if (colour[3] < 1 && source.text("alphaMode", "OPAQUE") == "BLEND") transparent_.push_back(result.name);
    return result;
  }

  /// The mean of a texture's image; 1 where there is no texture or its image cannot be read.
  BandValues texture(const GltfItem& material, const char* key) {
    const BandValues none = BandValues::Ones(3);
    if (!material.has(key)) return none;
    const std::size_t number = material.object(key).whole("index");
    const GltfItem item = root_.element("textures", number);
    std::size_t image = item.whole("source", root_.size("images"));
    if (image >= root_.size("images") && !item.has("source")) {
      unread_images_.insert(fmt::format("textures[{}]", number));
      return none;
    }
    const auto [entry, added] = means_.try_emplace(image);
    if (added) entry->second = image_mean(image);
    return entry->second.value_or(none);
  }

  std::optional<BandValues> image_mean(std::size_t number) {
    const GltfItem image = root_.element("images", number);
    std::optional<BandValues> mean;
    std::string name = fmt::format("images[{}]", number);
    if (image.has("bufferView")) {
      mean = texture_mean(file_.view(image.whole("bufferView")));
    } else {
      const std::string uri = image.text("uri", "");
      if (const auto bytes = GltfFile::embedded(uri)) {
        mean = texture_mean(std::string_view(*bytes));
      } else {
        name = file_.neighbour(uri).string();
        mean = texture_mean(file_.neighbour(uri));
      }
    }
    if (!mean) unread_images_.insert(name);
    return mean;
  }

  GltfFile file_;
  GltfItem root_;
  MeshFile mesh_;
  std::vector<Transform> to_world_;
  std::vector<bool> placed_;
  std::map<std::size_t, Index> numbers_;
  std::map<std::size_t, std::optional<BandValues>> means_;
  std::set<std::string> unread_images_;
  std::vector<std::string> transparent_;
  std::size_t left_out_ = 0;
};

}  // namespace

MeshFile read_gltf(const std::filesystem::path& file) {
  return GltfReader(file).read();
}

}  // namespace radiosity
