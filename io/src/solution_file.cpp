// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/solution_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkInformation.h>
#include <vtkInformationStringKey.h>
#include <vtkIntArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <system_error>

#include "child_process.hpp"
#include "mesh_file.hpp"
#include "radiosity/io/nearest_name.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/rendering/tone_map.hpp"
#include "solution_pieces.hpp"
#include "vtk_support.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRadiosityUnits = "W/m2";

// Three bands are red, green and blue; others have no names.
void name_bands(vtkDataArray& array) {
  if (array.GetNumberOfComponents() != 3) return;
  for (int k = 0; const char* band : {"red", "green", "blue"}) array.SetComponentName(k++, band);
}

void add_doubles(vtkFieldData* data, const char* name, const Eigen::Ref<const BandArray>& values,
                 const char* units = nullptr) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(values.cols()));
  array->SetNumberOfTuples(values.rows());
  Eigen::Map<BandArray>(array->GetPointer(0), values.rows(), values.cols()) = values;
  name_bands(*array);
  if (units != nullptr) array->GetInformation()->Set(vtkDataArray::UNITS_LABEL(), units);
  data->AddArray(array);
}

template <class Value>
void add_integers(vtkFieldData* data, const char* name, Index count, Value&& value) {
  vtkNew<vtkIntArray> array;
  array->SetName(name);
  array->SetNumberOfValues(count);
  for (Index i = 0; i < count; ++i) array->SetValue(i, value(i));
  data->AddArray(array);
}

void add_strings(vtkFieldData* data, const char* name, const std::vector<std::string>& values) {
  vtkNew<vtkStringArray> array;
  array->SetName(name);
  for (const auto& value : values) array->InsertNextValue(value);
  data->AddArray(array);
}

void add_display_rgb(vtkPolyData& data, const BandArray& vertex_radiosity, double exposure) {
  const auto colours = tone_map(vertex_radiosity, exposure);
  vtkNew<vtkUnsignedCharArray> array;
  array->SetName("display_rgb");
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(colours.size()));
  name_bands(*array);
  for (std::size_t v = 0; v < colours.size(); ++v)
    array->SetTypedTuple(static_cast<vtkIdType>(v), colours[v].data());
  data.GetPointData()->AddArray(array);
}

// Cells that are written, and the numbers of the vertices that they have.
struct Part {
  Index first, last;
  std::vector<Index> vertices;
};

Part all_of(const PatchMesh& mesh) {
  Part all{0, mesh.patch_count(), std::vector<Index>(static_cast<std::size_t>(mesh.vertex_count()))};
  std::iota(all.vertices.begin(), all.vertices.end(), 0);
  return all;
}

Part piece(const PatchMesh& mesh, int number, int count) {
  const auto bound = [&](std::int64_t k) { return static_cast<Index>(k * mesh.patch_count() / count); };
  Part out{bound(number), bound(number + 1), {}};
  std::vector<std::uint8_t> has(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (Index i = out.first; i < out.last; ++i)
    for (const Index v : mesh.corners(i)) has[v] = 1;
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    if (has[v] != 0) out.vertices.push_back(v);
  return out;
}

vtkSmartPointer<vtkPolyData> geometry(const PatchMesh& mesh, const Part& part) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(part.vertices.size()));
  std::vector<vtkIdType> place(static_cast<std::size_t>(mesh.vertex_count()));
  for (vtkIdType k = 0; const Index v : part.vertices) {
    points->SetPoint(k, mesh.vertex(v).data());
    place[v] = k++;
  }
  vtkNew<vtkCellArray> polygons;
  for (Index i = part.first; i < part.last; ++i) {
    polygons->InsertNextCell(static_cast<int>(mesh.corners(i).size()));
    for (const Index v : mesh.corners(i)) polygons->InsertCellPoint(place[v]);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polygons);
  const Index count = part.last - part.first;
  add_integers(data->GetCellData(), "surface", count, [&](Index i) { return mesh.surface(part.first + i); });
  add_integers(data->GetCellData(), "material", count,
               [&](Index i) { return mesh.material(part.first + i); });
  std::vector<std::string> names;
  for (const Material& material : mesh.materials()) names.push_back(material.name);
  add_strings(data->GetFieldData(), "material_names", names);
  add_strings(data->GetFieldData(), "units", {"W/m2; m"});
  return data;
}

