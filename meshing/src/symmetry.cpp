// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/meshing/symmetry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// What a face, or the whole cell, reaches over along a direction.
struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

void require_planes(const Symmetry& symmetry) {
  const auto& planes = symmetry.planes;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (planes[k].axis < 0 || planes[k].axis > 2 || !std::isfinite(planes[k].offset))
      throw InputError(fmt::format("symmetry: plane {} is not x, y or z at a finite place", k));
    for (std::size_t m = 0; m < k; ++m) {
      if (planes[m].axis != planes[k].axis) continue;
      Vec3 period = Vec3::Zero();
      period[planes[k].axis] = 2 * std::abs(planes[k].offset - planes[m].offset);
      throw InputError(
          period.isZero(0)
              ? fmt::format("symmetry: the plane {} is given twice", text_of(planes[k]))
              : fmt::format("symmetry: the planes {} and {} are parallel, which makes images without end; "
                            "give one of them, and period = [{}, {}, {}], twice their distance",
                            text_of(planes[m]), text_of(planes[k]), period.x(), period.y(), period.z()));
    }
  }
  const Vec3& p = symmetry.period;
  if (!p.allFinite()) throw InputError("symmetry: the period is not finite");
  if (symmetry.steps < 0)
    throw InputError(fmt::format("symmetry: {} steps of the period are less than 0", symmetry.steps));
  for (const MirrorPlane& plane : planes)
    if (p[plane.axis] != 0 && (p.array() != 0).count() > 1)
      throw InputError(
          fmt::format("symmetry: the period {} {} {} is neither along nor across the plane {}, whose "
                      "mirror would turn it",
                      p.x(), p.y(), p.z(), text_of(plane)));
}

const MirrorPlane* plane_along(const Symmetry& symmetry) {
  for (const MirrorPlane& plane : symmetry.planes)
    if (symmetry.period[plane.axis] != 0) return &plane;
  return nullptr;
}

}  // namespace

Vec3 SymmetryImage::of_point(Vec3 x, double touch) const {
  for (const auto& [axis, offset] : planes)
    if (std::abs(x[axis] - offset) > touch) x[axis] = 2 * offset - x[axis];
  return x + shift;
}

Vec3 SymmetryImage::of_direction(Vec3 d) const {
  for (const auto& [axis, offset] : planes) d[axis] = -d[axis];
  return d;
}

std::vector<SymmetryImage> images(const Symmetry& symmetry) {
  const Index steps = symmetry.periodic() ? symmetry.steps : 0;
  std::vector<SymmetryImage> out;
  for (Index step = 0; step <= steps; ++step)
    for (const int way : {1, -1}) {
      if (step == 0 && way < 0) continue;
      for (unsigned chosen = 0; chosen < 1U << symmetry.planes.size(); ++chosen) {
        SymmetryImage image;
        for (std::size_t k = 0; k < symmetry.planes.size(); ++k)
          if ((chosen >> k & 1U) != 0) image.planes.push_back(symmetry.planes[k]);
        image.shift = way * static_cast<double>(step) * symmetry.period;
        if (step > 0 || chosen != 0) out.push_back(std::move(image));
      }
    }
  return out;
}

bool goes_on(const Symmetry& symmetry, const Vec3& a, const Vec3& b, const Vec3& lower, const Vec3& upper,
             double touch) {
  const auto in = [&](const Vec3& normal, double offset) {
    return std::abs(normal.dot(a) - offset) <= touch && std::abs(normal.dot(b) - offset) <= touch;
  };
  for (const MirrorPlane& plane : symmetry.planes)
    if (in(Vec3::Unit(plane.axis), plane.offset)) return true;
  if (!symmetry.periodic()) return false;
  const double length = symmetry.period.norm();
  const Vec3 along = symmetry.period / length;
  if (const MirrorPlane* const plane = plane_along(symmetry)) {
    const double middle = along[plane->axis] * plane->offset;
    return in(along, middle - length / 2) || in(along, middle + length / 2);
  }
  Vec3 lowest;
  for (int k = 0; k < 3; ++k) lowest[k] = along[k] > 0 ? lower[k] : upper[k];
  return in(along, along.dot(lowest)) || in(along, along.dot(lowest) + length);
}

Index steps_of_period(const Symmetry& symmetry, const Vec3& lower, const Vec3& upper) {
  const double length = symmetry.period.norm();
  const Vec3 along = symmetry.period / length;
  Vec3 size = upper - lower;
  for (const MirrorPlane& plane : symmetry.planes)
    size[plane.axis] =
        2 * std::max(std::abs(upper[plane.axis] - plane.offset), std::abs(lower[plane.axis] - plane.offset));
  // The box's shadow along the period.
  const Vec3 sides(size.y() * size.z(), size.z() * size.x(), size.x() * size.y());
  const double area = sides.dot(along.cwiseAbs());
  const double diagonal = std::sqrt(std::max(0.0, size.squaredNorm() - std::pow(along.dot(size), 2)));
  const double reach = std::cbrt(2 * area * diagonal / (std::numbers::pi * kBeyond));
  constexpr double kMost = 1e6;
  return static_cast<Index>(std::clamp(std::ceil(reach / length), 1.0, kMost));
}

