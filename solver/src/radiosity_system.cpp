// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/solver/radiosity_system.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

RadiositySystem::RadiositySystem(const FormFactorOperator& form_factors, Eigen::ArrayXd areas,
                                 BandArray reflectance, BandArray emission, BandArray absorptance)
    : form_factors_(&form_factors),
      rows_(dynamic_cast<const FormFactorRows*>(&form_factors)),
      areas_(std::move(areas)),
      reflectance_(std::move(reflectance)),
      emission_(std::move(emission)),
      absorptance_(std::move(absorptance)),
      escaped_(Eigen::ArrayXd::Zero(form_factors.rows())) {
  validate();
  if (!on_demand()) escaped_ = form_factors.escaped();
  component_ = std::make_shared<const std::vector<Index>>(form_factors.component());
  for (const Index c : *component_) components_ = std::max(components_, c + 1);
}

RadiositySystem::RadiositySystem(const FormFactorOperator& form_factors, Eigen::ArrayXd areas,
                                 BandArray reflectance, BandArray emission)
    : RadiositySystem(form_factors, std::move(areas), reflectance, std::move(emission), 1 - reflectance) {}

RadiositySystem::RadiositySystem(const FormFactorOperator& form_factors, const PatchMesh& mesh)
    : RadiositySystem(form_factors, mesh.cluster_areas(), mesh.per_cluster(mesh.reflectance()),
                      mesh.per_cluster(mesh.emission()), mesh.per_cluster(mesh.absorptance())) {}

void RadiositySystem::validate() const {
  const Index n = size();
  if (form_factors_->columns() != n)
    throw InputError(fmt::format("radiosity system: F is {} × {}, not square", n, form_factors_->columns()));
  const auto fits = [&](const BandArray& x) { return x.rows() == n && x.cols() == bands(); };
  if (areas_.size() != n || bands() == 0 || !fits(reflectance_) || !fits(emission_) || !fits(absorptance_)) {
    throw InputError(fmt::format(
        "radiosity system: F has {} patches, but there are {} areas, {} × {} reflectances, {} × {} "
        "absorptances and {} × {} emissions",
        n, areas_.size(), reflectance_.rows(), reflectance_.cols(), absorptance_.rows(), absorptance_.cols(),
        emission_.rows(), emission_.cols()));
  }
  for (Index i = 0; i < n; ++i) {
    if (!(areas_[i] > 0 && std::isfinite(areas_[i]))) {
      throw InputError(fmt::format("patch {}: area {} m² is not positive", i, areas_[i]));
    }
    for (Index b = 0; b < bands(); ++b) {
      const double rho = reflectance_(i, b);
      const double alpha = absorptance_(i, b);
      const double e = emission_(i, b);
      if (!(rho >= 0 && rho <= 1)) {
        throw InputError(fmt::format("patch {}, band {}: reflectance {} is outside [0, 1]", i, b, rho));
      }
      if (!(alpha >= 0 && alpha <= 1 && 1 - alpha == rho) && !(1 - rho == alpha)) {
        throw InputError(fmt::format("patch {}, band {}: absorptance {} is not 1 minus the reflectance {}", i,
                                     b, alpha, rho));
      }
      if (!(e >= 0 && std::isfinite(e))) {
        throw InputError(
            fmt::format("patch {}, band {}: emission {} W/m² is negative or not finite", i, b, e));
      }
    }
  }
}

BandArray RadiositySystem::sums(const BandArray& x) const {
  BandArray sums = BandArray::Zero(components_, x.cols());
  for (Index i = 0; i < size(); ++i) sums.row((*component_)[i]) += x.row(i);
  return sums;
}

BandArray RadiositySystem::spread(const BandArray& values) const {
  BandArray x(size(), values.cols());
  for (Index i = 0; i < size(); ++i) x.row(i) = values.row((*component_)[i]);
  return x;
}

RadiositySystem RadiositySystem::with_bands(BandArray reflectance, BandArray emission,
                                            BandArray absorptance) const {
  RadiositySystem other = *this;
  other.reflectance_ = std::move(reflectance);
  other.emission_ = std::move(emission);
  other.absorptance_ = std::move(absorptance);
  other.external_irradiance_ = {};
  other.validate();
  return other;
}

RadiositySystem RadiositySystem::with_external_irradiance(BandArray irradiance) const {
  if (irradiance.rows() != size() || irradiance.cols() != bands())
    throw InputError(fmt::format("external irradiance: {} × {} values for {} patches and {} bands",
                                 irradiance.rows(), irradiance.cols(), size(), bands()));
  for (Index i = 0; i < size(); ++i)
    for (Index b = 0; b < bands(); ++b)
      if (!(irradiance(i, b) >= 0 && std::isfinite(irradiance(i, b))))
        throw InputError(
            fmt::format("patch {}, band {}: external irradiance {} W/m² is negative or not finite", i, b,
                        irradiance(i, b)));
  RadiositySystem other = *this;
  other.external_irradiance_ = std::move(irradiance);
  return other;
}

BandArray RadiositySystem::source() const {
  if (external_irradiance_.size() == 0) return emission_;
  return emission_ + reflectance_ * external_irradiance_;
}

BandArray RadiositySystem::irradiance(const BandArray& radiosity) const {
  BandArray h;
  if (!on_demand()) {
    form_factors_->apply(radiosity, h);
    if (external_irradiance_.size() > 0) h += external_irradiance_;
    return h;
  }
  // Rows are expensive: B = E + ρH gives H wherever something reflects, and only black patches gather.
  h.resize(radiosity.rows(), radiosity.cols());
  tbb::parallel_for(tbb::blocked_range<Index>(0, size()), [&](const tbb::blocked_range<Index>& block) {
    RowBuffer buffer;
    for (Index i = block.begin(); i != block.end(); ++i) {
      if ((reflectance_.row(i) > 0).all()) {
        h.row(i) = (radiosity.row(i) - emission_.row(i)) / reflectance_.row(i);
        continue;
      }
      const FormFactorRow row = rows_->row(i, buffer);
      h.row(i) = row.diagonal * radiosity.row(i);
      if (external_irradiance_.size() > 0) h.row(i) += external_irradiance_.row(i);
      for_each_entry(row, [&](Index j, float f) { h.row(i) += static_cast<double>(f) * radiosity.row(j); });
    }
  });
  return h;
}

}  // namespace radiosity