void write(const fs::path& file, vtkPolyData& data) {
  write_atomically(file, [&](const fs::path& temporary) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    vtkNew<VtkErrors> errors;
    errors->watch(writer);
    writer->SetHeaderTypeToUInt64();  // blocks may exceed 4 GiB
    writer->SetFileName(temporary.c_str());
    writer->SetInputData(&data);
    if (writer->Write() == 0 || !errors->first().empty() || writer->GetErrorCode() != vtkErrorCode::NoError)
      throw IoError(errors->first().empty() ? vtkErrorCode::GetStringFromErrorCode(writer->GetErrorCode())
                                            : errors->first());
  });
}

BandArray scalar(double value) {
  return BandArray::Constant(1, 1, value);
}

void require_shape(const BandArray& values, Index rows, Index bands, const char* name) {
  if (values.rows() != rows || values.cols() != bands)
    throw InputError(fmt::format("{} has {} rows and {} bands, but the mesh has {} and {}", name,
                                 values.rows(), values.cols(), rows, bands));
}

/// Nothing where all materials are diffuse.
void add_specular(vtkFieldData* data, const PatchMesh& mesh) {
  const auto& materials = mesh.materials();
  const auto count = static_cast<Eigen::Index>(materials.size());
  BandArray mirrored(count, mesh.bands()), transmitted(count, mesh.bands()), shininess(count, 1),
      index(count, 1);
  const bool disperses = std::any_of(materials.begin(), materials.end(), [](const Material& material) {
    return material.refractive_indices.size() > 0;
  });
  if (disperses) index.resize(count, mesh.bands());
  for (Eigen::Index m = 0; m < count; ++m) {
    const Material& material = materials[m];
    mirrored.row(m) = specular(material).transpose();
    transmitted.row(m) = transmission(material).transpose();
    shininess(m, 0) = material.shininess;
    index.row(m).setConstant(material.refractive_index);
    if (material.refractive_indices.size() > 0) index.row(m) = material.refractive_indices.transpose();
  }
  if ((mirrored == 0).all() && (transmitted == 0).all()) return;
  add_doubles(data, "material_specular", mirrored, "1");
  add_doubles(data, "material_transmission", transmitted, "1");
  add_doubles(data, "material_shininess", shininess, "1");
  add_doubles(data, "material_refractive_index", index, "1");
}

/// Reads the arrays of one file, naming it in every complaint.
class SolutionReader {
 public:
  SolutionReader(const fs::path& file, vtkPolyData& data) : file_(file), data_(data) {}

