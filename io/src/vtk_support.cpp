// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk_support.hpp"

#include <fmt/format.h>
#include <vtkAlgorithm.h>
#include <vtkDataArray.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkStringArray.h>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

void VtkErrors::Execute(vtkObject*, unsigned long event, void* text) {
  if (event != vtkCommand::ErrorEvent || !text || !first_.empty()) return;
  // "ERROR: In file.cxx, line 12\nvtkClass (0x55d0): what happened\n\n"
  first_ = static_cast<const char*>(text);
  if (const auto colon = first_.find("): "); colon != std::string::npos) first_.erase(0, colon + 3);
  first_.erase(std::min(first_.find('\n'), first_.size()));
}

void VtkErrors::watch(vtkAlgorithm* algorithm) {
  for (const auto event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent}) {
    algorithm->AddObserver(event, this);
    algorithm->GetExecutive()->AddObserver(event, this);
  }
}

void read_xml(vtkXMLReader& reader, const std::filesystem::path& file) {
  vtkNew<VtkErrors> errors;
  errors->watch(&reader);
  reader.SetReaderErrorObserver(errors);
  reader.SetParserErrorObserver(errors);
  reader.SetFileName(file.c_str());
  try {
    reader.Update();
  } catch (const std::exception&) {  // std::bad_alloc of a size that stands in a damaged file
    throw IoError(
        fmt::format("{}: cannot be understood: it asks for more memory than there is", file.string()));
  }
  if (!errors->first().empty() || reader.GetErrorCode() != vtkErrorCode::NoError)
    throw IoError(fmt::format("{}: cannot be understood: {}", file.string(),
                              errors->first().empty()
                                  ? vtkErrorCode::GetStringFromErrorCode(reader.GetErrorCode())
                                  : errors->first()));
}

std::optional<BandArray> band_array(vtkFieldData* data, const char* name) {
  vtkDataArray* const array = data->GetArray(name);
  if (!array) return {};
  BandArray values(array->GetNumberOfTuples(), array->GetNumberOfComponents());
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    for (Eigen::Index b = 0; b < values.cols(); ++b)
      values(i, b) = array->GetComponent(i, static_cast<int>(b));
  return values;
}

std::vector<std::string> strings(vtkFieldData* data, const char* name) {
  std::vector<std::string> values;
  if (auto* const array = vtkStringArray::SafeDownCast(data->GetAbstractArray(name)))
    for (vtkIdType i = 0; i < array->GetNumberOfValues(); ++i) values.push_back(array->GetValue(i));
  return values;
}

}  // namespace radiosity
