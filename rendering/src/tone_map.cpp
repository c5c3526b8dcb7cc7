// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/rendering/tone_map.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "display.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

/// Display value that automatic_exposure gives to the bright surfaces: linear 0.8 is 231 of 255, near white
/// with room for what is brighter.
constexpr double kNearWhite = 0.8;

}  // namespace

double automatic_exposure(const PatchMesh& mesh, const BandArray& patch_radiosity) {
  if (patch_radiosity.rows() != mesh.patch_count())
    throw InputError(fmt::format("radiosity has {} rows, but the mesh has {} patches", patch_radiosity.rows(),
                                 mesh.patch_count()));
  const Eigen::ArrayXd brightest = patch_radiosity.rowwise().maxCoeff();
  std::vector<Index> reflecting;
  double area = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if ((mesh.material_of(i).emission == 0).all()) {
      reflecting.push_back(i);
      area += mesh.area(i);
    }
  std::stable_sort(reflecting.begin(), reflecting.end(),
                   [&](Index a, Index b) { return brightest[a] < brightest[b]; });
  double quantile = 0, below = 0;
  for (const Index i : reflecting) {
    quantile = brightest[i];
    below += mesh.area(i);
    if (below >= 0.9 * area) break;
  }
  if (!(quantile > 0)) quantile = brightest.size() > 0 ? brightest.maxCoeff() : 0;
  return quantile > 0 ? kNearWhite / quantile : 1;
}

double automatic_exposure(const LinearImage& image) {
  if (image.radiosity.rows() == 0) return 1;
  Eigen::ArrayXd brightest = image.radiosity.rowwise().maxCoeff();
  double* const quantile = brightest.data() + (brightest.size() - 1) * 9 / 10;
  std::nth_element(brightest.data(), quantile, brightest.data() + brightest.size());
  const double bright = *quantile > 0 ? *quantile : brightest.maxCoeff();
  return bright > 0 ? kNearWhite / bright : 1;
}

std::vector<Rgb8> tone_map(const BandArray& radiosity, double exposure) {
  std::vector<Rgb8> colours;
  colours.reserve(radiosity.rows());
  for (Eigen::Index i = 0; i < radiosity.rows(); ++i)
    colours.push_back(bytes(display(radiosity.row(i), exposure)));
  return colours;
}

Image tone_map(const LinearImage& image, double exposure) {
  return {image.width, image.height, tone_map(image.radiosity, exposure)};
}

}  // namespace radiosity
