// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/png.hpp"

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"
#include "vtk_support.hpp"

namespace radiosity {

std::string encode_png(const Image& image) {
  const auto row_bytes = static_cast<std::size_t>(image.width);
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() != row_bytes * static_cast<std::size_t>(image.height))
    throw InputError(fmt::format("an image of {} x {} cannot have {} pixels", image.width, image.height,
                                 image.pixels.size()));
  vtkNew<vtkImageData> data;
  data->SetDimensions(image.width, image.height, 1);
  data->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < image.height; ++y) {  // VTK counts rows from the bottom
    const auto* row = image.pixels.data() + static_cast<std::size_t>(image.height - 1 - y) * row_bytes;
    std::copy_n(row->data(), 3 * row_bytes, static_cast<std::uint8_t*>(data->GetScalarPointer(0, y, 0)));
  }
  // Encoded in memory: to a file that cannot be opened, VTK's writer leaks.
  vtkNew<vtkPNGWriter> writer;
  vtkNew<VtkErrors> errors;
  errors->watch(writer);
  writer->WriteToMemoryOn();
  writer->SetInputData(data);
  writer->Write();
  if (!errors->first().empty()) throw IoError(fmt::format("PNG: {}", errors->first()));
  vtkUnsignedCharArray* const bytes = writer->GetResult();
  return {reinterpret_cast<const char*>(bytes->GetPointer(0)),
          static_cast<std::size_t>(bytes->GetNumberOfValues())};
}

void write_png(const std::filesystem::path& file, const Image& image) {
  write_file(file, encode_png(image));
}

}  // namespace radiosity
