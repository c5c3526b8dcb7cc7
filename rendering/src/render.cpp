// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/render.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "display.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/rendering/pinhole.hpp"

namespace radiosity {
Image paint(const Visibility& visibility, const std::vector<Rgb8>& patch_colours, const Camera& camera,
            int width, int height, int samples) {
  if (patch_colours.size() != static_cast<std::size_t>(visibility.mesh().patch_count()))
    throw InputError(
        fmt::format("{} colours for {} patches", patch_colours.size(), visibility.mesh().patch_count()));
  if (width < 1 || height < 1 || samples < 1)
    throw InputError(fmt::format("image of {} x {} pixels with {} x {} samples: all must be at least 1",
                                 width, height, samples, samples));
  const Pinhole pinhole(camera, width, height);
  const auto colour = [&](const Vec3& direction) -> Rgb {
    const auto hit = visibility.first_hit(pinhole.position(), direction);
    if (hit.patch < 0 || !hit.front) return Rgb::Ones();
    const auto& bytes = patch_colours[hit.patch];
    return Rgb(bytes[0], bytes[1], bytes[2]) / 255;
  };
  Image image{width, height,
              std::vector<Rgb8>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      Rgb sum = Rgb::Zero();
      for (int sy = 0; sy < samples; ++sy)
        for (int sx = 0; sx < samples; ++sx)
          sum += colour(
              pinhole.direction((x + (sx + 0.5) / samples) / width, (y + (sy + 0.5) / samples) / height));
      image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)] = bytes(sum / (samples * samples));
    }
  });
  return image;
}

Camera automatic_camera(const PatchMesh& mesh) {
  const Vec3 centre = (mesh.lower() + mesh.upper()) / 2, half = (mesh.upper() - mesh.lower()) / 2;
  // Σ A_i n_i is 0 for a closed surface; where a wall is missing it points out through the gap. The volume
  // ⅓ Σ A_i n_i·(c_i − centre) is negative where fronts look inwards: a room.
  Vec3 opening = Vec3::Zero();
  double volume = 0, area = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const Vec3 vector = mesh.area(i) * mesh.normal(i);
    opening += vector;
    volume += vector.dot(mesh.centroid(i) - centre) / 3;
    area += mesh.area(i);
  }
  struct View {
    Vec3 from, up;
  };
  const std::array<View, 6> views{{{Vec3::UnitZ(), Vec3::UnitY()},
                                   {-Vec3::UnitZ(), Vec3::UnitY()},
                                   {Vec3::UnitX(), Vec3::UnitY()},
                                   {-Vec3::UnitX(), Vec3::UnitY()},
                                   {Vec3::UnitY(), -Vec3::UnitZ()},
                                   {-Vec3::UnitY(), Vec3::UnitZ()}}};
  // An opening counts when it shows more than a twentieth of all surfaces; horizontal views come first.
  const double least = area / 20;
  const View* best = nullptr;
  for (std::size_t k = 0; k < views.size(); ++k) {
    if (k == 4 && best) break;
    const double shown = opening.dot(views[k].from);
    if (shown > least && (!best || shown > opening.dot(best->from))) best = &views[k];
  }
  Camera camera;
  camera.target = centre;
  if (!best && volume < 0) {
    // A closed room: from one end of its longer side, at mid-height, looking across.
    const Vec3 from = half.x() > half.z() ? Vec3(Vec3::UnitX()) : Vec3(Vec3::UnitZ());
    camera.position = centre + 0.95 * half.dot(from) * from;
    camera.vertical_fov_deg = 75;
    return camera;
  }
  const View& view = best ? *best : views[0];
  const Vec3 side = view.from.cross(view.up);
  const double half_width = std::max(half.dot(side.cwiseAbs()), half.dot(view.up.cwiseAbs()));
  // The near face of the bounding box fills a square image but for a margin of 5 %.
  const double distance = 1.05 * half_width / std::tan(camera.vertical_fov_deg * std::numbers::pi / 360);
  camera.position = centre + (half.dot(view.from.cwiseAbs()) + distance) * view.from;
  camera.up = view.up;
  return camera;
}

}  // namespace radiosity
