// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/assemble.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "methods.hpp"
#include "pairwise.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

// Rows that one task computes.
constexpr Index kBlock = 16;

// Sparse rows while they are being made, columns ascending.
struct Entry {
  Index column;
  float value;
};
using Row = std::vector<Entry>;
using RowList = std::vector<Row>;

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

// Rounded towards zero: rows of single precision never exceed the sums that they stand for, and what they lack goes to a
// diagonal that is never negative.
float stored(double f) {
  const auto nearest = static_cast<float>(f);
  const std::uint32_t above = static_cast<double>(nearest) > f ? 1 : 0;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) - above);  // f ≥ 0: the next smaller one
}

std::size_t count_entries(const RowList& rows) {
  std::size_t count = 0;
  for (const Row& row : rows) count += row.size();
  return count;
}

template <class F>
void for_each_row(Index n, F&& f) {
  tbb::parallel_for(tbb::blocked_range<Index>(0, n, 64), [&](const tbb::blocked_range<Index>& block) {
    for (Index i = block.begin(); i != block.end(); ++i) f(i);
  });
}

// What a method must never give; found here and not in the light.
void require_factors(Index i, std::span<const Index> columns, std::span<const double> values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!(values[k] >= 0 && std::isfinite(values[k])))
      throw InputError(fmt::format(
          "form factor from patch {} to patch {}: {} is not a share of light; the shape of one of "
          "them is beyond what double precision tells",
          i, columns[k], values[k]));
}

struct Computed {
  RowList rows;
  std::vector<double> escaped;  // as the method saw it; negative: it cannot tell
  bool completed = true;
};

Computed compute_rows(const FormFactorMethod& method, Index n, bool upper, const Progress& progress) {
  Computed out;
  out.rows.resize(at(n));
  out.escaped.assign(at(n), -1);
  const auto compute = [&](Index first, Index last) {
    method.rows(first, last, upper,
                [&](Index i, std::span<const Index> columns, std::span<const double> values, double escaped) {
                  require_factors(i, columns, values);
                  Row& row = out.rows[at(i)];
                  row.resize(values.size());
                  for (std::size_t k = 0; k < row.size(); ++k) row[k] = {columns[k], stored(values[k])};
                  out.escaped[at(i)] = escaped;
                });
  };
  const auto watch = [&](Index done) {
    if (!progress) return true;
    // With `upper`, the first rows hold the share 1 − (1 − done/n)² of the entries.
    const double share = static_cast<double>(done) / n;
    return progress(upper ? 1 - (1 - share) * (1 - share) : share);
  };
  out.completed = for_each_block(n, kBlock, compute, watch);
  return out;
}

// Fᵀ, rows ascending by column. Blocks of rows are counted, then scattered, each on its own.
RowList transpose(const RowList& rows) {
  constexpr std::size_t kBlocks = 16;
  const std::size_t n = rows.size();
  const auto first = [&](std::size_t block) { return n * block / kBlocks; };
  std::vector<std::vector<std::uint32_t>> place(kBlocks, std::vector<std::uint32_t>(n, 0));
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i)
      for (const Entry& e : rows[i]) ++place[block][at(e.column)];
  });
  RowList t(n);
  for_each_row(static_cast<Index>(n), [&](Index j) {
    std::uint32_t sum = 0;
    for (auto& block : place) sum += std::exchange(block[at(j)], sum);
    t[at(j)].resize(sum);
  });
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i) {
      for (const Entry& e : rows[i])
        t[at(e.column)][place[block][at(e.column)]++] = {static_cast<Index>(i), e.value};
    }
  });
  return t;
}

// Calls f(j, a_j, b_j) for every column of either row, ascending, with 0 where one has no entry.
template <class F>
void merge(const Row& a, const Row& b, F&& f) {
  constexpr Index kEnd = std::numeric_limits<Index>::max();
  auto p = a.begin();
  auto q = b.begin();
  while (p != a.end() || q != b.end()) {
    const Index ja = p != a.end() ? p->column : kEnd;
    const Index jb = q != b.end() ? q->column : kEnd;
    f(std::min(ja, jb), ja <= jb ? static_cast<double>(p->value) : 0,
      jb <= ja ? static_cast<double>(q->value) : 0);
    p += ja <= jb ? 1 : 0;
    q += jb <= ja ? 1 : 0;
  }
}

