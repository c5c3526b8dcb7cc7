// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/assemble.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "methods.hpp"
#include "pair_factors.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

// Rows that one task computes.
constexpr Index kBlock = 16;

// Sparse rows while they are being made.
struct Row {
  std::vector<Index> columns;
  std::vector<float> values;
};
using RowList = std::vector<Row>;

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

// Rounded towards zero: rows of single precision never exceed the sums that they stand for, and what they lack goes to a
// diagonal that is never negative.
float stored(double f) {
  const auto nearest = static_cast<float>(f);
  return static_cast<double>(nearest) > f ? std::nextafter(nearest, 0.0F) : nearest;
}

template <class F>
void for_each_row(Index n, F&& f) {
  tbb::parallel_for(tbb::blocked_range<Index>(0, n, 64), [&](const tbb::blocked_range<Index>& block) {
    for (Index i = block.begin(); i != block.end(); ++i) f(i);
  });
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
  std::atomic<bool> stop = false;
  std::atomic<Index> rows_done = 0;
  std::mutex watching;
  double shown = 0;
  tbb::parallel_for(Index{0}, (n + kBlock - 1) / kBlock, [&](Index block) {
    if (stop) return;
    const Index first = block * kBlock;
    const Index last = std::min(n, first + kBlock);
    method.rows(first, last, upper,
                [&](Index i, std::span<const Index> columns, std::span<const double> values, double escaped) {
                  Row& row = out.rows[at(i)];
                  row.columns.assign(columns.begin(), columns.end());
                  row.values.resize(values.size());
                  std::transform(values.begin(), values.end(), row.values.begin(), stored);
                  out.escaped[at(i)] = escaped;
                });
    rows_done += last - first;
    if (progress) {
      const std::lock_guard lock(watching);
      const double k = rows_done;
      // With `upper`, the first k rows hold the share 1 − (1 − k/n)² of the entries.
      const double fraction = upper ? 1 - (1 - k / n) * (1 - k / n) : k / n;
      if (fraction > shown) {
        shown = fraction;
        if (!progress(fraction)) stop = true;
      }
    }
  });
  out.completed = rows_done == n;
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
      for (const Index j : rows[i].columns) ++place[block][at(j)];
  });
  RowList t(n);
  for_each_row(static_cast<Index>(n), [&](Index j) {
    std::uint32_t sum = 0;
    for (auto& block : place) sum += std::exchange(block[at(j)], sum);
    t[at(j)].columns.resize(sum);
    t[at(j)].values.resize(sum);
  });
  tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
    for (std::size_t i = first(block); i < first(block + 1); ++i) {
      for (std::size_t k = 0; k < rows[i].columns.size(); ++k) {
        const std::size_t j = at(rows[i].columns[k]);
        const std::uint32_t p = place[block][j]++;
        t[j].columns[p] = static_cast<Index>(i);
        t[j].values[p] = rows[i].values[k];
      }
    }
  });
  return t;
}

// Calls f(j, a_j, b_j) for every column of either row, ascending, with 0 where one has no entry.
template <class F>
void merge(const Row& a, const Row& b, F&& f) {
  std::size_t p = 0;
  std::size_t q = 0;
  while (p < a.columns.size() || q < b.columns.size()) {
    const bool take_a = q == b.columns.size() || (p < a.columns.size() && a.columns[p] <= b.columns[q]);
    const bool take_b = p == a.columns.size() || (q < b.columns.size() && b.columns[q] <= a.columns[p]);
    const Index j = take_a ? a.columns[p] : b.columns[q];
    f(j, take_a ? static_cast<double>(a.values[p]) : 0, take_b ? static_cast<double>(b.values[q]) : 0);
    p += take_a ? 1 : 0;
    q += take_b ? 1 : 0;
  }
}

// Adds the lower triangle of a reciprocal F: F_ji = F_ij A_i / A_j.
void mirror(RowList& upper, const Eigen::ArrayXd& areas) {
  const RowList lower = transpose(upper);
  for_each_row(static_cast<Index>(upper.size()), [&](Index j) {
    const Row& left = lower[at(j)];
    Row& row = upper[at(j)];
    Row full;
    full.columns.reserve(left.columns.size() + row.columns.size());
    full.values.reserve(full.columns.capacity());
    for (std::size_t k = 0; k < left.columns.size(); ++k) {
      const Index i = left.columns[k];
      full.columns.push_back(i);
      full.values.push_back(stored(static_cast<double>(left.values[k]) * areas[i] / areas[j]));
    }
    full.columns.insert(full.columns.end(), row.columns.begin(), row.columns.end());
    full.values.insert(full.values.end(), row.values.begin(), row.values.end());
    row = std::move(full);
  });
}

