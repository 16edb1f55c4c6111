#ifndef HEDDLE_FIBERS_MATH_SG_SUM_FIT_H_
#define HEDDLE_FIBERS_MATH_SG_SUM_FIT_H_
// Fits a binary map on the sphere by a sum of normalised spherical Gaussians of one sharpness about
// Fibonacci axes. Weights are in steradians and never negative:
//   V(w) ~ sum over q of weight[q] G(w; axis[q], sharpness) / M(sharpness)
//
// kVoronoi is Khungurn 2017, section 4.1: a weight is the open solid angle nearer to its axis than
// to any other. kNnls is the non-negative least-squares fit, over the whole sphere, of V blurred by
// a Gaussian of sharpness kBlur. Lights that use the sum see little finer detail, and all integrals
// have closed forms. A stronger blur (30) costs a quarter to a half more error on maps of real
// fabrics. Errors of all choices: docs/performance.md, "Visibility".
//
// Axes of the upper hemisphere stand for light from the face only. Cells whose centre is not above
// the horizon then count as closed. The axes may be turned about +z by whole columns. Tested in
// tests/math/sg_sum_fit_test.cpp.

#include <vector>

#include <Eigen/Core>

#include "fibers/math/fibonacci_axes.h"
#include "fibers/math/spherical_map.h"
#include "fibers/math/vector.h"

namespace heddle {

enum class SgWeights { kVoronoi, kNnls };

/// The sharpness that suits 48 axes: they lie farther apart on the whole sphere.
constexpr double default_sg_sharpness(FibonacciSet axes) {
  return axes == FibonacciSet::kSphere ? 32 : 48;
}

struct SgSumShape {
  FibonacciSet axes = FibonacciSet::kHemisphere;
  int count = 48;
  double sharpness = default_sg_sharpness(FibonacciSet::kHemisphere);
  SgWeights weights = SgWeights::kNnls;
};

class SgSumFit {
 public:
  static constexpr double kBlur = 120;

  SgSumFit(int resolution, const SgSumShape& shape);

  /// [lobe] before any turn about +z.
  const std::vector<Vec3d>& axes() const { return axes_; }

  /// [lobe] weights for the axes turned about +z by `turned_columns` (0 .. N - 1) columns of the
  /// map.
  Eigen::VectorXd weights(const SphericalMap& map, int turned_columns = 0) const;

 private:
  SgWeights method_;
  int resolution_;
  int rows_;  // rows that count
  std::vector<Vec3d> axes_;
  std::vector<int> nearest_axis_;  // [row][column], kVoronoi
  // [lobe, cell], kNnls: what an open cell adds
  Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic> projection_;
  Eigen::MatrixXd gram_;
};

/// The sum in one direction.
double sg_sum_value(const std::vector<Vec3d>& axes, const Eigen::VectorXd& weights,
                    double sharpness, const Vec3d& direction);

/// Integral of the normalised Gaussian G / M of `light_sharpness` about `direction` times the sum.
double sg_sum_integral(const std::vector<Vec3d>& axes, const Eigen::VectorXd& weights,
                       double sharpness, const Vec3d& direction, double light_sharpness);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SG_SUM_FIT_H_
