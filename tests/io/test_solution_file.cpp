// SPDX-License-Identifier: GPL-3.0-or-later
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationStringKey.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLPPolyDataReader.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUtilities.h>

#include <algorithm>
#include <cmath>

#include "cases/scenes.hpp"
#include "files.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/rendering/tone_map.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// A triangle, a quad and a pentagon that stand apart, of two materials and two bands.
PatchMesh three_patches() {
  PatchMesh::Arrays arrays;
  const auto add = [&](const std::vector<Vec3>& loop, Index surface, Index material_number) {
    for (const Vec3& x : loop) {
      arrays.corners.push_back(static_cast<Index>(arrays.vertices.size()));
      arrays.vertices.push_back(x);
    }
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(surface);
    arrays.patch_material.push_back(material_number);
  };
  add({{0, 0, 0.1}, {1, 0, 0.1}, {0, 1.0 / 3, 0.1}}, 4, 1);
  add({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}, 4, 0);
  add({{5, 0, 2}, {6, 0, 2}, {7, 1, 2}, {6, 2, 2}, {5, 1, 2}}, 9, 1);
  arrays.materials = {material("lamp", Eigen::Array2d(0, 0.1), Eigen::Array2d(100, 1.0 / 7)),
                      material("white wall", Eigen::Array2d(0.7, 0.6), Eigen::Array2d(0, 0))};
  return PatchMesh(std::move(arrays));
}

Solution made_up_solution(const PatchMesh& mesh) {
  Solution solution;
  solution.radiosity = BandArray(mesh.patch_count(), 2);
  solution.irradiance = BandArray(mesh.patch_count(), 2);
  solution.vertex_radiosity = BandArray(mesh.vertex_count(), 2);
  for (Index i = 0; i < mesh.patch_count(); ++i)
    for (Index b = 0; b < 2; ++b) {
      solution.radiosity(i, b) = (i + 1) / 3.0 + b;
      solution.irradiance(i, b) = (i + 1) / 7.0 + b;
    }
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    for (Index b = 0; b < 2; ++b) solution.vertex_radiosity(v, b) = v / 11.0 + b;
  solution.report.residual = 2.5e-7;
  return solution;
}

const Provenance kProvenance{"1.2", "radiosity solve \"a b.obj\" & more", "analytic", "jacobi", false};

vtkSmartPointer<vtkPolyData> read_vtp(const std::filesystem::path& file) {
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader->GetOutput();
}

template <class Array>
Array* array(vtkFieldData* data, const char* name) {
  auto* const result = Array::SafeDownCast(data->GetAbstractArray(name));
  EXPECT_NE(result, nullptr) << name;
  return result;
}

void expect_equal(vtkFieldData* data, const char* name, const BandArray& values) {
  auto* const found = array<vtkDoubleArray>(data, name);
  ASSERT_NE(found, nullptr);
  ASSERT_EQ(found->GetNumberOfTuples(), values.rows());
  ASSERT_EQ(found->GetNumberOfComponents(), values.cols());
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    for (Eigen::Index b = 0; b < values.cols(); ++b)
      EXPECT_EQ(found->GetComponent(i, static_cast<int>(b)), values(i, b)) << name;
}