// Adds the lower triangle of a reciprocal F: F_ji = F_ij A_i / A_j.
void mirror(RowList& upper, const Eigen::ArrayXd& areas) {
  const RowList lower = transpose(upper);
  for_each_row(static_cast<Index>(upper.size()), [&](Index j) {
    const Row& left = lower[at(j)];
    Row& row = upper[at(j)];
    Row full;
    full.reserve(left.size() + row.size());
    for (const Entry& e : left)
      full.push_back({e.column, stored(static_cast<double>(e.value) * areas[e.column] / areas[j])});
    full.insert(full.end(), row.begin(), row.end());
    row = std::move(full);
  });
}

// Patches whose rows and columns are computed pair by pair.
struct ReplacedRows {
  std::vector<Index> patches;    // ascending
  std::vector<std::uint8_t> is;  // of all patches
  bool has(Index i) const { return is[at(i)] != 0; }
};

ReplacedRows replaced_rows(std::vector<Index> patches, Index n) {
  ReplacedRows out{std::move(patches), std::vector<std::uint8_t>(at(n), 0)};
  for (const Index i : out.patches) out.is[at(i)] = 1;
  return out;
}

}  // namespace

struct PairRows {
  std::vector<Index> patches, misjudged;  // as in PairwisePatches
  Index lamps = 0;
  RowList rows,
      columns;  // of patch i, empty where it is none of them: what it sends to all, and what all send to it
};

namespace {

// Null where `progress`, which is told that all rows are there, asked to stop.
std::shared_ptr<const PairRows> compute_pairs(const PairwisePatches& chosen, const Eigen::ArrayXd& areas,
                                              const Progress& progress) {
  const auto n = static_cast<std::size_t>(areas.size());
  auto out = std::make_shared<PairRows>(
      PairRows{chosen.patches, chosen.misjudged, chosen.lamps, RowList(n), RowList(n)});
  const auto compute = [&](Index k) {
    const Index i = chosen.patches[at(k)];
    Row& row = out->rows[at(i)];
    Row& column = out->columns[at(i)];
    chosen.factors->for_each_in_row(i, false, [&](Index j, double mutual) {
      row.push_back({j, stored(mutual / areas[i])});
      column.push_back({j, stored(mutual / areas[j])});
    });
    const auto before = [](const Entry& a, const Entry& b) { return a.column < b.column; };
    std::sort(row.begin(), row.end(), before);
    std::sort(column.begin(), column.end(), before);
  };
  const bool completed = for_each_block(
      static_cast<Index>(chosen.patches.size()), 1, [&](Index k, Index) { compute(k); },
      [&](Index) { return !progress || progress(1); });
  if (!completed) return nullptr;
  return out;
}

// Replaces rows and columns by factors of single pairs.
void replace_by_pairs(RowList& rows, const ReplacedRows& replaced, const PairRows& pairs) {
  for (const Index i : replaced.patches) rows[at(i)] = pairs.rows[at(i)];
  const RowList exact = transpose(pairs.columns);
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (replaced.has(i)) return;
    Row merged;
    merged.reserve(rows[at(i)].size() + exact[at(i)].size());
    merge(rows[at(i)], exact[at(i)], [&](Index j, double sampled, double pair) {
      const double f = replaced.has(j) ? pair : sampled;
      if (f > 0) merged.push_back({j, static_cast<float>(f)});
    });
    rows[at(i)] = std::move(merged);
  });
}

// Σ term(e) in four chains: one alone would wait for each of its additions.
template <class F>
double sum(const Row& row, F&& term) {
  std::array<double, 4> s{};
  std::size_t k = 0;
  for (; k + 4 <= row.size(); k += 4)
    for (std::size_t chain = 0; chain < 4; ++chain) s[chain] += term(row[k + chain]);
  for (; k < row.size(); ++k) s[0] += term(row[k]);
  return (s[0] + s[1]) + (s[2] + s[3]);
}

double sum(const Row& row) {
  return sum(row, [](const Entry& e) { return static_cast<double>(e.value); });
}

