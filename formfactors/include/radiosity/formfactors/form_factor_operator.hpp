// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// F as far as it can be applied: stored or not, square (patches × patches) or rectangular (elements × patches). Thread-safe.
class FormFactorOperator {
 public:
  virtual ~FormFactorOperator() = default;

  virtual Index rows() const = 0;
  virtual Index columns() const = 0;

  /// y = F x for all bands in one pass over F: x is columns × bands, and y becomes rows × bands. Throws InputError on another x.
  void apply(const BandArray& x, BandArray& y) const;

  /// The share of what leaves i that reaches no patch's front, of each row:  1 − Σ_j F_ij. Unless an operator knows better, by applying
  /// it to 1, with what is nothing but rounding, below tolerance::kNotLost, taken for 0.
  virtual Eigen::ArrayXd escaped() const;

 private:
  /// Fills y, which has rows × bands values, with F x.
  virtual void multiply(const BandArray& x, BandArray& y) const = 0;
};

/// Row i of F: the form factors F_ij from patch i. `diagonal` is added to F_ii: see FormFactorMatrix.
struct FormFactorRow {
  std::span<const Index> columns;  ///< ascending; none where the row is dense
  std::span<const float> values;   ///< F_ij of j = columns[k], or of j = k where the row is dense
  double diagonal = 0;

  bool dense() const { return columns.empty() && !values.empty(); }
};

/// Calls f(j, F_ij) for every stored entry of the row, the diagonal remainder not included.
template <class F>
void for_each_entry(const FormFactorRow& row, F&& f) {
  if (row.dense()) {
    for (std::size_t j = 0; j < row.values.size(); ++j) f(static_cast<Index>(j), row.values[j]);
  } else {
    for (std::size_t k = 0; k < row.values.size(); ++k) f(row.columns[k], row.values[k]);
  }
}

/// Memory for a row that is computed on demand.
struct RowBuffer {
  std::vector<Index> columns;
  std::vector<float> values;
};

/// A square F whose rows can be read, as Gauss–Seidel and shooting do.
class FormFactorRows : public FormFactorOperator {
 public:
  virtual Index size() const = 0;
  Index rows() const final { return size(); }
  Index columns() const final { return size(); }

  /// Row i; valid until `buffer` is used again. F is stored: no work. F is computed on demand: the cost of
  /// one row.
  virtual FormFactorRow row(Index i, RowBuffer& buffer) const = 0;

  /// Whether row() is a look-up, so that applying F costs little.
  virtual bool stored() const = 0;

  Eigen::ArrayXd escaped() const override = 0;

 private:
  void multiply(const BandArray& x, BandArray& y) const final;
};

}  // namespace radiosity
