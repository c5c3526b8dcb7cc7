// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/matrices.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "cases/scenes.hpp"

namespace radiosity::test {

Eigen::MatrixXd as_dense(const FormFactorRows& f) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(f.size(), f.size());
  RowBuffer buffer;
  for (Index i = 0; i < f.size(); ++i) {
    const FormFactorRow row = f.row(i, buffer);
    for_each_entry(row, [&](Index j, float value) { dense(i, j) += static_cast<double>(value); });
    dense(i, i) += row.diagonal;
  }
  return dense;
}

RawRows raw_rows(const FormFactorMethod& method, Index n, bool upper) {
  RawRows rows{Eigen::MatrixXd::Zero(n, n), std::vector<std::optional<double>>(n)};
  std::mutex mutex;
  method.rows(0, n, upper,
              [&](Index i, std::span<const Index> columns, std::span<const double> values,
                  std::optional<double> escaped) {
                const std::lock_guard lock(mutex);
                for (std::size_t k = 0; k < columns.size(); ++k) rows.f(i, columns[k]) = values[k];
                rows.escape[i] = escaped;
              });
  return rows;
}

namespace {

FormFactorMatrix stored(const Eigen::MatrixXd& f, bool sparse) {
  FormFactorMatrix::Rows rows;
  rows.n = static_cast<Index>(f.rows());
  if (sparse) rows.start.push_back(0);
  for (Index i = 0; i < rows.n; ++i) {
    double sum = 0;
    for (Index j = 0; j < rows.n; ++j) {
      if (sparse && f(i, j) == 0) continue;
      const auto value = static_cast<float>(f(i, j));
      if (sparse) rows.columns.push_back(j);
      rows.values.push_back(value);
      sum += static_cast<double>(value);
    }
    if (sparse) rows.start.push_back(rows.values.size());
    // A row that sums to 1 but for rounding is closed: as ρ → 1 nothing less will do.
    const double escaped = 1 - f.row(i).sum();
    rows.escaped.push_back(std::abs(escaped) < 1e-14 ? 0 : escaped);
    rows.diagonal.push_back(1 - rows.escaped.back() - sum);
  }
  return FormFactorMatrix(std::move(rows));
}

}  // namespace

FormFactorMatrix dense_matrix(const Eigen::MatrixXd& f) {
  return stored(f, false);
}
FormFactorMatrix sparse_matrix(const Eigen::MatrixXd& f) {
  return stored(f, true);
}

RandomEnclosure random_enclosure(Index n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = i + 1; j < n; ++j) {
      const double value = uniform(random);
      if (uniform(random) < 0.5 || j == i + 1) s(i, j) = s(j, i) = value;
    }
  RandomEnclosure enclosure;
  enclosure.areas = s.rowwise().sum().array();
  enclosure.f = enclosure.areas.inverse().matrix().asDiagonal() * s;
  return enclosure;
}

double reciprocity_error(const Eigen::MatrixXd& f, const Eigen::ArrayXd& areas) {
  const Eigen::MatrixXd s = areas.matrix().asDiagonal() * f;
  return ((s - s.transpose()).cwiseAbs().rowwise().sum().array() / areas).maxCoeff() / 2;
}

}  // namespace radiosity::test
