// SPDX-License-Identifier: GPL-3.0-or-later
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "files.hpp"
#include "radiosity/io/read_scene.hpp"

namespace radiosity::test {
namespace {

using Json = nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// glTF's componentTypes.
template <class T>
constexpr int kType = 0;
template <>
constexpr int kType<std::int8_t> = 5120;
template <>
constexpr int kType<std::uint8_t> = 5121;
template <>
constexpr int kType<std::int16_t> = 5122;
template <>
constexpr int kType<std::uint16_t> = 5123;
template <>
constexpr int kType<std::uint32_t> = 5125;
template <>
constexpr int kType<float> = 5126;

/// A glTF file in the making. As it begins, it holds one node with one mesh: the triangle (0,0,0) (1,0,0) (0,1,0)
/// with the material "glow".
class Gltf {
 public:
  Gltf() {
    json = Json::parse(
        R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
      "materials": [{"name": "glow", "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1]},
                     "emissiveFactor": [1, 0.5, 0.25]}]})");
    add<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    add<std::uint16_t>("SCALAR", {0, 1, 2});
  }

  /// A new accessor with a buffer view of its own; `gap` bytes lie between its elements. Returns its number.
  template <class T>
  std::size_t add(const std::string& type, const std::vector<T>& values, bool normalized = false,
                  std::size_t gap = 0) {
    const std::size_t components = type == "SCALAR" ? 1
                                   : type == "MAT4" ? 16
                                                    : static_cast<std::size_t>(type[3] - '0');
    bytes.resize((bytes.size() + 3) / 4 * 4);
    const std::size_t first = bytes.size();
    for (std::size_t k = 0; k < values.size(); k += components) {
      bytes.append(reinterpret_cast<const char*>(&values[k]), components * sizeof(T));
      bytes.append(gap, '\xff');
    }
    Json view{{"buffer", 0}, {"byteOffset", first}, {"byteLength", bytes.size() - first}};
    if (gap > 0) view["byteStride"] = components * sizeof(T) + gap;
    json["bufferViews"].push_back(view);
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", kType<T>},
                                 {"count", values.size() / components},
                                 {"type", type},
                                 {"normalized", normalized}});
    return json["accessors"].size() - 1;
  }

  Json& primitive() { return json["meshes"][0]["primitives"][0]; }

  std::filesystem::path write(const TemporaryDirectory& directory, const std::string& uri = "a.bin",
                              const std::string& name = "a.bin") const {
    directory.write(name, bytes);
    Json whole = json;
    whole["buffers"] = {{{"byteLength", bytes.size()}, {"uri", uri}}};
    return directory.write("a.gltf", whole.dump());
  }

  std::string glb() const {
    Json whole = json;
    whole["buffers"] = {{{"byteLength", bytes.size()}}};
    std::string text = whole.dump(), result = "glTF";
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto put = [&](std::size_t value) {
      const auto number = static_cast<std::uint32_t>(value);
      result.append(reinterpret_cast<const char*>(&number), 4);
    };
    put(2);
    put(12 + 8 + text.size() + 8 + bytes.size());
    put(text.size());
    result += "JSON" + text;
    put(bytes.size());
    return result + std::string("BIN\0", 4) + bytes;
  }

  Json json;
  std::string bytes;
};

std::vector<Vec3> face_points(const Scene& scene, Index face) {
  std::vector<Vec3> result;
  for (const Index v : scene.corners(face)) result.push_back(scene.vertices()[v]);
  return result;
}

std::string refusal(const Gltf& gltf) {
  const TemporaryDirectory directory;
  const auto file = gltf.write(directory);
  const std::string message = message_of<Error>([&] { read_scene(file); });
  EXPECT_THAT(message, StartsWith(file.string() + ": "));
  return message.substr(std::min(message.size(), file.string().size() + 2));
}

LoadedScene load(const Gltf& gltf) {
  const TemporaryDirectory directory;
  return read_scene(gltf.write(directory));
}

