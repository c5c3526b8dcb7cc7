// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "assembly_steps.hpp"

namespace radiosity {

double reciprocity_error(double f_ij, double f_ji, double a_i, double a_j) {
  return std::abs(f_ij * a_i - f_ji * a_j) / (2 * a_i);
}

FormFactorQuality quality_of(const MeasuredRows& rows, const Eigen::ArrayXd& target,
                             const Eigen::ArrayXd& areas) {
  if (areas.size() == 0) return {};
  const Eigen::ArrayXd closure = (rows.sums - target).abs();
  const double total = areas.sum();
  return {closure.maxCoeff(), (closure * areas).sum() / total, rows.reciprocity.maxCoeff(),
          (rows.reciprocity * areas).sum() / total};
}

void drop_isolated(RowList& rows, const Eigen::ArrayXd& target) {
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    if (target[i] == 0)
      rows[i].clear();
    else
      std::erase_if(rows[i], [&](const Entry& e) { return target[e.column] == 0; });
  });
}

MeasuredRows measure(RowList& rows, const Eigen::ArrayXd& areas, bool symmetrise, const Ranks* ranks) {
  RowList t = transpose(rows, rows.size(), ranks);
  MeasuredRows out{Eigen::ArrayXd(areas.size()), Eigen::ArrayXd(areas.size())};
  for_each_row(static_cast<Index>(rows.size()), [&](Index i) {
    Row& row = rows[i];
    thread_local std::vector<Entry> symmetric;
    symmetric.clear();
    out.sums[i] = sum(row);
    double error = 0;
    merge(row, t[i], [&](Index j, double f_ij, double f_ji) {
      error += reciprocity_error(f_ij, f_ji, areas[i], areas[j]);
      if (symmetrise)
        symmetric.push_back(
            {j, static_cast<float>((f_ij + f_ji) * (areas[i] * areas[j] / (areas[i] + areas[j])))});
    });
    out.reciprocity[i] = error;
    if (symmetrise) row = Row(symmetric.begin(), symmetric.end());
    t[i] = Row();  // {} would keep its memory
  });
  gather(ranks, out.sums);
  gather(ranks, out.reciprocity);
  t.clear();
  release_freed(count_entries(rows));
  return out;
}

}  // namespace radiosity