Eigen::ArrayXd row_sums(const RowList& rows) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[at(i)]); });
  return sums;
}

// Takes out what should exchange nothing: no scaling reaches such a sum.
void drop_isolated(RowList& rows, const Eigen::ArrayXd& target) {
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (target[i] == 0)
      rows[at(i)].clear();
    else
      std::erase_if(rows[at(i)], [&](const Entry& e) { return target[e.column] == 0; });
  });
}

FormFactorQuality quality_of(const Eigen::ArrayXd& sums, const Eigen::ArrayXd& target,
                             const Eigen::ArrayXd& reciprocity, const Eigen::ArrayXd& areas) {
  FormFactorQuality quality;
  if (areas.size() == 0) return quality;
  const Eigen::ArrayXd closure = (sums - target).abs();
  quality.closure_error_max = closure.maxCoeff();
  quality.closure_error_mean = (closure * areas).sum() / areas.sum();
  quality.reciprocity_error_max = reciprocity.maxCoeff();
  quality.reciprocity_error_mean = (reciprocity * areas).sum() / areas.sum();
  return quality;
}

// What two entries that should be A_i F_ij = A_j F_ji differ by, as a share of what leaves i.
double reciprocity_error(double f_ij, double f_ji, double a_i, double a_j) {
  return std::abs(f_ij * a_i - f_ji * a_j) / (2 * a_i);
}

FormFactorQuality measure(const RowList& rows, const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas) {
  const RowList t = transpose(rows);
  Eigen::ArrayXd reciprocity = Eigen::ArrayXd::Zero(areas.size());
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    merge(rows[at(i)], t[at(i)], [&](Index j, double f_ij, double f_ji) {
      reciprocity[i] += reciprocity_error(f_ij, f_ji, areas[i], areas[j]);
    });
  });
  return quality_of(row_sums(rows), target, reciprocity, areas);
}

// Turns F into S, S_ij = A_i F_ij, the same bits on both sides of the diagonal, and measures F while it passes. Two estimates of
// the same A_i F_ij, one from either end: the one from i, of K samples, has a variance in proportion to A_i; weighted by inverse
// variance,   S_ij = (F_ij + F_ji) / (1/A_i + 1/A_j).
FormFactorQuality symmetrise(RowList& rows, const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas) {
  RowList t = transpose(rows);
  Eigen::ArrayXd reciprocity = Eigen::ArrayXd::Zero(areas.size());
  Eigen::ArrayXd sums(areas.size());
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    Row& row = rows[at(i)];
    sums[i] = sum(row);
    Row symmetric;
    symmetric.reserve(row.size() + t[at(i)].size());
    double error = 0;
    merge(row, t[at(i)], [&](Index j, double f_ij, double f_ji) {
      error += reciprocity_error(f_ij, f_ji, areas[i], areas[j]);
      symmetric.push_back(
          {j, static_cast<float>((f_ij + f_ji) * (areas[i] * areas[j] / (areas[i] + areas[j])))});
    });
    reciprocity[i] = error;
    row = Row(symmetric.begin(), symmetric.end());
    t[at(i)] = {};
  });
  return quality_of(sums, target, reciprocity, areas);
}

// How S is scaled:
//   S_ij ← d_i d_j min(s_i, s_j) S_ij   between sampled patches,
//   S_ij ← c_i c_j min(s_i, s_j) S_ij   where one was computed pair by pair: such entries are right as they are, up to a factor of
// the whole row; c = 1 for sampled patches. s_i ≤ 1 holds back rows that would otherwise pass their target.
struct RowScaling {
  Eigen::ArrayXd d, s, c;
  const std::vector<std::uint8_t>& pairwise;
  double operator()(Index i, Index j) const {
    const bool sampled = (pairwise[at(i)] | pairwise[at(j)]) == 0;
    return (sampled ? d[i] * d[j] : c[i] * c[j]) * std::min(s[i], s[j]);
  }
};