TEST(ReadGltf, AppliesNodeTransformsAndMaterialFactors) {
  Gltf gltf;
  gltf.json["scenes"][0]["nodes"] = {0, 1};
  gltf.json["nodes"].push_back({{"mesh", 0}, {"scale", {-1, 1, 1}}, {"translation", {10, 0, 0}}});
  const LoadedScene loaded = load(gltf);
  const Scene& scene = loaded.scene;
  ASSERT_EQ(scene.face_count(), 2);
  EXPECT_EQ(scene.lower(), Vec3(0, 0, 0));
  EXPECT_EQ(scene.upper(), Vec3(10, 1, 0));
  // A mirror image still shows its front to +z.
  EXPECT_EQ(scene.area_vector(0), Vec3(0, 0, 0.5));
  EXPECT_EQ(scene.area_vector(1), Vec3(0, 0, 0.5));
  ASSERT_EQ(scene.materials().size(), 1U);
  EXPECT_EQ(scene.materials()[0].name, "glow");
  EXPECT_TRUE((scene.materials()[0].reflectance == rgb(0.25, 0.5, 0.75)).all());
  EXPECT_TRUE((scene.materials()[0].emission == rgb(1, 0.5, 0.25)).all());
  EXPECT_EQ(scene.materials()[0].sides, Sides::front);
  EXPECT_THAT(loaded.warnings, IsEmpty());
}

TEST(ReadGltf, ChainsTransformsInDoublePrecision) {
  Gltf gltf;
  // Turned about z by 90 degrees and moved by 2 in x below a matrix that moves by 10 million in y, by columns.
  const double half = std::sqrt(0.5);
  gltf.json["nodes"] = {{{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1e7, 0, 1}}, {"children", {1}}},
                        {{"mesh", 0}, {"translation", {2, 0, 0}}, {"rotation", {0, 0, half, half}}}};
  const Scene scene = load(gltf).scene;
  EXPECT_NEAR((face_points(scene, 0)[1] - Vec3(2, 1e7 + 1, 0)).norm(), 0, 1e-8);
  EXPECT_NEAR((face_points(scene, 0)[2] - Vec3(1, 1e7, 0)).norm(), 0, 1e-8);
}

TEST(ReadGltf, ReadsBuffersInTheFileAndInAGlb) {
  const TemporaryDirectory directory;
  Gltf gltf;
  // 36 bytes of coordinates and 6 of indices: as long as without the padding.
  const auto inside = gltf.write(
      directory,
      "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA");
  EXPECT_EQ(read_scene(inside).scene.area_vector(0), Vec3(0, 0, 0.5));
  const auto glb = directory.write("a.glb", gltf.glb());
  EXPECT_EQ(read_scene(glb).scene.area_vector(0), Vec3(0, 0, 0.5));
  const auto cut = directory.write("cut.glb", gltf.glb().substr(0, gltf.glb().size() - 1));
  EXPECT_THAT(message_of<IoError>([&] { read_scene(cut); }),
              AllOf(StartsWith(cut.string()), HasSubstr("is cut off")));
}

TEST(ReadGltf, DecodesPercentSignsInBufferNames) {
  const TemporaryDirectory directory;
  EXPECT_EQ(read_scene(Gltf().write(directory, "my%20buffer%2Ebin", "my buffer.bin")).scene.face_count(), 1);
  // What is no code of two digits stands for itself.
  EXPECT_EQ(read_scene(Gltf().write(directory, "100%.bin", "100%.bin")).scene.face_count(), 1);
}

