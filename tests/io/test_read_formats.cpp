// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

#include "files.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/meshing/make_patches.hpp"

namespace radiosity::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// Written with all 17 digits, it keeps its bits only in double precision.
constexpr double kFine = 1.0000000000000002;

TEST(ReadPly, ReadsTextInDoublePrecision) {
  const TemporaryDirectory directory;
  const auto file =
      directory.write("a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
                      "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
                      "end_header\n0 0 0\n1.0000000000000002 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  const LoadedScene loaded = read_scene(file);
  EXPECT_EQ(loaded.scene.vertices()[1].x(), kFine);
  EXPECT_THAT(loaded.scene.corners(0), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(loaded.scene.materials()[0].name, "default");
  EXPECT_EQ(loaded.scene.materials()[0].reflectance[0], 0.5);
  EXPECT_EQ(loaded.scene.bands(), 1);
  EXPECT_TRUE(loaded.warnings.empty());
}

TEST(ReadPly, ReadsBinary) {
  const TemporaryDirectory directory;
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
      "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const double x : {0.0, 0.0, 0.0, kFine, 0.0, 0.0, 0.0, 1.0, 0.0}) put(x);
  put(static_cast<unsigned char>(3));
  for (const std::int32_t v : {0, 1, 2}) put(v);
  EXPECT_EQ(read_scene(directory.write("a.ply", text)).scene.vertices()[1].x(), kFine);
  const auto cut = directory.write("cut.ply", text.substr(0, text.size() - 8));
  EXPECT_THAT(message_of<IoError>([&] { read_scene(cut); }),
              AllOf(StartsWith(cut.string()), HasSubstr("ply")));
}

TEST(ReadPly, RejectsAVertexThatDoesNotExist) {
  const TemporaryDirectory directory;
  const auto file =
      directory.write("a.ply",
                      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                      "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                      "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n");
  EXPECT_THAT(message_of<InputError>([&] { read_scene(file); }),
              AllOf(StartsWith(file.string()), HasSubstr("face 0"), HasSubstr("vertex 7")));
}

TEST(ReadOff, ReadsPolygonsInDoublePrecision) {
  const TemporaryDirectory directory;
  const auto file = directory.write(
      "a.off", "OFF\n4 2 0\n0 0 0\n1.0000000000000002 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n");
  const LoadedScene loaded = read_scene(file);
  EXPECT_EQ(loaded.scene.vertices()[1].x(), kFine);
  EXPECT_THAT(loaded.scene.corners(0), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(loaded.scene.corners(1), ElementsAre(0, 1, 2));
}

TEST(ReadOff, RejectsSizesThatNoFileHas) {
  const TemporaryDirectory directory;
  const auto file = directory.write("a.off", "OFF\n4000000000000 1 0\n0 0 0\n");
  EXPECT_THAT(message_of<IoError>([&] { read_scene(file); }), StartsWith(file.string()));
}

std::string binary_stl(std::vector<float> coordinates) {
  std::string text(80, ' ');
  const auto put = [&](auto value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(coordinates.size() / 9));
  for (std::size_t t = 0; t + 8 < coordinates.size(); t += 9) {
    for (int k = 0; k < 3; ++k) put(0.0F);
    for (std::size_t k = 0; k < 9; ++k) put(coordinates[t + k]);
    put(std::uint16_t{0});
  }
  return text;
}

TEST(ReadStl, ReadsTextAndBinary) {
  const TemporaryDirectory directory;
  const auto text =
      directory.write("a.stl",
                      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                      "vertex 1.0000000000000002 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
  EXPECT_EQ(read_scene(text).scene.vertices()[1].x(), kFine);
  const auto binary =
      directory.write("b.STL", binary_stl({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0}));
  const LoadedScene loaded = read_scene(binary);
  EXPECT_EQ(loaded.scene.face_count(), 2);
  EXPECT_EQ(loaded.scene.vertex_count(), 4);  // equal corners are one vertex
}

TEST(ReadStl, RejectsCoordinatesThatAreNotNumbers) {
  const TemporaryDirectory directory;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto file = directory.write("a.stl", binary_stl({0, 0, 0, 1, kNan, 0, 1, 1, 0}));
  EXPECT_THAT(message_of<InputError>([&] { read_scene(file); }),
              AllOf(StartsWith(file.string()), HasSubstr("nan")));
}

TEST(ReadDae, KeepsPolygonsAndMaterialNames) {
  const TemporaryDirectory directory;
  const auto file = directory.write("a.dae", R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="paint-fx"><profile_COMMON><technique sid="c"><lambert>
<emission><color>2 3 4 1</color></emission><diffuse><color>0.25 0.5 0.75 1</color></diffuse>
</lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="paint" name="paint"><instance_effect url="#paint-fx"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 2 0 0 2 1 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist material="m" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
<vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="m" target="#paint"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)");
  const Scene scene = read_scene(file).scene;
  ASSERT_EQ(scene.face_count(), 1);
  EXPECT_EQ(scene.corners(0).size(), 4U);
  EXPECT_EQ(scene.area_vector(0), Vec3(0, 0, 2));
  EXPECT_EQ(scene.materials()[0].name, "paint");
  EXPECT_TRUE((scene.materials()[0].reflectance == rgb(0.25, 0.5, 0.75)).all());
  EXPECT_TRUE((scene.materials()[0].emission == rgb(2, 3, 4)).all());
}

/// A COLLADA file whose nodes n0, n1, … hold what `inside` says of each.
std::string nodes(int count, const std::function<std::string(int)>& inside) {
  std::string text =
      R"(<?xml version="1.0"?><COLLADA version="1.4.1"><library_visual_scenes><visual_scene id="s">)";
  for (int k = 0; k < count; ++k) text += fmt::format("<node id=\"n{}\">{}</node>\n", k, inside(k));
  return text +
         R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(ReadAssimp, ACrashOfTheLibraryIsAnError) {
  // A node within itself: endless recursion in assimp 5.2.
  const TemporaryDirectory directory;
  const auto file = directory.write("a.dae", nodes(1, [](int) { return R"(<instance_node url="#n0"/>)"; }));
  EXPECT_THAT(message_of<IoError>([&] { read_scene(file); }),
              AllOf(StartsWith(file.string() + ": the reader (assimp "), HasSubstr("crashed on this file")));
}

TEST(ReadAssimp, HungerForMemoryIsAnError) {
  // Each of 40 nodes holds the next one twice: 2^40 nodes.
  const TemporaryDirectory directory;
  const auto file = directory.write("a.dae", nodes(40, [](int k) {
                                      return k == 39 ? std::string()
                                                     : fmt::format(
                                                           "<instance_node url=\"#n{0}\"/>"
                                                           "<instance_node url=\"#n{0}\"/>",
                                                           k + 1);
                                    }));
  EXPECT_THAT(
      message_of<IoError>([&] { read_scene(file); }),
      AllOf(StartsWith(file.string() + ": the reader (assimp "), HasSubstr("needs more than 1.0 GB")));
}

TEST(ReadIfc, RefusesOtherSchemasThanIfc2x3ByName) {
  const TemporaryDirectory directory;
  const auto file = directory.write(
      "a.ifc",
      "ISO-10303-21;\nHEADER;\nFILE_SCHEMA (\n ( 'Ifc4' ) );\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
  EXPECT_EQ(
      message_of<IoError>([&] { read_scene(file); }),
      file.string() + ": its schema is IFC4, and only IFC2X3 is read: export it as IFC2x3, glTF or OBJ");
}

/// The scenes in a folder of tests/data, a folder each.
std::vector<std::filesystem::path> scene_folders(const std::string& name) {
  std::vector<std::filesystem::path> folders;
  for (const auto& folder :
       std::filesystem::directory_iterator(std::filesystem::path(RADIOSITY_SOURCE_DIR) / "tests/data" / name))
    folders.push_back(folder.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::string name_of(const testing::TestParamInfo<std::filesystem::path>& folder) {
  std::string name = folder.param.filename();
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

/// scene.toml, or the one mesh in the folder.
std::filesystem::path main_file(const std::filesystem::path& folder) {
  std::filesystem::path mesh;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const auto extension = file.path().extension();
    if (extension == ".toml") return file.path();
    if (extension != ".mtl" && extension != ".png") mesh = file.path();
  }
  return mesh;
}

/// What scripts/fuzz starts from.
class EverySeed : public testing::TestWithParam<std::filesystem::path> {};
INSTANTIATE_TEST_SUITE_P(Fuzz, EverySeed, testing::ValuesIn(scene_folders("seeds")), name_of);

TEST_P(EverySeed, IsAScene) {
  const LoadedScene loaded = read_scene(main_file(GetParam()));
  EXPECT_GE(loaded.scene.face_count(), 2);
}

/// Files that scripts/fuzz made, and that a reader, or the division into patches, did not survive once.
class EveryFind : public testing::TestWithParam<std::filesystem::path> {};
INSTANTIATE_TEST_SUITE_P(Fuzz, EveryFind, testing::ValuesIn(scene_folders("corpus")), name_of);

TEST_P(EveryFind, IsASceneOrAnError) {
  const auto file = main_file(GetParam());
  try {
    const LoadedScene loaded = read_scene(file);
    EXPECT_GE(loaded.scene.face_count(), 1);
    make_patches(loaded.scene);
  } catch (const Error& error) {
    EXPECT_STRNE(error.what(), "");
  }
}

/// Two unit squares side by side as polygons.
vtkSmartPointer<vtkPolyData> two_squares() {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int k = 0; k < 6; ++k) points->InsertNextPoint(k % 3 == 2 ? 1 + kFine : k % 3, k / 3, 0);
  vtkNew<vtkCellArray> polygons;
  for (const auto& loop : {std::array<vtkIdType, 4>{0, 1, 4, 3}, std::array<vtkIdType, 4>{1, 2, 5, 4}})
    polygons->InsertNextCell(4, loop.data());
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polygons);
  return data;
}

void add(vtkFieldData* data, const char* name, int components, const std::vector<double>& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  for (std::size_t k = 0; k < values.size(); k += static_cast<std::size_t>(components))
    array->InsertNextTuple(&values[k]);
  data->AddArray(array);
}

std::filesystem::path write_vtp(const std::filesystem::path& file, vtkPolyData* data) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(data);
  EXPECT_EQ(writer->Write(), 1);
  return file;
}

TEST(ReadVtp, GivesCellsWithEqualValuesOneMaterial) {
  const TemporaryDirectory directory;
  const auto data = two_squares();
  add(data->GetCellData(), "reflectance", 2, {0.1, 0.2, 0.1, 0.2});
  add(data->GetCellData(), "emission", 2, {5, 6, 5, 7});
  const Scene scene = read_scene(write_vtp(directory / "a.vtp", data)).scene;
  EXPECT_EQ(scene.vertices()[2].x(), 1 + kFine);
  EXPECT_EQ(scene.bands(), 2);
  ASSERT_EQ(scene.materials().size(), 2U);
  EXPECT_EQ(scene.materials()[0].name, "material_0");
  EXPECT_EQ(scene.materials()[1].name, "material_1");
  EXPECT_EQ(scene.materials()[1].emission[1], 7);
  EXPECT_EQ(scene.materials()[1].reflectance[0], 0.1);
  add(data->GetCellData(), "emission", 2, {5, 6, 5, 6});
  EXPECT_EQ(read_scene(write_vtp(directory / "b.vtp", data)).scene.materials().size(), 1U);
}

TEST(ReadVtp, WithoutArraysHasTheDefaultMaterial) {
  const TemporaryDirectory directory;
  const Scene scene = read_scene(write_vtp(directory / "a.vtp", two_squares())).scene;
  ASSERT_EQ(scene.materials().size(), 1U);
  EXPECT_EQ(scene.materials()[0].name, "default");
}

/// Two squares as text, with these numbers in place of the right ones.
std::string vtp_text(const std::string& points, const std::string& connectivity, const std::string& offsets) {
  return "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
         "header_type=\"UInt64\"><PolyData>"
         "<Piece NumberOfPoints=\"" +
         points +
         "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
         "NumberOfPolys=\"2\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">"
         "0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0</DataArray></Points><Polys>"
         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">" +
         connectivity +
         "</DataArray>"
         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" +
         offsets +
         "</DataArray>"
         "</Polys></Piece></PolyData></VTKFile>";
}

TEST(ReadVtp, RejectsNumbersThatVtkDoesNotCheck) {
  const TemporaryDirectory directory;
  const auto read = [&](const std::string& points, const std::string& connectivity,
                        const std::string& offsets) {
    return read_scene(directory.write("a.vtp", vtp_text(points, connectivity, offsets)));
  };
  EXPECT_THAT(read("6", "0 1 4 3 1 2 5 4", "4 8").scene.corners(1), ElementsAre(1, 2, 5, 4));
  const auto error = [&](const std::string& points, const std::string& connectivity,
                         const std::string& offsets) {
    const std::string message = message_of<IoError>([&] { read(points, connectivity, offsets); });
    EXPECT_THAT(message, StartsWith((directory / "a.vtp").string()));
    return message;
  };
  EXPECT_THAT(error("6", "0 1 4 3 1 2 6 4", "4 8"),
              HasSubstr("a cell refers to point 6, but there are only 6"));
  EXPECT_THAT(error("6", "0 1 4 3 1 2 4294967296 4", "4 8"), HasSubstr("point 4294967296"));
  EXPECT_THAT(error("6", "0 1 4 3 1 2 -1 4", "4 8"), HasSubstr("point -1"));
  error("6", "0 1 4 3 1 2 5 4", "9 8");
  error("6", "0 1 4 3 1 2 5 4", "8 8");
  error("6", "0 1 4 3 1 2 5 4", "4 800000000000");
  error("4000000000000", "0 1 4 3 1 2 5 4", "4 8");
  error("-1", "0 1 4 3 1 2 5 4", "4 8");
}

TEST(ReadVtp, RejectsAFileThatIsCutWithinItsData) {
  const TemporaryDirectory directory;
  vtkNew<vtkXMLPolyDataWriter> writer;
  const auto data = two_squares();
  writer->SetFileName((directory / "a.vtp").c_str());
  writer->SetInputData(data);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  EXPECT_EQ(writer->Write(), 1);
  const std::string whole = read_text(directory / "a.vtp");
  // The data end where their closing tag begins; VTK reads no further.
  const std::size_t end = whole.rfind("</AppendedData>");
  for (std::size_t size = 0; size < end - 4; size += 29) {
    const auto file = directory.write("cut.vtp", whole.substr(0, size));
    EXPECT_THAT(message_of<IoError>([&] { read_scene(file); }), StartsWith(file.string())) << size;
  }
}

TEST(ReadVtp, RejectsDifferentNumbersOfComponents) {
  const TemporaryDirectory directory;
  const auto data = two_squares();
  add(data->GetCellData(), "reflectance", 1, {0.1, 0.2});
  add(data->GetCellData(), "emission", 2, {5, 6, 5, 7});
  const auto file = write_vtp(directory / "a.vtp", data);
  EXPECT_THAT(
      message_of<InputError>([&] { read_scene(file); }),
      AllOf(StartsWith(file.string()), HasSubstr("'reflectance' has 1"), HasSubstr("'emission' has 2")));
}

TEST(ReadVtp, TakesMaterialNames) {
  const TemporaryDirectory directory;
  const auto data = two_squares();
  add(data->GetCellData(), "reflectance", 1, {0.1, 0.2});
  vtkNew<vtkIntArray> material;
  material->SetName("material");
  material->InsertNextValue(1);
  material->InsertNextValue(0);
  data->GetCellData()->AddArray(material);
  vtkNew<vtkStringArray> names;
  names->SetName("material_names");
  names->InsertNextValue("floor");
  names->InsertNextValue("lamp shade");
  data->GetFieldData()->AddArray(names);
  const Scene scene = read_scene(write_vtp(directory / "a.vtp", data)).scene;
  EXPECT_EQ(scene.materials()[0].name, "lamp shade");
  EXPECT_EQ(scene.materials()[0].reflectance[0], 0.1);
  EXPECT_EQ(scene.materials()[1].name, "floor");

  // The same material with different values in two cells becomes two.
  material->SetValue(1, 1);
  const Scene split = read_scene(write_vtp(directory / "b.vtp", data)).scene;
  EXPECT_EQ(split.materials()[0].name, "lamp shade");
  EXPECT_EQ(split.materials()[1].name, "lamp shade_1");

  material->SetValue(1, 2);
  const auto file = write_vtp(directory / "c.vtp", data);
  EXPECT_THAT(message_of<InputError>([&] { read_scene(file); }),
              AllOf(HasSubstr("cell 1"), HasSubstr("material 2"), HasSubstr("from 0 to 1")));
}

TEST(ReadVtu, TakesPolygonsAndNamesWhatItCannotTake) {
  const TemporaryDirectory directory;
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(two_squares()->GetPoints());
  const std::array<vtkIdType, 3> triangle{0, 1, 3};
  const std::array<vtkIdType, 4> quad{1, 2, 5, 4};
  grid->InsertNextCell(VTK_TRIANGLE, 3, triangle.data());
  grid->InsertNextCell(VTK_QUAD, 4, quad.data());
  const auto write = [&](const std::string& name) {
    vtkNew<vtkXMLUnstructuredGridWriter> writer;
    writer->SetFileName((directory / name).c_str());
    writer->SetInputData(grid);
    EXPECT_EQ(writer->Write(), 1);
    return directory / name;
  };
  const Scene scene = read_scene(write("a.vtu")).scene;
  EXPECT_THAT(scene.corners(0), ElementsAre(0, 1, 3));
  EXPECT_THAT(scene.corners(1), ElementsAre(1, 2, 5, 4));
  grid->InsertNextCell(VTK_TETRA, 4, quad.data());
  const auto file = write("b.vtu");
  EXPECT_THAT(message_of<InputError>([&] { read_scene(file); }),
              AllOf(StartsWith(file.string()), HasSubstr("cell 2 is a vtkTetra")));
}

class EveryExtension : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, EveryExtension,
                         testing::Values(".toml", ".ply", ".stl", ".off", ".gltf", ".glb", ".dae", ".ifc",
                                         ".fbx", ".vtp", ".vtu"),
                         [](const auto& extension) { return std::string(extension.param).substr(1); });

TEST_P(EveryExtension, GarbageIsAnErrorThatBeginsWithTheFile) {
  const TemporaryDirectory directory;
  for (const std::string& text :
       {std::string("Not a mesh at all, but 1 2 3 words.\n"), std::string(500, '\xfe'),
        std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">\n<PolyData>")}) {
    const auto file = directory.write(std::string("a") + GetParam(), text);
    EXPECT_THAT(message_of<Error>([&] { read_scene(file); }), StartsWith(file.string())) << text;
  }
}

TEST_P(EveryExtension, AnEmptyFileIsAnErrorThatBeginsWithTheFile) {
  const TemporaryDirectory directory;
  const auto file = directory.write(std::string("a") + GetParam(), "");
  EXPECT_THAT(message_of<Error>([&] { read_scene(file); }), StartsWith(file.string()));
}

TEST_P(EveryExtension, AMissingFileAndADirectoryAreNamed) {
  const TemporaryDirectory directory;
  const auto file = directory / (std::string("a") + GetParam());
  EXPECT_EQ(message_of<IoError>([&] { read_scene(file); }), file.string() + ": no such file");
  std::filesystem::create_directory(file);
  EXPECT_EQ(message_of<IoError>([&] { read_scene(file); }), file.string() + ": is a directory, not a file");
}

TEST(ReadScene, AnUnknownExtensionListsTheKnownOnes) {
  const TemporaryDirectory directory;
  for (const char* name : {"a.blurb", "a"}) {
    const auto file = directory.write(name, "x");
    EXPECT_THAT(
        message_of<IoError>([&] { read_scene(file); }),
        AllOf(StartsWith(file.string() + ": unknown extension"), HasSubstr(".obj"), HasSubstr(".vtu")));
  }
}

}  // namespace
}  // namespace radiosity::test