// Rows whose sums are scaled to their targets, and how far.
struct Scaled {
  Eigen::ArrayXd factor;
  std::vector<std::uint8_t> frozen;  // rows that do not agree with the others, left as they are
  explicit Scaled(Index n) : factor(Eigen::ArrayXd::Ones(n)), frozen(at(n), 0) {}
  // Multiplies factor i; a row that would need more than sampling could have missed is frozen.
  void multiply(Index i, double by) {
    if (frozen[at(i)] != 0) return;
    factor[i] *= by;
    if (factor[i] >= 1 / tolerance::kMostScaling && factor[i] <= tolerance::kMostScaling) return;
    factor[i] = 1;
    frozen[at(i)] = 1;
  }
};

// D diagonal such that Σ_j D_i S_ij D_j = A_i t_i, by Newton's method in log D: with R_i the row sums of the scaled F,
//   (diag(A R) + D S D) δ = A (t − R),   D ← D exp(δ),
// where each step is solved by conjugate gradients preconditioned with diag(A R). (The symmetric Sinkhorn iteration
// D_i ← D_i √(t_i / R_i) [Knight2008] takes 100 products where this takes 30.) Patches that nearly only see each other may
// not agree on what they exchange: then there is no such D. Rows that would need more than kMostScaling are left out, so that
// the others are not bent to fit them; of all iterates the one with the least error is taken; and no row is left above its
// target. Rows of patches computed pair by pair are scaled first, each as a whole, by Sinkhorn's iteration: they are few.
RowScaling scaling_to_row_sums(const RowList& rows, const Eigen::ArrayXd& row_target,
                               const Eigen::ArrayXd& areas, const ReplacedRows& replaced) {
  constexpr int kSteps = 20;
  constexpr int kInner = 30;
  constexpr double kInnerTolerance = 1e-2;
  constexpr double kEnough = 1e-6;  // what is left goes to the diagonal
  constexpr int kSinkhorn = 30;
  const auto n = static_cast<Index>(rows.size());
  RowScaling out{Eigen::ArrayXd::Ones(n), Eigen::ArrayXd::Ones(n), Eigen::ArrayXd::Ones(n), replaced.is};
  Eigen::ArrayXd target = row_target;
  if (!replaced.patches.empty()) {
    Scaled whole(n);
    for (int step = 0; step < kSinkhorn; ++step) {
      Eigen::ArrayXd by = Eigen::ArrayXd::Ones(n);
      for (const Index i : replaced.patches) {
        double reached = 0;
        for (const Entry& e : rows[at(i)]) reached += static_cast<double>(e.value) * whole.factor[e.column];
        if (reached > 0) by[i] = std::sqrt(row_target[i] * areas[i] / (whole.factor[i] * reached));
      }
      for (const Index i : replaced.patches) whole.multiply(i, by[i]);
    }
    out.c = whole.factor;
    for_each_row(n, [&](Index i) {
      for (const Entry& e : rows[at(i)])
        if (replaced.has(i) || replaced.has(e.column))
          target[i] -= out.c[i] * out.c[e.column] * static_cast<double>(e.value) / areas[i];
    });
  }
  Scaled sampled(n);
  Eigen::ArrayXd& d = sampled.factor;
  for (const Index i : replaced.patches) {
    d[i] = 0;
    sampled.frozen[at(i)] = 1;
  }
  const auto product = [&](const Eigen::ArrayXd& x) {  // of the scaled F
    Eigen::ArrayXd y(n);
    const Eigen::ArrayXd dx = d * x;
    for_each_row(n, [&](Index i) {
      y[i] = d[i] / areas[i] *
             sum(rows[at(i)], [&](const Entry& e) { return static_cast<double>(e.value) * dx[e.column]; });
    });
    return y;
  };
  Eigen::ArrayXd reached, best_reached;
  double before = std::numeric_limits<double>::infinity();
  double least = before;
  for (int step = 0;; ++step) {
    reached = product(Eigen::ArrayXd::Ones(n));
    const Eigen::ArrayXd missing = (reached > 0).select(target - reached, 0.0);
    if (const double error = (missing.abs() * areas).sum(); error < least) {
      least = error;
      out.d = d;
      best_reached = reached;
    }
    Eigen::ArrayXd free(n);
    for (Index i = 0; i < n; ++i) free[i] = sampled.frozen[at(i)] == 0 ? 1 : 0;
    const double error = (free * missing.abs()).mean();
    if ((free * missing.abs()).maxCoeff() <= kEnough || !(error <= 0.5 * before) || step == kSteps) break;
    before = error;
    // In the unknown δ, with the rows divided by A R:  δ + F'δ / R = (t − R) / R.
    const Eigen::ArrayXd weight = areas * reached;
    const Eigen::ArrayXd inverse = (reached > 0).select(free / reached.max(1e-300), 0.0);
    Eigen::ArrayXd delta = Eigen::ArrayXd::Zero(n);
    Eigen::ArrayXd r = missing * inverse;
    Eigen::ArrayXd p = r;
    double rr = (weight * r * r).sum();
    const double enough = kInnerTolerance * kInnerTolerance * rr;
    for (int k = 0; k < kInner && rr > enough; ++k) {
      const Eigen::ArrayXd q = p + product(p) * inverse;
      const double curvature = (weight * p * q).sum();
      if (!(curvature > 0)) break;
      delta += rr / curvature * p;
      r -= rr / curvature * q;
      const double next = (weight * r * r).sum();
      p = r + next / rr * p;
      rr = next;
    }
    for (Index i = 0; i < n; ++i) {
      if (sampled.frozen[at(i)] != 0) continue;
      sampled.multiply(i, std::exp(std::clamp(delta[i], -1.0, 1.0)));
      if (sampled.frozen[at(i)] != 0) before = std::numeric_limits<double>::infinity();  // another problem
    }
  }
  reached = best_reached + (row_target - target);
  out.s = (reached > row_target).select(row_target / reached.max(1e-300), 1.0);
  return out;
}

