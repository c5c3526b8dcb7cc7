// SPDX-License-Identifier: GPL-3.0-or-later
#include "comparison_page.hpp"

#include <vtkBase64Utilities.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/png.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kPage =
#include "comparison_page.inc"  // CMakeLists.txt makes it of comparison_page.html
    ;
constexpr std::string_view kTradePlace = "{{trade.json}}", kPicturesPlace = "{{pictures}}";
static_assert(kPage.find(kTradePlace) < kPage.find(kPicturesPlace) &&
              kPage.find(kPicturesPlace) != kPage.npos);

/// Ten colours of the map "viridis", at even distances; between them linear.
constexpr std::array<Rgb8, 10> kViridis{{{68, 1, 84},
                                         {72, 40, 120},
                                         {62, 74, 137},
                                         {49, 104, 142},
                                         {38, 130, 142},
                                         {31, 158, 137},
                                         {53, 183, 121},
                                         {109, 205, 89},
                                         {180, 222, 44},
                                         {253, 231, 37}}};

Rgb8 colour_of(double t) {
  const double place = std::clamp(t, 0.0, 1.0) * (kViridis.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double f = place - static_cast<double>(k);
  Rgb8 out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::lround((1 - f) * kViridis[k][c] + f * kViridis[k + 1][c]));
  return out;
}

std::string data_url(const Image& image) {
  const std::string bytes = encode_png(image);
  std::string text((bytes.size() + 2) / 3 * 4 + 4, '\0');
  const auto length = vtkBase64Utilities::Encode(reinterpret_cast<const unsigned char*>(bytes.data()),
                                                 bytes.size(), reinterpret_cast<unsigned char*>(text.data()));
  text.resize(length);
  return "data:image/png;base64," + text;
}

// The scene and, for each map of errors, its run (null: the size of the patches), all from one camera.
Json pictures(const Comparison& comparison, const ComparisonOrigin& origin) {
  std::vector<std::pair<Json, const Eigen::ArrayXd*>> maps;
  for (std::size_t r = 0; r < comparison.runs.size(); ++r)
    if (comparison.runs[r].where.size() > 0) maps.emplace_back(r, &comparison.runs[r].where);
  if (comparison.where_patches.size() > 0) maps.emplace_back(nullptr, &comparison.where_patches);
  Json json = {{"maps", Json::array()}};
  if (maps.empty()) return json;
  // From the decade that the hundredth part of all area exceeds, three decades down.
  std::vector<double> values;
  for (const auto& [run, where] : maps) values.insert(values.end(), where->begin(), where->end());
  const auto quantile =
      values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), quantile, values.end());
  constexpr int kDecades = 3;
  const int top = *quantile > 0 ? static_cast<int>(std::ceil(std::log10(*quantile))) : 0;
  const PatchMesh mesh = comparison.mesh->unfolded();
  const BandArray radiosity = comparison.mesh->unfolded(comparison.radiosity);
  const Visibility visibility(mesh);
  const Camera camera = origin.camera ? *origin.camera : automatic_camera(mesh);
  constexpr int kWidth = 480, kHeight = 400, kSamples = 2;
  json["most"] = std::pow(10.0, top);
  json["decades"] = kDecades;
  json["colours"] = kViridis;
  const double exposure = automatic_exposure(mesh, radiosity);
  const auto second_pass =
      find_pipeline("radiosity")
          .make({std::make_shared<const PatchMesh>(mesh),
                 comparison.mesh->unfolded(vertex_values(*comparison.mesh, comparison.radiosity))});
  const LinearImage scene = second_pass->draw(
      camera,
      {.width = kWidth, .height = kHeight, .samples = kSamples * kSamples, .brightest = 1 / exposure});
  json["scene"] = data_url(tone_map(scene, exposure));
  for (const auto& [run, where] : maps) {
    std::vector<Rgb8> colours;
    const Eigen::ArrayXd of_whole = comparison.mesh->unfolded(*where);
    for (const double value : of_whole)
      colours.push_back(colour_of(value > 0 ? 1 + (std::log10(value) - top) / kDecades : 0));
    json["maps"].push_back(
        {{"run", run}, {"picture", data_url(paint(visibility, colours, camera, kWidth, kHeight, kSamples))}});
  }
  return json;
}

}  // namespace

std::string comparison_page(const std::string& trade_json, const Comparison& comparison,
                            const ComparisonOrigin& origin) {
  std::string page(kPage);  // filled from its end: what has been put in is not searched for places
  page.replace(kPage.find(kPicturesPlace), kPicturesPlace.size(), pictures(comparison, origin).dump());
  page.replace(kPage.find(kTradePlace), kTradePlace.size(), trade_json);
  return page;
}

}  // namespace radiosity
