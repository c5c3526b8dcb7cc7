// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"
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

  /// Of a square F: patches that exchange light with each other, directly or by way of others, have the same number, counted from 0 in
  /// the order of the least patch of each. All 0 unless an operator knows better.
  virtual std::vector<Index> component() const {
    return std::vector<Index>(static_cast<std::size_t>(rows()), 0);
  }

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
  /// All 0 where rows are not stored.
  std::vector<Index> component() const override;

 private:
  void multiply(const BandArray& x, BandArray& y) const final;
};

/// F whose rows several ranks have, each those that it owns. Collective: see Ranks.
class DistributedFormFactors final : public FormFactorOperator {
 public:
  /// `own` has all n rows, those of others empty, and what escapes from each. It must outlive this object.
  DistributedFormFactors(const FormFactorRows& own, std::shared_ptr<const Ranks> ranks);

  Index rows() const override { return own_.size(); }
  Index columns() const override { return own_.size(); }
  Eigen::ArrayXd escaped() const override { return own_.escaped(); }
  std::vector<Index> component() const override;

  const FormFactorRows& own() const { return own_; }
  const Ranks& ranks() const { return *ranks_; }

 private:
  void multiply(const BandArray& x, BandArray& y) const override;

  const FormFactorRows& own_;
  std::shared_ptr<const Ranks> ranks_;
};

}  // namespace radiosity