// 1 − e, or 0 where nothing but the rounding of the sum e is left.
double not_lost(double e) {
  return 1 - e > tolerance::kNotLost ? 1 - e : 0;
}

[[noreturn]] void throw_not_finite(const Eigen::ArrayXd& sums) {
  Index i = 0;
  while (std::isfinite(sums[i])) ++i;
  throw InputError(fmt::format("form factors of patch {}: they add up to {}", i, sums[i]));
}

// Share of the directions from each patch that is lost through open sides or on the backs of patches.
std::vector<double> probe_escape(const Visibility& visibility, std::uint64_t& rays) {
  constexpr Index kProbes = 256;
  const auto probe = make_hemisphere(visibility, {.samples = kProbes});
  std::vector<double> escaped(at(visibility.mesh().patch_count()));
  tbb::parallel_for(Index{0}, (visibility.mesh().patch_count() + kBlock - 1) / kBlock, [&](Index block) {
    probe->rows(
        block * kBlock, std::min(visibility.mesh().patch_count(), (block + 1) * kBlock), false,
        [&](Index i, std::span<const Index>, std::span<const double>, double e) { escaped[at(i)] = e; });
  });
  rays += probe->rays();
  return escaped;
}

// Of rows of so many entries, and so many patches that are computed pair by pair.
void require_memory(const FormFactorMethod& method, Index n, double entries, std::size_t pairwise,
                    std::size_t limit) {
  if (limit == 0) return;
  // Each patch that is computed pair by pair has a whole row and a whole column.
  const double needed = assembly_bytes(n, entries + 2 * static_cast<double>(pairwise));
  if (needed <= static_cast<double>(limit)) return;
  const double per_row = needed / n;
  const auto gigabytes = [](double bytes) { return bytes / 1e9; };
  throw MemoryLimitError(fmt::format(
      "memory limit: F of {} patches may need {:.3g} GB with this method, the limit is {:.3g} GB; {} patches "
      "would fit "
      "for certain, as would the progressive solver, which does not store F",
      n, gigabytes(needed), gigabytes(static_cast<double>(limit)),
      method.max_entries_per_row() < n ? static_cast<Index>(static_cast<double>(limit) / per_row)
                                       : static_cast<Index>(std::sqrt(static_cast<double>(limit) / 24))));
}

