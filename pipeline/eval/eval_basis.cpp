#include <Eigen/SVD>

#include "fibers/math/sh_rotation.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/spherical_harmonics.h"
#include "pipeline/eval/eval_quantities.h"

namespace heddle {
namespace {

// Nine numbers, row by row, orthogonal to 1e-3: the nearest exact rotation.
Mat3d read_rotation(EvalObject& request, const std::string& field) {
  const std::vector<double> v = request.numbers(field, 9);
  const Mat3d matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
  if (!((matrix * matrix.transpose() - Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-3)) {
    request.fail(field, "must be orthogonal to 1e-3");
  }
  if (matrix.determinant() < 0.0) request.fail(field, "must be a rotation, this is a reflection");
  const Eigen::JacobiSVD<Mat3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

nlohmann::json eval_sg_mass(EvalObject& request) {
  const double sharpness = request.sharpness("sharpness");
  request.finish();
  return sg_mass(sharpness);
}

nlohmann::json eval_sg_product(EvalObject& request) {
  const SphericalGaussian a{request.direction("axis_a"), request.sharpness("sharpness_a")};
  const SphericalGaussian b{request.direction("axis_b"), request.sharpness("sharpness_b")};
  request.finish();
  const SgProduct product = sg_product(a, b);
  const Vec3d& axis = product.gaussian.axis;
  return {{"axis", {axis.x(), axis.y(), axis.z()}},
          {"sharpness", product.gaussian.sharpness},
          {"log_scale", product.log_scale}};
}

nlohmann::json eval_sg_zonal(EvalObject& request) {
  const double sharpness = request.sharpness("sharpness");
  const int order = request.order("order");
  request.finish();
  return sg_zonal(order, sharpness);
}

nlohmann::json eval_sh(EvalObject& request) {
  const int order = request.order("order");
  const Vec3d direction = request.direction("direction");
  request.finish();
  std::vector<double> values(static_cast<std::size_t>(sh_count(order)));
  evaluate_sh(order, direction, values.data());
  return values;
}

nlohmann::json eval_sh_rotate(EvalObject& request) {
  const int order = request.order("order");
  const Mat3d rotation = read_rotation(request, "rotation");
  std::vector<double> coefficients =
      request.numbers("coefficients", static_cast<std::size_t>(sh_count(order)));
  request.finish();
  ShRotation(order, rotation).rotate(coefficients.data(), coefficients.data());
  return coefficients;
}

}  // namespace heddle