// One piece of each rank; of five, two have no cell.
TEST(WriteSolution, WritesPiecesOfRanksThatAreTheWholeTogether) {
  const TemporaryDirectory directory;
  for (const PatchMesh& mesh :
       {three_patches(),
        cube_room(2).with_materials({1, material("wall", Eigen::Array2d(0.5, 0.4), Eigen::Array2d(1, 0))})}) {
    const Solution solution = made_up_solution(mesh);
    const BandArray error = solution.radiosity / 16;
    std::vector<Index> patch(static_cast<std::size_t>(mesh.patch_count()));
    for (std::size_t k = 0; k < patch.size(); ++k) patch[k] = static_cast<Index>(k / 2);
    const auto write_to = [&](const std::filesystem::path& file, const Ranks* ranks) {
      write_solution(file, mesh, solution, kProvenance, 0.25, &error, patch, ranks);
    };
    write_to(directory / "whole.vtp", nullptr);
    const SolvedMesh whole = read_solution(directory / "whole.vtp", "radiosity_error");
    write_to(directory / "one.pvtp", nullptr);
    EXPECT_TRUE(std::filesystem::exists(directory / "one-1-of-1.vtp"));
    for (const int count : {1, 2, 5})
      on_ranks(count, [&](const std::shared_ptr<const Ranks>& ranks) {
        write_to(directory / (std::to_string(count) + ".pvtp"), ranks.get());
      });
    for (const char* name : {"one.pvtp", "1.pvtp", "2.pvtp", "5.pvtp"}) {
      const SolvedMesh read = read_solution(directory / name, "radiosity_error");
      ASSERT_EQ(read.mesh.patch_count(), mesh.patch_count());
      ASSERT_EQ(read.mesh.vertex_count(), mesh.vertex_count());
      for (Index v = 0; v < mesh.vertex_count(); ++v) EXPECT_EQ(read.mesh.vertex(v), mesh.vertex(v));
      for (Index i = 0; i < mesh.patch_count(); ++i) {
        EXPECT_TRUE(std::ranges::equal(read.mesh.corners(i), mesh.corners(i)));
        EXPECT_EQ(read.mesh.surface(i), mesh.surface(i));
        EXPECT_EQ(read.mesh.material_of(i).name, mesh.material_of(i).name);
      }
      EXPECT_TRUE((read.patch_radiosity == whole.patch_radiosity).all());
      EXPECT_TRUE((read.vertex_radiosity == whole.vertex_radiosity).all());
      EXPECT_TRUE((read.array->values == error).all());
      EXPECT_EQ(read.array->units, "W/m2");
      EXPECT_EQ(read.exposure, 0.25);
      // As ParaView has it.
      vtkNew<vtkXMLPPolyDataReader> reader;
      reader->SetFileName((directory / name).c_str());
      reader->Update();
      vtkPolyData& data = *reader->GetOutput();
      EXPECT_EQ(data.GetNumberOfPolys(), mesh.patch_count());
      expect_equal(data.GetCellData(), "radiosity", solution.radiosity);
      expect_equal(data.GetCellData(), "radiosity_error", error);
      EXPECT_EQ(data.GetCellData()->GetNumberOfArrays(), 9);
      EXPECT_EQ(data.GetPointData()->GetNumberOfArrays(), 2);
    }
  }
}

TEST(ReadSolution, NamesThePieceThatIsNotThere) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  on_ranks(2, [&](const std::shared_ptr<const Ranks>& ranks) {
    write_solution(directory / "out.pvtp", mesh, made_up_solution(mesh), kProvenance, 1, nullptr, {},
                   ranks.get());
  });
  EXPECT_EQ(directory.entries(), 3);
  const auto read = [&] { read_solution(directory / "out.pvtp"); };
  const std::filesystem::path second = directory / "out-2-of-2.vtp";
  write_solution(second, mesh, made_up_solution(mesh), kProvenance, 1);
  EXPECT_THAT(message_of<IoError>(read), HasSubstr("out-2-of-2.vtp: cannot be understood: it is no piece"));
  std::filesystem::remove(second);
  EXPECT_THAT(message_of<IoError>(read), HasSubstr("out-2-of-2.vtp"));
  directory.write("out.pvtp", "<VTKFile type=\"PPolyData\"><PPolyData/></VTKFile>");
  EXPECT_THAT(message_of<IoError>(read), HasSubstr("out.pvtp: cannot be understood: it names no pieces"));
  directory.write("out.pvtp", "<VTKFile");
  EXPECT_THAT(message_of<IoError>(read), HasSubstr("out.pvtp: cannot be understood: "));
}

TEST(WriteSolution, WritesEveryArrayThatWasPromised) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  const Solution solution = made_up_solution(mesh);
  write_solution(directory / "out.vtp", mesh, solution, kProvenance, 0.25);
  EXPECT_EQ(directory.entries(), 1);
  const auto data = read_vtp(directory / "out.vtp");
  ASSERT_EQ(data->GetNumberOfPolys(), 3);
  ASSERT_EQ(data->GetNumberOfPoints(), 12);
  EXPECT_EQ(data->GetPoints()->GetDataType(), VTK_DOUBLE);

  vtkFieldData* const cells = data->GetCellData();
  EXPECT_EQ(cells->GetNumberOfArrays(), 7);
  expect_equal(cells, "radiosity", solution.radiosity);
  expect_equal(cells, "irradiance", solution.irradiance);
  expect_equal(cells, "emission", mesh.emission());
  expect_equal(cells, "reflectance", mesh.reflectance());
  expect_equal(cells, "area", mesh.areas());
  const auto* const surface = array<vtkIntArray>(cells, "surface");
  const auto* const number = array<vtkIntArray>(cells, "material");
  for (Index i = 0; i < 3; ++i) {
    EXPECT_EQ(surface->GetValue(i), mesh.surface(i));
    EXPECT_EQ(number->GetValue(i), mesh.material(i));
  }

  vtkFieldData* const points = data->GetPointData();
  EXPECT_EQ(points->GetNumberOfArrays(), 2);
  expect_equal(points, "radiosity", solution.vertex_radiosity);
  auto* const rgb_bytes = array<vtkUnsignedCharArray>(points, "display_rgb");
  ASSERT_EQ(rgb_bytes->GetNumberOfComponents(), 3);
  const auto expected = tone_map(solution.vertex_radiosity, 0.25);
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(rgb_bytes->GetTypedComponent(v, k), expected[v][k]);

  vtkFieldData* const fields = data->GetFieldData();
  const auto text = [&](const char* name, vtkIdType k = 0) {
    return array<vtkStringArray>(fields, name)->GetValue(k);
  };
  EXPECT_EQ(text("version"), "1.2");
  EXPECT_EQ(text("command"), kProvenance.command);
  EXPECT_EQ(text("method"), "analytic");
  EXPECT_EQ(text("solver"), "jacobi");
  EXPECT_EQ(text("units"), "W/m2; m");
  EXPECT_EQ(text("material_names", 0), "lamp");
  EXPECT_EQ(text("material_names", 1), "white wall");
  EXPECT_EQ(array<vtkIntArray>(fields, "converged")->GetValue(0), 0);
  EXPECT_EQ(array<vtkDoubleArray>(fields, "residual")->GetValue(0), 2.5e-7);
  EXPECT_EQ(array<vtkDoubleArray>(fields, "exposure")->GetValue(0), 0.25);
}

