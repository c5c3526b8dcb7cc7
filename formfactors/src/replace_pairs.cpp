// SPDX-License-Identifier: GPL-3.0-or-later
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
