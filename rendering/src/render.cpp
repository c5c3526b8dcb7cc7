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

namespace radiosity {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The weights of a convex quad's corners at x: inverse of x = (1−u)(1−v) c0 + u(1−v) c1 + uv c2 + (1−u)v c3.
/// With h = x − c0, e = c1 − c0, f = c3 − c0, g = c0 − c1 + c2 − c3, v is a root of
///   (g×f) v² + (e×f + h×g) v + h×e = 0.
std::array<double, 4> bilinear_weights(const std::array<Eigen::Vector2d, 4>& c, const Eigen::Vector2d& x) {
  const Eigen::Vector2d h = x - c[0], e = c[1] - c[0], f = c[3] - c[0], g = c[0] - c[1] + c[2] - c[3];
  const double k2 = cross(g, f), k1 = cross(e, f) + cross(h, g), k0 = cross(h, e);
  // Roots q/k2 and k0/q: neither cancels, and k2 = 0 (parallel edges) needs no case of its own.
  const double q = -0.5 * (k1 + std::copysign(std::sqrt(std::max(k1 * k1 - 4 * k0 * k2, 0.0)), k1));
  const auto outside = [](double t) { return std::isfinite(t) ? std::max({-t, t - 1, 0.0}) : HUGE_VAL; };
  const double v1 = k0 / q, v2 = q / k2;
  const double v = std::clamp(outside(v1) <= outside(v2) ? v1 : v2, 0.0, 1.0);
  const Eigen::Vector2d along = e + v * g;
  const double length = along.squaredNorm();
  const double u = length > 0 ? std::clamp((h - v * f).dot(along) / length, 0.0, 1.0) : 0.0;
  return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
}

/// Interpolates vertex values at a point of a patch.
class Interpolation {
 public:
  Interpolation(const PatchMesh& mesh, const BandArray& values) : mesh_(mesh), values_(values) {}

  BandValues at(Index patch, const Vec3& x) const {
    // Dropping the axis along which the normal is longest keeps the shape and its interpolation weights.
    Eigen::Index axis = 0;
    mesh_.normal(patch).cwiseAbs().maxCoeff(&axis);
    const auto flat = [axis](const Vec3& p) { return Eigen::Vector2d(p[(axis + 1) % 3], p[(axis + 2) % 3]); };

    const auto corners = mesh_.corners(patch);
    if (corners.size() == 4) {
      std::array<Eigen::Vector2d, 4> c;
      for (std::size_t k = 0; k < 4; ++k) c[k] = flat(mesh_.vertex(corners[k]));
      const double sign = mesh_.normal(patch)[axis];
      bool convex = true;
      for (std::size_t k = 0; k < 4; ++k)
        convex = convex && sign * cross(c[(k + 1) % 4] - c[k], c[(k + 2) % 4] - c[(k + 1) % 4]) > 0;
      if (convex) return sum(corners, bilinear_weights(c, flat(x)));
    }
    // The triangle that holds x: the one whose smallest barycentric coordinate is the largest.
    double best = -HUGE_VAL;
    std::array<double, 3> best_weights{};
    std::span<const Index> best_triangle;
    for (const auto& triangle : mesh_.triangles(patch)) {
      const auto a = flat(mesh_.vertex(triangle[0])), b = flat(mesh_.vertex(triangle[1])),
                 c = flat(mesh_.vertex(triangle[2])), p = flat(x);
      const double whole = cross(b - a, c - a);
      if (whole == 0) continue;
      const std::array<double, 3> weights{cross(b - p, c - p) / whole, cross(c - p, a - p) / whole,
                                          cross(a - p, b - p) / whole};
      const double least = *std::min_element(weights.begin(), weights.end());
      if (least > best) {
        best = least;
        best_weights = weights;
        best_triangle = triangle;
      }
    }
    return sum(best_triangle, best_weights);
  }

 private:
  BandValues sum(std::span<const Index> vertices, std::span<const double> weights) const {
    BandValues result = BandValues::Zero(values_.cols());
    for (std::size_t k = 0; k < vertices.size(); ++k)
      result += weights[k] * values_.row(vertices[k]).transpose();
    return result;
  }

