// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/linear_image.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <fmt/format.h>

#include <array>
#include <vector>

#include "mesh_file.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace radiosity {
namespace {

namespace fs = std::filesystem;

std::string channel(Eigen::Index band, Eigen::Index bands) {
  constexpr std::array kColours{"R", "G", "B"};
  return bands == 3 ? kColours[band] : fmt::format("band_{}", band);
}

struct Layer {
  std::string name;  ///< of the channel
  Eigen::ArrayXf pixels;
};

void write_exr(const fs::path& file, int width, int height, std::vector<Layer> layers,
               const std::string& comment) {
  Imf::Header header(width, height);
  Imf::addComments(header, comment);
  Imf::FrameBuffer frame;
  for (Layer& layer : layers) {
    header.channels().insert(layer.name, Imf::Channel(Imf::FLOAT));
    frame.insert(layer.name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(layer.pixels.data()),
                                        sizeof(float), sizeof(float) * static_cast<std::size_t>(width)));
  }
  write_atomically(file, [&](const fs::path& temporary) {
    try {
      Imf::OutputFile out(temporary.c_str(), header);
      out.setFrameBuffer(frame);
      out.writePixels(height);
    } catch (const std::exception& error) {
      throw IoError(error.what());
    }
  });
}

std::vector<Layer> layers(const LinearImage& image) {
  std::vector<Layer> result;
  const auto add = [&](const std::string& prefix, const BandArray& values) {
    for (Eigen::Index b = 0; b < values.cols(); ++b)
      result.push_back({prefix + channel(b, values.cols()), values.col(b).cast<float>()});
  };
  add("", image.radiosity);
  if (image.standard_error) add("standard_error.", *image.standard_error);
  return result;
}

using Rgb32 = Eigen::Array<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

void write_hdr(const fs::path& file, int width, int height, const Rgb32& rgb) {
  std::string bytes;
  stbi_write_hdr_to_func(
      [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
      },
      &bytes, width, height, 3, rgb.data());
  write_file(file, bytes);
}

void require_pixels(int width, int height, Eigen::Index pixels) {
  if (width < 1 || height < 1 || pixels != static_cast<Eigen::Index>(width) * height)
    throw InputError(fmt::format("an image of {} x {} cannot have {} pixels", width, height, pixels));
}

[[noreturn]] void refuse_extension(const fs::path& file) {
  throw InputError(fmt::format("{}: the extension must be .exr or .hdr", file.string()));
}

}  // namespace

void write_linear_image(const fs::path& file, const LinearImage& image) {
  require_pixels(image.width, image.height, image.radiosity.rows());
  const std::string extension = lower_case_extension(file);
  if (extension == ".exr") {
    write_exr(file, image.width, image.height, layers(image),
              "pi times radiance, in W/m2: of a diffuse surface its radiosity");
  } else if (extension == ".hdr") {
    Rgb32 rgb(image.radiosity.rows(), 3);
    if (image.radiosity.cols() == 3)
      rgb = image.radiosity.cast<float>();
    else
      rgb.colwise() = image.radiosity.rowwise().mean().cast<float>();
    write_hdr(file, image.width, image.height, rgb);
  } else {
    refuse_extension(file);
  }
}

void write_field(const fs::path& file, const FieldMeans& means, const Field& field) {
  require_pixels(means.width, means.height, means.values.size());
  const std::string extension = lower_case_extension(file);
  if (extension == ".exr") {
    std::string comment = field.name;
    if (!field.of.empty()) comment += ", " + field.of;
    if (!field.unit.empty()) comment += ", in " + field.unit;
    write_exr(file, means.width, means.height,
              {{field.name, means.values.cast<float>()}, {"A", means.coverage.cast<float>()}}, comment);
  } else if (extension == ".hdr") {
    if (means.values.minCoeff() < 0)
      throw InputError(
          fmt::format("{}: '{}' is {:.4g} at a pixel, but .hdr holds no negative values; use .exr",
                      file.string(), field.name, means.values.minCoeff()));
    Rgb32 grey(means.values.size(), 3);
    grey.colwise() = means.values.cast<float>();
    write_hdr(file, means.width, means.height, grey);
  } else {
    refuse_extension(file);
  }
}

}  // namespace radiosity
