// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "radiosity/formfactors/form_factor_matrix.hpp"
#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// (I − ρF) B = E for all bands. Keeps a reference to F, which must outlive it.
class RadiositySystem {
 public:
  /// reflectance and emission are n × bands, areas n. Throws InputError on other shapes, ρ outside [0, 1],
  /// E negative or not finite, A not positive.
  RadiositySystem(const FormFactors& form_factors, Eigen::ArrayXd areas, BandArray reflectance,
                  BandArray emission);
  RadiositySystem(const FormFactors& form_factors, const PatchMesh& mesh);

  Index size() const { return form_factors_->size(); }
  Index bands() const { return static_cast<Index>(emission_.cols()); }
  const FormFactors& form_factors() const { return *form_factors_; }
  const Eigen::ArrayXd& areas() const { return areas_; }         ///< A, m²
  const BandArray& reflectance() const { return reflectance_; }  ///< ρ
  const BandArray& emission() const { return emission_; }        ///< E, W/m²

  /// H = F B, W/m².
  BandArray irradiance(const BandArray& radiosity) const;

 private:
  const FormFactors* form_factors_;
  Eigen::ArrayXd areas_;
  BandArray reflectance_, emission_;
};

}  // namespace radiosity