// Calls finish(i, row), which turns a row into what is stored of it; the rows are used up.
template <class F>
FormFactorMatrix::Rows pack(RowList& rows, F&& finish) {
  FormFactorMatrix::Rows out;
  out.n = static_cast<Index>(rows.size());
  const std::size_t n = rows.size();
  const std::size_t entries = count_entries(rows);
  const bool sparse =
      entries * (sizeof(float) + sizeof(Index)) + (n + 1) * sizeof(std::size_t) < n * n * sizeof(float);
  if (sparse) {
    out.start.assign(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) out.start[i + 1] = out.start[i] + rows[i].size();
    out.columns.resize(entries);
    out.values.resize(entries);
  } else {
    out.values.assign(n * n, 0.0F);
  }
  for_each_row(out.n, [&](Index i) {
    Row& row = rows[at(i)];
    finish(i, row);
    for (std::size_t k = 0; k < row.size(); ++k) {
      const float f = row[k].value;
      if (sparse) {
        out.columns[out.start[at(i)] + k] = row[k].column;
        out.values[out.start[at(i)] + k] = f;
      } else {
        out.values[at(i) * n + at(row[k].column)] = f;
      }
    }
    row = {};
  });
  return out;
}

// F_ij = D S D / A_i, and how well it closes.
FormFactorMatrix::Rows pack_scaled(RowList& symmetric, const RowScaling& scaling,
                                   const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas,
                                   FormFactorQuality& quality, Eigen::ArrayXd& sums) {
  sums = Eigen::ArrayXd::Zero(areas.size());
  Eigen::ArrayXd reciprocity = sums;
  const Eigen::ArrayXd inverse = 1 / areas;
  FormFactorMatrix::Rows out = pack(symmetric, [&](Index i, Row& row) {
    double error = 0;
    for (Entry& e : row) {
      const double s = scaling(i, e.column) * static_cast<double>(e.value);
      const float f_ij = stored(s * inverse[i]);
      const float f_ji =
          stored(s * inverse[e.column]);  // what row j stores: S and its scaling are the same there
      error +=
          reciprocity_error(static_cast<double>(f_ij), static_cast<double>(f_ji), areas[i], areas[e.column]);
      e.value = f_ij;
    }
    sums[i] = sum(row);
    reciprocity[i] = error;
  });
  quality = quality_of(sums, target, reciprocity, areas);
  return out;
}

}  // namespace

double assembly_bytes(double patches, double entries) {
  return std::min(32 * patches * std::min(patches, entries), 24 * patches * patches);
}

