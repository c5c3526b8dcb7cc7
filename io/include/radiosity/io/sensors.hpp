// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "radiosity/simulation/probe.hpp"

namespace radiosity {

/// A line "x y z nx ny nz" per sensor: position in m and the direction it faces, which comes back with length 1. Blank lines and
/// what follows a # are skipped. Throws IoError where the file cannot be read, InputError that names file and line where a line
/// is anything else, where the direction is 0, or where there is no sensor at all.
std::vector<Sensor> read_sensors(const std::filesystem::path& file);

/// A header and a line per sensor:
///   x,y,z,nx,ny,nz,irradiance_0,…,standard_error_0,…    m, and W/m² with one column per band
/// Positions and normals have all their digits. The file appears under its name only when complete. Throws IoError when it
/// cannot be written, InputError when the result is not of as many sensors.
void write_irradiance(const std::filesystem::path& file, const std::vector<Sensor>& sensors,
                      const ProbeResult& result);

}  // namespace radiosity
