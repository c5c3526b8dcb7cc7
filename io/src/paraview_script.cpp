// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/paraview_script.hpp"

#include <fmt/format.h>

#include <string>

#include "radiosity/io/output.hpp"

namespace radiosity {
namespace {

// A path as a Python expression: names need not be UTF-8.
std::string path_literal(const std::filesystem::path& path) {
  std::string bytes;
  for (const char c : std::filesystem::absolute(path).lexically_normal().string()) {
    const bool plain = c >= ' ' && c <= '~' && c != '"' && c != '\\';
    bytes += plain ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return fmt::format("os.fsdecode(b\"{}\")", bytes);
}

std::string list(const Vec3& x) {
  return fmt::format("[{}, {}, {}]", x.x(), x.y(), x.z());
}

constexpr const char* kScript =
    R"(# Shows a solution of radiosity in ParaView: paraview --script=THIS_FILE, or Tools > Python Shell > Run Script.
# pvpython THIS_FILE PICTURE.png saves the picture.
import os
import sys

from paraview.simple import *

solution = {solution}

reader = {reader}(FileName=[solution])
view = GetActiveViewOrCreate("RenderView")
display = Show(reader, view)

# The array holds colours, not numbers to be mapped.
ColorBy(display, ("POINTS", "display_rgb"))
display.MapScalars = 0
# The light is in the data already.
display.Ambient = 1
display.Diffuse = 0
display.Specular = 0
# A closed room is looked into through its walls.
display.BackfaceRepresentation = "Cull Backface"

# The first picture of a view brings a camera of its own.
Render(view)
view.CameraPosition = {position}
view.CameraFocalPoint = {target}
view.CameraViewUp = {up}
view.CameraViewAngle = {angle}
Render(view)
if sys.argv[-1].endswith(".png"):
    SaveScreenshot(sys.argv[-1], view, ImageResolution=[800, 600])
)";

}  // namespace

void write_paraview_script(const std::filesystem::path& script, const std::filesystem::path& solution,
                           const Camera& camera) {
  write_file(script,
             fmt::format(fmt::runtime(kScript), fmt::arg("solution", path_literal(solution)),
                         fmt::arg("reader", solution.extension() == ".pvtp" ? "XMLPartitionedPolydataReader"
                                                                            : "XMLPolyDataReader"),
                         fmt::arg("position", list(camera.position)), fmt::arg("target", list(camera.target)),
                         fmt::arg("up", list(camera.up)), fmt::arg("angle", camera.vertical_fov_deg)));
}

}  // namespace radiosity
