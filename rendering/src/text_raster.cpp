// SPDX-License-Identifier: GPL-3.0-or-later
#include "text_raster.hpp"

#include <vtkFreeTypeStringToImage.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <string>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

TextRaster plain(std::string_view text, int size) {
  vtkNew<vtkTextProperty> property;
  property->SetFontFamilyToArial();  // VTK's own, whatever fonts the machine has
  property->SetFontSize(size);
  vtkNew<vtkFreeTypeStringToImage> renderer;
  renderer->SetScaleToPowerOfTwo(false);
  vtkNew<vtkImageData> image;
  constexpr int kDpi = 72;  // so that sizes are pixels
  if (renderer->RenderString(property, vtkStdString(std::string(text)), kDpi, image, nullptr) == 0)
    throw Error("VTK cannot draw the text '" + std::string(text) + "'");
  const int width = image->GetDimensions()[0], height = image->GetDimensions()[1];
  TextRaster result{width, height, {}};
  for (int y = height - 1; y >= 0; --y)  // VTK counts rows from the bottom
    for (int x = 0; x < width; ++x)
      result.coverage.push_back(
          static_cast<float>(image->GetScalarComponentAsDouble(x, y, 0, 3) / 255));  // alpha
  return result;
}

TextRaster beside(const TextRaster& left, const TextRaster& right) {
  TextRaster result{left.width + right.width, std::max(left.height, right.height), {}};
  result.coverage.resize(static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height));
  const auto put = [&](const TextRaster& part, int at) {
    for (int y = 0; y < part.height; ++y)
      std::copy_n(part.coverage.data() + y * part.width, part.width,
                  result.coverage.data() + y * result.width + at);
  };
  put(left, 0);
  put(right, left.width);
  return result;
}

}  // namespace

TextRaster raster(std::string_view text, int size) {
  constexpr std::string_view kRaised = "²";
  const std::size_t at = text.find(kRaised);
  if (at == std::string_view::npos) return plain(text, size);
  const TextRaster raised = plain("2", std::max(5, 2 * size / 3));
  const std::string_view rest = text.substr(at + kRaised.size());
  TextRaster result = beside(plain(text.substr(0, at), size), raised);
  return rest.empty() ? result : beside(result, raster(rest, size));
}

}  // namespace radiosity
