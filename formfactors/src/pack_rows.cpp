// SPDX-License-Identifier: GPL-3.0-or-later
#include "assembly_steps.hpp"

namespace radiosity {

FormFactorMatrix::Rows store(RowList& rows, const std::function<void(Index, Row&)>& finish) {
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
    Row& row = rows[i];
    if (finish) finish(i, row);
    for (std::size_t k = 0; k < row.size(); ++k) {
      const float f = row[k].value;
      if (sparse) {
        out.columns[out.start[i] + k] = row[k].column;
        out.values[out.start[i] + k] = f;
      } else {
        out.values[i * n + row[k].column] = f;
      }
    }
    row = {};
  });
  return out;
}

PackedRows pack(RowList& rows, const Eigen::ArrayXd& target, const Eigen::ArrayXd& areas) {
  PackedRows out{{}, row_sums(rows), measure(rows, target, areas, false)};
  out.rows = store(rows);
  return out;
}

PackedRows pack_scaled(RowList& symmetric, const RowScaling& scaling, const Eigen::ArrayXd& target,
                       const Eigen::ArrayXd& areas) {
  PackedRows out{{}, Eigen::ArrayXd::Zero(areas.size()), {}};
  Eigen::ArrayXd reciprocity = out.sums;
  const Eigen::ArrayXd inverse = 1 / areas;
  out.rows = store(symmetric, [&](Index i, Row& row) {
    double error = 0;
    for (Entry& e : row) {
      const double s = scaling(i, e.column) * static_cast<double>(e.value);
      const float f_ij = rounded_down(s * inverse[i]);
      const float f_ji =
          rounded_down(s * inverse[e.column]);  // what row j stores: S and its scaling are the same there
      error +=
          reciprocity_error(static_cast<double>(f_ij), static_cast<double>(f_ji), areas[i], areas[e.column]);
      e.value = f_ij;
    }
    out.sums[i] = sum(row);
    reciprocity[i] = error;
  });
  out.quality = quality_of(out.sums, target, reciprocity, areas);
  return out;
}

}  // namespace radiosity
