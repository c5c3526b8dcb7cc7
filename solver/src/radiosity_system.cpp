// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/radiosity_system.hpp"

#include <fmt/format.h>

#include <cmath>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

RadiositySystem::RadiositySystem(const FormFactors& form_factors, Eigen::ArrayXd areas, BandArray reflectance,
                                 BandArray emission)
    : form_factors_(&form_factors),
      areas_(std::move(areas)),
      reflectance_(std::move(reflectance)),
      emission_(std::move(emission)) {
  const Index n = form_factors.size();
  if (areas_.size() != n || reflectance_.rows() != n || emission_.rows() != n ||
      reflectance_.cols() != emission_.cols() || emission_.cols() == 0) {
    throw InputError(fmt::format(
        "radiosity system: F has {} patches, but there are {} areas, {} × {} reflectances and {} × {} "
        "emissions",
        n, areas_.size(), reflectance_.rows(), reflectance_.cols(), emission_.rows(), emission_.cols()));
  }
  for (Index i = 0; i < n; ++i) {
    if (!(areas_[i] > 0 && std::isfinite(areas_[i]))) {
      throw InputError(fmt::format("patch {}: area {} m² is not positive", i, areas_[i]));
    }
    for (Index b = 0; b < bands(); ++b) {
      const double rho = reflectance_(i, b);
      const double e = emission_(i, b);
      if (!(rho >= 0 && rho <= 1)) {
        throw InputError(fmt::format("patch {}, band {}: reflectance {} is outside [0, 1]", i, b, rho));
      }
      if (!(e >= 0 && std::isfinite(e))) {
        throw InputError(
            fmt::format("patch {}, band {}: emission {} W/m² is negative or not finite", i, b, e));
      }
    }
  }
}

RadiositySystem::RadiositySystem(const FormFactors& form_factors, const PatchMesh& mesh)
    : RadiositySystem(form_factors, mesh.areas(), mesh.reflectance(), mesh.emission()) {}

BandArray RadiositySystem::irradiance(const BandArray& radiosity) const {
  BandArray h;
  if (form_factors_->stored()) {
    form_factors_->multiply(radiosity, h);
    return h;
  }
  // Rows are dear: B = E + ρH gives H wherever something reflects, and only black patches gather.
  h.resize(radiosity.rows(), radiosity.cols());
  RowBuffer buffer;
  for (Index i = 0; i < size(); ++i) {
    if ((reflectance_.row(i) > 0).all()) {
      h.row(i) = (radiosity.row(i) - emission_.row(i)) / reflectance_.row(i);
      continue;
    }
    const FormFactorRow row = form_factors_->row(i, buffer);
    h.row(i) = row.diagonal * radiosity.row(i);
    for_each_entry(row, [&](Index j, float f) { h.row(i) += static_cast<double>(f) * radiosity.row(j); });
  }
  return h;
}

}  // namespace radiosity
