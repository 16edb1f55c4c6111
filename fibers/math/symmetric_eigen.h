#ifndef HEDDLE_FIBERS_MATH_SYMMETRIC_EIGEN_H_
#define HEDDLE_FIBERS_MATH_SYMMETRIC_EIGEN_H_
// Eigenvalues and eigenvectors of real symmetric matrices of any size, and singular values by them:
// Eigen's solver, compiled once for all who need it (it takes a compiler many seconds).
// Single-threaded. Tested in tests/math/symmetric_eigen_test.cpp.

#include <Eigen/Core>

namespace heddle {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // orthonormal columns, in the order of the values
};

/// Reads the lower triangle of `matrix`, which must be square and finite.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// Of a tridiagonal matrix: its diagonal [n], and what stands below it [n - 1].
SymmetricEigen symmetric_eigen(const Eigen::VectorXd& diagonal,
                               const Eigen::VectorXd& off_diagonal);

/// A = U diag(values) V^T, without U: the best approximation of rank r is A V_r V_r^T, with the
/// first r columns of V.
struct RightSingular {
  Eigen::VectorXd values;  // descending
  Eigen::MatrixXd right;   // V, orthonormal columns, in the order of the values
};

/// By the eigenvectors of A^T A. Values below 1e-8 of the largest are rounding, and their vectors
/// any of the rest.
RightSingular right_singular(const Eigen::MatrixXd& matrix);

/// A V_r V_r^T.
Eigen::MatrixXd of_rank(const Eigen::MatrixXd& matrix, const RightSingular& singular,
                        Eigen::Index rank);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SYMMETRIC_EIGEN_H_
