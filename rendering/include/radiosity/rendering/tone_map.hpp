// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

/// An sRGB colour of 8 bits a channel.
using Rgb8 = std::array<std::uint8_t, 3>;

/// The exposure that maps the area-weighted 90 % quantile of the non-emitting surfaces' radiosity (the
/// largest band) to a display value near white; 1 where everything is dark.
double automatic_exposure(const PatchMesh& mesh, const BandArray& patch_radiosity);

/// From radiosities (W/m², rows × bands) to 8-bit sRGB, one colour for each row: sRGB-encode(min(1, exposure · B)) [IEC61966-2-1]. Three
/// bands are red, green, blue; any other number is shown as the grey of its mean. Clamping is a matter of display only.
std::vector<Rgb8> tone_map(const BandArray& radiosity, double exposure);

}  // namespace radiosity
