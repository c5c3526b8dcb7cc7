// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Mean of an image's pixels in linear light: red, green and blue. Integer channels are sRGB-coded [IEC61966-2-1]
/// and decoded before they are averaged; floating-point channels are linear; alpha is ignored. `bytes` are those
/// of a PNG, JPEG, TGA, BMP or Radiance HDR file; absent when they are not, or end too early.
std::optional<BandValues> texture_mean(std::string_view bytes);

/// The same of a file; absent also when it does not exist or cannot be opened.
std::optional<BandValues> texture_mean(const std::filesystem::path& file);

}  // namespace radiosity
