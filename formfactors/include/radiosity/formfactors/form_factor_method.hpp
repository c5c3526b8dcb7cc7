// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity {

inline constexpr double kFactorTolerance =
    1e-6;  ///< the default, and that of pairs in methods that sample directions

struct FormFactorOptions {
  /// Rays per patch (hemisphere); viewpoints per patch (hemicube); points, or shadow rays, per partly hidden pair (analytic).
  /// 0: the default.
  Index samples = 0;
  Index resolution = 0;    ///< cells along an edge of the hemicube's top; 0: the default
  std::uint64_t seed = 1;  ///< of the streams of random numbers, one stream per patch
  /// Relative error of the factor of two patches that nothing stands between (analytic), root mean square over positions; 0: the default.
  double tolerance = 0;

  /// Of options in force, and of a method's defaults: whether the method has a use for them.
  bool has_tolerance() const { return tolerance > 0; }
  bool has_samples() const { return samples > 0; }
  bool has_resolution() const { return resolution > 0; }
};

/// What a method that looks at pairs found out about them, each pair once or, where rows are asked for whole, twice.
struct PairCounts {
  std::uint64_t behind = 0;   ///< one lies behind the other, or is covered: skipped, mostly in groups
  std::uint64_t hidden = 0;   ///< one polygon was proved to stand between them, mostly in groups
  std::uint64_t free = 0;     ///< nothing can stand between them
  std::uint64_t partial = 0;  ///< exact shadows measured what is seen
  std::uint64_t by_rays = 0;  ///< shadow rays did

  PairCounts& operator+=(const PairCounts& other) {
    behind += other.behind;
    hidden += other.hidden;
    free += other.free;
    partial += other.partial;
    by_rays += other.by_rays;
    return *this;
  }
};

/// The counts by their names in files: visit(name, number).
template <class Counts, class Visit>
void for_each_count(Counts& pairs, Visit&& visit) {
  visit("pairs_behind", pairs.behind);
  visit("pairs_hidden", pairs.hidden);
  visit("pairs_free", pairs.free);
  visit("pairs_partial", pairs.partial);
  visit("pairs_by_rays", pairs.by_rays);
}

/// A way to compute form factors. One object serves one mesh; it keeps references to the mesh and the
/// visibility it was made with. Methods only fill rows: threads, symmetry, closure, storage and their
/// measurement are the duty of `assemble` and `RowsOnDemand`, which all methods share.
class FormFactorMethod {
 public:
  virtual ~FormFactorMethod() = default;

  /// Receives one row: F_ij for j = columns[k], ascending, zeros left out, and what the method saw leave
  /// through open sides or end on the backs of patches, absent where it cannot tell (it looks at pairs, not at
  /// directions). Called once per row asked for, from the thread that asked.
  using Sink = std::function<void(Index row, std::span<const Index> columns, std::span<const double> values,
                                  std::optional<double> escaped)>;

  /// Fills rows [first, last), of the mesh's clusters, F averaged over all members of each. Where `upper` is set, only entries with
  /// column ≥ row are wanted: the others follow by reciprocity (only for methods that are `reciprocal`). Thread-safe; the answer for a row
  /// depends neither on the other rows of the call nor on the thread.
  virtual void rows(Index first, Index last, bool upper, const Sink& sink) const = 0;

  /// A_i F_ij = A_j F_ji holds to rounding by construction, so half of F is enough.
  virtual bool reciprocal() const = 0;

  /// The entries are exact up to rounding for this mesh; closing their rows would only blur them.
  virtual bool exact() const = 0;

  /// What is in force: what was asked for, rounded to what the method can do; see FormFactorOptions::has_samples.
  virtual FormFactorOptions options() const = 0;

  /// No row has more entries than this; known before any row is computed, so that memory can be planned.
  virtual Index max_entries_per_row() const = 0;

  /// The share of the hemisphere that one ray or one cell answers for at most; absent where the method looks at pairs.
  virtual std::optional<double> direction_share() const { return std::nullopt; }

  /// What lies too near to other patches counts as escaped, instead of passing through them.
  virtual bool leaves_out_faced() const { return false; }

  /// Rays cast so far.
  virtual std::uint64_t rays() const { return 0; }

  /// Pairs looked at so far.
  virtual PairCounts pairs() const { return {}; }
};

/// A row of the table of methods.
struct FormFactorMethodInfo {
  std::string_view name;
  std::string_view summary;    ///< one line for --help
  std::string_view citation;   ///< keys of references.bib
  FormFactorOptions defaults;  ///< of what trades its speed for accuracy
  std::unique_ptr<FormFactorMethod> (*factory)(const Visibility& visibility,
                                               const FormFactorOptions& options);

  /// The method with defaults filled in. Throws InputError on a setting that is negative or absurdly large
  /// (more than 2^20 samples or 2^12 cells, a tolerance outside [1e-9, 0.01]).
  std::unique_ptr<FormFactorMethod> make(const Visibility& visibility, FormFactorOptions options = {}) const;
};

/// All methods. Tests, benchmarks and the command line read this table.
std::span<const FormFactorMethodInfo> form_factor_methods();

/// Throws InputError that lists the names there are.
const FormFactorMethodInfo& find_form_factor_method(std::string_view name);

}  // namespace radiosity