  SolvedMesh read(const std::string& wanted) {
    const Index patches = static_cast<Index>(data_.GetNumberOfPolys());
    if (patches == 0 || data_.GetNumberOfCells() != patches)
      fail("has no polygons, or cells that are not polygons");
    BandArray radiosity = cells("radiosity");
    auto vertex_radiosity = band_array(data_.GetPointData(), "radiosity");
    if (!vertex_radiosity) fail("has no point array 'radiosity'");
    const Eigen::Index bands = radiosity.cols();
    if (vertex_radiosity->cols() != bands) fail("has different numbers of bands per cell and per point");

    PatchMesh::Arrays arrays;
    for (vtkIdType v = 0; v < data_.GetNumberOfPoints(); ++v) {
      Vec3 x;
      data_.GetPoint(v, x.data());
      arrays.vertices.push_back(x);
    }
    arrays.patch_surface = indices("surface", std::numeric_limits<Index>::max());
    const auto names = strings(data_.GetFieldData(), "material_names");
    arrays.patch_material = indices("material", static_cast<double>(names.size()) - 1);
    vtkNew<vtkIdList> ids;
    for (Index i = 0; i < patches; ++i) {
      data_.GetCellPoints(i, ids);
      for (vtkIdType k = 0; k < ids->GetNumberOfIds(); ++k)
        arrays.corners.push_back(static_cast<Index>(ids->GetId(k)));
      arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    }
    for (const auto& name : names) {  // those that no patch uses stay black
      arrays.materials.push_back({name, BandValues::Zero(bands), BandValues::Zero(bands)});
      read_specular(data_.GetFieldData(), arrays.materials.size() - 1, arrays.materials.back());
    }
    const BandArray reflectance = cells("reflectance"), emission = cells("emission");
    if (reflectance.cols() != bands || emission.cols() != bands)
      fail("has different numbers of bands in radiosity, reflectance and emission");
    for (Index i = 0; i < patches; ++i) {
      Material& material = arrays.materials[arrays.patch_material[i]];
      material.reflectance = reflectance.row(i).transpose();
      material.emission = emission.row(i).transpose();
    }
    std::optional<double> exposure;
    if (const auto value = band_array(data_.GetFieldData(), "exposure"); value && value->size() == 1)
      exposure = (*value)(0, 0);
    auto array = wanted.empty() ? std::nullopt : std::optional(find_array(wanted));
    try {
      arrays.symmetry = symmetry();
      const PatchMesh cell(std::move(arrays));
      if (array) array->values = cell.unfolded(array->values);
      return {cell.unfolded(), cell.unfolded(radiosity), cell.unfolded(*vertex_radiosity), exposure,
              std::move(array)};
    } catch (const InputError& error) {
      fail(fmt::format("holds a mesh that is not valid: {}", error.what()));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw IoError(
        fmt::format("{}: is not a solved scene, as radiosity solve writes one: it {}", file_.string(), what));
  }

  Symmetry symmetry() const {
    vtkFieldData* const fields = data_.GetFieldData();
    Symmetry out;
    for (const std::string& plane : strings(fields, "symmetry_planes")) out.planes.push_back(plane_of(plane));
    const auto period = band_array(fields, "symmetry_period"), steps = band_array(fields, "symmetry_steps");
    if (period && period->size() == 3) out.period = period->reshaped().matrix();
    if (steps && steps->size() == 1) out.steps = static_cast<Index>((*steps)(0, 0));
    return out;
  }

  MeshArray find_array(const std::string& name) const {
    std::vector<std::string> known;
    for (vtkFieldData* data : {static_cast<vtkFieldData*>(data_.GetPointData()),
                               static_cast<vtkFieldData*>(data_.GetCellData())}) {
      const auto values = band_array(data, name.c_str());
      if (!values) {
        for (int k = 0; k < data->GetNumberOfArrays(); ++k)
          if (data->GetArray(k) != nullptr && data->GetArrayName(k) != nullptr &&
              std::find(known.begin(), known.end(), data->GetArrayName(k)) == known.end())
            known.emplace_back(data->GetArrayName(k));
        continue;
      }
      vtkDataArray& array = *data->GetArray(name.c_str());
      MeshArray found{name, {}, {}, data == data_.GetPointData(), *values};
      if (array.HasInformation() && array.GetInformation()->Has(vtkDataArray::UNITS_LABEL()) != 0)
        found.units = array.GetInformation()->Get(vtkDataArray::UNITS_LABEL());
      for (int k = 0; k < array.GetNumberOfComponents(); ++k) {
        const char* component = array.GetComponentName(k);
        found.components.emplace_back(component != nullptr ? component : "");
      }
      return found;
    }
    const auto meant = nearest_name(name, known);
    throw InputError(fmt::format("{}: has no array '{}'{} It has {}", file_.string(), name,
                                 meant ? fmt::format("; did you mean '{}'?", *meant) : ".",
                                 fmt::join(known, ", ")));
  }

  BandArray cells(const char* name) const {
    auto values = band_array(data_.GetCellData(), name);
    if (!values) fail(fmt::format("has no cell array '{}'", name));
    return std::move(*values);
  }

  std::vector<Index> indices(const char* name, double last) const {
    const BandArray values = cells(name);
    std::vector<Index> result;
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      const double value = values(i, 0);
      if (values.cols() != 1 || !(value >= 0 && value <= last) || value != std::floor(value))
        fail(fmt::format("has {} = {} in cell {}, which is not a number from 0 to {}", name, value, i, last));
      result.push_back(static_cast<Index>(value));
    }
    return result;
  }

