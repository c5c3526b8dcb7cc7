// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk_support.hpp"

#include <fmt/format.h>
#include <vtkAlgorithm.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkOutputWindow.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

namespace {

/// "ERROR: In file.cxx, line 12\nvtkClass (0x55d0): what happened\n\n", without what comes before and after.
std::string first_complaint(std::string text) {
  if (const auto colon = text.find("): "); colon != std::string::npos) text.erase(0, colon + 3);
  text.erase(std::min(text.find('\n'), text.size()));
  return text;
}

}  // namespace

void VtkErrors::Execute(vtkObject*, unsigned long event, void* text) {
  if (event == vtkCommand::ErrorEvent && text && first_.empty())
    first_ = first_complaint(static_cast<const char*>(text));
}

void VtkErrors::watch(vtkAlgorithm* algorithm) {
  for (const auto event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent}) {
    algorithm->AddObserver(event, this);
    algorithm->GetExecutive()->AddObserver(event, this);
  }
}

namespace {

/// What VTK would print: objects without an observer complain here.
class Complaints : public vtkOutputWindow {
 public:
  static Complaints* New() { return new Complaints; }
  void DisplayText(const char* text) override {
    if (first.empty()) first = first_complaint(text);
  }
  std::string first;
};

/// Corners that are no points of the data, or lists of corners that are not as long as they should be; VTK does not
/// look.
std::string wrong_cells(vtkCellArray* cells, vtkIdType points) {
  if (!cells || cells->GetNumberOfCells() == 0) return {};
  if (!cells->IsValid()) return "the offsets of its cells do not fit their connectivity";
  vtkDataArray& corners = *cells->GetConnectivityArray();
  for (vtkIdType k = 0; k < corners.GetNumberOfTuples(); ++k)
    if (const double v = corners.GetComponent(k, 0); !(v >= 0 && v < static_cast<double>(points)))
      return fmt::format("a cell refers to point {}, but there are only {}", v, points);
  return {};
}

std::string wrong_cells(vtkDataSet& data) {
  if (auto* const grid = vtkUnstructuredGrid::SafeDownCast(&data))
    return wrong_cells(grid->GetCells(), data.GetNumberOfPoints());
  auto* const surface = vtkPolyData::SafeDownCast(&data);
  for (vtkCellArray* cells :
       {surface->GetVerts(), surface->GetLines(), surface->GetPolys(), surface->GetStrips()})
    if (std::string wrong = wrong_cells(cells, data.GetNumberOfPoints()); !wrong.empty()) return wrong;
  surface->BuildCells();  // complains of polygons without corners
  return {};
}

/// Reads, and says what is wrong; empty: nothing.
std::string complaint(vtkXMLReader& reader) {
  vtkNew<VtkErrors> errors;
  errors->watch(&reader);
  reader.SetReaderErrorObserver(errors);
  reader.SetParserErrorObserver(errors);
  reader.Update();
  if (!errors->first().empty()) return errors->first();
  if (reader.GetErrorCode() != vtkErrorCode::NoError)
    return vtkErrorCode::GetStringFromErrorCode(reader.GetErrorCode());
  return wrong_cells(*reader.GetOutputAsDataSet());
}

}  // namespace

void read_xml(vtkXMLReader& reader, const std::filesystem::path& file) {
  reader.SetFileName(file.c_str());
  vtkNew<Complaints> complaints;
  vtkOutputWindow::SetInstance(complaints);
  std::string why = complaint(reader);
  vtkOutputWindow::SetInstance(nullptr);
  if (why.empty()) why = complaints->first;
  if (!why.empty()) throw IoError(fmt::format("{}: cannot be understood: {}", file.string(), why));
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
