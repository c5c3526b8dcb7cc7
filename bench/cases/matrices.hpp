// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

#include "radiosity/formfactors/form_factor_matrix.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity::test {

/// F as a plain matrix, in the precision in which it is stored, the diagonal remainder included: what a
/// solver that does everything right works with.
Eigen::MatrixXd as_dense(const FormFactorRows& f);

/// Rows of a method as it gives them.
struct RawRows {
  Eigen::MatrixXd f;                          ///< n × n
  std::vector<std::optional<double>> escape;  ///< as passed to the sink
  std::optional<double> escaped(Index i) const { return escape[i]; }
};
RawRows raw_rows(const FormFactorMethod& method, Index n, bool upper = false);

/// Stored F with the given entries; what rounding to single precision changes in a row sum goes to the
/// diagonal.
FormFactorMatrix dense_matrix(const Eigen::MatrixXd& f);
/// The same, stored sparse.
FormFactorMatrix sparse_matrix(const Eigen::MatrixXd& f);

/// An enclosure without geometry: S symmetric with zero diagonal and about half of its entries uniform on [0,
/// 1), the rest zero; A_i = Σ_j S_ij and F_ij = S_ij / A_i, which is reciprocal and closed.
struct RandomEnclosure {
  Eigen::MatrixXd f;
  Eigen::ArrayXd areas;
};
RandomEnclosure random_enclosure(Index n, std::uint64_t seed);

/// max_i Σ_j |F_ij − F_ji A_j/A_i| / 2.
double reciprocity_error(const Eigen::MatrixXd& f, const Eigen::ArrayXd& areas);

}  // namespace radiosity::test
