// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vtkCommand.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkXMLReader.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "radiosity/meshing/types.hpp"

class vtkFieldData;

namespace radiosity {

/// Keeps VTK's complaints, which it would otherwise print.
class VtkErrors : public vtkCommand {
 public:
  static VtkErrors* New() { return new VtkErrors; }
  void Execute(vtkObject* caller, unsigned long event, void* text) override;
  /// The first error's own words; empty: none.
  const std::string& first() const { return first_; }
  void watch(vtkAlgorithm* algorithm);

 private:
  std::string first_;
};

/// Runs an XML reader. Throws IoError unless it understood the whole file.
void read_xml(vtkXMLReader& reader, const std::filesystem::path& file);

/// The array of that name as doubles, one row per tuple; absent when there is none.
std::optional<BandArray> band_array(vtkFieldData* data, const char* name);
/// The values of a string array; empty when there is none.
std::vector<std::string> strings(vtkFieldData* data, const char* name);

/// Mirrors and glass of a material, which solved files have as field data, a row for each material. What is not there stays as it is.
template <class Finish>  // Material or MeshMaterial
void read_specular(vtkFieldData* data, std::size_t material, Finish& finish) {
  const auto row = [&](const char* name) -> std::optional<BandValues> {
    const auto values = band_array(data, name);
    if (!values || static_cast<std::size_t>(values->rows()) <= material) return {};
    return BandValues(values->row(static_cast<Eigen::Index>(material)).transpose());
  };
  if (const auto values = row("material_specular")) finish.specular = *values;
  if (const auto values = row("material_transmission")) finish.transmission = *values;
  if (const auto values = row("material_shininess")) finish.shininess = (*values)[0];
  if (const auto values = row("material_refractive_index")) {
    const bool equal = (*values == (*values)[0]).all();
    finish.refractive_index = equal ? (*values)[0] : values->mean();
    if (!equal) finish.refractive_indices = *values;
  }
}

}  // namespace radiosity
