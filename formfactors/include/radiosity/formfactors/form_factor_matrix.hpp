// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <vector>

#include "radiosity/formfactors/form_factor_operator.hpp"

namespace radiosity {

/// Stored F, dense or sparse (whichever takes fewer bytes), in single precision. The remainder
///   d_i = (1 − escaped_i) − Σ_j F_ij
/// of closed rows is kept beside it in double and acts as F_ii, so that closure is exact although F is
/// rounded: an error ε of the row sums would be amplified by 1/(1 − ρ). A diagonal leaves reciprocity
/// untouched.
class FormFactorMatrix final : public FormFactorRows {
 public:
  struct Rows {
    Index n = 0;
    std::vector<std::size_t> start;  ///< n + 1 offsets into values (and columns); empty: dense, n × n values
    std::vector<Index> columns;
    std::vector<float> values;
    std::vector<double> diagonal;  ///< d_i; empty: zero
    std::vector<double> escaped;   ///< 1 − Σ_j F_ij − d_i
    /// Of each row its place among those that are stored; −1: another rank has it, and here it is empty. Empty: all are.
    std::vector<Index> place = {};
  };
  /// Throws InputError when the sizes do not fit together, columns are not those of patches, ascending, a factor is negative or
  /// not finite, or a row and what escapes do not add up to 1 (but for the rounding of a sum of doubles).
  explicit FormFactorMatrix(Rows rows);

  Index size() const override { return rows_.n; }
  FormFactorRow row(Index i, RowBuffer&) const override { return row(i); }
  FormFactorRow row(Index i) const;
  bool stored() const override { return true; }
  Eigen::ArrayXd escaped() const override;

  const Rows& arrays() const { return rows_; }
  bool sparse() const { return !rows_.start.empty(); }
  /// Entries that are not zero.
  std::size_t nonzeros() const;
  std::size_t bytes() const;
  /// What is stored, as Eigen's own solvers take it; the diagonal remainder is not in it. Valid as long as this matrix. Throws
  /// InputError where F is dense (sparse), or has more entries than an Index counts, and as_dense where other ranks have rows of it.
  using SparseMap = Eigen::Map<const Eigen::SparseMatrix<float, Eigen::RowMajor, Index>>;
  using DenseMap = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
  SparseMap as_sparse() const;
  DenseMap as_dense() const;
  /// d_i, n.
  Eigen::ArrayXd diagonal() const;

  /// One entry (a binary search where F is sparse), without the diagonal remainder.
  double operator()(Index i, Index j) const;

 private:
  void require_rows() const;
  // What is wrong with a row; empty where nothing is.
  std::string fault_of(Index i) const;

  Rows rows_;
  std::vector<Index> outer_;  // rows_.start as Eigen takes it; empty where F is dense or has too many entries
};

}  // namespace radiosity
