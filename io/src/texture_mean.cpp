// SPDX-License-Identifier: GPL-3.0-or-later
#include "texture_mean.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "child_process.hpp"
#include "radiosity/meshing/error.hpp"
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

/// The bytes of a file as stb_image asks for them. Past their end it goes on with zeros, and does not say so.
struct Source {
  std::string_view bytes;
  std::size_t at = 0;
  bool past_end = false;

  static int read(void* self, char* to, int size) {
    auto& [bytes, at, past_end] = *static_cast<Source*>(self);
    const std::size_t count = std::min(static_cast<std::size_t>(size), bytes.size() - at);
    past_end = past_end || (count == 0 && size > 0);
    std::copy_n(bytes.data() + at, count, to);
    at += count;
    return static_cast<int>(count);
  }
  static void skip(void* self, int size) {
    auto& [bytes, at, past_end] = *static_cast<Source*>(self);
    const auto to = static_cast<std::ptrdiff_t>(at) + size;
    past_end = past_end || to > static_cast<std::ptrdiff_t>(bytes.size());
    at = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(to, 0, static_cast<std::ptrdiff_t>(bytes.size())));
  }
  static int at_end(void* self) {
    return static_cast<Source*>(self)->at == static_cast<Source*>(self)->bytes.size();
  }
};

/// `load` is one of stb_image's functions.
template <class Value>
std::optional<BandValues> load_mean(Value* (*load)(const stbi_io_callbacks*, void*, int*, int*, int*, int),
                                    std::string_view bytes) {
  constexpr stbi_io_callbacks kCallbacks{&Source::read, &Source::skip, &Source::at_end};
  Source source{bytes};
  Image image;
  const std::unique_ptr<Value, void (*)(void*)> values(
      load(&kCallbacks, &source, &image.width, &image.height, &image.channels, 0), &stbi_image_free);
  if (!values || image.pixels() == 0 || source.past_end) return {};
  // One channel is grey, two are grey and alpha.
  const int second = image.channels < 3 ? 0 : 1, third = image.channels < 3 ? 0 : 2;
  const BandValues rgb =
      Eigen::Array3d(linear_mean(values.get(), image, 0), linear_mean(values.get(), image, second),
                     linear_mean(values.get(), image, third));
  if (!rgb.isFinite().all()) return {};
  return rgb;
}

std::optional<BandValues> decoded_mean(std::string_view bytes) {
  const auto* const data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const auto size = static_cast<int>(bytes.size());
  if (stbi_is_hdr_from_memory(data, size)) return load_mean<float>(&stbi_loadf_from_callbacks, bytes);
  if (stbi_is_16_bit_from_memory(data, size))
    return load_mean<std::uint16_t>(&stbi_load_16_from_callbacks, bytes);
  return load_mean<stbi_uc>(&stbi_load_from_callbacks, bytes);
}

}  // namespace

std::optional<BandValues> texture_mean(std::string_view bytes) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return {};
  // stb_image 2.27 writes beyond its tables of codes where a JPEG is damaged: in a process of its own.
  const auto work = [&] {
    Packer packer;
    if (const auto mean = decoded_mean(bytes)) packer.put_all(mean->data(), 3);
    return std::move(packer.bytes());
  };
  const ChildResult result = run_in_child(work, limits_for(bytes.size()));
  if (result.end != ChildEnd::done) return {};
  const auto rgb = Unpacker(result.bytes).take_all<double>();
  if (rgb.size() != 3) return {};
  return BandValues(Eigen::Array3d(rgb.data()));
}

std::optional<BandValues> texture_mean(const std::filesystem::path& file) {
  try {
    return texture_mean(std::string_view(read_bytes(file)));
  } catch (const IoError&) {
    return {};
  }
}

}  // namespace radiosity
