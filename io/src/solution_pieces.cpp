// SPDX-License-Identifier: GPL-3.0-or-later
#include "solution_pieces.hpp"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkIdList.h>
#include <vtkInformation.h>
#include <vtkInformationStringKey.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLDataParser.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh_file.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "vtk_support.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw IoError(fmt::format("{}: cannot be understood: {}", file.string(), why));
}

const char* type_name(const vtkDataArray& array) {
  switch (const_cast<vtkDataArray&>(array).GetDataType()) {
    case VTK_UNSIGNED_CHAR:
      return "UInt8";
    case VTK_INT:
      return "Int32";
    default:
      return "Float64";
  }
}

vtkNew<vtkXMLDataElement> element(const char* name) {
  vtkNew<vtkXMLDataElement> out;
  out->SetName(name);
  return out;
}

vtkNew<vtkXMLDataElement> array_element(vtkDataArray& array) {
  auto out = element("PDataArray");
  out->SetAttribute("type", type_name(array));
  out->SetAttribute("Name", array.GetName());
  out->SetIntAttribute("NumberOfComponents", array.GetNumberOfComponents());
  for (int k = 0; k < array.GetNumberOfComponents(); ++k)
    if (const char* component = array.GetComponentName(k))
      out->SetAttribute(fmt::format("ComponentName{}", k).c_str(), component);
  return out;
}

// Values of one array in pieces, at their places in the whole.
void unite(const fs::path& file, vtkFieldData& to, const std::vector<vtkFieldData*>& pieces,
           const std::vector<std::vector<vtkIdType>>& places, vtkIdType count) {
  for (int a = 0; a < pieces[0]->GetNumberOfArrays(); ++a) {
    vtkDataArray* const first = pieces[0]->GetArray(a);
    if (first == nullptr || first->GetName() == nullptr) continue;
    const auto whole = vtkSmartPointer<vtkDataArray>::Take(first->NewInstance());
    whole->SetName(first->GetName());
    whole->SetNumberOfComponents(first->GetNumberOfComponents());
    for (int k = 0; k < first->GetNumberOfComponents(); ++k)
      if (const char* component = first->GetComponentName(k)) whole->SetComponentName(k, component);
    if (first->HasInformation()) whole->CopyInformation(first->GetInformation());
    whole->SetNumberOfTuples(count);
    whole->Fill(0);
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      vtkDataArray* const part = pieces[p]->GetArray(first->GetName());
      if (part == nullptr || part->GetNumberOfComponents() != first->GetNumberOfComponents() ||
          part->GetNumberOfTuples() != static_cast<vtkIdType>(places[p].size()))
        refuse(file, fmt::format("its pieces do not all have the same array '{}'", first->GetName()));
      for (std::size_t k = 0; k < places[p].size(); ++k)
        whole->SetTuple(places[p][k], static_cast<vtkIdType>(k), part);
    }
    to.AddArray(whole);
  }
}

std::vector<fs::path> pieces_named_in(const fs::path& file) {
  vtkNew<vtkXMLDataParser> parser;
  vtkNew<VtkErrors> errors;
  parser->AddObserver(vtkCommand::ErrorEvent, errors);
  parser->SetFileName(file.c_str());
  if (parser->Parse() == 0 || !errors->first().empty()) refuse(file, errors->first());
  vtkXMLDataElement* const root = parser->GetRootElement();
  vtkXMLDataElement* const data = root != nullptr ? root->FindNestedElementWithName("PPolyData") : nullptr;
  std::vector<fs::path> pieces;
  for (int k = 0; data != nullptr && k < data->GetNumberOfNestedElements(); ++k) {
    vtkXMLDataElement* const piece = data->GetNestedElement(k);
    if (piece->GetName() != std::string_view("Piece")) continue;
    const char* const source = piece->GetAttribute("Source");
    if (source == nullptr) refuse(file, "one of its pieces has no Source");
    pieces.push_back(file.parent_path() / source);
  }
  if (pieces.empty()) refuse(file, "it names no pieces of polygons");
  return pieces;
}

}  // namespace

fs::path piece_of(const fs::path& file, int rank, int count) {
  return file.parent_path() / fmt::format("{}-{}-of-{}.vtp", file.stem().string(), rank + 1, count);
}