TEST(ReadGltf, ABufferThatIsMissingOrTooShortIsAnError) {
  const TemporaryDirectory directory;
  const auto missing = Gltf().write(directory, "other.bin");
  EXPECT_EQ(message_of<IoError>([&] { read_scene(missing); }),
            (directory / "other.bin").string() + ": no such file");
  const auto short_one = Gltf().write(directory);
  directory.write("a.bin", std::string(20, '\0'));
  EXPECT_THAT(message_of<InputError>([&] { read_scene(short_one); }),
              AllOf(StartsWith(short_one.string()), HasSubstr("byteLength is 42, but there are 20 bytes")));
}

TEST(ReadGltf, ReadsQuantizedCoordinates) {
  // 52428 / 65535 of 5 m are 4 m but for rounding to whole numbers: 1 / 65535 of 5 m at most.
  Gltf gltf;
  gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  gltf.json["nodes"][0]["scale"] = {5, 5, 5};
  gltf.primitive()["attributes"]["POSITION"] =
      gltf.add<std::uint16_t>("VEC3", {0, 0, 0, 52428, 0, 0, 0, 32768, 0}, true, 2);
  const LoadedScene unsigned_16 = load(gltf);
  EXPECT_EQ(face_points(unsigned_16.scene, 0)[1], Vec3(5 * (52428.0 / 65535.0), 0, 0));
  EXPECT_EQ(face_points(unsigned_16.scene, 0)[2], Vec3(0, 5 * (32768.0 / 65535.0), 0));
  EXPECT_THAT(unsigned_16.warnings, IsEmpty());

  // The smallest signed number is -1, like the next one.
  gltf.primitive()["attributes"]["POSITION"] =
      gltf.add<std::int8_t>("VEC3", {-128, 0, 0, 127, 0, 0, 0, -127, 0}, true, 1);
  const Scene signed_8 = load(gltf).scene;
  EXPECT_EQ(face_points(signed_8, 0)[0], Vec3(-5, 0, 0));
  EXPECT_EQ(face_points(signed_8, 0)[1], Vec3(5, 0, 0));
  EXPECT_EQ(face_points(signed_8, 0)[2], Vec3(0, -5, 0));

  gltf.primitive()["attributes"]["POSITION"] =
      gltf.add<std::int16_t>("VEC3", {-300, 0, 0, 400, 0, 0, 0, 20000, 0}, false, 2);
  EXPECT_EQ(load(gltf).scene.upper(), Vec3(2000, 100000, 0));
}

TEST(ReadGltf, ReadsSparseAccessors) {
  Gltf gltf;
  const std::size_t places = gltf.add<std::uint16_t>("SCALAR", {2}),
                    values = gltf.add<float>("VEC3", {0, 7, 0});
  Json& position = gltf.json["accessors"][0];
  position["sparse"] = {{"count", 1},
                        {"indices", {{"bufferView", places}, {"componentType", 5123}}},
                        {"values", {{"bufferView", values}}}};
  EXPECT_EQ(load(gltf).scene.area_vector(0), Vec3(0, 0, 3.5));
  // Without a buffer view, what is not replaced is 0.
  position.erase("bufferView");
  EXPECT_EQ(load(gltf).scene.upper(), Vec3(0, 7, 0));
  position["count"] = 4000000000;
  EXPECT_THAT(refusal(gltf), HasSubstr("accessors[0]: its count 4000000000 is above"));
  position["count"] = 2;
  EXPECT_THAT(refusal(gltf), HasSubstr("index 2 is not one of the 2 elements"));
}

TEST(ReadGltf, ReadsInstancesOfAMesh) {
  Gltf gltf;
  gltf.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  gltf.json["nodes"][0]["translation"] = {0, 0, 1};
  Json& attributes = gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes["TRANSLATION"] = gltf.add<float>("VEC3", {0, 0, 0, 16, 0, 0, 0, 20, 0});
  attributes["SCALE"] = gltf.add<float>("VEC3", {1, 1, 1, 2, 1, 1, -1, 1, 1});
  const Scene scene = load(gltf).scene;
  ASSERT_EQ(scene.face_count(), 3);
  EXPECT_EQ(scene.area_vector(0), Vec3(0, 0, 0.5));
  EXPECT_EQ(scene.area_vector(1), Vec3(0, 0, 1));
  EXPECT_EQ(scene.area_vector(2), Vec3(0, 0, 0.5));
  EXPECT_EQ(scene.lower(), Vec3(-1, 0, 1));
  EXPECT_EQ(scene.upper(), Vec3(18, 21, 1));
  attributes["ROTATION"] = gltf.add<float>("VEC4", {0, 0, 0, 1});
  EXPECT_THAT(refusal(gltf), AllOf(StartsWith("nodes[0]"), HasSubstr("ROTATION has 1 values, others 3")));
}