TEST(WriteSolution, NumbersThePatchesOfElements) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  const Solution solution = made_up_solution(mesh);
  write_solution(directory / "patches.vtp", mesh, solution, kProvenance, 1);
  EXPECT_EQ(read_vtp(directory / "patches.vtp")->GetCellData()->GetArray("patch"), nullptr);
  const std::vector<Index> patch{4, 4, 7};
  write_solution(directory / "out.vtp", mesh, solution, kProvenance, 1, nullptr, patch);
  const auto data = read_vtp(directory / "out.vtp");
  auto* const numbers = array<vtkIntArray>(data->GetCellData(), "patch");
  for (int e = 0; e < 3; ++e) EXPECT_EQ(numbers->GetValue(e), patch[e]);
  EXPECT_THROW(
      write_solution(directory / "out.vtp", mesh, solution, kProvenance, 1, nullptr, std::vector<Index>{1}),
      InputError);
}

TEST(WriteSolution, NamesThreeBandsByTheirColoursAndTellsUnits) {
  const TemporaryDirectory directory;
  const BandValues none = Eigen::Array3d::Zero();
  const PatchMesh mesh =
      three_patches().with_materials({material("lamp", none, none), material("white wall", none, none)});
  Solution solution;
  solution.radiosity = solution.irradiance = BandArray::Ones(mesh.patch_count(), 3);
  solution.vertex_radiosity = BandArray::Ones(mesh.vertex_count(), 3);
  write_solution(directory / "out.vtp", mesh, solution, kProvenance, 0.25, &solution.radiosity);
  const auto data = read_vtp(directory / "out.vtp");
  const auto expect = [](vtkFieldData* of, const char* name, const char* units) {
    vtkDataArray* const found = of->GetArray(name);
    ASSERT_NE(found, nullptr) << name;
    EXPECT_STREQ(found->GetInformation()->Get(vtkDataArray::UNITS_LABEL()), units) << name;
    if (found->GetNumberOfComponents() != 3) return;
    for (int k = 0; const char* band : {"red", "green", "blue"})
      EXPECT_STREQ(found->GetComponentName(k++), band) << name;
  };
  for (const char* name : {"radiosity", "irradiance", "emission", "radiosity_error"})
    expect(data->GetCellData(), name, "W/m2");
  expect(data->GetCellData(), "reflectance", "1");
  expect(data->GetCellData(), "area", "m2");
  expect(data->GetPointData(), "radiosity", "W/m2");
  expect(data->GetPointData(), "display_rgb", nullptr);
  expect(data->GetFieldData(), "exposure", "m2/W");
}

