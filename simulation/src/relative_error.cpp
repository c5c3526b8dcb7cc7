// SPDX-License-Identifier: GPL-3.0-or-later
#include "relative_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "light_unit.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/compare.hpp"

namespace radiosity {
namespace {

// Area-weighted, over the patches whose value is a number.
double mean(const Eigen::ArrayXd& areas, const Eigen::ArrayXd& values) {
  const Eigen::ArrayXd known = values.isNaN().select(0.0, areas);
  return (known * values.isNaN().select(0.0, values)).sum() / known.sum();
}

}  // namespace

Eigen::ArrayXd mean_square(const Eigen::ArrayXd& areas, const BandArray& error, const BandArray& reflected) {
  const BandValues unit = light_unit(reflected);
  Eigen::ArrayXd above = Eigen::ArrayXd::Zero(error.cols());
  Eigen::ArrayXd below = above;
  for (Eigen::Index i = 0; i < areas.size(); ++i) {
    if (error.row(i).isNaN().any()) continue;
    above += areas[i] * (error.row(i).transpose() / unit).square();
    below += areas[i] * (reflected.row(i).transpose() / unit).square();
  }
  return (below > 0).select(above / below, 0.0);
}

double relative_rms(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected) {
  return std::sqrt(mean_square(mesh.areas(), error, reflected).maxCoeff());
}

double largest_share(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected) {
  double largest = 0;
  for (Eigen::Index b = 0; b < error.cols(); ++b) {
    const double least = 0.01 * mean(mesh.areas(), reflected.col(b));
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (least > 0 && reflected(i, b) >= least)  // false where it is not a number
        largest = std::max(largest, std::abs(error(i, b)) / reflected(i, b));
  }
  return largest;
}

RelativeError relative_error(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference) {
  if (radiosity.rows() != mesh.patch_count() || reference.rows() != mesh.patch_count() ||
      radiosity.cols() != reference.cols())
    throw InputError(fmt::format("radiosities of {} × {} and {} × {} for {} patches", radiosity.rows(),
                                 radiosity.cols(), reference.rows(), reference.cols(), mesh.patch_count()));
  const BandArray error = radiosity - reference, reflected = reference - mesh.emission();
  return {relative_rms(mesh, error, reflected), largest_share(mesh, error, reflected)};
}

Eigen::ArrayXd error_map(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& reference) {
  Eigen::ArrayXd out = Eigen::ArrayXd::Zero(mesh.patch_count());
  const BandArray emission = mesh.emission();
  for (Eigen::Index b = 0; b < radiosity.cols(); ++b) {
    const double scale = mean(mesh.areas(), reference.col(b) - emission.col(b));
    const Eigen::ArrayXd error = (radiosity.col(b) - reference.col(b)).abs();
    if (scale > 0) out = out.max(error.isNaN().select(0.0, error) / scale);
  }
  return out;
}

}  // namespace radiosity