// Replaces rows and columns of the lamps by factors of single pairs.
void replace_lamps(RowList& rows, const std::vector<Index>& lamps, const PairFactors& pairs,
                   const Eigen::ArrayXd& areas) {
  const auto n = static_cast<Index>(rows.size());
  std::vector<Eigen::ArrayXd> mutual(lamps.size(), Eigen::ArrayXd(n));
  for_each_row(n, [&](Index i) {
    for (std::size_t k = 0; k < lamps.size(); ++k)
      mutual[k][i] = i == lamps[k] ? 0 : pairs.mutual_area(i, lamps[k]);
  });
  for_each_row(n, [&](Index i) {
    Row exact;
    const auto own = std::lower_bound(lamps.begin(), lamps.end(), i);
    if (own != lamps.end() && *own == i) {
      const Eigen::ArrayXd& row = mutual[at(static_cast<Index>(own - lamps.begin()))];
      for (Index j = 0; j < n; ++j) {
        if (row[j] <= 0) continue;
        exact.columns.push_back(j);
        exact.values.push_back(stored(row[j] / areas[i]));
      }
      rows[at(i)] = std::move(exact);
      return;
    }
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      if (mutual[k][i] <= 0) continue;
      exact.columns.push_back(lamps[k]);
      exact.values.push_back(stored(mutual[k][i] / areas[i]));
    }
    Row merged;
    merge(rows[at(i)], exact, [&](Index j, double sampled, double pair) {
      const double f = std::binary_search(lamps.begin(), lamps.end(), j) ? pair : sampled;
      if (f <= 0) return;
      merged.columns.push_back(j);
      merged.values.push_back(static_cast<float>(f));
    });
    rows[at(i)] = std::move(merged);
  });
}

// Two estimates of the same A_i F_ij, one from either end. The one from i, of K samples, has a variance in proportion to A_i;
// weighted by inverse variance,   A_i F_ij = (F_ij + F_ji) / (1/A_i + 1/A_j).
void symmetrise(RowList& rows, const RowList& t, const Eigen::ArrayXd& areas) {
  RowList symmetric(rows.size());
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    Row& row = symmetric[at(i)];
    merge(rows[at(i)], t[at(i)], [&](Index j, double f_ij, double f_ji) {
      row.columns.push_back(j);
      row.values.push_back(stored((f_ij + f_ji) * areas[j] / (areas[i] + areas[j])));
    });
  });
  rows = std::move(symmetric);
}

double sum(const Row& row) {
  double s = 0;
  for (const float f : row.values) s += static_cast<double>(f);
  return s;
}

Eigen::ArrayXd row_sums(const RowList& rows) {
  Eigen::ArrayXd sums(static_cast<Index>(rows.size()));
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) { sums[i] = sum(rows[at(i)]); });
  return sums;
}

// S ← D S D, and where that leaves row sums R_i above their targets
//   S_ij ← S_ij min(s_i, s_j),   s_i = min(1, t_i / R_i).
void scale(RowList& rows, const Eigen::ArrayXd& d, const Eigen::ArrayXd& reached,
           const Eigen::ArrayXd& target) {
  const Eigen::ArrayXd cap = (reached > target).select(target / reached.max(1e-300), 1.0);
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    Row& row = rows[at(i)];
    for (std::size_t k = 0; k < row.columns.size(); ++k) {
      const Index j = row.columns[k];
      row.values[k] = stored(d[i] * static_cast<double>(row.values[k]) * d[j] * std::min(cap[i], cap[j]));
    }
  });
}