TEST(ReadGltf, RefusesRequiredExtensionsItDoesNotReadByName) {
  Gltf gltf;
  gltf.json["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_draco_mesh_compression", "ACME_scent"};
  EXPECT_THAT(refusal(gltf),
              AllOf(HasSubstr("KHR_draco_mesh_compression and ACME_scent"), Not(HasSubstr("quantization"))));
}

TEST(ReadGltf, AnIndexOutOfRangeIsAnError) {
  Gltf gltf;
  gltf.primitive()["indices"] = gltf.add<std::uint16_t>("SCALAR", {0, 1, 77});
  EXPECT_EQ(refusal(gltf), "accessors[2]: index 77 is not one of the 3 vertices");
}

TEST(ReadGltf, ElementsOutsideOfTheirBufferAreAnError) {
  Gltf gltf;
  for (const std::size_t count : {std::size_t{4}, std::size_t{1} << 63, ~std::size_t{0}}) {
    gltf.json["accessors"][0]["count"] = count;
    EXPECT_THAT(refusal(gltf),
                StartsWith("accessors[0]: its " + std::to_string(count) + " elements of 12 bytes"));
  }
  gltf.json["bufferViews"][0]["byteOffset"] = ~std::size_t{0};
  EXPECT_THAT(refusal(gltf),
              AllOf(StartsWith("bufferViews[0]"), HasSubstr("not within the 42 of its buffer")));
}

TEST(ReadGltf, RejectsNodesThatAreNoTree) {
  Gltf gltf;
  gltf.json["nodes"][0]["children"] = {0};
  EXPECT_EQ(refusal(gltf), "nodes[0]: it is in the scene twice: the nodes are not a tree");
  gltf.json["nodes"][0]["children"] = {9};
  EXPECT_EQ(refusal(gltf), "nodes[0]: child 9 is not one of the 1 nodes");
}

TEST(ReadGltf, NamesThePlaceOfWhatIsMissingOrOfAnotherType) {
  Gltf gltf;
  gltf.primitive()["indices"] = 1.5;
  EXPECT_EQ(refusal(gltf), "meshes[0].primitives[0]: 'indices' is 1.5, not a whole number from 0");
  gltf.primitive()["indices"] = 8;
  EXPECT_EQ(refusal(gltf), "there is no accessors[8]: there are 2");
  gltf.primitive()["attributes"].erase("POSITION");
  EXPECT_EQ(refusal(gltf), "meshes[0].primitives[0].attributes: 'POSITION' is missing");
  gltf.json["nodes"] = "none";
  EXPECT_EQ(refusal(gltf), "'nodes' is not an array but of type string");
}

TEST(ReadGltf, FacesWithoutAMaterialGetTheDefault) {
  Gltf gltf;
  gltf.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}});
  const LoadedScene loaded = load(gltf);
  ASSERT_EQ(loaded.scene.materials().size(), 2U);
  const Material& plain = loaded.scene.materials()[1];
  EXPECT_EQ(plain.name, "default");
  EXPECT_TRUE((plain.reflectance == rgb(0.5, 0.5, 0.5)).all());
  EXPECT_TRUE((plain.emission == 0).all());
  EXPECT_THAT(loaded.warnings, ElementsAre("faces without a material get 'default'"));
  EXPECT_EQ(loaded.scene.vertex_count(), 3);  // both primitives share their vertices
}