void write_xml(const fs::path& file, vtkXMLDataElement& root) {
  write_atomically(file, [&](const fs::path& temporary) {
    std::ofstream out(temporary);
    out << "<?xml version=\"1.0\"?>\n";
    root.PrintXML(out, vtkIndent());
    out.close();
    if (!out) throw IoError("the disk is full or the file cannot be opened");
  });
}

// By hand: VTK's own writer would write the pieces, too, and all of them here.
void write_pieces(const fs::path& file, vtkPolyData& like, int count) {
  const auto root = element("VTKFile"), data = element("PPolyData"), points = element("PPoints");
  root->SetAttribute("type", "PPolyData");
  root->SetAttribute("version", "1.0");
  root->SetAttribute("header_type", "UInt64");
  root->AddNestedElement(data);
  data->SetIntAttribute("GhostLevel", 0);
  for (const auto& [name, arrays] : {std::pair<const char*, vtkFieldData*>{"PPointData", like.GetPointData()},
                                     {"PCellData", like.GetCellData()}}) {
    const auto list = element(name);
    for (int k = 0; k < arrays->GetNumberOfArrays(); ++k)
      list->AddNestedElement(array_element(*arrays->GetArray(k)));
    data->AddNestedElement(list);
  }
  points->AddNestedElement(array_element(*like.GetPoints()->GetData()));
  data->AddNestedElement(points);
  for (int k = 0; k < count; ++k) {
    const auto piece = element("Piece");
    piece->SetAttribute("Source", piece_of(file, k, count).filename().c_str());
    data->AddNestedElement(piece);
  }
  write_xml(file, *root);
}

vtkSmartPointer<vtkPolyData> read_pieces(const fs::path& file) {
  std::vector<vtkSmartPointer<vtkPolyData>> pieces;
  std::vector<std::vector<vtkIdType>> points, cells;
  std::vector<vtkFieldData*> of_points, of_cells;
  vtkIdType point_count = 0, cell_count = 0, most = 0;
  for (const fs::path& source : pieces_named_in(file)) {
    require_readable(source);
    vtkNew<vtkXMLPolyDataReader> reader;
    read_xml(*reader, source);
    vtkPolyData& piece = *reader->GetOutput();
    const auto numbers = band_array(piece.GetFieldData(), kVertices);
    if (!numbers || numbers->size() != piece.GetNumberOfPoints() ||
        piece.GetNumberOfPolys() != piece.GetNumberOfCells())
      refuse(source, "it is no piece as radiosity solve writes one");
    most += piece.GetNumberOfPoints();
    auto& own = points.emplace_back();
    for (const double number : numbers->reshaped()) {
      if (!(number >= 0 && number < 1e18))
        refuse(source, fmt::format("{} is not a number of a point", number));
      own.push_back(static_cast<vtkIdType>(number));
      point_count = std::max(point_count, own.back() + 1);
    }
    auto& places = cells.emplace_back();
    for (vtkIdType k = 0; k < piece.GetNumberOfCells(); ++k) places.push_back(cell_count++);
    of_points.push_back(piece.GetPointData());
    of_cells.push_back(piece.GetCellData());
    pieces.emplace_back(&piece);
  }
  if (point_count > most) refuse(file, "points of it are in no piece");

  vtkNew<vtkPoints> all;
  all->SetDataTypeToDouble();
  all->SetNumberOfPoints(point_count);
  all->GetData()->Fill(0);
  vtkNew<vtkCellArray> polygons;
  vtkNew<vtkIdList> corners;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    for (std::size_t k = 0; k < points[p].size(); ++k)
      all->SetPoint(points[p][k], pieces[p]->GetPoint(static_cast<vtkIdType>(k)));
    for (vtkIdType cell = 0; cell < pieces[p]->GetNumberOfCells(); ++cell) {
      pieces[p]->GetCellPoints(cell, corners);
      for (vtkIdType k = 0; k < corners->GetNumberOfIds(); ++k)
        corners->SetId(k, points[p][static_cast<std::size_t>(corners->GetId(k))]);
      polygons->InsertNextCell(corners);
    }
  }
  auto whole = vtkSmartPointer<vtkPolyData>::New();
  whole->SetPoints(all);
  whole->SetPolys(polygons);
  unite(file, *whole->GetPointData(), of_points, points, point_count);
  unite(file, *whole->GetCellData(), of_cells, cells, cell_count);
  whole->GetFieldData()->ShallowCopy(pieces[0]->GetFieldData());
  return whole;
}

}  // namespace radiosity
