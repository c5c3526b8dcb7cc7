// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "radiosity/formfactors/form_factor_matrix.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/meshing/progress.hpp"

namespace radiosity {

/// Factors of the patches whose rows and columns were computed pair by pair. Opaque; they depend on the mesh and not on samples.
struct PairRows;

/// The first rows of F as a method gave them, before anything is restored; of a run of several ranks, some rows in whole blocks
/// (Ranks::kBlock).
struct PartialRows {
  Index done = 0;                  ///< how many
  std::vector<Index> rows = {};    ///< their numbers, ascending; empty: the first
  std::vector<std::size_t> start;  ///< done + 1 offsets into columns and values
  std::vector<Index> columns;
  std::vector<float> values;
  std::vector<double> escaped;  ///< as the method saw it; empty where it cannot tell
  std::uint64_t rays = 0;
  PairCounts pairs = {};
};

struct AssemblyOptions {
  bool close = true;  ///< restore reciprocity and closure of methods that are not exact
  std::size_t memory_limit_bytes =
      0;  ///< of F; 0: none. Exceeding it throws MemoryLimitError before it is allocated.
  Progress progress = {};
  /// Share the work, and each keeps its own rows; null: this process does all of it. All ranks assemble alike.
  std::shared_ptr<const Ranks> ranks = {};
  /// Of an earlier assembly of the same mesh by the same method: its pairs are taken as they are, and no others are computed.
  std::shared_ptr<const PairRows> pair_rows = {};
  /// Of an earlier assembly that was ended: its rows are taken as they are, and the bits are those of one that was not.
  std::shared_ptr<const PartialRows> partial = {};
  /// Called on the calling thread each time that some hundred rows more are done, and with the last one: `state` makes a copy of them
  /// all. What it throws ends the assembly.
  std::function<void(Index done, const std::function<PartialRows()>& state)> save = {};
};

/// Errors that F itself shows. They prove nothing about single entries: a hemicube's rows close to 1e-8 while
/// its factors are 2 % wrong.
struct FormFactorQuality {
  double closure_error_max = 0;      ///< max_i |Σ_j F_ij − (1 − escaped_i)|
  double closure_error_mean = 0;     ///< area-weighted mean of the same
  double reciprocity_error_max = 0;  ///< max_i Σ_j |F_ij − F_ji A_j/A_i| / 2
  /// Area-weighted mean of the same. Rows sampled independently of each other: half the difference of two estimates is what
  /// their mean errs by, so this is the mean error Σ_j |ΔF_ij| of the rows once they are averaged.
  double reciprocity_error_mean = 0;
};

struct AssemblyReport {
  bool completed = true;            ///< false: `progress` asked to stop, rows not reached are empty
  bool closed_scene = false;        ///< no ray got out and none met a back: every row sums to 1
  bool closed_rows = false;         ///< reciprocity and closure were restored
  FormFactorQuality before, after;  ///< equal where nothing was restored
  double escaped_mean = 0;  ///< area-weighted mean of 1 − Σ_j F_ij over the patches that see any other
  Index lamps = 0;          ///< patches that emit whose factors were computed pair by pair instead of sampled
  Index pairwise = 0;       ///< all such patches, whatever the reason
  std::shared_ptr<const PairRows> pair_rows;  ///< their factors; null where the method looks at pairs anyway
  Index isolated_patches = 0;                 ///< see no patch at all
  /// Clusters that nearly touch others with a share of their area and are too many to be computed pair by pair: the factors of that
  /// share are wrong. A warning says so where it takes part in more than 1 % of the exchange. (Those that do so with nearly all of
  /// it exchange nothing.)
  std::vector<std::pair<Index, double>> unreliable;
  std::uint64_t rays = 0;
  PairCounts pairs;  ///< of the method itself, patches computed pair by pair in sampled methods not included
  std::vector<std::string> warnings;