// S ← D S D with Σ_j S_ij = A_i t_i, D diagonal, by Newton's method in log D: with R_i the row sums of the scaled F,
//   (diag(A R) + D S D) δ = A (t − R),   D ← D exp(δ),
// where each step is solved by conjugate gradients preconditioned with diag(A R). (The symmetric Sinkhorn iteration
// D_i ← D_i √(t_i / R_i) [Knight2008] takes 100 products where this takes 30.) Where patches that nearly only see each other do
// not agree on what they exchange there is no such D: the iteration ends where it stops paying, and no row is left above its
// target.
void scale_to_row_sums(RowList& rows, const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas) {
  constexpr int kSteps = 20;
  constexpr int kInner = 30;
  constexpr double kInnerTolerance = 1e-2;
  constexpr double kEnough = 1e-6;  // what is left goes to the diagonal
  const auto n = static_cast<Index>(rows.size());
  Eigen::ArrayXd d = Eigen::ArrayXd::Ones(n);
  const auto product = [&](const Eigen::ArrayXd& x) {  // of the scaled F
    Eigen::ArrayXd y(n);
    const Eigen::ArrayXd dx = d * x;
    for_each_row(n, [&](Index i) {
      const Row& row = rows[at(i)];
      double s = 0;
      for (std::size_t k = 0; k < row.columns.size(); ++k)
        s += static_cast<double>(row.values[k]) * dx[row.columns[k]];
      y[i] = d[i] * s;
    });
    return y;
  };
  Eigen::ArrayXd reached;
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0;; ++step) {
    reached = product(Eigen::ArrayXd::Ones(n));
    const Eigen::ArrayXd missing = (reached > 0).select(target - reached, 0.0);
    const double error = missing.abs().mean();
    if (missing.abs().maxCoeff() <= kEnough || error > 0.5 * before || step == kSteps) break;
    before = error;
    // In the unknown δ, with the rows divided by A R:  δ + F'δ / R = (t − R) / R.
    const Eigen::ArrayXd weight = areas * reached;
    const Eigen::ArrayXd inverse = (reached > 0).select(1 / reached.max(1e-300), 0.0);
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
    d *= delta.max(-1).min(1).exp();
  }
  scale(rows, d, reached, target);
}

// t is the transpose of rows.
FormFactorQuality measure(const RowList& rows, const RowList& t, const Eigen::ArrayXd& target,
                          const Eigen::ArrayXd& areas) {
  const auto n = static_cast<Index>(rows.size());
  FormFactorQuality quality;
  if (n == 0) return quality;
  const Eigen::ArrayXd closure = (row_sums(rows) - target).abs();
  quality.closure_error_max = closure.maxCoeff();
  quality.closure_error_mean = (closure * areas).sum() / areas.sum();
  Eigen::ArrayXd reciprocity = Eigen::ArrayXd::Zero(n);
  for_each_row(n, [&](Index i) {
    merge(rows[at(i)], t[at(i)], [&](Index j, double f_ij, double f_ji) {
      reciprocity[i] += std::abs(f_ij - f_ji * areas[j] / areas[i]) / 2;
    });
  });
  quality.reciprocity_error_max = reciprocity.maxCoeff();
  quality.reciprocity_error_mean = (reciprocity * areas).sum() / areas.sum();
  return quality;
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

void require_memory(const FormFactorMethod& method, Index n, std::size_t limit) {
  if (limit == 0) return;
  // Rows, their transpose and the symmetric union of both stand in memory at the same time, 8 bytes an entry.
  const double entries = static_cast<double>(n) * std::min(n, method.max_entries_per_row());
  const double needed = std::min(32 * entries, 24 * static_cast<double>(n) * n);
  if (needed <= static_cast<double>(limit)) return;
  const double per_row = needed / n;
  const auto gigabytes = [](double bytes) { return bytes / 1e9; };
  throw InputError(fmt::format(
      "memory limit: F of {} patches may need {:.3g} GB with this method, the limit is {:.3g} GB; {} patches "
      "would fit "
      "for certain, as would the progressive solver, which does not store F",
      n, gigabytes(needed), gigabytes(static_cast<double>(limit)),
      method.max_entries_per_row() < n ? static_cast<Index>(static_cast<double>(limit) / per_row)
                                       : static_cast<Index>(std::sqrt(static_cast<double>(limit) / 24))));
}

FormFactorMatrix::Rows pack(RowList& rows) {
  FormFactorMatrix::Rows out;
  out.n = static_cast<Index>(rows.size());
  const std::size_t n = rows.size();
  std::size_t entries = 0;
  for (const Row& row : rows) entries += row.columns.size();
  const bool sparse =
      entries * (sizeof(float) + sizeof(Index)) + (n + 1) * sizeof(std::size_t) < n * n * sizeof(float);
  if (sparse) {
    out.start.assign(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) out.start[i + 1] = out.start[i] + rows[i].columns.size();
    out.columns.resize(entries);
    out.values.resize(entries);
  } else {
    out.values.assign(n * n, 0.0F);
  }
  for_each_row(out.n, [&](Index i) {
    Row& row = rows[at(i)];
    if (sparse) {
      std::copy(row.columns.begin(), row.columns.end(),
                out.columns.begin() + static_cast<std::ptrdiff_t>(out.start[at(i)]));
      std::copy(row.values.begin(), row.values.end(),
                out.values.begin() + static_cast<std::ptrdiff_t>(out.start[at(i)]));
    } else {
      for (std::size_t k = 0; k < row.columns.size(); ++k)
        out.values[at(i) * n + at(row.columns[k])] = row.values[k];
    }
    row = {};
  });
  return out;
}

}  // namespace

