// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/form_factor_matrix.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "cases/matrices.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity::test {
namespace {

// All of these are exact in single precision.
Eigen::MatrixXd small() {
  Eigen::MatrixXd f(3, 3);
  f << 0, 0.5, 0.25, 0.75, 0, 0, 0.125, 0, 0;
  return f;
}

TEST(FormFactorMatrix, ReadsTheSameFromDenseAndFromSparseStorage) {
  const FormFactorMatrix dense = dense_matrix(small()), sparse = sparse_matrix(small());
  EXPECT_FALSE(dense.sparse());
  EXPECT_TRUE(sparse.sparse());
  EXPECT_EQ(as_dense(dense), small());
  EXPECT_EQ(as_dense(sparse), small());
  for (Index i = 0; i < 3; ++i)
    for (Index j = 0; j < 3; ++j) {
      EXPECT_EQ(dense(i, j), small()(i, j));
      EXPECT_EQ(sparse(i, j), small()(i, j));
    }
  EXPECT_EQ(dense.nonzeros(), 4u);
  EXPECT_EQ(sparse.nonzeros(), 4u);
  EXPECT_GE(dense.bytes(), 9 * sizeof(float));
  EXPECT_GE(sparse.bytes(), 4 * (sizeof(float) + sizeof(Index)));
  EXPECT_DOUBLE_EQ(dense.escaped()[0], 0.25);
  EXPECT_DOUBLE_EQ(sparse.escaped()[2], 0.875);
  EXPECT_TRUE(dense.stored());
}

TEST(FormFactorMatrix, AddsTheDiagonalRemainderToProductsAndKeepsItOutOfEntries) {
  FormFactorMatrix::Rows rows{2, {}, {}, {0, 0.5f, 0.25f, 0}, {0.5, 0.75}, {0, 0}};
  const FormFactorMatrix f(rows);
  EXPECT_EQ(f(0, 0), 0);
  EXPECT_EQ(f.row(1).diagonal, 0.75);
  BandArray x(2, 2), y;
  x << 1, 2, 4, 8;
  f.apply(x, y);
  BandArray expected(2, 2);
  expected << 0.5 * 1 + 0.5 * 4, 0.5 * 2 + 0.5 * 8, 0.25 * 1 + 0.75 * 4, 0.25 * 2 + 0.75 * 8;
  EXPECT_EQ(y.matrix(), expected.matrix());
}

TEST(FormFactorMatrix, MultipliesAllBandsAtOnceForAnyNumberOfBands) {
  const RandomEnclosure enclosure = random_enclosure(37, 5);
  for (const bool sparse : {false, true}) {
    const FormFactorMatrix f = sparse ? sparse_matrix(enclosure.f) : dense_matrix(enclosure.f);
    for (const Index bands : {1, 2, 3, 4, 7}) {
      std::mt19937_64 random(9);
      BandArray x(37, bands), y;
      for (double& value : x.reshaped()) value = uniform(random);
      f.apply(x, y);
      const Eigen::MatrixXd expected = as_dense(f) * x.matrix();
      EXPECT_LT((y.matrix() - expected).cwiseAbs().maxCoeff(), 1e-6) << bands << " bands";
    }
  }
}

TEST(FormFactorMatrix, KeepsAConstantFieldToDoublePrecisionInAClosedScene) {
  // What rounding to single precision takes from a row is in its diagonal: F·1 = 1.
  const FormFactorMatrix f = dense_matrix(random_enclosure(60, 2).f);
  BandArray y;
  f.apply(BandArray::Ones(60, 3), y);
  EXPECT_LT((y - 1).abs().maxCoeff(), 1e-13);
}

TEST(FormFactorMatrix, MultipliesToTheSameBitsWithAnyNumberOfThreads) {
  const FormFactorMatrix f = dense_matrix(random_enclosure(300, 4).f);
  const BandArray x = BandArray::Random(300, 3);
  const auto product = [&](int threads) {
    const ThreadLimit limit(threads);
    BandArray y;
    f.apply(x, y);
    return y;
  };
  EXPECT_TRUE((product(1) == product(4)).all());
}

TEST(FormFactorMatrix, RefusesSizesThatDoNotFit) {
  const std::vector<double> none;
  using Rows = FormFactorMatrix::Rows;
  EXPECT_THROW(FormFactorMatrix(Rows{2, {}, {}, {0, 1, 1}, none, {0, 0}}), InputError);
  EXPECT_THROW(FormFactorMatrix(Rows{2, {}, {}, {0, 1, 1, 0}, {0.5}, {0, 0}}), InputError);
  EXPECT_THROW(FormFactorMatrix(Rows{2, {}, {}, {0, 1, 1, 0}, none, {0}}), InputError);
  EXPECT_THROW(FormFactorMatrix(Rows{2, {0, 1}, {1}, {1}, none, {0, 0}}), InputError);
  EXPECT_THROW(FormFactorMatrix(Rows{2, {0, 1, 2}, {1}, {1, 1}, none, {0, 0}}), InputError);
}

TEST(FormFactorMatrix, RefusesRowsThatDoNotAddUpToOneWithWhatEscapes) {
  // Two patches that send 0.9 to each other; where 0 is said to escape, even light would be kept by 1 − ρ alone.
  const auto matrix = [](double escaped) {
    return FormFactorMatrix({2, {}, {}, {0, 0.9f, 0.9f, 0}, {}, {escaped, escaped}});
  };
  const double sum = static_cast<double>(0.9f);
  EXPECT_NO_THROW(matrix(1 - sum));
  EXPECT_THROW(matrix(0), InputError);
  EXPECT_THROW(matrix(1 - sum + 1e-8), InputError);
  EXPECT_THROW(matrix(std::numeric_limits<double>::quiet_NaN()), InputError);
}

TEST(FormFactorMatrix, RefusesColumnsThatAreNoPatchesOrDoNotAscend) {
  const auto sparse = [](std::vector<std::size_t> start, std::vector<Index> columns) {
    return FormFactorMatrix({3, std::move(start), std::move(columns), {0.5f, 0.5f, 1}, {}, {0, 0, 1}});
  };
  EXPECT_NO_THROW(sparse({0, 2, 3, 3}, {1, 2, 0}));
  EXPECT_THROW(sparse({0, 2, 3, 3}, {1, 3, 0}), InputError);
  EXPECT_THROW(sparse({0, 2, 3, 3}, {-1, 2, 0}), InputError);
  EXPECT_THROW(sparse({0, 2, 3, 3}, {2, 1, 0}), InputError);
  EXPECT_THROW(sparse({0, 2, 3, 3}, {1, 1, 0}), InputError);
  EXPECT_THROW(sparse({0, 100, 2, 3}, {1, 2, 0}), InputError);
}

TEST(FormFactorMatrix, RefusesFactorsThatAreNoSharesOfLight) {
  const auto matrix = [](float f) {
    return FormFactorMatrix({2, {}, {}, {0, f, 0, 0}, {}, {1 - static_cast<double>(f), 1}});
  };
  EXPECT_NO_THROW(matrix(0.25f));
  EXPECT_THROW(matrix(-0.25f), InputError);
  EXPECT_THROW(matrix(std::numeric_limits<float>::infinity()), InputError);
}

TEST(FormFactorMatrix, RefusesToMultiplyAFieldOfAnotherSize) {
  const FormFactorMatrix f = dense_matrix(small());
  BandArray y;
  EXPECT_THROW(f.apply(BandArray::Ones(4, 1), y), InputError);
}

}  // namespace
}  // namespace radiosity::test
