// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/annotate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "display.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "text_raster.hpp"

namespace radiosity {
namespace {

using Point = Eigen::Vector2d;
constexpr Rgb8 kBlack{0, 0, 0}, kWhite{255, 255, 255};

int font_size(int image_height) {
  return std::clamp(image_height / 40, 9, 64);
}

/// Text and lines are legible on this colour.
Rgb8 legible_on(const Rgb8& colour) {
  return 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2] > 110 ? kBlack : kWhite;
}

Rgb8& pixel(Image& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(x)];
}

void blend(Rgb8& under, const Rgb8& colour, float share) {
  for (std::size_t k = 0; k < 3; ++k)
    under[k] = static_cast<std::uint8_t>(
        std::lround((1 - share) * static_cast<float>(under[k]) + share * static_cast<float>(colour[k])));
}

void fill(Image& image, int left, int top, int width, int height, const Rgb8& colour) {
  for (int y = std::max(0, top); y < std::min(image.height, top + height); ++y)
    for (int x = std::max(0, left); x < std::min(image.width, left + width); ++x) pixel(image, x, y) = colour;
}

void write(Image& image, const TextRaster& text, int left, int top, const Rgb8& colour) {
  for (int y = 0; y < text.height; ++y)
    for (int x = 0; x < text.width; ++x)
      if (left + x >= 0 && left + x < image.width && top + y >= 0 && top + y < image.height)
        blend(pixel(image, left + x, top + y), colour,
              text.coverage[static_cast<std::size_t>(y * text.width + x)]);
}

/// "0.25", "1500", "2e6"
std::string number(double value) {
  std::string text = fmt::format("{:.6g}", value);
  if (const auto e = text.find('e'); e != std::string::npos) {
    std::size_t digits = e + 2;
    while (text[digits] == '0' && digits + 1 < text.size()) text.erase(digits, 1);
    if (text[e + 1] == '+') text.erase(e + 1, 1);
  }
  return text;
}

/// Which pixels show the same surface: patches joined by vertices that they share, or in one plane and of one material.
class Surfaces {
 public:
  explicit Surfaces(const PatchMesh& mesh)
      : mesh_(mesh),
        distance_(tolerance::kContact * mesh.diagonal()),
        joined_(static_cast<std::size_t>(mesh.patch_count())) {
    for (Index v = 0; v < mesh.vertex_count(); ++v)
      for (const Index i : mesh.vertex_patches(v)) joined_.unite(mesh.vertex_patches(v)[0], i);
  }

  bool same(Index a, Index b) {
    if (a == b) return true;
    if (a < 0 || b < 0) return false;
    if (joined_.root(a) == joined_.root(b)) return true;
    const Vec3 between = mesh_.centroid(b) - mesh_.centroid(a);
    return mesh_.material(a) == mesh_.material(b) && mesh_.normal(a).dot(mesh_.normal(b)) > 1 - 1e-9 &&
           std::abs(mesh_.normal(a).dot(between)) < distance_;
  }

 private:
  const PatchMesh& mesh_;
  double distance_;  // m
  DisjointSets joined_;
};

struct Segment {
  Point from, to;
};

/// Where a field crosses a level within triangles of pixels.
class Contours {
 public:
  Contours(const FieldImage& seen, const PatchMesh& mesh) : seen_(seen), surfaces_(mesh) {
    for (int y = 0; y + 1 < seen.height; ++y)
      for (int x = 0; x + 1 < seen.width; ++x)
        if (const Index a = patch(x, y); surfaces_.same(a, patch(x + 1, y)) &&
                                         surfaces_.same(a, patch(x + 1, y + 1)) &&
                                         surfaces_.same(a, patch(x, y + 1)) && a >= 0)
          squares_.push_back({x, y});
  }