void settle(Symmetry& symmetry, const std::vector<Vec3>& vertices, std::span<const Index> corners,
            std::span<const Index> face_start, double touch) {
  if (symmetry.none()) return;
  require_planes(symmetry);
  const auto extent_of = [&](std::size_t face, const auto& height) {
    Extent out;
    for (Index c = face_start[face]; c < face_start[face + 1]; ++c) out.add(height(vertices[corners[c]]));
    return out;
  };
  const auto faces = face_start.size() - 1;
  for (const MirrorPlane& plane : symmetry.planes) {
    const std::string name = text_of(plane);
    std::size_t first = 0;
    int first_side = 0;
    for (std::size_t f = 0; f < faces; ++f) {
      const Extent x = extent_of(f, [&](const Vec3& v) { return v[plane.axis]; });
      const bool below = x.low < plane.offset - touch;
      const bool above = x.high > plane.offset + touch;
      if (below && above)
        throw InputError(
            fmt::format("symmetry: face {} crosses the plane {}: it reaches from {} to {} m; all faces must "
                        "lie on one side, as the other side is the image",
                        f, name, x.low, x.high));
      if (!below && !above)
        throw InputError(
            fmt::format("symmetry: face {} lies in the plane {}, where it would be a wall between the scene "
                        "and its image; leave it out",
                        f, name));
      const int side = below ? -1 : 1;
      if (first_side == 0) {
        first = f;
        first_side = side;
      } else if (side != first_side) {
        throw InputError(
            fmt::format("symmetry: face {} reaches from {} to {} m and face {} lies on the other side of the "
                        "plane {}; all faces must lie on one side, as the other side is the image",
                        f, x.low, x.high, first, name));
      }
    }
  }
  if (!symmetry.periodic()) return;
  const double length = symmetry.period.norm();
  const Vec3 along = symmetry.period / length;
  const MirrorPlane* const mirror = plane_along(symmetry);
  const auto height = [&](const Vec3& x) { return along.dot(x); };
  Extent all;
  if (mirror != nullptr) all.add(along[mirror->axis] * mirror->offset);
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (std::size_t f = 0; f < faces; ++f)
    for (Index c = face_start[f]; c < face_start[f + 1]; ++c) {
      const Vec3& x = vertices[corners[c]];
      lower = lower.cwiseMin(x);
      upper = upper.cwiseMax(x);
      all.add(height(x));
    }
  const double longest = mirror == nullptr ? length : length / 2;
  if (all.high - all.low > longest + touch)
    throw InputError(
        fmt::format("symmetry: along the period the scene reaches from {} to {} m, {} m{}, and would overlap "
                    "its next image: at most {} m are possible{}",
                    all.low, all.high, all.high - all.low,
                    mirror == nullptr ? "" : fmt::format(" from the plane {}", text_of(*mirror)), longest,
                    mirror == nullptr ? "" : ", half the period"));
  if (symmetry.steps == 0) symmetry.steps = steps_of_period(symmetry, lower, upper);
}

std::string text_of(const MirrorPlane& plane) {
  return fmt::format("{} = {}", "xyz"[plane.axis], plane.offset);
}

MirrorPlane plane_of(const std::string& text) {
  std::string packed;
  std::ranges::copy_if(text, std::back_inserter(packed), [](char c) { return c != ' ' && c != '\t'; });
  MirrorPlane plane;
  const char* const end = packed.data() + packed.size();
  if (packed.size() > 2 && packed[0] >= 'x' && packed[0] <= 'z' && packed[1] == '=') {
    plane.axis = packed[0] - 'x';
    const auto [last, error] = std::from_chars(packed.data() + 2, end, plane.offset);
    if (error == std::errc() && last == end && std::isfinite(plane.offset)) return plane;
  }
  throw InputError(fmt::format("\"{}\" is no plane such as \"x = 0\", \"y = 1.5\" or \"z = -2\"", text));
}

std::string text_of(const Symmetry& symmetry) {
  std::vector<std::string> parts;
  for (const MirrorPlane& plane : symmetry.planes) parts.push_back(text_of(plane));
  std::string text = parts.empty() ? "" : fmt::format("mirrored in {}", fmt::join(parts, ", "));
  if (symmetry.periodic())
    text += fmt::format("{}period {:.6g} {:.6g} {:.6g} m, {} {} either way", text.empty() ? "" : "; ",
                        symmetry.period.x(), symmetry.period.y(), symmetry.period.z(), symmetry.steps,
                        symmetry.steps == 1 ? "step" : "steps");
  const auto count = images(symmetry).size();
  return text + fmt::format(": {} {}", count, count == 1 ? "image" : "images");
}

}  // namespace radiosity