TEST(ReadGltf, ReadsStripsAndFansAndLeavesOutLines) {
  Gltf gltf;
  gltf.primitive()["attributes"]["POSITION"] = gltf.add<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  gltf.primitive()["indices"] = gltf.add<std::uint8_t>("SCALAR", {0, 1, 2, 3});
  gltf.primitive()["mode"] = 5;
  const Scene strip = load(gltf).scene;
  ASSERT_EQ(strip.face_count(), 2);
  EXPECT_EQ(strip.area_vector(0), Vec3(0, 0, 0.5));
  EXPECT_EQ(strip.area_vector(1), Vec3(0, 0, 0.5));
  gltf.primitive()["mode"] = 6;
  gltf.primitive()["indices"] = gltf.add<std::uint32_t>("SCALAR", {0, 1, 3, 2});
  const Scene fan = load(gltf).scene;
  EXPECT_THAT(fan.corners(1), ElementsAre(0, 3, 2));
  Json lines = gltf.primitive();
  lines["mode"] = 1;
  gltf.json["meshes"][0]["primitives"].push_back(lines);
  const LoadedScene loaded = load(gltf);
  EXPECT_EQ(loaded.scene.face_count(), 2);
  EXPECT_THAT(loaded.warnings, ElementsAre("1 sets of points and lines are not surfaces: left out"));
  gltf.primitive()["mode"] = 4;
  EXPECT_EQ(refusal(gltf), "meshes[0].primitives[0]: 4 corners do not make triangles");
}

TEST(ReadGltf, ASkinWithoutJointsIsAnError) {
  Gltf gltf;
  gltf.json["nodes"][0]["skin"] = 0;
  gltf.json["skins"] = {{{"joints", {0}}}};
  EXPECT_THAT(refusal(gltf), AllOf(StartsWith("meshes[0].primitives[0].attributes: its node has a skin"),
                                   HasSubstr("JOINTS_0")));
  gltf.json["skins"] = {{{"joints", Json::array()}}};
  EXPECT_EQ(refusal(gltf), "skins[0]: it has no joints");
}

TEST(ReadGltf, JointsMoveAMesh) {
  // The second joint lifts what it moves by 2; inverse bind matrices halve. The node's own transform does not count.
  Gltf gltf;
  gltf.json["scenes"][0]["nodes"] = {0, 1, 2};
  gltf.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"scale", {100, 100, 100}}},
                        {{"name", "a"}},
                        {{"name", "b"}, {"translation", {0, 0, 2}}}};
  std::vector<float> halves;
  for (int j = 0; j < 2; ++j)
    for (int k = 0; k < 16; ++k) halves.push_back(k == 15 ? 1.0F : k % 5 == 0 ? 0.5F : 0.0F);
  gltf.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", gltf.add<float>("MAT4", halves)}}};
  gltf.primitive()["attributes"]["JOINTS_0"] =
      gltf.add<std::uint8_t>("VEC4", {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 9, 9});
  gltf.primitive()["attributes"]["WEIGHTS_0"] =
      gltf.add<std::uint8_t>("VEC4", {255, 0, 0, 0, 255, 0, 0, 0, 100, 100, 0, 0}, true);
  const Scene scene = load(gltf).scene;
  EXPECT_EQ(face_points(scene, 0)[0], Vec3(0, 0, 0));
  EXPECT_EQ(face_points(scene, 0)[1], Vec3(0.5, 0, 2));
  EXPECT_EQ(face_points(scene, 0)[2], Vec3(0, 0.5, 1));
}