  const fs::path& file_;
  vtkPolyData& data_;
};

}  // namespace

bool in_pieces(const fs::path& file) {
  return lower_case_extension(file) == ".pvtp";
}

bool is_solution(const fs::path& file) {
  return in_pieces(file) || lower_case_extension(file) == ".vtp";
}

void write_solution(const fs::path& file, const PatchMesh& mesh, const Solution& solution,
                    const Provenance& provenance, double exposure, const BandArray* radiosity_error,
                    std::span<const Index> patch, const Ranks* ranks) {
  require_shape(solution.radiosity, mesh.patch_count(), mesh.bands(), "radiosity");
  require_shape(solution.irradiance, mesh.patch_count(), mesh.bands(), "irradiance");
  require_shape(solution.vertex_radiosity, mesh.vertex_count(), mesh.bands(), "vertex radiosity");
  if (radiosity_error != nullptr)
    require_shape(*radiosity_error, mesh.patch_count(), mesh.bands(), "radiosity error");
  if (!patch.empty() && patch.size() != static_cast<std::size_t>(mesh.patch_count()))
    throw InputError(fmt::format("{} numbers of patches for {} elements", patch.size(), mesh.patch_count()));
  const int number = ranks != nullptr ? ranks->rank() : 0, count = ranks != nullptr ? ranks->count() : 1;
  const Part part = in_pieces(file) ? piece(mesh, number, count) : all_of(mesh);
  const auto own = [&](const auto& values) { return values.middleRows(part.first, part.last - part.first); };
  const auto data = geometry(mesh, part);
  auto* const cells = data->GetCellData();
  add_specular(data->GetFieldData(), mesh);
  add_doubles(cells, "radiosity", own(solution.radiosity), kRadiosityUnits);
  add_doubles(cells, "irradiance", own(solution.irradiance), kRadiosityUnits);
  add_doubles(cells, "emission", own(mesh.emission()), kRadiosityUnits);
  add_doubles(cells, "reflectance", own(mesh.reflectance()), "1");
  add_doubles(cells, "area", own(mesh.areas()), "m2");
  if (radiosity_error != nullptr)
    add_doubles(cells, "radiosity_error", own(*radiosity_error), kRadiosityUnits);
  if (!patch.empty())
    add_integers(cells, "patch", part.last - part.first, [&](Index e) { return patch[part.first + e]; });
  const BandArray at_points = solution.vertex_radiosity(part.vertices, Eigen::all);
  add_doubles(data->GetPointData(), "radiosity", at_points, kRadiosityUnits);
  add_display_rgb(*data, at_points, exposure);
  auto* const fields = data->GetFieldData();
  add_strings(fields, "version", {provenance.version});
  add_strings(fields, "command", {provenance.command});
  add_strings(fields, "method", {provenance.method});
  add_strings(fields, "solver", {provenance.solver});
  add_integers(fields, "converged", 1, [&](Index) { return provenance.converged ? 1 : 0; });
  add_doubles(fields, "residual", scalar(solution.report.residual));
  add_doubles(fields, "exposure", scalar(exposure), "m2/W");
  if (const Symmetry& symmetry = mesh.symmetry(); !symmetry.none()) {
    std::vector<std::string> planes;
    for (const MirrorPlane& plane : symmetry.planes) planes.push_back(text_of(plane));
    add_strings(fields, "symmetry_planes", planes);
    add_doubles(fields, "symmetry_period", symmetry.period.transpose(), "m");
    add_integers(fields, "symmetry_steps", 1, [&](Index) { return symmetry.steps; });
  }
  if (!in_pieces(file)) {
    write(file, *data);
    return;
  }
  add_integers(fields, kVertices, static_cast<Index>(part.vertices.size()),
               [&](Index k) { return part.vertices[k]; });
  // What names the pieces is there only while they belong together.
  if (number == 0) {
    std::error_code none;
    fs::remove(file, none);
  }
  on_all(ranks, true);
  write(piece_of(file, number, count), *data);
  on_all(ranks, true);
  if (number == 0) write_pieces(file, *data, count);
}

