// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"

namespace radiosity {

std::shared_ptr<const PairRows> compute_pairs(const PairwisePatches& chosen, const Eigen::ArrayXd& areas,
                                              const Progress& progress) {
  const std::size_t count = chosen.patches.size();
  auto out = std::make_shared<PairRows>(PairRows{chosen.patches, chosen.misjudged, chosen.lamps,
                                                 chosen.hidden, RowList(count), RowList(count)});
  const auto compute = [&](Index k) {
    const Index i = chosen.patches[k];
    std::vector<double> all;
    chosen.factors->cluster_row(i, false, all);
    for (Index j = 0; j < static_cast<Index>(all.size()); ++j) {
      if (all[j] == 0) continue;
      out->rows[k].push_back({j, rounded_down(all[j] / areas[i])});
      out->columns[k].push_back({j, rounded_down(all[j] / areas[j])});
    }
  };
  const bool completed = for_each_block(
      static_cast<Index>(count), 1, [&](Index k, Index) { compute(k); },
      [&](Index) { return !progress || progress(1); });
  if (!completed) return nullptr;
  return out;
}

BandArray pair_errors(const PairRows& pairs, const Visibility& visibility, const BandArray& radiosity,
                      std::span<const Index> clusters) {
  const PatchMesh& mesh = visibility.mesh();
  BandArray out =
      BandArray::Constant(mesh.cluster_count(), radiosity.cols(), std::numeric_limits<double>::quiet_NaN());
  std::vector<Index> place(mesh.cluster_count(), -1);  // among the patches of `pairs`
  for (std::size_t k = 0; k < pairs.patches.size(); ++k) place[pairs.patches[k]] = static_cast<Index>(k);
  std::vector<Index> members;
  for (const Index c : clusters)
    members.insert(members.end(), mesh.members(c).begin(), mesh.members(c).end());
  constexpr Index kMore = 4;
  const PairFactors better(visibility, kMore * pairwise_samples(visibility), 2, kFactorTolerance, members);
  tbb::parallel_for(std::size_t{0}, clusters.size(), [&](std::size_t c) {
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
    out.row(i).setZero();
    for (Eigen::Index k = 0; k < factors.size(); ++k) {
      const Row& column = pairs.columns[k];
      const auto at = std::ranges::lower_bound(column, i, {}, &Entry::column);
      const double given = at != column.end() && at->column == i ? static_cast<double>(at->value) : 0;
      out.row(i) += (given - factors[k]) * radiosity.row(pairs.patches[k]);
    }
  });
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

ReplacedRows replace_by_pairs(RowList& rows, const PairRows& pairs) {
  ReplacedRows replaced(static_cast<Index>(rows.size()), pairs.patches);
  if (pairs.patches.empty()) return replaced;
  for (std::size_t k = 0; k < pairs.patches.size(); ++k) rows[pairs.patches[k]] = pairs.rows[k];
  RowList exact = transpose(pairs.columns, rows.size());
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (replaced.has(i)) return;
    for (Entry& e : exact[i]) e.column = pairs.patches[e.column];
    Row merged;
    merged.reserve(rows[i].size() + exact[i].size());
    merge(rows[i], exact[i], [&](Index j, double sampled, double pair) {
      const double f = replaced.has(j) ? pair : sampled;
      if (f > 0) merged.push_back({j, static_cast<float>(f)});
    });
    rows[i] = std::move(merged);
  });
  return replaced;
}

}  // namespace radiosity
