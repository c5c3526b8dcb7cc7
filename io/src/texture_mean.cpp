// SPDX-License-Identifier: GPL-3.0-or-later
#include "texture_mean.hpp"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkImageReader2.h>
#include <vtkImageReader2Factory.h>
#include <vtkJPEGReader.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>

#include <cmath>
#include <limits>
#include <map>
#include <type_traits>

#include "vtk_support.hpp"

namespace radiosity {
namespace {

/// An image of 16384 × 16384 pixels; headers that claim more are taken for damaged, before memory is asked for.
constexpr double kMostPixels = 16384.0 * 16384.0;

/// sRGB → linear [IEC61966-2-1].
double srgb_decode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

template <class Value>
double linear_mean(vtkDataArray& pixels, int channel) {
  const vtkIdType count = pixels.GetNumberOfTuples();
  const auto* const values = static_cast<const Value*>(pixels.GetVoidPointer(0));
  const auto stride = static_cast<vtkIdType>(pixels.GetNumberOfComponents());
  double sum = 0;
  if constexpr (std::is_integral_v<Value>) {
    constexpr std::size_t kLevels = std::size_t{1} << (8 * sizeof(Value));
    std::vector<vtkIdType> histogram(kLevels);
    for (vtkIdType i = 0; i < count; ++i) ++histogram[values[i * stride + channel]];
    for (std::size_t level = 0; level < kLevels; ++level)
      sum += static_cast<double>(histogram[level]) * srgb_decode(static_cast<double>(level) / static_cast<double>(kLevels - 1));
  } else {
    for (vtkIdType i = 0; i < count; ++i) sum += static_cast<double>(values[i * stride + channel]);
  }
  return sum / static_cast<double>(count);
}

std::optional<BandValues> mean_of(vtkDataArray& pixels) {
  const auto mean = [&](int channel) {
    switch (pixels.GetDataType()) {
      case VTK_UNSIGNED_CHAR: return linear_mean<std::uint8_t>(pixels, channel);
      case VTK_UNSIGNED_SHORT: return linear_mean<std::uint16_t>(pixels, channel);
      case VTK_FLOAT: return linear_mean<float>(pixels, channel);
      default: return std::numeric_limits<double>::quiet_NaN();
    }
  };
  // One channel is grey, two are grey and alpha.
  const bool grey = pixels.GetNumberOfComponents() < 3;
  const BandValues rgb = Eigen::Array3d(mean(0), mean(grey ? 0 : 1), mean(grey ? 0 : 2));
  if (!rgb.isFinite().all()) return {};
  return rgb;
}

std::optional<BandValues> read_mean(vtkImageReader2& reader) {
  vtkNew<VtkErrors> errors;
  errors->watch(&reader);
  try {
    reader.UpdateInformation();
    const int* const extent = reader.GetDataExtent();
    const double pixels = (extent[1] + 1.0 - extent[0]) * (extent[3] + 1.0 - extent[2]);
    if (!errors->first().empty() || !(pixels > 0) || pixels > kMostPixels) return {};
    reader.Update();
  } catch (const std::exception&) {  // a size that no memory holds
    return {};
  }
  vtkDataArray* const scalars = reader.GetOutput()->GetPointData()->GetScalars();
  if (!errors->first().empty() || !scalars || scalars->GetNumberOfTuples() == 0) return {};
  return mean_of(*scalars);
}

}  // namespace

std::optional<BandValues> texture_mean(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return {};
  const auto reader = vtkSmartPointer<vtkImageReader2>::Take(
      vtkImageReader2Factory::CreateImageReader2(file.c_str()));
  if (!reader) return {};
  reader->SetFileName(file.c_str());
  return read_mean(*reader);
}

std::optional<BandValues> texture_mean(std::string_view bytes) {
  vtkSmartPointer<vtkImageReader2> reader;
  if (bytes.starts_with("\x89PNG"))
    reader = vtkSmartPointer<vtkPNGReader>::New();
  else if (bytes.starts_with("\xff\xd8"))
    reader = vtkSmartPointer<vtkJPEGReader>::New();
  else
    return {};
  reader->SetMemoryBuffer(bytes.data());
  reader->SetMemoryBufferLength(static_cast<vtkIdType>(bytes.size()));
  return read_mean(*reader);
}

}  // namespace radiosity
