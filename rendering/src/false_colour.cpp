// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/false_colour.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "display.hpp"
#include "interpolation.hpp"
#include "pipelines.hpp"
#include "radiosity/meshing/error.hpp"
#include "visible.hpp"

namespace radiosity {
namespace {

/// Every fifth of the 256 colours of the published table of viridis, sRGB as RRGGBB; between them it is linear within 1/255.
constexpr std::string_view kViridis =
    "44015446085c471063481769481d6f482475472a7a46307e453781433d844142873f48893d4e8a3a538b38598c355e8d"
    "33638d31688e2e6d8e2c718e2a768e297b8e27808e25848e23898e218e8d20928c1f978b1e9c891fa18821a58524aa83"
    "28ae802eb37c35b7793dbc7446c06f50c46a5ac86465cb5e70cf577cd25089d54895d840a2da37b0dd2fbddf26cae11f"
    "d8e219e5e419f1e51dfde725";
constexpr std::size_t kStops = kViridis.size() / 6;

constexpr int hexadecimal(char c) {
  return c <= '9' ? c - '0' : c - 'a' + 10;
}

double channel(std::size_t stop, std::size_t k) {
  const std::size_t at = 6 * stop + 2 * k;
  return (16 * hexadecimal(kViridis[at]) + hexadecimal(kViridis[at + 1])) / 255.0;
}

Rgb encoded(double t) {
  const double place = std::clamp(t, 0.0, 1.0) * static_cast<double>(kStops - 1);
  const auto stop = std::min(static_cast<std::size_t>(place), kStops - 2);
  const double share = place - static_cast<double>(stop);
  Rgb colour;
  for (std::size_t k = 0; k < 3; ++k)
    colour[static_cast<Eigen::Index>(k)] = (1 - share) * channel(stop, k) + share * channel(stop + 1, k);
  return colour;
}

const Rgb kNothingSeen = Rgb::Constant(0.85);

/// mantissa · 10^power, correctly rounded where a decimal of so many digits is.
double decimal(double mantissa, int power) {
  return power < 0 ? mantissa / std::pow(10.0, -power) : mantissa * std::pow(10.0, power);
}

constexpr double kRounding = 1e-9;  // of a step: a tick at the very end is one

std::vector<double> linear_ticks(double least, double most, int count) {
  const double span = most - least;
  if (!(span > 0)) return {};
  std::vector<double> ticks;
  for (int power = static_cast<int>(std::floor(std::log10(span / count)));; ++power)
    for (const double step : {1.0, 2.0, 5.0}) {
      const double width = decimal(step, power);
      const double first = std::ceil(least / width - kRounding), last = std::floor(most / width + kRounding);
      if (!(last - first < count)) continue;
      for (double k = first; k <= last; ++k) ticks.push_back(decimal(k * step, power));
      return ticks;
    }
}

std::vector<double> logarithmic_ticks(double least, double most, int count) {
  const int first = static_cast<int>(std::floor(std::log10(least))),
            last = static_cast<int>(std::ceil(std::log10(most)));
  const auto with = [&](std::span<const double> mantissas, int stride) {
    std::vector<double> ticks;
    for (int power = first; power <= last; ++power) {
      if (((power % stride) + stride) % stride != 0) continue;
      for (const double m : mantissas)
        if (const double value = decimal(m, power);
            value >= least * (1 - kRounding) && value <= most * (1 + kRounding))
          ticks.push_back(value);
    }
    return ticks;
  };
  constexpr std::array kFine{1.0, 2.0, 5.0}, kCoarse{1.0, 0.0, 0.0};
  std::vector<double> ticks = with(kFine, 1);
  for (int stride = 1; static_cast<int>(ticks.size()) > count; ++stride)
    ticks = with(std::span(kCoarse).first(1), stride);
  return ticks;
}

}  // namespace

double ColourScale::position(double value) const {
  if (!(most > least)) return 0.5;
  const double t = kind == ScaleKind::linear ? (value - least) / (most - least)
                                             : std::log(value / least) / std::log(most / least);
  return t > 0 ? std::min(t, 1.0) : 0;  // 0 also of the logarithm of what is not positive
}

void validate(const ColourScale& scale) {
  if (!(std::isfinite(scale.least) && std::isfinite(scale.most) && scale.least <= scale.most))
    throw InputError(
        fmt::format("a scale from {} to {}: both must be finite, and not falling", scale.least, scale.most));
  if (scale.kind == ScaleKind::logarithmic && !(scale.least > 0))
    throw InputError(
        fmt::format("a logarithmic scale from {} to {}: it must begin above 0", scale.least, scale.most));
}

std::vector<double> round_values(const ColourScale& scale, int most) {
  validate(scale);
  if (most < 1) return {};
  std::vector<double> ticks;
  if (scale.kind == ScaleKind::logarithmic) ticks = logarithmic_ticks(scale.least, scale.most, most);
  // Less than two decades may hold hardly any of those.
  if (ticks.size() < std::min<std::size_t>(3, static_cast<std::size_t>(most)))
    if (auto even = linear_ticks(scale.least, scale.most, most); even.size() > ticks.size())
      ticks = std::move(even);
  if (ticks.empty()) ticks = {scale.least};
  if (ticks.size() == 1 && most > 1 && scale.most > scale.least && ticks[0] == scale.least)
    ticks.push_back(scale.most);
  return ticks;
}

Rgb8 viridis(double t) {
  return bytes(encoded(t));
}

FieldView::FieldView(std::shared_ptr<const PatchMesh> mesh, Field field)
    : mesh_(std::move(mesh)), field_(std::move(field)), visibility_(*mesh_) {
  const Index count = field_.at_vertices ? mesh_->vertex_count() : mesh_->patch_count();
  if (field_.values.size() != count)
    throw InputError(fmt::format("'{}' has {} values for {} {}", field_.name, field_.values.size(), count,
                                 field_.at_vertices ? "vertices" : "patches"));
  for (Index i = 0; i < count; ++i)
    if (!std::isfinite(field_.values[i]))
      throw InputError(fmt::format("'{}' is {} at {} {}, which is not a finite number", field_.name,
                                   field_.values[i], field_.at_vertices ? "vertex" : "patch", i));
}

namespace {

/// visit(point, patch, value), in parallel.
template <class Visit>
void for_each_value(const Visibility& visibility, const Field& field, const Pinhole& eye,
                    const SampleGrid& grid, Visit&& visit) {
  if (!field.at_vertices) {
    for_each_visible(visibility, eye, grid, [&](Eigen::Index point, Index patch, const Vec3&) {
      visit(point, patch, field.values[patch]);
    });
    return;
  }
  const BandArray values = field.values;
  for_each_visible(visibility, eye, grid, [&](Eigen::Index point, Index patch, const Vec3& x) {
    visit(point, patch, interpolate(visibility.mesh(), values, patch, x)[0]);
  });
}

void require_image(int width, int height, Index samples) {
  if (width < 1 || height < 1 || samples < 1)
    throw InputError(fmt::format("image of {} x {} pixels with {} samples: all must be at least 1", width,
                                 height, samples));
}

}  // namespace

FieldImage FieldView::look(const Camera& camera, int width, int height) const {
  require_image(width, height, 1);
  const auto count = static_cast<Eigen::Index>(width) * height;
  FieldImage image{width, height, Eigen::ArrayXd::Constant(count, std::numeric_limits<double>::quiet_NaN()),
                   std::vector<Index>(static_cast<std::size_t>(count), Visibility::kNothing)};
  for_each_value(visibility_, field_, Pinhole(camera, width, height), {width, height, 1, 0.5, 0.5, 0},
                 [&](Eigen::Index pixel, Index patch, double value) {
                   image.values[pixel] = value;
                   image.patch[static_cast<std::size_t>(pixel)] = patch;
                 });
  return image;
}

FieldMeans FieldView::means(const Camera& camera, int width, int height, Index samples) const {
  require_image(width, height, samples);
  const auto count = static_cast<Eigen::Index>(width) * height;
  FieldMeans means{width, height, Eigen::ArrayXd::Zero(count), Eigen::ArrayXd::Zero(count)};
  const Pinhole eye(camera, width, height);
  for (Index k = 0; const auto& [x, y] : sample_places(samples))
    for_each_value(visibility_, field_, eye, {width, height, 1, x, y, k++},
                   [&](Eigen::Index pixel, Index, double value) {
                     means.values[pixel] += value / samples;
                     means.coverage[pixel] += 1.0 / samples;
                   });
  return means;
}

Image FieldView::colours(const Camera& camera, int width, int height, Index samples,
                         const ColourScale& scale) const {
  require_image(width, height, samples);
  validate(scale);
  const auto count = static_cast<Eigen::Index>(width) * height;
  Eigen::Array<double, Eigen::Dynamic, 3, Eigen::RowMajor> sum = kNothingSeen.transpose().replicate(count, 1);
  const Pinhole eye(camera, width, height);
  for (Index k = 0; const auto& [x, y] : sample_places(samples))
    for_each_value(visibility_, field_, eye, {width, height, 1, x, y, k++},
                   [&](Eigen::Index pixel, Index, double value) {
                     sum.row(pixel) += (encoded(scale.position(value)) - kNothingSeen).transpose() / samples;
                   });
  Image image{width, height, std::vector<Rgb8>(static_cast<std::size_t>(count))};
  for (Eigen::Index pixel = 0; pixel < count; ++pixel)
    image.pixels[static_cast<std::size_t>(pixel)] =
        bytes(sum.row(pixel).transpose().max(0.0).min(1.0));  // rounding of the sum
  return image;
}

}  // namespace radiosity
