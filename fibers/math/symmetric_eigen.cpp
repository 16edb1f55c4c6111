#include "fibers/math/symmetric_eigen.h"

#include <Eigen/Eigenvalues>
#include <cassert>

namespace heddle {
namespace {

using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

}  // namespace

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix) {
  assert(matrix.rows() == matrix.cols());
  const Solver solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen symmetric_eigen(const Eigen::VectorXd& diagonal,
                               const Eigen::VectorXd& off_diagonal) {
  assert(off_diagonal.size() + 1 == diagonal.size());
  Solver solver;
  solver.computeFromTridiagonal(diagonal, off_diagonal, Eigen::ComputeEigenvectors);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

RightSingular right_singular(const Eigen::MatrixXd& matrix) {
  const SymmetricEigen gram = symmetric_eigen(matrix.transpose() * matrix);
  return {gram.values.cwiseMax(0.0).cwiseSqrt().reverse(), gram.vectors.rowwise().reverse()};
}

Eigen::MatrixXd of_rank(const Eigen::MatrixXd& matrix, const RightSingular& singular,
                        Eigen::Index rank) {
  const auto leading = singular.right.leftCols(rank);
  const Eigen::MatrixXd coordinates = matrix * leading;
  return coordinates * leading.transpose();
}

}  // namespace heddle