TEST(ReadSolution, GivesBackEveryBit) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  const Solution solution = made_up_solution(mesh);
  write_solution(directory / "out.vtp", mesh, solution, kProvenance, 1.0 / 3);
  const SolvedMesh solved = read_solution(directory / "out.vtp");
  EXPECT_EQ(solved.mesh.vertices(), mesh.vertices());
  ASSERT_EQ(solved.mesh.patch_count(), mesh.patch_count());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    EXPECT_TRUE(std::ranges::equal(solved.mesh.corners(i), mesh.corners(i)));
    EXPECT_EQ(solved.mesh.surface(i), mesh.surface(i));
    EXPECT_EQ(solved.mesh.material(i), mesh.material(i));
    EXPECT_EQ(solved.mesh.material_of(i).name, mesh.material_of(i).name);
  }
  EXPECT_TRUE((solved.mesh.reflectance() == mesh.reflectance()).all());
  EXPECT_TRUE((solved.mesh.emission() == mesh.emission()).all());
  EXPECT_TRUE((solved.patch_radiosity == solution.radiosity).all());
  EXPECT_TRUE((solved.vertex_radiosity == solution.vertex_radiosity).all());
  EXPECT_EQ(solved.exposure, 1.0 / 3);
}

TEST(ReadSolution, KeepsMirrorsAndGlass) {
  const TemporaryDirectory directory;
  std::vector<Material> materials = three_patches().materials();
  materials[1].specular = Eigen::Array2d(0.1, 0.3);
  materials[1].shininess = 12.5;
  materials[0].transmission = Eigen::Array2d(0.5, 1.0 / 3);
  materials[0].refractive_index = 1.52;
  materials[1].refractive_indices = Eigen::Array2d(1.4, 1.6);
  const PatchMesh mesh = three_patches().with_materials(materials);
  write_solution(directory / "out.vtp", mesh, made_up_solution(mesh), kProvenance, 1);
  const std::vector<Material> solved = read_solution(directory / "out.vtp").mesh.materials();
  const std::vector<Material> as_scene = read_scene(directory / "out.vtp").scene.materials();
  for (const Material& glass : {solved[0], as_scene[1]}) {
    EXPECT_EQ(glass.name, "lamp");
    EXPECT_TRUE((specular(glass) == 0).all());
    ASSERT_EQ(glass.transmission.size(), 2);
    EXPECT_TRUE((glass.transmission == materials[0].transmission).all());
    EXPECT_EQ(glass.refractive_index, 1.52);
    EXPECT_EQ(glass.refractive_indices.size(), 0);
    EXPECT_TRUE(std::isinf(glass.shininess));
  }
  for (const Material& gloss : {solved[1], as_scene[0]}) {
    ASSERT_EQ(gloss.specular.size(), 2);
    EXPECT_TRUE((gloss.specular == materials[1].specular).all());
    EXPECT_EQ(gloss.shininess, 12.5);
    EXPECT_EQ(gloss.refractive_index, 1.5);
    ASSERT_EQ(gloss.refractive_indices.size(), 2);
    EXPECT_TRUE((gloss.refractive_indices == materials[1].refractive_indices).all());
  }
}

TEST(ReadSolution, WhatItWritesIsAlsoAScene) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  write_solution(directory / "out.vtp", mesh, made_up_solution(mesh), kProvenance, 1);
  const LoadedScene loaded = read_scene(directory / "out.vtp");
  ASSERT_EQ(loaded.scene.face_count(), 3);
  EXPECT_EQ(loaded.scene.materials()[0].name, "white wall");  // the first patch's
  EXPECT_TRUE((loaded.scene.materials()[1].emission == mesh.materials()[0].emission).all());
}

TEST(ReadSolution, NamesWhatAForeignFileLacks) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  write_solution(directory / "out.vtp", mesh, made_up_solution(mesh), kProvenance, 1);
  for (const char* name : {"radiosity", "reflectance", "emission", "surface", "material"}) {
    const auto data = read_vtp(directory / "out.vtp");
    data->GetCellData()->RemoveArray(name);
    const auto file = directory / "foreign.vtp";
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetFileName(file.c_str());
    writer->SetInputData(data);
    writer->Write();
    EXPECT_EQ(message_of<IoError>([&] { read_solution(file); }),
              file.string() +
                  ": is not a solved scene, as radiosity solve writes one: it has no cell array '" + name +
                  "'");
  }
}

TEST(ReadSolution, ADamagedFileIsAnErrorAndPrintsNothing) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  write_solution(directory / "out.vtp", mesh, made_up_solution(mesh), kProvenance, 1);
  const std::string whole = read_text(directory / "out.vtp");
  // Cut anywhere before the end of the data; what follows is only closing tags.
  const std::size_t data_end = whole.rfind("</AppendedData>");
  ASSERT_NE(data_end, std::string::npos);
  for (std::size_t size = 0; size + 4 < data_end; size += 89) {
    const auto file = directory.write("cut.vtp", whole.substr(0, size));
    EXPECT_THAT(message_of<IoError>([&] { read_solution(file); }), StartsWith(file.string())) << size;
  }
  EXPECT_THAT(message_of<IoError>([&] { read_solution(directory / "none.vtp"); }), HasSubstr("no such file"));
}