SolvedMesh read_solution(const fs::path& file, const std::string& array) {
  require_readable(file);
  if (!is_solution(file))
    throw IoError(fmt::format(
        "{}: a solved scene has the extension .vtp or .pvtp; radiosity solve writes one", file.string()));
  const auto read = [&] {
    if (in_pieces(file)) return SolutionReader(file, *read_pieces(file)).read(array);
    vtkNew<vtkXMLPolyDataReader> reader;
    read_xml(*reader, file);
    return SolutionReader(file, *reader->GetOutput()).read(array);
  };
  // VTK may not survive a damaged file: tried where that does no harm. What it throws there, it throws here.
  run_isolated(file, "VTK", [&] {
    try {
      read();
    } catch (const Error&) {
    }
    return std::string();
  });
  return read();
}

SolutionSeries::SolutionSeries(fs::path pvd_file, const PatchMesh& mesh)
    : file_(std::move(pvd_file)), mesh_(mesh) {}

void SolutionSeries::add(double time, const BandArray& patch_radiosity, double exposure) {
  require_shape(patch_radiosity, mesh_.patch_count(), mesh_.bands(), "radiosity");
  if (steps_.empty()) exposure_ = exposure;
  const fs::path folder = file_.parent_path() / file_.stem();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(fmt::format("{}: cannot be created: {}", folder.string(), error.message()));
  const std::string name = fmt::format("{}_{:04}.vtp", file_.stem().string(), steps_.size());

  const auto data = geometry(mesh_, all_of(mesh_));
  const BandArray at_vertices = vertex_values(mesh_, patch_radiosity);
  add_doubles(data->GetCellData(), "radiosity", patch_radiosity, kRadiosityUnits);
  add_doubles(data->GetPointData(), "radiosity", at_vertices, kRadiosityUnits);
  add_display_rgb(*data, at_vertices, exposure_);
  add_doubles(data->GetFieldData(), "exposure", scalar(exposure_), "m2/W");
  write(folder / name, *data);
  steps_.emplace_back(time, (file_.stem() / name).generic_string());
}

void SolutionSeries::finish() {
  vtkNew<vtkXMLDataElement> root;
  root->SetName("VTKFile");
  root->SetAttribute("type", "Collection");
  root->SetAttribute("version", "0.1");
  vtkNew<vtkXMLDataElement> collection;
  collection->SetName("Collection");
  root->AddNestedElement(collection);
  for (const auto& [time, step] : steps_) {
    vtkNew<vtkXMLDataElement> data_set;
    data_set->SetName("DataSet");
    data_set->SetAttribute("timestep", fmt::format("{}", time).c_str());
    data_set->SetAttribute("part", "0");
    data_set->SetAttribute("file", step.c_str());
    collection->AddNestedElement(data_set);
  }
  write_xml(file_, *root);
}

}  // namespace radiosity
