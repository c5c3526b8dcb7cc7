// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/png.hpp"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include "files.hpp"

namespace radiosity::test {
namespace {

TEST(WritePng, ReadsBackPixelByPixelFromTheTop) {
  const TemporaryDirectory directory;
  Image image{2, 3, {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {10, 20, 30}, {40, 50, 60}, {70, 80, 90}}};
  write_png(directory / "a.png", image);
  EXPECT_EQ(directory.entries(), 1);
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName((directory / "a.png").c_str());
  reader->Update();
  vtkImageData* const data = reader->GetOutput();
  ASSERT_EQ(data->GetDimensions()[0], 2);
  ASSERT_EQ(data->GetDimensions()[1], 3);
  ASSERT_EQ(data->GetNumberOfScalarComponents(), 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 2; ++x)
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(data->GetScalarComponentAsDouble(x, 2 - y, 0, k), image.pixels[2 * y + x][k]);
}

TEST(WritePng, NamesAFileThatCannotBeWrittenAndPrintsNothing) {
  const TemporaryDirectory directory;
  const auto file = directory / "none/a.png";
  const Image image{1, 1, {{1, 2, 3}}};
  EXPECT_THAT(message_of<IoError>([&] { write_png(file, image); }), testing::StartsWith(file.string()));
  EXPECT_THROW(write_png(directory / "a.png", {2, 1, {{1, 2, 3}}}), InputError);
}

}  // namespace
}  // namespace radiosity::test