  const PatchMesh& mesh_;
  const BandArray& values_;
};

/// Rays through the points of an image plane at distance 1.
class Pinhole {
 public:
  Pinhole(const Camera& camera, int width, int height) : position_(camera.position) {
    if (!(camera.vertical_fov_deg > 0 && camera.vertical_fov_deg < 180))
      throw InputError(
          fmt::format("camera: vertical_fov_deg {} is outside (0, 180)", camera.vertical_fov_deg));
    forward_ = (camera.target - camera.position).normalized();
    const Vec3 right = forward_.cross(camera.up.normalized());
    // Also false for what is not a number: position equal to target, or up = 0.
    if (!(right.norm() > 1e-9))
      throw InputError(
          "camera: position, target and up must span a plane: up is parallel to the line of sight");
    const double half_height = std::tan(camera.vertical_fov_deg * std::numbers::pi / 360);
    up_ = right.normalized().cross(forward_) * half_height;
    right_ = right.normalized() * half_height * width / height;
  }

  const Vec3& position() const { return position_; }
  /// u from the left and v from the top, both in [0, 1].
  Vec3 direction(double u, double v) const { return forward_ + (2 * u - 1) * right_ + (1 - 2 * v) * up_; }

 private:
  Vec3 position_, forward_, right_, up_;
};

/// The image of what `ray_colour` sees in each direction, `samples`² rays a pixel; encoded values are averaged.
template <class RayColour>
Image trace(const Pinhole& pinhole, int width, int height, int samples, const RayColour& ray_colour) {
  if (width < 1 || height < 1 || samples < 1)
    throw InputError(fmt::format("image of {} x {} pixels with {} x {} samples: all must be at least 1",
                                 width, height, samples, samples));
  Image image{width, height,
              std::vector<Rgb8>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      Rgb sum = Rgb::Zero();
      for (int sy = 0; sy < samples; ++sy)
        for (int sx = 0; sx < samples; ++sx)
          sum += ray_colour(
              pinhole.direction((x + (sx + 0.5) / samples) / width, (y + (sy + 0.5) / samples) / height));
      image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)] = bytes(sum / (samples * samples));
    }
  });
  return image;
}

}  // namespace

Image render(const Visibility& visibility, const BandArray& vertex_radiosity, const Camera& camera, int width,
             int height, double exposure, int samples) {
  const PatchMesh& mesh = visibility.mesh();
  if (vertex_radiosity.rows() != mesh.vertex_count())
    throw InputError(fmt::format("vertex radiosity has {} rows, but the mesh has {} vertices",
                                 vertex_radiosity.rows(), mesh.vertex_count()));
  const Pinhole pinhole(camera, width, height);
  const Interpolation interpolation(mesh, vertex_radiosity);
  return trace(pinhole, width, height, samples, [&](const Vec3& direction) -> Rgb {
    const auto hit = visibility.first_hit(pinhole.position(), direction);
    if (hit.patch < 0 || !hit.front) return Rgb::Zero();
    // In double precision: first_hit's distance is single.
    const Vec3& normal = mesh.normal(hit.patch);
    const double distance = normal.dot(mesh.centroid(hit.patch) - pinhole.position()) / normal.dot(direction);
    return display(interpolation.at(hit.patch, pinhole.position() + distance * direction), exposure);
  });
}

Image paint(const Visibility& visibility, const std::vector<Rgb8>& patch_colours, const Camera& camera,
            int width, int height, int samples) {
  if (patch_colours.size() != static_cast<std::size_t>(visibility.mesh().patch_count()))
    throw InputError(
        fmt::format("{} colours for {} patches", patch_colours.size(), visibility.mesh().patch_count()));
  const Pinhole pinhole(camera, width, height);
  return trace(pinhole, width, height, samples, [&](const Vec3& direction) -> Rgb {
    const auto hit = visibility.first_hit(pinhole.position(), direction);
    if (hit.patch < 0 || !hit.front) return Rgb::Ones();
    const auto& colour = patch_colours[static_cast<std::size_t>(hit.patch)];
    return Rgb(colour[0], colour[1], colour[2]) / 255;
  });
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
