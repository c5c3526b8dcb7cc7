// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

namespace radiosity {

/// A line of text as coverage in [0, 1], row by row from the top. All lines of one size are equally high.
struct TextRaster {
  int width = 0, height = 0;
  std::vector<float> coverage = {};
};

/// Text of that size in pixels, in ASCII; a ² is raised.
TextRaster raster(std::string_view text, int size);

}  // namespace radiosity
