// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/aggregate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {

FormFactorMatrix aggregate(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                           const Coarsening& coarsening) {
  const auto n = static_cast<std::size_t>(f.size());
  const auto count = static_cast<std::size_t>(coarsening.count);
  if (areas.size() != f.size() || coarsening.parent.size() != n)
    throw InputError(
        fmt::format("form factors of larger patches: F has {} rows, there are {} areas and {} parents", n,
                    areas.size(), coarsening.parent.size()));
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

  FormFactorMatrix::Rows out = store(rows);
  out.diagonal = std::move(diagonals);
  out.escaped = std::move(escapes);
  return FormFactorMatrix(std::move(out));
}

}  // namespace radiosity
