#ifndef HEDDLE_FIBERS_MATH_NONNEGATIVE_LEAST_SQUARES_H_
#define HEDDLE_FIBERS_MATH_NONNEGATIVE_LEAST_SQUARES_H_
// min |A w - y|^2 over w >= 0, given the normal equations: gram = A^T A (positive definite),
// right_side = A^T y. Entries may have a bound above as well.
//
// Coordinate descent with the gradient kept up to date. Each step solves one coordinate exactly, so
// the error falls monotonically to the one minimum. It ends when the optimality conditions
// (gradient 0 where w > 0, not negative where w = 0, not positive at a bound above) hold to
// kTolerance of the largest entry of the right side. A nearly singular gram ends it after
// kMaxSweeps. Tested in tests/math/nonnegative_least_squares_test.cpp.

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Core>

namespace heddle {

/// `most`: the bounds above, or nothing.
inline Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& gram,
                                                 const Eigen::VectorXd& right_side,
                                                 const Eigen::VectorXd* most = nullptr) {
  constexpr double kTolerance = 1e-6;
  constexpr int kMaxSweeps = 2000;
  assert(gram.rows() == right_side.size() && gram.cols() == right_side.size());
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(right_side.size());
  if (right_side.size() == 0) return solution;
  Eigen::VectorXd gradient = -right_side;
  const double allowed = kTolerance * right_side.cwiseAbs().maxCoeff();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double violation = 0;
    for (Eigen::Index q = 0; q < solution.size(); ++q) {
      const bool is_most = most != nullptr && !(solution[q] < (*most)[q]);
      violation = std::max(violation, is_most           ? gradient[q]
                                      : solution[q] > 0 ? std::abs(gradient[q])
                                                        : -gradient[q]);
      double next = std::max(0.0, solution[q] - gradient[q] / gram(q, q));
      if (most != nullptr) next = std::min(next, (*most)[q]);
      const double change = next - solution[q];
      if (change == 0) continue;
      solution[q] = next;
      gradient += change * gram.col(q);
    }
    if (violation <= allowed) break;
  }
  return solution;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_NONNEGATIVE_LEAST_SQUARES_H_
