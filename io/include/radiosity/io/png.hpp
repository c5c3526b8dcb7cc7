// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "radiosity/rendering/render.hpp"

namespace radiosity {

/// The bytes of a .png file. Throws InputError where the image has not as many pixels as its size says.
std::string encode_png(const Image& image);

/// The file appears under its name only when complete. Throws IoError when it cannot be written.
void write_png(const std::filesystem::path& file, const Image& image);

}  // namespace radiosity