  /// Share of what leaves the patches, on average, that restoring could not place: patches that nearly only see each other need
  /// not agree on what they exchange. It goes to the matrix's diagonal, so that no light is lost.
  double unrestored() const { return closed_rows ? after.closure_error_mean : 0; }
};

struct AssembledFormFactors {
  FormFactorMatrix matrix;
  AssemblyReport report;
};

/// Bytes that assembling F of `patches` rows of at most `entries` entries may take for certain: rows and their transpose stand in memory at
/// the same time, 8 bytes an entry, or in their place the symmetric union of both; half as much again for what memory in pieces loses.
double assembly_bytes(double patches, double entries);

/// The mesh's clusters as PatchMesh::Arrays::patch_cluster, with those members apart that see nothing of what the others do: what
/// lies against another patch (Visibility::covered), and what nearly does. Empty where the mesh has none.
std::vector<Index> clusters_apart(const Visibility& visibility);

/// All rows of F, one for each cluster of the mesh. Rows are computed in parallel in blocks of fixed size, so the bits do not depend on the
/// number of threads.
///
/// Where the method samples directions, patches that emit get factors pair by pair, as by the analytic method:
/// what few samples find of a small lamp is noise. Only while they are few: at most one patch in 20 (in 4 up to
/// 2·10⁶ pairs), and at most 5·10⁷ pairs that may see each other; where they are more and so small that the samples do not tell them, a warning says so.
///
/// Then, unless the method is exact or `close` is off, the two estimates of each A_i F_ij are averaged by
/// inverse variance and scaled,
///   S_ij = (F_ij + F_ji) / (1/A_i + 1/A_j),
///   S ← D S D   with D diagonal such that Σ_j S_ij = A_i (1 − escaped_i),
/// a symmetric scaling [Knight2008] that keeps zeros and signs; what remains goes to the matrix's diagonal. Rows that would need more
/// than tolerance::kMostScaling contradict others and are left out of it. Rows of a method that cannot tell what escapes are scaled
/// in closed scenes only. Throws MemoryLimitError where the limit may not suffice, InputError where a factor is no share of light.
AssembledFormFactors assemble(const FormFactorMethod& method, const Visibility& visibility,
                              const AssemblyOptions& options = {});

/// What some clusters receive wrongly, W/m², from those whose factors were computed pair by pair and whose radiosities are given,
/// clusters × bands: Σ_j (F_ij − F'_ij) B_j with F' of four times the points or shadow rays, at other places. The rows of clusters
/// that were not asked about are not-a-number.
BandArray pair_errors(const PairRows& pairs, const Visibility& visibility, const BandArray& radiosity,
                      std::span<const Index> clusters, const Ranks* ranks = nullptr);

/// F that is not assembled: each row is computed when a solver asks for it, as the method makes it, but the rows
/// of lamps pair by pair as in `assemble`. Rows are kept while there is room, and the one that nobody has asked for longest makes room
/// for another. Reciprocity and closure cannot be restored row by row: what a row lacks shows in the energy balance.
class RowsOnDemand final : public FormFactorRows {
 public:
  /// Both must outlive this object. Kept rows take at most `memory_bytes`, 8 an entry; 0: none are kept.
  RowsOnDemand(const FormFactorMethod& method, const Visibility& visibility, std::size_t memory_bytes);
  ~RowsOnDemand() override;

  Index size() const override { return n_; }
  FormFactorRow row(Index i, RowBuffer& buffer) const override;
  bool stored() const override { return false; }
  /// Known for the rows computed so far, 0 for the others. A method that cannot tell gets 1 − Σ_j F_ij.
  Eigen::ArrayXd escaped() const override;

  /// Rows that were computed, again if they had been given up.
  std::uint64_t computed() const { return computed_.load(std::memory_order_relaxed); }

 private:
  struct Pairwise;
  class Kept;
  void compute(Index i, RowBuffer& buffer) const;
  const FormFactorMethod& method_;
  Index n_;
  std::unique_ptr<Pairwise> pairwise_;  // absent where the method looks at pairs anyway
  std::unique_ptr<std::atomic<double>[]> escaped_;
  std::unique_ptr<Kept> kept_;
  mutable std::atomic<std::uint64_t> computed_{0};
};

}  // namespace radiosity
