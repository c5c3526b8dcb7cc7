// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// Mean of an image's pixels in linear light: red, green and blue in [0, 1]. Integer channels are sRGB-coded
/// [IEC61966-2-1] and decoded before they are averaged; floating-point channels are linear; alpha is ignored.
/// Absent when the file is not there or is not an image that VTK reads.
std::optional<BandValues> texture_mean(const std::filesystem::path& file);

/// The same for the bytes of a PNG or JPEG file; absent for all others.
std::optional<BandValues> texture_mean(std::string_view bytes);

}  // namespace radiosity
