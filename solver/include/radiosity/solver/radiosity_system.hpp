// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "radiosity/formfactors/form_factor_operator.hpp"
#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// B = E + ρ (H₀ + F B) for all bands, H₀ what arrives from outside of the system; zero unless it is given. Keeps a reference to F,
/// which must outlive it.
class RadiositySystem {
 public:
  /// F is n × n; reflectance, emission and absorptance are n × bands, areas n. 1 − ρ is an input of its own, because a double
  /// near 1 does not hold it: of ρ = 1 − 10⁻¹² it would be off by 10⁻⁴. Throws InputError on other shapes, ρ or
  /// 1 − ρ outside [0, 1], a reflectance that is not 1 − absorptance as a double, E negative or not finite, A not
  /// positive.
  RadiositySystem(const FormFactorOperator& form_factors, Eigen::ArrayXd areas, BandArray reflectance,
                  BandArray emission, BandArray absorptance);
  /// absorptance = 1 − reflectance, which is exact.
  RadiositySystem(const FormFactorOperator& form_factors, Eigen::ArrayXd areas, BandArray reflectance,
                  BandArray emission);
  /// A row for each cluster of the mesh.
  RadiositySystem(const FormFactorOperator& form_factors, const PatchMesh& mesh);

  /// The same with an external irradiance H₀, n × bands, W/m². Throws InputError on another shape, and where it is negative or not
  /// finite.
  RadiositySystem with_external_irradiance(BandArray irradiance) const;

  Index size() const { return form_factors_->rows(); }
  Index bands() const { return static_cast<Index>(emission_.cols()); }
  const FormFactorOperator& form_factors() const { return *form_factors_; }
  /// F, where its rows can be read; otherwise null.
  const FormFactorRows* rows() const { return rows_; }
  /// Rows of F are computed on demand, so that applying F costs as much as computing all of it.
  bool on_demand() const { return rows_ != nullptr && !rows_->stored(); }
  const Eigen::ArrayXd& areas() const { return areas_; }                         ///< A, m²
  const BandArray& reflectance() const { return reflectance_; }                  ///< ρ
  const BandArray& absorptance() const { return absorptance_; }                  ///< 1 − ρ
  const BandArray& emission() const { return emission_; }                        ///< E, W/m²
  const BandArray& external_irradiance() const { return external_irradiance_; }  ///< H₀, W/m²; empty: zero
  BandArray source() const;                                                      ///< E + ρ H₀, W/m²
  const Eigen::ArrayXd& escaped() const { return escaped_; }  ///< 1 − Σ_j F_ij; of rows on demand: 0

  /// Patches that exchange light with each other, directly or by way of others, have the same number, counted from
  /// 0: the connected components of the graph of F, systems of their own. All 0 where the rows of F are not stored.
  const std::vector<Index>& component() const { return *component_; }
  Index components() const { return components_; }

  /// Σ_i x_ib over the patches i of each component, components × bands.
  BandArray sums(const BandArray& x) const;
  /// The rows of `values` (components × bands) spread over the patches: n × bands.
  BandArray spread(const BandArray& values) const;

  /// The same patches with other bands, and no external irradiance.
  RadiositySystem with_bands(BandArray reflectance, BandArray emission, BandArray absorptance) const;

  /// H = H₀ + F B, W/m².
  BandArray irradiance(const BandArray& radiosity) const;

 private:
  void validate() const;

  const FormFactorOperator* form_factors_;
  const FormFactorRows* rows_;
  Eigen::ArrayXd areas_;
  BandArray reflectance_, emission_, absorptance_, external_irradiance_;
  Eigen::ArrayXd escaped_;
  std::shared_ptr<const std::vector<Index>> component_;
  Index components_ = 0;
};

}  // namespace radiosity