TEST(WriteSolution, NamesAFileThatCannotBeWrittenAndPrintsNothing) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  const auto file = directory / "none/out.vtp";
  EXPECT_THAT(
      message_of<IoError>([&] { write_solution(file, mesh, made_up_solution(mesh), kProvenance, 1); }),
      AllOf(StartsWith(file.string()), HasSubstr("cannot be written")));
}

TEST(WriteSolution, RejectsArraysOfAnotherMesh) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  Solution solution = made_up_solution(mesh);
  solution.irradiance.conservativeResize(2, 2);
  EXPECT_THAT(
      message_of<InputError>([&] { write_solution(directory / "a.vtp", mesh, solution, kProvenance, 1); }),
      HasSubstr("irradiance has 2 rows"));
}

TEST(SolutionSeries, WritesOneFilePerStepAndAListOfThem) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = three_patches();
  const BandArray first = made_up_solution(mesh).radiosity, second = 2 * first;
  const auto file = directory / "a&b.pvd";
  SolutionSeries series(file, mesh);
  series.add(0, first, 0.5);
  EXPECT_FALSE(std::filesystem::exists(file));
  series.add(2.5, second, 99);
  series.finish();

  const vtkSmartPointer<vtkXMLDataElement> root =
      vtkSmartPointer<vtkXMLDataElement>::Take(vtkXMLUtilities::ReadElementFromFile(file.c_str()));
  ASSERT_NE(root, nullptr);
  EXPECT_STREQ(root->GetName(), "VTKFile");
  EXPECT_STREQ(root->GetAttribute("type"), "Collection");
  auto* const collection = root->FindNestedElementWithName("Collection");
  ASSERT_NE(collection, nullptr);
  ASSERT_EQ(collection->GetNumberOfNestedElements(), 2);
  const auto attribute = [&](int step, const char* name) {
    return std::string(collection->GetNestedElement(step)->GetAttribute(name));
  };
  EXPECT_EQ(std::stod(attribute(0, "timestep")), 0);
  EXPECT_EQ(std::stod(attribute(1, "timestep")), 2.5);
  EXPECT_EQ(attribute(0, "file"), "a&b/a&b_0000.vtp");
  EXPECT_EQ(attribute(1, "file"), "a&b/a&b_0001.vtp");

  const auto data = read_vtp(directory / attribute(1, "file"));
  expect_equal(data->GetCellData(), "radiosity", second);
  const BandArray at_vertices = vertex_values(mesh, second);
  expect_equal(data->GetPointData(), "radiosity", at_vertices);
  // The exposure of the first step holds for all.
  auto* const rgb_bytes = array<vtkUnsignedCharArray>(data->GetPointData(), "display_rgb");
  const auto expected = tone_map(at_vertices, 0.5);
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    EXPECT_EQ(rgb_bytes->GetTypedComponent(v, 0), expected[v][0]);
}

TEST(SolutionFile, OfACellIsReadAsTheWhole) {
  const TemporaryDirectory directory;
  PatchMesh::Arrays arrays;
  arrays.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  arrays.corners = {0, 1, 2, 3};
  arrays.patch_start = {0, 4};
  arrays.patch_surface = arrays.patch_material = {0};
  arrays.materials = {material("wall", Eigen::Array2d(0.5, 0.25), Eigen::Array2d(1, 2))};
  arrays.symmetry = {.planes = {{0, 0}}, .period = {0, 0.1 + 1, 0}, .steps = 2};
  const PatchMesh cell(std::move(arrays));
  Solution solution = made_up_solution(cell);
  write_solution(directory / "cell.vtp", cell, solution, {}, 1, nullptr);
  const SolvedMesh read = read_solution(directory / "cell.vtp", "radiosity");
  ASSERT_EQ(read.mesh.patch_count(), 10);  // 2 · (2 · 2 + 1)
  EXPECT_NEAR(read.mesh.areas().sum(), 10, 1e-12);
  EXPECT_EQ(read.mesh.lower(), Vec3(-1, -2 * (0.1 + 1), 0));
  for (Index i = 0; i < 10; ++i) {
    EXPECT_TRUE((read.patch_radiosity.row(i) == solution.radiosity.row(0)).all());
    EXPECT_EQ(read.mesh.normal(i), Vec3(0, 0, 1));
  }
  EXPECT_EQ(read.vertex_radiosity.rows(), read.mesh.vertex_count());
  EXPECT_EQ(read.array->values.rows(), read.array->at_vertices ? read.mesh.vertex_count() : 10);
}

}  // namespace
}  // namespace radiosity::test
