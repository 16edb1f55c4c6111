#include "fibers/math/symmetric_eigen.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

TEST(SymmetricEigen, VectorsAreOrthonormalAndRebuildTheMatrix) {
  RandomStream random(1, RandomStage::kTest, 70, 0);
  for (const int n : {1, 2, 7, 40}) {
    Eigen::MatrixXd matrix(n, n);
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column <= row; ++column)
        matrix(row, column) = matrix(column, row) = random.uniform_double() - 0.5;
    }
    const SymmetricEigen eigen = symmetric_eigen(matrix);
    for (int k = 0; k + 1 < n; ++k) EXPECT_LE(eigen.values[k], eigen.values[k + 1]);
    EXPECT_LT((eigen.vectors.transpose() * eigen.vectors - Eigen::MatrixXd::Identity(n, n)).norm(),
              1e-13 * n);
    EXPECT_LT(
        (eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - matrix).norm(),
        1e-13 * n);
  }
}

// The chain of n equal springs: eigenvalues 2 - 2 cos(pi k / (n + 1)).
TEST(SymmetricEigen, TridiagonalMatrixHasTheEigenvaluesOfTheChain) {
  const int n = 12;
  const SymmetricEigen eigen =
      symmetric_eigen(Eigen::VectorXd::Constant(n, 2), Eigen::VectorXd::Constant(n - 1, -1));
  for (int k = 0; k < n; ++k)
    EXPECT_NEAR(eigen.values[k], 2 - 2 * std::cos(kPi * (k + 1) / (n + 1)), 1e-14) << k;
}

// Columns of a matrix with known singular values 1, 1/2, 1/4, ...: what rank r leaves has the norm
// of the values beyond r (Eckart and Young 1936).
TEST(SymmetricEigen, SingularValuesAreThoseTheMatrixWasMadeOf) {
  constexpr int kRows = 9;
  constexpr int kColumns = 6;
  RandomStream random(1, RandomStage::kTest, 71, 0);
  const auto orthonormal = [&](int n) {
    Eigen::MatrixXd matrix(n, n);
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column <= row; ++column)
        matrix(row, column) = matrix(column, row) = random.uniform_double() - 0.5;
    }
    return symmetric_eigen(matrix).vectors;
  };
  Eigen::VectorXd values(kColumns);
  for (int k = 0; k < kColumns; ++k) values[k] = std::exp2(-k);
  const Eigen::MatrixXd matrix = orthonormal(kRows).leftCols(kColumns) * values.asDiagonal() *
                                 orthonormal(kColumns).transpose();
  const RightSingular singular = right_singular(matrix);
  for (int r = 0; r <= kColumns; ++r) {
    if (r < kColumns) {
      EXPECT_NEAR(singular.values[r], values[r], 1e-14);
    }
    EXPECT_NEAR((of_rank(matrix, singular, r) - matrix).norm(), values.tail(kColumns - r).norm(),
                1e-14);
  }
}

}  // namespace
}  // namespace heddle
