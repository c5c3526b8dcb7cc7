// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "radiosity/rendering/false_colour.hpp"

namespace radiosity {

/// Draws lines of equal value into an image of the same size, and writes the values beside them where there is room. Lines end where
/// one surface ends: a step from one to another is no isoline. They are linear within triangles of the middles of three pixels.
void draw_isolines(Image& image, const FieldImage& seen, const PatchMesh& mesh, const ColourScale& scale,
                   std::span<const double> levels);

/// Values are seen that lie outside the scale, and have the colours of its ends.
struct Beyond {
  bool below = false, above = false;
};

/// The image with a legend to its right: name, unit, and the colours with round values beside them, and "<" and ">" where values lie
/// beyond. As high as the image, or as high as a legend must be.
Image with_legend(const Image& image, const Field& field, const ColourScale& scale, Beyond beyond = {});

}  // namespace radiosity
