// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "pairwise.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "row_list.hpp"

/// The steps of `assemble`, in their order; a file each. Of several ranks each has the rows that it owns and leaves the others empty;
/// what is one value per row is whole on all of them.
namespace radiosity {

/// f ≥ 0 in single precision, rounded towards zero: rows never exceed the sums that they stand for, and what they lack goes to a
/// diagonal that is never negative.
inline float rounded_down(double f) {
  const auto nearest = static_cast<float>(f);
  const std::uint32_t above = static_cast<double>(nearest) > f ? 1 : 0;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) - above);
}

// 1. compute_rows.cpp

inline constexpr Index kRowsPerTask = Ranks::kBlock;

/// Of each row: Σ_j F_ij and Σ_j |F_ij − F_ji A_j/A_i| / 2.
struct MeasuredRows {
  Eigen::ArrayXd sums, reciprocity;
};
struct PackedRows {
  FormFactorMatrix::Rows rows;  ///< without what escapes, and the diagonal
  MeasuredRows measured;
};

struct ComputedRows {
  RowList rows;
  std::optional<PackedRows> packed;  ///< in place of `rows`, dense, where nothing is left to be done to them
  /// Of exact `rows` that one process would have had dense, with the bits that they had there.
  std::optional<Eigen::ArrayXd> sums = {};
  std::optional<Eigen::ArrayXd> escaped;  ///< as the method saw it; absent where it cannot tell
  bool completed = true;                  ///< false: `progress` asked to stop, rows not reached are empty
  std::uint64_t rays = 0;
  PairCounts pairs = {};

  float* dense_row(Index i) {
    FormFactorMatrix::Rows& dense = packed->rows;
    return dense.values.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(dense.n);
  }
};
/// F as the method gives it; of a reciprocal one half is computed. Throws InputError on what is not a share of light, or rows of an
/// earlier run that are not of as many patches.
ComputedRows compute_rows(const FormFactorMethod& method, const Eigen::ArrayXd& areas,
                          const AssemblyOptions& options);

// 2. replace_pairs.cpp

struct PairRows {
  std::vector<Index> patches, misjudged;  ///< as in PairwisePatches
  Index lamps = 0;
  std::vector<Index> hidden;  ///< as in PairwisePatches
  RowList rows, columns;      ///< of each of `patches`: what it sends to all, and what all send to it
};
/// Of several ranks, each computes some of them. Null where `progress`, which is told that all rows are there, asked to stop.
std::shared_ptr<const PairRows> compute_pairs(const PairwisePatches& chosen, const Eigen::ArrayXd& areas,
                                              const Progress& progress, const Ranks* ranks);

/// Patches whose rows and columns are computed pair by pair.
struct ReplacedRows {
  explicit ReplacedRows(Index n, std::vector<Index> replaced = {});
  bool has(Index i) const { return is[i] != 0; }

  std::vector<Index> patches;    ///< ascending
  std::vector<std::uint8_t> is;  ///< of all patches
};
/// Takes out what should exchange nothing.
void drop_hidden(RowList& rows, const std::vector<Index>& hidden);
ReplacedRows replace_by_pairs(RowList& rows, const PairRows& pairs, const Ranks* ranks);

// 3. symmetrise.cpp

/// What two entries that should be A_i F_ij = A_j F_ji differ by, as a share of what leaves i.
double reciprocity_error(double f_ij, double f_ji, double a_i, double a_j);
FormFactorQuality quality_of(const MeasuredRows& rows, const Eigen::ArrayXd& target,
                             const Eigen::ArrayXd& areas);
/// Takes out what should exchange nothing: no scaling reaches such a sum.
void drop_isolated(RowList& rows, const Eigen::ArrayXd& target);
/// Measures F and, where `symmetrise` is set, turns it into S, S_ij = A_i F_ij, the same bits on both sides of the diagonal. Two
/// estimates of the same A_i F_ij, one from either end: the one from i, of K samples, has a variance in proportion to A_i; weighted
/// by inverse variance,   S_ij = (F_ij + F_ji) / (1/A_i + 1/A_j).
MeasuredRows measure(RowList& rows, const Eigen::ArrayXd& areas, bool symmetrise, const Ranks* ranks);

// 4. close_rows.cpp

/// How S is scaled:
///   S_ij ← d_i d_j min(s_i, s_j) S_ij   between sampled patches,
///   S_ij ← c_i c_j min(s_i, s_j) S_ij   where one was computed pair by pair: such entries are right as they are, up to a factor of
/// the whole row; c = 1 for sampled patches. s_i ≤ 1 holds back rows that would otherwise pass their target.
struct RowScaling {
  Eigen::ArrayXd d, s, c;
  ReplacedRows replaced;
  double operator()(Index i, Index j) const {
    const bool sampled = (replaced.is[i] | replaced.is[j]) == 0;
    return (sampled ? d[i] * d[j] : c[i] * c[j]) * std::min(s[i], s[j]);
  }
};
/// The one that brings the row sums of S to A_i target_i, where rows agree on what they exchange.
RowScaling scaling_to_row_sums(const RowList& symmetric, const Eigen::ArrayXd& target,
                               const Eigen::ArrayXd& areas, ReplacedRows replaced, const Ranks* ranks);
/// None, but for what holds back rows that sum to more than 1.
RowScaling scaling_to_at_most_one(const Eigen::ArrayXd& row_sums, ReplacedRows replaced);

// 5. pack_rows.cpp

/// Large pages where the system has them: tiles of F touch many at a time.
std::vector<float> zeros(std::size_t count);
/// Rounded down, side by side; whether all are at least 0 and finite.
bool store_factors(std::span<const double> values, float* row);
/// Dense or sparse, whichever takes fewer bytes; finish(i, row) turns a row into what is stored of it. The rows are used up.
FormFactorMatrix::Rows store(RowList& rows, const Ranks* ranks,
                             const std::function<void(Index, Row&)>& finish = {});
/// Of F as it is; the rows are used up.
PackedRows pack(RowList& rows, const Eigen::ArrayXd& areas, const Ranks* ranks);
/// Adds the lower half of n × n values: F_ji = F_ij A_i / A_j.
MeasuredRows mirror_dense(std::vector<float>& values, const Eigen::ArrayXd& areas);
/// A row of a dense F, from column `first` on, and all rows.
Row dense_row(const FormFactorMatrix::Rows& dense, Index i, Index first);
RowList unpack(const FormFactorMatrix::Rows& dense);
/// Makes a dense F sparse where that takes fewer bytes.
void shrink(FormFactorMatrix::Rows& dense);
/// Of F_ij = S_ij scaling(i, j) / A_i; the rows of S are used up.
PackedRows pack_scaled(RowList& symmetric, const RowScaling& scaling, const Eigen::ArrayXd& areas,
                       const Ranks* ranks);

}  // namespace radiosity
