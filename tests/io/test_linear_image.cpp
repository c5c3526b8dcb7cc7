// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/linear_image.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>

#include "files.hpp"

namespace radiosity::test {
namespace {

LinearImage two_by_two(Index bands) {
  LinearImage image{2, 2, BandArray(4, bands)};
  for (Index k = 0; k < 4; ++k)
    for (Index b = 0; b < bands; ++b) image.radiosity(k, b) = 1000.5 * k + b;  // exact in single precision
  return image;
}

std::vector<float> exr_channel(const std::filesystem::path& file, const char* name) {
  Imf::InputFile in(file.c_str());
  std::vector<float> values(4, -1);
  Imf::FrameBuffer frame;
  frame.insert(
      name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float), 2 * sizeof(float)));
  in.setFrameBuffer(frame);
  in.readPixels(0, 1);
  return values;
}

TEST(WriteLinearImage, KeepsPhysicalUnitsAndErrorsInExr) {
  const TemporaryDirectory directory;
  LinearImage image = two_by_two(3);
  image.standard_error = 0.5 * image.radiosity;
  write_linear_image(directory / "a.exr", image);
  EXPECT_EQ(directory.entries(), 1);
  EXPECT_THAT(exr_channel(directory / "a.exr", "R"), testing::ElementsAre(0, 1000.5, 2001, 3001.5));
  EXPECT_THAT(exr_channel(directory / "a.exr", "B"), testing::ElementsAre(2, 1002.5, 2003, 3003.5));
  EXPECT_THAT(exr_channel(directory / "a.exr", "standard_error.G"),
              testing::ElementsAre(0.5, 500.75, 1001, 1501.25));
  write_linear_image(directory / "a.exr", two_by_two(2));
  EXPECT_THAT(exr_channel(directory / "a.exr", "band_1"), testing::ElementsAre(1, 1001.5, 2002, 3002.5));
}

TEST(WriteField, KeepsValuesAndWhereTheyAreSeen) {
  const TemporaryDirectory directory;
  FieldMeans means{2, 2, Eigen::ArrayXd(4), Eigen::ArrayXd(4)};
  means.values << -1, 0, 0.25, 1000.5;
  means.coverage << 1, 0, 0.25, 1;
  const Field field{.name = "irradiance", .unit = "W/m2", .values = {}};
  write_field(directory / "a.exr", means, field);
  EXPECT_THAT(exr_channel(directory / "a.exr", "irradiance"), testing::ElementsAre(-1, 0, 0.25, 1000.5));
  EXPECT_THAT(exr_channel(directory / "a.exr", "A"), testing::ElementsAre(1, 0, 0.25, 1));
  EXPECT_THAT(message_of<InputError>([&] { write_field(directory / "a.hdr", means, field); }),
              testing::HasSubstr(".hdr holds no negative values"));
  means.values[0] = 1;
  write_field(directory / "a.hdr", means, field);
  EXPECT_THAT(read_text(directory / "a.hdr"), testing::StartsWith("#?RADIANCE"));
}

// A pixel of RGBE is four bytes: mantissas m of 8 bits and an exponent e, m / 256 · 2^(e − 128) [Ward's format]; short rows are not packed.
TEST(WriteLinearImage, KeepsTwoDigitsInHdr) {
  const TemporaryDirectory directory;
  const LinearImage image = two_by_two(3);
  write_linear_image(directory / "a.hdr", image);
  const std::string bytes = read_text(directory / "a.hdr");
  EXPECT_THAT(bytes, testing::StartsWith("#?RADIANCE"));
  EXPECT_THAT(bytes, testing::HasSubstr("-Y 2 +X 2\n"));
  const std::string pixels = bytes.substr(bytes.size() - 16);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t b = 0; b < 3; ++b) {
      const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(pixels[4 * k + n]); };
      const double value = std::ldexp(byte(b) / 256.0, byte(3) - 128);
      EXPECT_NEAR(value, image.radiosity(static_cast<Index>(k), static_cast<Index>(b)),
                  image.radiosity.row(static_cast<Index>(k)).maxCoeff() / 128);
    }
}

TEST(WriteLinearImage, NamesWhatCannotBeWrittenAndPrintsNothing) {
  const TemporaryDirectory directory;
  for (const char* name : {"none/a.exr", "none/a.hdr"}) {
    const auto file = directory / name;
    EXPECT_THAT(message_of<IoError>([&] { write_linear_image(file, two_by_two(3)); }),
                testing::StartsWith(file.string()));
  }
  EXPECT_THAT(message_of<InputError>([&] { write_linear_image(directory / "a.tif", two_by_two(3)); }),
              testing::HasSubstr("must be .exr or .hdr"));
  LinearImage image = two_by_two(3);
  image.height = 3;
  EXPECT_THROW(write_linear_image(directory / "a.exr", image), InputError);
  EXPECT_EQ(directory.entries(), 0);
}

}  // namespace
}  // namespace radiosity::test
