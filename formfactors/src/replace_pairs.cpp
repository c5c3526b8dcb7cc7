// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"

namespace radiosity {

std::shared_ptr<const PairRows> compute_pairs(const PairwisePatches& chosen, const Eigen::ArrayXd& areas,
                                              const Progress& progress, const Ranks* ranks) {
  const std::size_t count = chosen.patches.size();
  auto out = std::make_shared<PairRows>(PairRows{chosen.patches, chosen.misjudged, chosen.lamps,
                                                 chosen.hidden, RowList(count), RowList(count)});
  const auto compute = [&](Index k) {
    if (ranks != nullptr && k % ranks->count() != ranks->rank()) return;
    const Index i = chosen.patches[k];
    std::vector<double> all;
    chosen.factors->cluster_row(i, false, all);
    const auto seen = static_cast<std::size_t>(std::ranges::count_if(all, [](double f) { return f != 0; }));
    out->rows[k].reserve(seen);
    out->columns[k].reserve(seen);
    for (Index j = 0; j < static_cast<Index>(all.size()); ++j) {
      if (all[j] == 0) continue;
      out->rows[k].push_back({j, rounded_down(all[j] / areas[i])});
      out->columns[k].push_back({j, rounded_down(all[j] / areas[j])});
    }
  };
  const bool completed = for_each_block(
      static_cast<Index>(count), 1, [&](Index k, Index) { compute(k); },
      [&](Index) { return !progress || progress(1); });
  if (!on_all(ranks, completed)) return nullptr;
  return out;
}

// Values of which each is set on one rank, and 0 on the others.
static void unite(const Ranks* ranks, std::span<double> values) {
  if (ranks == nullptr) return;
  std::vector<std::uint64_t> bits(values.size());
  std::ranges::transform(values, bits.begin(), [](double x) { return std::bit_cast<std::uint64_t>(x); });
  ranks->sum(bits);
  std::ranges::transform(bits, values.begin(), [](std::uint64_t x) { return std::bit_cast<double>(x); });
}

BandArray pair_errors(const PairRows& pairs, const Visibility& visibility, const BandArray& radiosity,
                      std::span<const Index> clusters, const Ranks* ranks) {
  const PatchMesh& mesh = visibility.mesh();
  BandArray out =
      BandArray::Constant(mesh.cluster_count(), radiosity.cols(), std::numeric_limits<double>::quiet_NaN());
  std::vector<Index> place(mesh.cluster_count(), -1);  // among the patches of `pairs`
  for (std::size_t k = 0; k < pairs.patches.size(); ++k) place[pairs.patches[k]] = static_cast<Index>(k);
  constexpr Index kMore = 4;
  const PairFactors better(visibility, kMore * pairwise_samples(visibility), 2, kFactorTolerance,
                           members_of(mesh, clusters));
  const auto count = static_cast<Eigen::Index>(clusters.size());
  Eigen::ArrayXXd given = Eigen::ArrayXXd::Zero(static_cast<Eigen::Index>(pairs.patches.size()), count);
  for (Eigen::Index k = 0; k < given.rows(); ++k)
    for (Eigen::Index c = 0; c < count; ++c) {
      const Row& column = pairs.columns[k];
      const auto at = std::ranges::lower_bound(column, clusters[c], {}, &Entry::column);
      if (at != column.end() && at->column == clusters[c]) given(k, c) = static_cast<double>(at->value);
    }
  unite(ranks, {given.data(), static_cast<std::size_t>(given.size())});
  BandArray errors = BandArray::Zero(count, radiosity.cols());
  tbb::parallel_for(Eigen::Index{0}, count, [&](Eigen::Index c) {
    if (ranks != nullptr && c % ranks->count() != ranks->rank()) return;
    const Index i = clusters[c];
    Eigen::ArrayXd factors = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(pairs.patches.size()));
    for (const Index member : mesh.members(i))
      better.for_each_in_row(
          member, false,
          [&](Index j, double mutual) {
            if (const Index k = place[mesh.cluster(j)]; k >= 0)
              factors[k] += mutual / mesh.cluster_areas()[i];
          },
          [&](const std::vector<Index>& patches) {
            return std::ranges::all_of(patches, [&](Index j) { return place[mesh.cluster(j)] < 0; });
          });
    for (Eigen::Index k = 0; k < factors.size(); ++k)
      errors.row(c) += (given(k, c) - factors[k]) * radiosity.row(pairs.patches[k]);
  });
  unite(ranks, {errors.data(), static_cast<std::size_t>(errors.size())});
  for (Eigen::Index c = 0; c < count; ++c) out.row(clusters[c]) = errors.row(c);
  return out;
}

ReplacedRows::ReplacedRows(Index n, std::vector<Index> replaced) : patches(std::move(replaced)), is(n, 0) {
  for (const Index i : patches) is[i] = 1;
}

void drop_hidden(RowList& rows, const std::vector<Index>& hidden) {
  if (hidden.empty()) return;
  std::vector<std::uint8_t> is(rows.size(), 0);
  for (const Index i : hidden) is[i] = 1;
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (is[i] != 0)
      rows[i].clear();
    else
      std::erase_if(rows[i], [&](const Entry& e) { return is[e.column] != 0; });
  });
}

ReplacedRows replace_by_pairs(RowList& rows, const PairRows& pairs, const Ranks* ranks) {
  ReplacedRows replaced(static_cast<Index>(rows.size()), pairs.patches);
  if (pairs.patches.empty()) return replaced;
  const auto count = static_cast<Index>(pairs.patches.size());
  for (Index k = 0; k < count; ++k) rows[pairs.patches[k]] = ranks == nullptr ? pairs.rows[k] : Row();
  if (ranks != nullptr) {
    std::vector<Entry> sent;  // row k goes to its owner
    Index of = 0;
    const auto take_row = [&] {
      if (!sent.empty()) rows[pairs.patches[of]] = Row(sent.begin(), sent.end());
      sent.clear();
    };
    exchange_entries<float>(
        *ranks, count, [&](Index k) { return pairs.rows[k].size(); },
        [&](Index k, const auto& send) {
          for (const Entry& e : pairs.rows[k]) send(ranks->owner(pairs.patches[k]), e.column, e.value);
        },
        [&](Index k, Index j, float value) {
          if (k != of) take_row();
          of = k;
          sent.push_back({j, value});
        });
    take_row();
  }
  const RowList exact = transpose(pairs.columns, rows.size(), ranks, pairs.patches);
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (replaced.has(i)) return;
    thread_local std::vector<Entry> merged;
    merged.clear();
    merge(rows[i], exact[i], [&](Index j, double sampled, double pair) {
      const double f = replaced.has(j) ? pair : sampled;
      if (f > 0) merged.push_back({j, static_cast<float>(f)});
    });
    rows[i] = Row(merged.begin(), merged.end());
  });
  return replaced;
}

}  // namespace radiosity
