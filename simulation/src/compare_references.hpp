// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "compare_ladder.hpp"
#include "radiosity/meshing/coarsen.hpp"

namespace radiosity {

/// Rays per patch of a reference, at least.
constexpr Index kLeastRays = 256;

/// A solution that others on the same patches are judged by.
struct Reference {
  ComparedReference facts;
  BandArray radiosity;  ///< n × bands, W/m²
  BandArray noise;      ///< an estimate of the error of `radiosity` from its form factors, n × bands, W/m²
  std::optional<FormFactorMatrix> f = {};  ///< to be released by whoever does not read it
  bool exact = false;                      ///< up to rounding
  std::optional<double> exact_s = {};      ///< predicted for exact form factors, which took too long
};

/// Form factors pair by pair if they can be had in about `share` (s), otherwise by as many rays as that allows: the mean of two
/// solutions of different seeds, half their difference its noise. Nothing where kLeastRays take too long, or interrupted.
std::optional<Reference> make_reference(const PreparedMesh& mesh, double share, std::uint64_t seed,
                                        Budget& budget);

/// A reference on the user's patches cut into k × k or, where they are clusters, on clusters of 1/k of their size.
struct RefinedReference {
  Index k;
  std::optional<Coarsening> to_user;  ///< from its patches to the user's; absent where they are clusters
  PreparedMesh mesh;
  Reference reference;
};
/// Exact on patches of a quarter, a third or half the user's size, where `reference` is exact and that fits twice the share of a
/// reference; otherwise as in make_reference on a quarter or half. Nothing where none of them fits, or is finer, or interrupted.
std::optional<RefinedReference> refine_reference(const PreparedMesh& user, const Scene& scene,
                                                 const Reference& reference, std::uint64_t seed,
                                                 Budget& budget);

/// Area-weighted means of the reference over the patches of each mesh of a series.
struct FinerReference {
  ComparedReference facts;           ///< `noise` on the user's patches
  std::vector<BandArray> radiosity;  ///< per mesh; not a number on patches that no finer one lies in
  std::vector<double> noise;         ///< per mesh, relative as RelativeError::rms
};
FinerReference restrict_reference(const RefinedReference& refined, const MeshSeries& series);

/// Sets patch_error, order and order_assumed of `finer` by Richardson's extrapolation (see compare), from `reference` and one on
/// patches of twice the size.
ComparedReference with_patch_error(const FinerReference& finer, Index k, const Reference& reference,
                                   const MeshSeries& series, std::uint64_t seed, Budget& budget);

}  // namespace radiosity