  std::vector<Segment> at(double level) const {
    std::vector<Segment> segments;
    for (const auto& [x, y] : squares_) {
      const std::array<std::pair<int, int>, 4> corner{{{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}}};
      for (const auto& triangle : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
        std::array<Point, 3> crossing;
        std::size_t count = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const auto& [ax, ay] = corner[static_cast<std::size_t>(triangle[k])];
          const auto& [bx, by] = corner[static_cast<std::size_t>(triangle[(k + 1) % 3])];
          const double a = value(ax, ay), b = value(bx, by);
          if ((a < level) == (b < level)) continue;
          const double t = (level - a) / (b - a);
          crossing[count++] = Point(ax + t * (bx - ax) + 0.5, ay + t * (by - ay) + 0.5);
        }
        if (count == 2) segments.push_back({crossing[0], crossing[1]});
      }
    }
    return segments;
  }

  /// The least and the largest value in a box, where it lies within the image and shows one surface.
  std::optional<std::pair<double, double>> values(int left, int top, int width, int height) {
    if (left < 0 || top < 0 || left + width > seen_.width || top + height > seen_.height) return {};
    const Index first = patch(left, top);
    if (first < 0) return {};
    std::pair range(value(left, top), value(left, top));
    for (int y = top; y < top + height; ++y)
      for (int x = left; x < left + width; ++x) {
        if (!surfaces_.same(first, patch(x, y))) return {};
        range = {std::min(range.first, value(x, y)), std::max(range.second, value(x, y))};
      }
    return range;
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(seen_.width) + static_cast<std::size_t>(x);
  }
  Index patch(int x, int y) const { return seen_.patch[index(x, y)]; }
  double value(int x, int y) const { return seen_.values[static_cast<Eigen::Index>(index(x, y))]; }

  const FieldImage& seen_;
  Surfaces surfaces_;
  std::vector<std::pair<int, int>> squares_;  // that lie in one surface
};

/// Lines of a width, whose ends overlap without being darker there.
void draw(Image& image, const std::vector<Segment>& segments, double width, const Rgb8& colour) {
  std::vector<float> coverage(image.pixels.size());
  for (const auto& [from, to] : segments) {
    const Point along = to - from;
    const double reach = width / 2 + 1;
    const auto first = [&](double a, double b) {
      return std::max(0, static_cast<int>(std::min(a, b) - reach));
    };
    const auto last = [&](double a, double b, int size) {
      return std::min(size - 1, static_cast<int>(std::max(a, b) + reach));
    };
    for (int y = first(from.y(), to.y()); y <= last(from.y(), to.y(), image.height); ++y)
      for (int x = first(from.x(), to.x()); x <= last(from.x(), to.x(), image.width); ++x) {
        const Point to_pixel = Point(x + 0.5, y + 0.5) - from;
        const double length = along.squaredNorm();
        const double t = length > 0 ? std::clamp(to_pixel.dot(along) / length, 0.0, 1.0) : 0.0;
        const double distance = (to_pixel - t * along).norm();
        float& covered = coverage[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                                  static_cast<std::size_t>(x)];
        covered = std::max(covered, static_cast<float>(std::clamp(width / 2 + 0.5 - distance, 0.0, 1.0)));
      }
  }
  for (std::size_t k = 0; k < coverage.size(); ++k)
    if (coverage[k] > 0) blend(image.pixels[k], colour, coverage[k]);
}

struct Box {
  int left, top, width, height;
  bool overlaps(const Box& other) const {
    return left < other.left + other.width && other.left < left + width && top < other.top + other.height &&
           other.top < top + height;
  }
};

}  // namespace

void draw_isolines(Image& image, const FieldImage& seen, const PatchMesh& mesh, const ColourScale& scale,
                   std::span<const double> levels) {
  if (image.width != seen.width || image.height != seen.height)
    throw InputError(fmt::format("isolines of {} x {} pixels in an image of {} x {}", seen.width, seen.height,
                                 image.width, image.height));
  Contours contours(seen, mesh);
  const int size = font_size(image.height);
  std::vector<std::vector<Segment>> lines;
  for (const double level : levels) {
    lines.push_back(contours.at(level));
    draw(image, lines.back(), std::max(1.0, size / 12.0), legible_on(viridis(scale.position(level))));
  }
  std::vector<Box> taken;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const double level = levels[k];
    const Rgb8 background = viridis(scale.position(level));
    const TextRaster text = raster(number(level), size);
    const int margin = std::max(1, size / 8), apart = 8 * size;
    std::vector<Box> own;  // of this level, with the room that another must leave
    for (const auto& [from, to] : lines[k]) {
      const Point middle = (from + to) / 2;
      const Box box{static_cast<int>(middle.x()) - text.width / 2 - margin,
                    static_cast<int>(middle.y()) - text.height / 2 - margin, text.width + 2 * margin,
                    text.height + 2 * margin};
      const auto hits = [&](const Box& other) { return other.overlaps(box); };
      if (std::any_of(taken.begin(), taken.end(), hits) || std::any_of(own.begin(), own.end(), hits))
        continue;
      const auto range = contours.values(box.left, box.top, box.width, box.height);
      if (!range) continue;
      const auto between = [&](double other) {
        return other != level && range->first <= other && other <= range->second;
      };
      if (std::any_of(levels.begin(), levels.end(), between)) continue;
      fill(image, box.left, box.top, box.width, box.height, background);
      write(image, text, box.left + margin, box.top + margin, legible_on(background));
      taken.push_back(box);
      own.push_back({box.left - apart, box.top - apart, box.width + 2 * apart, box.height + 2 * apart});
    }
  }
}

