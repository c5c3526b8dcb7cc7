// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pair_factors.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity {

/// Of all these clusters, one after the other.
std::vector<Index> members_of(const PatchMesh& mesh, std::span<const Index> clusters);

/// PairFactors::samples of these patches: points per partly hidden pair or, where the scene has too many polygons, shadow rays of
/// every pair.
Index pairwise_samples(const Visibility& visibility);

/// Patches whose rows and columns a method that samples directions had better leave to the pairs.
struct PairwisePatches {
  std::vector<Index> patches;         ///< ascending
  double pairs = 0;                   ///< that their rows have at most, about
  Index lamps = 0;                    ///< how many of them emit
  std::vector<Index> misjudged;       ///< those whose escaping share the directions do not tell either
  std::vector<std::string> warnings;  ///< of those that are too many
  std::vector<Index> hidden;          ///< near others with nearly all of their area, and too many
  std::vector<std::pair<Index, double>> unreliable;  ///< AssemblyReport::unreliable
  std::unique_ptr<PairFactors> factors;              ///< absent where `patches` is empty
};

/// - Lamps: what few samples find of a small lamp is noise, and everybody's light depends on it.
/// - Patches that lie nearly against others: rays and cells pass through what lies in the plane that they start from.
/// - Patches that hardly any ray or cell finds something from: a thin or distant object is missed or found too large.
/// Clusters are taken whole. Each kind only while it is at most one cluster in 20 (lamps: in 4 up to 2·10⁶ pairs), or 32, and 5·10⁷ pairs of patches (lamps:
/// of those that are not hidden from each other in whole groups): half a minute and 400 MB. Where there are so many polygons that
/// shadow rays tell what is seen, it is 2·10⁶ but for lamps.
PairwisePatches pairwise_patches(const FormFactorMethod& method, const Visibility& visibility,
                                 std::span<const double> row_sums);

/// The first two kinds, which show before any row is computed.
std::vector<Index> pairwise_in_advance(const Visibility& visibility);

/// Whether a row is of the third kind.
bool hardly_answered(const FormFactorMethod& method, double row_sum);

}  // namespace radiosity
