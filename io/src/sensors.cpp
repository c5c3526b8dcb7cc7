// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/sensors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "mesh_file.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {

std::vector<Sensor> read_sensors(const std::filesystem::path& file) {
  require_readable(file);
  std::ifstream in(file);
  std::vector<Sensor> sensors;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const auto refuse = [&](const std::string& rule) {
      throw InputError(fmt::format("{}: line {}: '{}': {}", file.string(), number,
                                   line.substr(0, line.find_last_not_of(" \t\r") + 1), rule));
    };
    std::istringstream text(line.substr(0, line.find('#')));
    if ((text >> std::ws).eof()) continue;
    Sensor sensor;
    Vec3 &x = sensor.position, &n = sensor.normal;
    // Extraction refuses nan, inf and what overflows.
    if (!(text >> x[0] >> x[1] >> x[2] >> n[0] >> n[1] >> n[2]) || !(text >> std::ws).eof())
      refuse("a sensor is six finite numbers, x y z nx ny nz");
    if (n.isZero(0)) refuse("the direction nx ny nz of a sensor is not 0 0 0");
    n.stableNormalize();
    sensors.push_back(sensor);
  }
  if (in.bad()) throw IoError(fmt::format("{}: cannot be read to its end", file.string()));
  if (sensors.empty())
    throw InputError(
        fmt::format("{}: holds no sensor; give a line 'x y z nx ny nz' for each", file.string()));
  return sensors;
}

void write_irradiance(const std::filesystem::path& file, const std::vector<Sensor>& sensors,
                      const ProbeResult& result) {
  const auto count = static_cast<Eigen::Index>(sensors.size());
  if (result.irradiance.rows() != count || result.standard_error.rows() != count)
    throw InputError(fmt::format("{} sensors, but irradiance at {} and errors of {}", count,
                                 result.irradiance.rows(), result.standard_error.rows()));
  write_atomically(file, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << "x,y,z,nx,ny,nz";
    for (Eigen::Index b = 0; b < result.irradiance.cols(); ++b) out << fmt::format(",irradiance_{}", b);
    for (Eigen::Index b = 0; b < result.standard_error.cols(); ++b)
      out << fmt::format(",standard_error_{}", b);
    out << '\n';
    for (Eigen::Index s = 0; s < count; ++s) {
      const auto& [x, n] = sensors[s];
      out << fmt::format("{},{},{},{},{},{}", x.x(), x.y(), x.z(), n.x(), n.y(), n.z());
      for (const double value : result.irradiance.row(s)) out << fmt::format(",{:.9g}", value);
      for (const double value : result.standard_error.row(s)) out << fmt::format(",{:.9g}", value);
      out << '\n';
    }
    out.close();
    if (!out) throw IoError("the disk is full or the file cannot be opened");
  });
}

}  // namespace radiosity
