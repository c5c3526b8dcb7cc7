// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "radiosity/meshing/camera.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

class Visibility;

/// From radiosities to 8-bit sRGB: rgb = sRGB-encode(min(1, exposure · B)). Three bands are red, green, blue;
/// any other number is shown as the grey of its mean. Clamping is a matter of display only.
struct ToneMapping {
  std::optional<double> exposure;  ///< 1/(W/m²); absent: automatic_exposure
};

/// The exposure that maps the area-weighted 90 % quantile of the non-emitting surfaces' radiosity (the
/// largest band) to a display value near white; 1 where everything is dark.
double automatic_exposure(const PatchMesh& mesh, const BandArray& patch_radiosity);

/// sRGB bytes of each row of `radiosity` (W/m², rows × bands).
std::vector<std::array<std::uint8_t, 3>> tone_map(const BandArray& radiosity, double exposure);

struct Image {
  int width = 0, height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;  ///< sRGB, row by row from the top
};

/// The second pass: visible surface by ray casting, vertex radiosities interpolated over the patch that was
/// hit (bilinear on quads, barycentric on triangles and on the triangles of other polygons), no lighting
/// step. `samples`² rays per pixel are averaged after tone mapping. Backs of patches and the void are black.
Image render(const Visibility& visibility, const BandArray& vertex_radiosity, const Camera& camera, int width,
             int height, double exposure, int samples = 3);

/// The same view with one colour for each patch, white where there is none.
Image paint(const Visibility& visibility, const std::vector<std::array<std::uint8_t, 3>>& patch_colours,
            const Camera& camera, int width, int height, int samples = 3);

/// A camera that has the whole mesh in view, looking in at an open side where there is one; see
/// docs/formats.md.
Camera automatic_camera(const PatchMesh& mesh);

/// The bytes of a .png file.
std::string encode_png(const Image& image);

void write_png(const std::filesystem::path& file, const Image& image);

}  // namespace radiosity
