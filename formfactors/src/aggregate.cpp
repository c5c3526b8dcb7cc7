// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/aggregate.hpp"

#include <fmt/format.h>

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <utility>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// Unites the columns of rows: row(i, use) calls use(j, value) of each entry of row i, whose sums over unions are taken times weight[i].
template <class RowOf>
RowList condensed(Index n, const Coarsening& coarsening, const Eigen::ArrayXd& weight, const RowOf& row) {
  RowList out(n);
  tbb::enumerable_thread_specific<std::vector<double>> all_sums(
      std::vector<double>(static_cast<std::size_t>(coarsening.count), 0.0));
  for_each_row(n, [&](Index i) {
    std::vector<double>& sums = all_sums.local();
    std::vector<Index> met;
    row(i, [&](Index j, float value) {
      if (value == 0) return;
      double& sum = sums[coarsening.parent[j]];
      if (sum == 0) met.push_back(coarsening.parent[j]);
      sum += static_cast<double>(value);
    });
    std::ranges::sort(met);
    out[i].reserve(met.size());
    for (const Index j : met) out[i].push_back({j, rounded_down(weight[i] * std::exchange(sums[j], 0))});
  });
  return out;
}

// Columns are united where their rows are, then rows as columns of the transpose, so that nobody needs more than its own rows.
FormFactorMatrix aggregate_on_ranks(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                                    const Coarsening& coarsening, const Ranks& ranks) {
  const Index n = f.size(), count = coarsening.count;
  RowList exchanged =
      condensed(n, coarsening, areas, [&](Index i, const auto& use) { for_each_entry(f.row(i), use); });
  exchanged = transpose(exchanged, &ranks);
  exchanged = condensed(n, coarsening, Eigen::ArrayXd::Ones(n), [&](Index j, const auto& use) {
    for (const Entry& e : exchanged[j]) use(e.column, e.value);
  });
  exchanged = transpose(exchanged, &ranks);
  exchanged.resize(static_cast<std::size_t>(count));

  Eigen::ArrayXd area = Eigen::ArrayXd::Zero(count), escaped = area, diagonal(count);
  for (Index i = 0; i < n; ++i) {
    area[coarsening.parent[i]] += areas[i];
    escaped[coarsening.parent[i]] += areas[i] * f.escaped()[i];
  }
  escaped /= area;
  for (Index g = 0; g < count; ++g) {
    for (Entry& e : exchanged[g]) e.value = rounded_down(static_cast<double>(e.value) / area[g]);
    diagonal[g] = 1 - escaped[g] - sum(exchanged[g]);
  }
  ranks.gather(diagonal);
  FormFactorMatrix::Rows out = store(exchanged, &ranks);
  out.diagonal.assign(diagonal.begin(), diagonal.end());
  out.escaped.assign(escaped.begin(), escaped.end());
  return FormFactorMatrix(std::move(out));
}

}  // namespace

FormFactorMatrix aggregate(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                           const Coarsening& coarsening, const Ranks* ranks) {
  const auto n = static_cast<std::size_t>(f.size());
  const auto count = static_cast<std::size_t>(coarsening.count);
  if (areas.size() != f.size() || coarsening.parent.size() != n)
    throw InputError(
        fmt::format("form factors of larger patches: F has {} rows, there are {} areas and {} parents", n,
                    areas.size(), coarsening.parent.size()));
  if (ranks != nullptr) return aggregate_on_ranks(f, areas, coarsening, *ranks);
  std::vector<std::vector<Index>> members(count);
  for (std::size_t i = 0; i < n; ++i) members[coarsening.parent[i]].push_back(static_cast<Index>(i));

  const Eigen::ArrayXd escaped_of = f.escaped();
  RowList rows(count);
  std::vector<double> diagonals(count), escapes(count);
  constexpr Index kBlock = 16;
  for_each_block(coarsening.count, kBlock, [&](Index first, Index last) {
    std::vector<double> sums(count, 0.0);
    std::vector<Index> met;
    for (Index group = first; group < last; ++group) {
      const auto g = static_cast<std::size_t>(group);
      double area = 0, diagonal = 0, escaped = 0;
      for (const Index i : members[g]) {
        area += areas[i];
        const FormFactorRow row = f.row(i);
        for_each_entry(row, [&](Index j, float f_ij) {
          if (f_ij == 0) return;
          const Index column = coarsening.parent[j];
          double& sum = sums[column];
          if (sum == 0) met.push_back(column);
          sum += areas[i] * static_cast<double>(f_ij);
        });
        diagonal += areas[i] * row.diagonal;
        escaped += areas[i] * escaped_of[i];
      }
      std::sort(met.begin(), met.end());
      diagonals[g] = diagonal / area;
      for (const Index j : met) {
        const double exact = std::exchange(sums[j], 0) / area;
        rows[g].push_back({j, rounded_down(exact)});
        diagonals[g] += exact - static_cast<double>(rows[g].back().value);
      }
      met.clear();
      escapes[g] = escaped / area;
    }
  });

  FormFactorMatrix::Rows out = store(rows, nullptr);
  out.diagonal = std::move(diagonals);
  out.escaped = std::move(escapes);
  return FormFactorMatrix(std::move(out));
}

}  // namespace radiosity
