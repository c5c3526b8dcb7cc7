// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <filesystem>

class vtkXMLDataElement;

namespace radiosity {

/// Field data of a piece: the number that each of its points has in the whole.
inline constexpr const char* kVertices = "vertices";

/// Throws IoError where it cannot be written.
void write_xml(const std::filesystem::path& file, vtkXMLDataElement& root);

/// Writes a .pvtp of so many pieces like this one, which need not be read for that.
void write_pieces(const std::filesystem::path& file, vtkPolyData& like, int count);

/// Reads a .pvtp whose pieces have kVertices: points that several share are one again. Field data are those of the first piece.
/// Throws IoError.
vtkSmartPointer<vtkPolyData> read_pieces(const std::filesystem::path& file);

}  // namespace radiosity