FormFactorMatrix assemble(const FormFactorMethod& method, const Visibility& visibility,
                          const AssemblyOptions& options, AssemblyReport* report) {
  const PatchMesh& mesh = visibility.mesh();
  const Eigen::ArrayXd& areas = mesh.areas();
  const Index n = mesh.patch_count();
  AssemblyReport facts;
  require_memory(method, n, method.max_entries_per_row(), 0, options.memory_limit_bytes);

  Computed computed = compute_rows(method, n, method.reciprocal(), options.progress);
  RowList& rows = computed.rows;
  facts.completed = computed.completed;
  if (method.reciprocal()) mirror(rows, areas);
  facts.rays = method.rays();
  facts.pairs = method.pairs();
  std::vector<double> escaped = std::move(computed.escaped);
  const bool method_sees_escape = n > 0 && escaped[0] >= 0;
  ReplacedRows replaced = replaced_rows({}, n);
  if (!method.reciprocal() && facts.completed) {
    facts.pair_rows = options.pair_rows;
    if (!facts.pair_rows) {
      const Eigen::ArrayXd sums = row_sums(rows);
      PairwisePatches chosen = pairwise_patches(method, visibility, {sums.data(), at(n)});
      require_memory(method, n, static_cast<double>(count_entries(rows)) / std::max<Index>(n, 1),
                     chosen.patches.size(), options.memory_limit_bytes);
      facts.pair_rows = compute_pairs(chosen, areas, options.progress);
      if (chosen.factors) facts.rays += chosen.factors->rays();
      facts.warnings = std::move(chosen.warnings);
      facts.unreliable = chosen.unreliable;
      facts.completed = facts.pair_rows != nullptr;
    }
  }
  if (facts.pair_rows) {
    const PairRows& pairs = *facts.pair_rows;
    replaced = replaced_rows(pairs.patches, n);
    if (!replaced.patches.empty()) replace_by_pairs(rows, replaced, pairs);
    facts.lamps = pairs.lamps;
    facts.pairwise = static_cast<Index>(replaced.patches.size());
    // Where nothing stands between two patches the rows of all of them are exact: cells may miss a narrow gap.
    for (const Index i : visibility.convex() ? replaced.patches : pairs.misjudged)
      escaped[at(i)] = std::max(0.0, 1 - sum(rows[at(i)]));
  }

  // What the rows should sum to.
  Eigen::ArrayXd target = row_sums(rows);
  const bool close = options.close && !method.exact() && facts.completed;
  if (!method_sees_escape && close) escaped = probe_escape(visibility, facts.rays);
  if (n > 0 && escaped[0] >= 0) {
    const Eigen::Map<const Eigen::ArrayXd> e(escaped.data(), n);
    const Eigen::ArrayXd seeing = (target > 0).cast<double>() * areas;
    facts.closed_scene = seeing.sum() > 0 && (e * seeing).sum() <= tolerance::kClosedScene * seeing.sum();
    if (facts.closed_scene) {
      target = (target > 0).cast<double>();
    } else if (method_sees_escape) {  // pairs know better than directions
      for (Index i = 0; i < n; ++i)
        if (target[i] > 0) target[i] = replaced.has(i) ? std::min(1.0, target[i]) : not_lost(e[i]);
    }
  }
  if (method.exact() && facts.completed && n > 0 && (target > 0).any()) {
    // Exact rows tell themselves whether anything is missing.
    const Eigen::ArrayXd whole = (target > 0).cast<double>();
    facts.closed_scene = (target - whole).abs().maxCoeff() <= tolerance::kNoEscape;
    if (facts.closed_scene) target = whole;
  }
  // A method that looks at pairs knows the row sums of an open scene better than a sample of directions does.
  const bool known_target = facts.closed_scene || method_sees_escape;

  facts.closed_rows = close && known_target;
  if (facts.closed_rows) drop_isolated(rows, target);
  FormFactorMatrix::Rows packed;
  Eigen::ArrayXd sums;
  if (facts.closed_rows) {
    facts.before = symmetrise(rows, target, areas);
    // Where all that see anything were computed pair by pair there is nothing to scale them against.
    Index sampled = 0;
    for (Index i = 0; i < n; ++i) sampled += target[i] > 0 && !replaced.has(i) ? 1 : 0;
    if (sampled == 0) replaced = replaced_rows({}, n);
    packed = pack_scaled(rows, scaling_to_row_sums(rows, target, areas, replaced), target, areas, facts.after,
                         sums);
  } else if (options.close && (target > 1).any()) {  // at most 1, even where the right sum is not known
    facts.before = symmetrise(rows, target, areas);
    const Eigen::ArrayXd one = Eigen::ArrayXd::Ones(n);
    packed = pack_scaled(rows, {one, target.max(1.0).inverse(), one, replaced.is}, target.min(1.0), areas,
                         facts.after, sums);
    target = sums;
  } else {
    facts.before = facts.after = measure(rows, target, areas);
    sums = row_sums(rows);
    packed = pack(rows, [](Index, Row&) {});
  }
  facts.isolated_patches = static_cast<Index>((sums == 0).count());
  const bool known_sums = facts.closed_rows || (facts.completed && facts.closed_scene && method.exact());
  const Eigen::ArrayXd reached = known_sums ? target : sums;
  if (known_sums) {
    const Eigen::ArrayXd remainder = target - sums;
    packed.diagonal.assign(remainder.begin(), remainder.end());
  }
  const Eigen::ArrayXd lost = 1 - reached;
  packed.escaped.assign(lost.begin(), lost.end());
  const Eigen::ArrayXd seeing = (sums != 0).cast<double>() * areas;
  facts.escaped_mean = seeing.sum() > 0 ? (lost * seeing).sum() / seeing.sum() : 0;

  if (!sums.isFinite().all()) throw_not_finite(sums);
  if (facts.closed_rows && facts.after.closure_error_mean > 1e-3) {
    facts.warnings.push_back(
        fmt::format("patches do not agree on what they exchange: {:.2g} % of what leaves them, on average, "
                    "could not be placed and "
                    "stays where it is; the error estimate takes it into account",
                    100 * facts.after.closure_error_mean));
  }
  if (report != nullptr) *report = std::move(facts);
  return FormFactorMatrix(std::move(packed));
}

}  // namespace radiosity
