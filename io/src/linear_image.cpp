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
using Pixels = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic>;  // a column per channel

std::string channel(Eigen::Index band, Eigen::Index bands) {
  constexpr std::array kColours{"R", "G", "B"};
  return bands == 3 ? kColours[band] : fmt::format("band_{}", band);
}

void write_exr(const fs::path& file, const LinearImage& image) {
  Imf::Header header(image.width, image.height);
  Imf::addComments(header, "pi times radiance, in W/m2: of a diffuse surface its radiosity");
  Imf::FrameBuffer frame;
  std::vector<Pixels> layers;  // what the frame buffer points into
  layers.reserve(2);
  const auto add = [&](const std::string& layer, const BandArray& values) {
    Pixels& pixels = layers.emplace_back(values.cast<float>());
    for (Eigen::Index b = 0; b < pixels.cols(); ++b) {
      const std::string name = layer + channel(b, pixels.cols());
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.col(b).data()), sizeof(float),
                                    sizeof(float) * static_cast<std::size_t>(image.width)));
    }
  };
  add("", image.radiosity);
  if (image.standard_error) add("standard_error.", *image.standard_error);
  write_atomically(file, [&](const fs::path& temporary) {
    try {
      Imf::OutputFile out(temporary.c_str(), header);
      out.setFrameBuffer(frame);
      out.writePixels(image.height);
    } catch (const std::exception& error) {
      throw IoError(error.what());
    }
  });
}

void write_hdr(const fs::path& file, const LinearImage& image) {
  Eigen::Array<float, Eigen::Dynamic, 3, Eigen::RowMajor> rgb(image.radiosity.rows(), 3);
  if (image.radiosity.cols() == 3)
    rgb = image.radiosity.cast<float>();
  else
    rgb.colwise() = image.radiosity.rowwise().mean().cast<float>();
  std::string bytes;
  stbi_write_hdr_to_func(
      [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
      },
      &bytes, image.width, image.height, 3, rgb.data());
  write_file(file, bytes);
}

}  // namespace

void write_linear_image(const fs::path& file, const LinearImage& image) {
  if (image.width < 1 || image.height < 1 ||
      image.radiosity.rows() != static_cast<Eigen::Index>(image.width) * image.height)
    throw InputError(fmt::format("an image of {} x {} cannot have {} pixels", image.width, image.height,
                                 image.radiosity.rows()));
  const std::string extension = lower_case_extension(file);
  if (extension == ".exr")
    write_exr(file, image);
  else if (extension == ".hdr")
    write_hdr(file, image);
  else
    throw InputError(fmt::format("{}: the extension must be .exr or .hdr", file.string()));
}

}  // namespace radiosity
