// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/aggregate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"
#include "rounded_down.hpp"

namespace radiosity {
namespace {

struct Row {
  std::vector<Index> columns;
  std::vector<float> values;
  double diagonal = 0;
};

}  // namespace

FormFactorMatrix aggregate(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                           const Coarsening& coarsening) {
  const auto n = static_cast<std::size_t>(f.size());
  const auto count = static_cast<std::size_t>(coarsening.count);
  if (areas.size() != f.size() || coarsening.parent.size() != n)
    throw InputError(
        fmt::format("form factors of larger patches: F has {} rows, there are {} areas and {} parents", n,
                    areas.size(), coarsening.parent.size()));
  std::vector<std::vector<Index>> members(count);
  for (std::size_t i = 0; i < n; ++i)
    members[static_cast<std::size_t>(coarsening.parent[i])].push_back(static_cast<Index>(i));

  const Eigen::ArrayXd escaped_of = f.escaped();
  std::vector<Row> rows(count);
  FormFactorMatrix::Rows out;
  out.n = coarsening.count;
  out.escaped.resize(count);
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
          const Index column = coarsening.parent[static_cast<std::size_t>(j)];
          double& sum = sums[static_cast<std::size_t>(column)];
          if (sum == 0) met.push_back(column);
          sum += areas[i] * static_cast<double>(f_ij);
        });
        diagonal += areas[i] * row.diagonal;
        escaped += areas[i] * escaped_of[i];
      }
      std::sort(met.begin(), met.end());
      Row& row = rows[g];
      row.columns = met;
      row.diagonal = diagonal / area;
      for (const Index j : met) {
        const double exact = std::exchange(sums[static_cast<std::size_t>(j)], 0) / area;
        row.values.push_back(rounded_down(exact));
        row.diagonal += exact - static_cast<double>(row.values.back());
      }
      met.clear();
      out.escaped[g] = escaped / area;
    }
  });

  std::size_t entries = 0;
  for (const Row& row : rows) entries += row.values.size();
  const bool sparse = entries * (sizeof(Index) + sizeof(float)) < count * count * sizeof(float);
  if (sparse) out.start.push_back(0);
  out.values.reserve(sparse ? entries : count * count);
  for (const Row& row : rows) {
    out.diagonal.push_back(row.diagonal);
    if (sparse) {
      out.columns.insert(out.columns.end(), row.columns.begin(), row.columns.end());
      out.values.insert(out.values.end(), row.values.begin(), row.values.end());
      out.start.push_back(out.values.size());
    } else {
      const std::size_t start = out.values.size();
      out.values.resize(start + count, 0.0F);
      for (std::size_t k = 0; k < row.columns.size(); ++k)
        out.values[start + static_cast<std::size_t>(row.columns[k])] = row.values[k];
    }
  }
  return FormFactorMatrix(std::move(out));
}

}  // namespace radiosity
