#include "fibers/math/nonnegative_least_squares.h"

#include <gtest/gtest.h>

#include "fibers/math/random.h"

namespace heddle {
namespace {

Eigen::MatrixXd random_matrix(int rows, int columns, std::uint64_t seed) {
  RandomStream random(seed, RandomStage::kTest, 0, 0);
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.uniform_double() - 0.3; });
}

TEST(NonnegativeLeastSquares, KnownSolutionInTwoUnknowns) {
  // Unconstrained minimum (2, -1): the second coordinate stays at 0, where the first is 3 / 2.
  Eigen::Matrix2d gram;
  gram << 2, 1, 1, 2;
  const Eigen::VectorXd solution = nonnegative_least_squares(gram, Eigen::Vector2d(3, 0));
  EXPECT_NEAR(solution[0], 1.5, 1e-6);
  EXPECT_EQ(solution[1], 0);
}

TEST(NonnegativeLeastSquares, ZeroRightSideGivesZero) {
  EXPECT_EQ(nonnegative_least_squares(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()).norm(),
            0);
}

// y made from weights that are not negative is fitted without residual: the weights come back.
TEST(NonnegativeLeastSquares, RecoversWeightsThatFit) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Eigen::MatrixXd a = random_matrix(60, 20, seed);
    Eigen::VectorXd weights = random_matrix(20, 1, seed + 100).col(0).cwiseMax(0.0);
    const Eigen::MatrixXd gram = a.transpose() * a;
    const Eigen::VectorXd solution = nonnegative_least_squares(gram, gram * weights);
    EXPECT_LT((solution - weights).cwiseAbs().maxCoeff(), 1e-4) << seed;
  }
}

// The conditions that single out the minimum of a convex problem.
TEST(NonnegativeLeastSquaresLaw, OptimalityConditions) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Eigen::MatrixXd a = random_matrix(60, 30, seed);
    const Eigen::VectorXd y = random_matrix(60, 1, seed + 100).col(0);
    const Eigen::MatrixXd gram = a.transpose() * a;
    const Eigen::VectorXd right_side = a.transpose() * y;
    const Eigen::VectorXd solution = nonnegative_least_squares(gram, right_side);
    const Eigen::VectorXd gradient = gram * solution - right_side;
    const double allowed = 1e-5 * right_side.cwiseAbs().maxCoeff();
    int at_zero = 0;
    for (Eigen::Index q = 0; q < solution.size(); ++q) {
      ASSERT_GE(solution[q], 0);
      if (solution[q] > 0) {
        EXPECT_NEAR(gradient[q], 0, allowed);
      } else {
        EXPECT_GE(gradient[q], -allowed);
      }
      at_zero += solution[q] == 0 ? 1 : 0;
    }
    EXPECT_GT(at_zero, 0) << "the constraint was never active";
  }
}

}  // namespace
}  // namespace heddle