Image with_legend(const Image& image, const Field& field, const ColourScale& scale, Beyond beyond) {
  validate(scale);
  const int size = font_size(image.height), gap = size / 2;
  std::vector<TextRaster> title{raster(field.name, size)};
  if (!field.of.empty()) title.push_back(raster(field.of, size));
  if (!field.unit.empty() && field.unit != "1") {
    std::string unit = field.unit;
    if (const auto square = unit.find("m2"); square != std::string::npos) unit.replace(square, 2, "m²");
    title.push_back(raster(unit, size));
  }
  const int line = title[0].height + gap / 2;
  const int top = size + static_cast<int>(title.size()) * line + gap;
  const int height = std::max(image.height, top + 6 * line + size);
  const int bar_width = 2 * size, bar_height = height - top - size;
  const int beyond_height = size;  // of the boxes at the ends of the bar
  const int upper = top + (beyond.above ? beyond_height : 0),
            length = bar_height - (beyond.above ? beyond_height : 0) - (beyond.below ? beyond_height : 0);

  struct Mark {
    TextRaster text;
    int y;
  };
  std::vector<Mark> marks;
  const auto at = [&](double value) {
    return upper + static_cast<int>(std::lround((1 - scale.position(value)) * (length - 1)));
  };
  if (beyond.above) marks.push_back({raster("> " + number(scale.most), size), top + beyond_height / 2});
  if (beyond.below)
    marks.push_back({raster("< " + number(scale.least), size), top + bar_height - 1 - beyond_height / 2});
  for (const double value : round_values(scale, std::max(2, length / (3 * line)))) {
    const int y = at(value);
    if (std::none_of(marks.begin(), marks.end(),
                     [&](const Mark& mark) { return std::abs(mark.y - y) < line; }))
      marks.push_back({raster(number(value), size), y});
  }

  int width = 0;
  for (const TextRaster& text : title) width = std::max(width, text.width);
  for (const Mark& mark : marks) width = std::max(width, bar_width + gap + gap + mark.text.width);
  const int left = image.width + size;
  Image out{left + width + size, height, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), kWhite);
  for (int y = 0; y < image.height; ++y)
    std::copy_n(&image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width)],
                image.width, &pixel(out, 0, y));

  for (int k = 0; k < static_cast<int>(title.size()); ++k)
    write(out, title[static_cast<std::size_t>(k)], left, size + k * line, kBlack);
  fill(out, left, top, bar_width, bar_height, kBlack);  // its frame
  for (int y = 0; y < length; ++y) {
    const double t = length > 1 ? 1 - static_cast<double>(y) / (length - 1) : 0.5;
    fill(out, left + 1, upper + y, bar_width - 2, 1, viridis(scale.most > scale.least ? t : 0.5));
  }
  if (beyond.above) fill(out, left + 1, top + 1, bar_width - 2, beyond_height - 2, viridis(1));
  if (beyond.below)
    fill(out, left + 1, top + bar_height - beyond_height + 1, bar_width - 2, beyond_height - 2, viridis(0));
  for (const Mark& mark : marks) {
    fill(out, left + bar_width, mark.y, gap, 1, kBlack);
    write(out, mark.text, left + bar_width + 2 * gap, mark.y - mark.text.height / 2, kBlack);
  }
  return out;
}

}  // namespace radiosity
