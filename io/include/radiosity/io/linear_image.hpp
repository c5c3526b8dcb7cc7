// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "radiosity/rendering/false_colour.hpp"
#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

/// An image in physical units, π L in W/m². The extension chooses the format:
/// .exr  OpenEXR, single precision: channels R, G and B of three bands, band_0, band_1, … of any other number, and the standard error,
///       where there is one, in channels of these names after "standard_error.";
/// .hdr  Radiance's RGBE, about two digits: the grey of the mean where bands are not three.
/// The file appears under its name only when complete. Throws InputError on another extension or an image without pixels, IoError when
/// it cannot be written.
void write_linear_image(const std::filesystem::path& file, const LinearImage& image);

/// The values of a field as it is seen, in its unit:
/// .exr  a channel with the field's name, and "A", the share of the pixel's samples that saw it, by which values are multiplied already;
/// .hdr  grey; InputError where a value is negative, which this format has no room for.
/// Errors as above.
void write_field(const std::filesystem::path& file, const FieldMeans& means, const Field& field);

}  // namespace radiosity