FormFactorMatrix assemble(const FormFactorMethod& method, const Visibility& visibility,
                          const AssemblyOptions& options, AssemblyReport* report) {
  const PatchMesh& mesh = visibility.mesh();
  const Eigen::ArrayXd& areas = mesh.areas();
  const Index n = mesh.patch_count();
  AssemblyReport facts;
  require_memory(method, n, options.memory_limit_bytes);

  Computed computed = compute_rows(method, n, method.reciprocal(), options.progress);
  RowList& rows = computed.rows;
  facts.completed = computed.completed;
  if (method.reciprocal()) mirror(rows, areas);
  facts.rays = method.rays();
  facts.pairs = method.pairs();
  if (!method.reciprocal() && facts.completed) {
    const std::vector<Index> lamps = lamps_of(mesh);
    if (!lamps.empty()) {
      const PairFactors pairs(visibility, kLampSamples, 1);
      replace_lamps(rows, lamps, pairs, areas);
      facts.rays += pairs.rays();
      facts.lamps = static_cast<Index>(lamps.size());
    }
  }

  // What the rows should sum to.
  Eigen::ArrayXd target = row_sums(rows);
  std::vector<double> escaped = std::move(computed.escaped);
  const bool method_sees_escape = n > 0 && escaped[0] >= 0;
  const bool close = options.close && !method.exact() && facts.completed;
  if (!method_sees_escape && close) escaped = probe_escape(visibility, facts.rays);
  if (n > 0 && escaped[0] >= 0) {
    const Eigen::Map<const Eigen::ArrayXd> e(escaped.data(), n);
    const Eigen::ArrayXd seeing = (target > 0).cast<double>() * areas;
    facts.closed_scene = seeing.sum() > 0 && (e * seeing).sum() <= tolerance::kClosedScene * seeing.sum();
    if (facts.closed_scene) {
      target = (target > 0).cast<double>();
    } else if (method_sees_escape) {
      target = (target > 0).select(1 - e, 0.0);
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

  RowList t = transpose(rows);
  facts.before = measure(rows, t, target, areas);
  facts.closed_rows = close && known_target;
  if (facts.closed_rows) {
    if (!method.reciprocal()) symmetrise(rows, t, areas);
    scale_to_row_sums(rows, target, areas);
    t = transpose(rows);
    facts.after = measure(rows, t, target, areas);
  } else if (options.close && (target > 1).any()) {  // at most 1, even where the right sum is not known
    const Eigen::ArrayXd one = Eigen::ArrayXd::Ones(n);
    scale(rows, one, target, one);
    target = row_sums(rows);
    t = transpose(rows);
    facts.after = measure(rows, t, target, areas);
  } else {
    facts.after = facts.before;
  }
  t = {};

  const Eigen::ArrayXd sums = row_sums(rows);
  facts.blind_patches = static_cast<Index>((sums == 0).count());
  FormFactorMatrix::Rows packed = pack(rows);
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

  if (facts.closed_rows && facts.after.closure_error_max > 1e-3) {
    facts.warnings.push_back(
        fmt::format("rows of F could not be scaled to their sums: the largest error left is {:.2g}; patches "
                    "that nearly only see "
                    "each other do not agree on what they exchange",
                    facts.after.closure_error_max));
  }
  if (facts.completed && facts.blind_patches > 0) {
    facts.warnings.push_back(fmt::format("{} of {} patches see no other patch; they keep their own emission",
                                         facts.blind_patches, n));
  }
  if (report != nullptr) *report = std::move(facts);
  return FormFactorMatrix(std::move(packed));
}

}  // namespace radiosity
