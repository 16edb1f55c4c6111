#include "fibers/math/spherical_gaussian.h"

#include <cassert>
#include <cmath>

#include "fibers/math/special_functions.h"

namespace heddle {

double sg_value(const SphericalGaussian& gaussian, const Vec3d& direction) {
  return std::exp(-0.5 * gaussian.sharpness * (direction - gaussian.axis).squaredNorm());
}

double sg_mass(double sharpness) {
  assert(sharpness >= 0.0);
  if (sharpness == 0.0) return 4.0 * kPi;
  return -2.0 * kPi * std::expm1(-2.0 * sharpness) / sharpness;
}

float sg_mass(float sharpness) {
  return static_cast<float>(sg_mass(static_cast<double>(sharpness)));
}

SgProduct sg_product(const SphericalGaussian& a, const SphericalGaussian& b) {
  const Vec3d sum = a.sharpness * a.axis + b.sharpness * b.axis;
  const double length = sum.norm();
  const double total = a.sharpness + b.sharpness + length;
  const double log_scale =
      total > 0.0 ? -a.sharpness * b.sharpness * (a.axis - b.axis).squaredNorm() / total : 0.0;
  return {{length > 0.0 ? Vec3d(sum / length) : a.axis, length}, log_scale};
}

std::vector<double> sg_zonal(int order, double sharpness) {
  std::vector<double> coefficients = spherical_bessel_ratios(order, sharpness);
  for (std::size_t l = 0; l < coefficients.size(); ++l) {
    coefficients[l] *= std::sqrt((2.0 * static_cast<double>(l) + 1.0) / (4.0 * kPi));
  }
  return coefficients;
}

}  // namespace heddle