TEST(ReadGltf, MorphTargetsMoveAMeshByTheirWeights) {
  Gltf gltf;
  const std::size_t moves = gltf.add<float>("VEC3", {0, 0, 0, 4, 0, 0, 0, 0, 0});
  gltf.primitive()["targets"] = {{{"POSITION", moves}}};
  EXPECT_EQ(load(gltf).scene.upper(), Vec3(1, 1, 0));
  gltf.json["meshes"][0]["weights"] = {0.25};
  EXPECT_EQ(load(gltf).scene.upper(), Vec3(2, 1, 0));
  gltf.json["nodes"][0]["weights"] = {0.5};
  EXPECT_EQ(load(gltf).scene.upper(), Vec3(3, 1, 0));
}

TEST(ReadGltf, ReadsTheStrengthOfEmission) {
  Gltf gltf;
  gltf.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
  const LoadedScene loaded = load(gltf);
  EXPECT_TRUE((loaded.scene.materials()[0].emission == rgb(8, 4, 2)).all());
  EXPECT_THAT(loaded.warnings, IsEmpty());
}

TEST(ReadGltf, ADoubleSidedMaterialRadiatesFromBothSidesUnlessTheSceneFileSaysOtherwise) {
  const TemporaryDirectory directory;
  Gltf gltf;
  gltf.json["materials"][0]["doubleSided"] = true;
  const LoadedScene loaded = read_scene(gltf.write(directory));
  EXPECT_EQ(loaded.scene.materials()[0].sides, Sides::both);
  EXPECT_THAT(loaded.warnings, IsEmpty());
  const auto own = directory.write("a.toml", "mesh = \"a.gltf\"\n[materials.glow]\nsides = \"front\"\n");
  EXPECT_EQ(read_scene(own).scene.materials()[0].sides, Sides::front);
  const auto other = directory.write("b.toml", "mesh = \"a.gltf\"\n[materials.glow]\nreflectance = 0.1\n");
  EXPECT_EQ(read_scene(other).scene.materials()[0].sides, Sides::both);
}

/// One white pixel and three black ones: a mean of a quarter.
void write_quarter_white(const std::filesystem::path& file) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(2, 2, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  auto* const values = static_cast<unsigned char*>(image->GetScalarPointer());
  for (int k = 0; k < 12; ++k) values[k] = k < 3 ? 255 : 0;
  vtkNew<vtkPNGWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(image);
  writer->Write();
}

TEST(ReadGltf, ATextureScalesReflectanceAndEmissionByItsMean) {
  const TemporaryDirectory directory;
  write_quarter_white(directory / "a picture.png");
  Gltf gltf;
  gltf.json["images"] = {{{"uri", "a%20picture.png"}}};
  gltf.json["textures"] = {{{"source", 0}}};
  gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  gltf.json["materials"][0]["emissiveTexture"]["index"] = 0;
  const LoadedScene loaded = read_scene(gltf.write(directory));
  EXPECT_TRUE((loaded.scene.materials()[0].reflectance == rgb(0.0625, 0.125, 0.1875)).all());
  EXPECT_TRUE((loaded.scene.materials()[0].emission == rgb(0.25, 0.125, 0.0625)).all());
  EXPECT_THAT(loaded.warnings, IsEmpty());

  // The same picture in a buffer view.
  const std::string png = read_text(directory / "a picture.png");
  const std::vector<std::uint8_t> picture(png.begin(), png.end());
  gltf.json["images"] = {
      {{"bufferView", gltf.add<std::uint8_t>("SCALAR", picture)}, {"mimeType", "image/png"}}};
  EXPECT_TRUE((load(gltf).scene.materials()[0].reflectance == rgb(0.0625, 0.125, 0.1875)).all());
}

TEST(ReadGltf, MissingImagesAreOneWarning) {
  Gltf gltf;
  gltf.json["images"] = {{{"uri", "one.png"}}, {{"uri", "two.webp"}}};
  gltf.json["textures"] = {{{"source", 0}}, {{"source", 1}}};
  gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  gltf.json["materials"][0]["emissiveTexture"]["index"] = 1;
  const LoadedScene loaded = load(gltf);
  EXPECT_TRUE((loaded.scene.materials()[0].reflectance == rgb(0.25, 0.5, 0.75)).all());
  EXPECT_THAT(loaded.warnings, ElementsAre(AllOf(StartsWith("2 "), HasSubstr("one.png"))));
}

