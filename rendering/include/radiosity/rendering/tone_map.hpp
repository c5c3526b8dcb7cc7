// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

/// An sRGB colour of 8 bits a channel.
using Rgb8 = std::array<std::uint8_t, 3>;

/// An image for a display.
struct Image {
  int width = 0, height = 0;
  std::vector<Rgb8> pixels;  ///< sRGB, row by row from the top
};

/// The exposure that maps the area-weighted 90 % quantile of the non-emitting surfaces' radiosity (the
/// largest band) to a display value near white; 1 where everything is dark.
double automatic_exposure(const PatchMesh& mesh, const BandArray& patch_radiosity);

/// The same of what is seen: below it are 90 % of the pixels.
double automatic_exposure(const LinearImage& image);

/// From radiosities (W/m², rows × bands) to 8-bit sRGB, one colour for each row: sRGB-encode(min(1, exposure · B)) [IEC61966-2-1]. Three
/// bands are red, green, blue; any other number is shown as the grey of its mean. Clamping is a matter of display only.
std::vector<Rgb8> tone_map(const BandArray& radiosity, double exposure);

/// The pixels of an image, each by itself: samples are averaged before, in linear light.
Image tone_map(const LinearImage& image, double exposure);

}  // namespace radiosity
