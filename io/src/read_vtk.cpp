// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkIdList.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cmath>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "vtk_support.hpp"

namespace radiosity {
namespace {

/// Cells with the same `material` and the same values share a material.
class CellMaterials {
 public:
  CellMaterials(const std::filesystem::path& file, vtkDataSet& data)
      : reflectance_(band_array(data.GetCellData(), "reflectance")),
        emission_(band_array(data.GetCellData(), "emission")),
        material_(band_array(data.GetCellData(), "material")),
        names_(strings(data.GetFieldData(), "material_names")),
        file_(file),
        data_(data) {
    if (reflectance_ && emission_ && reflectance_->cols() != emission_->cols())
      throw InputError(fmt::format(
          "{}: cell array 'reflectance' has {} components, but 'emission' has {}; both need one per band",
          file.string(), reflectance_->cols(), emission_->cols()));
    if (names_.empty() || (material_ && material_->cols() != 1)) material_.reset();
  }

  Index number(Eigen::Index cell, std::vector<MeshMaterial>& materials) {
    std::string name = kDefaultMaterial, key;
    MeshMaterial material;
    if (material_) {
      const double index = (*material_)(cell, 0);
      if (!(index >= 0 && index < static_cast<double>(names_.size())) || index != std::floor(index))
        throw InputError(fmt::format("{}: cell {}: material {} is not a number from 0 to {} (material_names)",
                                     file_.string(), cell, index, names_.size() - 1));
      name = names_[static_cast<std::size_t>(index)];
      read_specular(data_.GetFieldData(), static_cast<std::size_t>(index), material);
      key = fmt::format("{}|", index);
      if (!reflectance_ && !emission_)
        material.undefined = fmt::format(
            "{}: cell {} has material '{}', but there are no cell arrays "
            "'reflectance' and 'emission'; define it in a scene file",
            file_.string(), cell, name);
    }
    const auto append = [&](const std::optional<BandArray>& array, BandValues& values) {
      if (!array) return;
      values = array->row(cell).transpose();
      for (const double value : values)
        key += fmt::format("{} ", value);  // the shortest text that reads back as the same bits
    };
    append(reflectance_, material.reflectance);
    append(emission_, material.emission);

    bool added = false;
    const Index result = numbers_.number(key, added);
    if (added) {
      const int copies = copies_[name]++;
      if (!material_ && (reflectance_ || emission_))
        material.name = fmt::format("material_{}", result);
      else
        material.name = copies == 0 ? name : fmt::format("{}_{}", name, copies);
      materials.push_back(std::move(material));
    }
    return result;
  }

 private:
  std::optional<BandArray> reflectance_, emission_, material_;
  std::vector<std::string> names_;
  std::filesystem::path file_;
  vtkDataSet& data_;
  MaterialNumbers numbers_;
  std::map<std::string, int> copies_;
};

}  // namespace

MeshFile read_vtk(const std::filesystem::path& file, const std::string& extension) {
  vtkSmartPointer<vtkXMLReader> reader;
  if (extension == ".vtp")
    reader = vtkSmartPointer<vtkXMLPolyDataReader>::New();
  else
    reader = vtkSmartPointer<vtkXMLUnstructuredGridReader>::New();
  read_xml(*reader, file);
  vtkDataSet& data = *reader->GetOutputAsDataSet();

  MeshFile mesh;
  for (vtkIdType v = 0; v < data.GetNumberOfPoints(); ++v) {
    Vec3 x;
    data.GetPoint(v, x.data());
    mesh.geometry.vertices.push_back(x);
  }
  CellMaterials cell_materials(file, data);
  vtkNew<vtkIdList> ids;
  std::vector<Index> corners;
  Index skipped = 0;
  for (vtkIdType c = 0; c < data.GetNumberOfCells(); ++c) {
    const int type = data.GetCellType(c);
    if (type == VTK_VERTEX || type == VTK_POLY_VERTEX || type == VTK_LINE || type == VTK_POLY_LINE) {
      ++skipped;
      continue;
    }
    if (type != VTK_TRIANGLE && type != VTK_QUAD && type != VTK_POLYGON)
      throw InputError(
          fmt::format("{}: cell {} is a {}; surfaces are made of vtkTriangle, vtkQuad and vtkPolygon",
                      file.string(), c, vtkCellTypes::GetClassNameFromTypeId(type)));
    data.GetCellPoints(c, ids);
    corners.clear();
    for (vtkIdType k = 0; k < ids->GetNumberOfIds(); ++k)
      corners.push_back(static_cast<Index>(ids->GetId(k)));
    mesh.geometry.add_face(corners, cell_materials.number(c, mesh.materials));
  }
  if (skipped > 0)
    mesh.warnings.push_back(fmt::format("{} points and lines are not surfaces: left out", skipped));
  return mesh;
}

}  // namespace radiosity