/// A triangle for each base colour, all of materials called Glas.
Gltf namesakes(const std::vector<double>& greys) {
  Gltf gltf;
  const Json primitive = gltf.primitive();
  gltf.json["materials"].clear();
  gltf.json["meshes"][0]["primitives"].clear();
  for (const double grey : greys) {
    Json triangle = primitive;
    triangle["material"] = gltf.json["materials"].size();
    gltf.json["meshes"][0]["primitives"].push_back(triangle);
    gltf.json["materials"].push_back(
        {{"name", "Glas"}, {"pbrMetallicRoughness", {{"baseColorFactor", {grey, grey, grey, 1}}}}});
  }
  return gltf;
}

TEST(ReadGltf, MaterialsOfOneNameAndOneValueAreOne) {
  const TemporaryDirectory directory;
  const LoadedScene loaded = read_scene(namesakes({0.25, 0.25, 0.25}).write(directory));
  ASSERT_EQ(loaded.scene.materials().size(), 1U);
  EXPECT_EQ(loaded.scene.materials()[0].name, "Glas");
  EXPECT_THAT(loaded.warnings, IsEmpty());
}

TEST(ReadGltf, MaterialsOfOneNameAndOtherValuesAreNumbered) {
  const TemporaryDirectory directory;
  const LoadedScene loaded = read_scene(namesakes({0.25, 0.5, 0.25, 0.5}).write(directory));
  ASSERT_EQ(loaded.scene.materials().size(), 2U);
  EXPECT_EQ(loaded.scene.materials()[0].name, "Glas");
  EXPECT_EQ(loaded.scene.materials()[1].name, "Glas_1");
  EXPECT_EQ(loaded.scene.materials()[1].reflectance[0], 0.5);
  for (Index f = 0; f < 4; ++f) EXPECT_EQ(loaded.scene.material(f), f % 2);
  EXPECT_THAT(loaded.warnings,
              ElementsAre(AllOf(HasSubstr("'Glas'"), HasSubstr("Glas_1"), HasSubstr("\"Glas*\""))));
}

TEST(ReadGltf, TransmissionTakesThePlaceOfDiffuseLight) {
  Gltf gltf;
  Json& extensions = gltf.json["materials"][0]["extensions"];
  extensions["KHR_materials_transmission"]["transmissionFactor"] = 0.75;
  const TemporaryDirectory directory;
  const Material glass = read_scene(gltf.write(directory)).scene.materials()[0];
  EXPECT_TRUE((glass.reflectance == rgb(0.0625, 0.125, 0.1875)).all());
  EXPECT_TRUE((glass.transmission == rgb(0.1875, 0.375, 0.5625)).all());
  EXPECT_EQ(glass.refractive_index, 1.5);
  extensions["KHR_materials_ior"]["ior"] = 1.25;
  EXPECT_EQ(read_scene(gltf.write(directory)).scene.materials()[0].refractive_index, 1.25);
  extensions["KHR_materials_transmission"]["transmissionFactor"] = 1.25;
  EXPECT_THAT(message_of<InputError>([&] { read_scene(gltf.write(directory)); }),
              HasSubstr("'transmissionFactor' is 1.25"));
}

TEST(ReadGltf, TellsOfTransparencyAndPunctualLights) {
  Gltf gltf;
  gltf.json["materials"][0]["alphaMode"] = "BLEND";
  gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.5;
  gltf.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  EXPECT_THAT(load(gltf).warnings, ElementsAre(HasSubstr("KHR_lights_punctual"), HasSubstr("'glow'")));
}

}  // namespace
}  // namespace radiosity::test
