// SPDX-License-Identifier: GPL-3.0-or-later
#include "texture_mean.hpp"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "text.hpp"

// Not VTK's image readers: its PNG reader prints, and crashes on each file that is damaged (VTK 9.1).
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_TGA
#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS 16384  // headers that claim more are taken for damaged
// What the data of a file do not reach is black, not what the memory held before.
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_REALLOC(pointer, size) std::realloc(pointer, size)
#define STBI_FREE(pointer) std::free(pointer)
#include <stb/stb_image.h>

namespace radiosity {
namespace {

/// sRGB → linear [IEC61966-2-1].
double srgb_decode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

struct Image {
  int width = 0, height = 0, channels = 0;
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

template <class Value>
double linear_mean(const Value* values, const Image& image, int channel) {
  const auto stride = static_cast<std::size_t>(image.channels);
  const Value* const first = values + channel;
  double sum = 0;
  if constexpr (std::is_integral_v<Value>) {
    constexpr std::size_t kLevels = std::size_t{std::numeric_limits<Value>::max()} + 1;
    std::vector<std::size_t> histogram(kLevels);
    for (std::size_t i = 0; i < image.pixels(); ++i) ++histogram[first[i * stride]];
    for (std::size_t level = 0; level < kLevels; ++level)
      sum += static_cast<double>(histogram[level]) *
             srgb_decode(static_cast<double>(level) / static_cast<double>(kLevels - 1));
  } else {
    for (std::size_t i = 0; i < image.pixels(); ++i) sum += static_cast<double>(first[i * stride]);
  }
  return sum / static_cast<double>(image.pixels());
}

/// `load` is one of stb_image's functions.
template <class Value>
std::optional<BandValues> load_mean(Value* (*load)(const stbi_uc*, int, int*, int*, int*, int),
                                    std::string_view bytes) {
  Image image;
  const std::unique_ptr<Value, void (*)(void*)> values(
      load(reinterpret_cast<const stbi_uc*>(bytes.data()), static_cast<int>(bytes.size()), &image.width,
           &image.height, &image.channels, 0),
      &stbi_image_free);
  if (!values || image.pixels() == 0) return {};
  // One channel is grey, two are grey and alpha.
  const int second = image.channels < 3 ? 0 : 1, third = image.channels < 3 ? 0 : 2;
  const BandValues rgb =
      Eigen::Array3d(linear_mean(values.get(), image, 0), linear_mean(values.get(), image, second),
                     linear_mean(values.get(), image, third));
  if (!rgb.isFinite().all()) return {};
  return rgb;
}

}  // namespace

std::optional<BandValues> texture_mean(std::string_view bytes) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return {};
  const auto* const data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const auto size = static_cast<int>(bytes.size());
  if (stbi_is_hdr_from_memory(data, size)) return load_mean<float>(&stbi_loadf_from_memory, bytes);
  if (stbi_is_16_bit_from_memory(data, size))
    return load_mean<std::uint16_t>(&stbi_load_16_from_memory, bytes);
  return load_mean<stbi_uc>(&stbi_load_from_memory, bytes);
}

std::optional<BandValues> texture_mean(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return {};
  return texture_mean(std::string_view(read_bytes(file)));
}

}  // namespace radiosity
