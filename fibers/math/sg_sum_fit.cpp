#include "fibers/math/sg_sum_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/nonnegative_least_squares.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

// Edge in radians of the parts into which cells are cut to integrate over them.
constexpr double kLargestPart = 0.025;

// Integral over the sphere of the product of two normalised Gaussians.
double normalised_overlap(const Vec3d& axis_a, double sharpness_a, const Vec3d& axis_b,
                          double sharpness_b) {
  const SgProduct product = sg_product({axis_a, sharpness_a}, {axis_b, sharpness_b});
  return std::exp(product.log_scale) * sg_mass(product.gaussian.sharpness) /
         (sg_mass(sharpness_a) * sg_mass(sharpness_b));
}

}  // namespace

SgSumFit::SgSumFit(int resolution, const SgSumShape& shape)
    : method_(shape.weights),
      resolution_(resolution),
      rows_(shape.axes == FibonacciSet::kSphere ? resolution : resolution / 2),
      axes_(fibonacci_axes(shape.axes, shape.count)) {
  const LatLongGrid grid(resolution);
  if (method_ == SgWeights::kVoronoi) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < resolution; ++column) {
        const Vec3d centre = grid.centre(row, column);
        const auto nearest = std::max_element(
            axes_.begin(), axes_.end(),
            [&](const Vec3d& a, const Vec3d& b) { return a.dot(centre) < b.dot(centre); });
        nearest_axis_.push_back(static_cast<int>(nearest - axes_.begin()));
      }
    }
    return;
  }
  // Cells are cut into parts far smaller than the blur's width of 0.09 rad.
  const int row_parts = static_cast<int>(std::ceil(grid.row_step() / kLargestPart));
  const int column_parts = static_cast<int>(std::ceil(grid.column_step() / kLargestPart));
  projection_.setZero(shape.count, rows_ * resolution);
  for (int row = 0; row < rows_ * row_parts; ++row) {
    const double polar = (row + 0.5) * grid.row_step() / row_parts;
    const double area = std::sin(polar) * 2 * std::sin(0.5 * grid.row_step() / row_parts) *
                        grid.column_step() / column_parts;
    for (int column = 0; column < resolution * column_parts; ++column) {
      const double azimuth = (column + 0.5) * grid.column_step() / column_parts;
      const Vec3d part(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                       std::cos(polar));
      for (int q = 0; q < shape.count; ++q) {
        projection_(q, (row / row_parts) * resolution + column / column_parts) +=
            static_cast<float>(area * normalised_overlap(axes_[q], shape.sharpness, part, kBlur));
      }
    }
  }
  gram_.resize(shape.count, shape.count);
  for (int q = 0; q < shape.count; ++q) {
    for (int p = 0; p < shape.count; ++p) {
      gram_(q, p) = normalised_overlap(axes_[q], shape.sharpness, axes_[p], shape.sharpness);
    }
  }
}

Eigen::VectorXd SgSumFit::weights(const SphericalMap& map, int turned_columns) const {
  assert(map.resolution() == resolution_ && turned_columns >= 0 && turned_columns < resolution_);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(axes_.size()));
  Eigen::ArrayXf row_sum(sum.size());
  for (int row = 0; row < rows_; ++row) {
    row_sum.setZero();
    for (int column = 0; column < resolution_; ++column) {
      if (!map.open(row, column)) continue;
      const int unturned = column >= turned_columns ? column - turned_columns
                                                    : column - turned_columns + resolution_;
      const int cell = row * resolution_ + unturned;
      if (method_ == SgWeights::kVoronoi) {
        sum[nearest_axis_[static_cast<std::size_t>(cell)]] += map.grid().solid_angle(row);
      } else {
        row_sum += projection_.col(cell);
      }
    }
    if (method_ == SgWeights::kNnls) sum += row_sum.matrix().cast<double>();
  }
  return method_ == SgWeights::kNnls ? nonnegative_least_squares(gram_, sum) : sum;
}

double sg_sum_value(const std::vector<Vec3d>& axes, const Eigen::VectorXd& weights,
                    double sharpness, const Vec3d& direction) {
  double sum = 0;
  for (std::size_t q = 0; q < axes.size(); ++q) {
    sum += weights[static_cast<Eigen::Index>(q)] * sg_value({axes[q], sharpness}, direction);
  }
  return sum / sg_mass(sharpness);
}

double sg_sum_integral(const std::vector<Vec3d>& axes, const Eigen::VectorXd& weights,
                       double sharpness, const Vec3d& direction, double light_sharpness) {
  double sum = 0;
  for (std::size_t q = 0; q < axes.size(); ++q) {
    sum += weights[static_cast<Eigen::Index>(q)] *
           normalised_overlap(axes[q], sharpness, direction, light_sharpness);
  }
  return sum;
}

}  // namespace heddle
