#include "fibers/math/spherical_gaussian.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/special_functions.h"

namespace heddle {

namespace {

// Up to this sharpness the distribution is the uniform one, share = depth / 2: the two differ by
// the factor 1 + sharpness (1 - share) to first order, which rounds to 1. Above, expm1 and log1p
// lose nothing, however small the sharpness.
constexpr double kUniform = 1e-16;

}  // namespace

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

double sg_share_within(double depth, double sharpness) {
  if (sharpness <= kUniform) return 0.5 * depth;
  return std::expm1(-sharpness * depth) / std::expm1(-2.0 * sharpness);
}

double sg_depth_of_share(double share, double sharpness) {
  if (sharpness <= kUniform) return 2.0 * share;
  return std::min(2.0, -std::log1p(share * std::expm1(-2.0 * sharpness)) / sharpness);
}

double sg_sharpness_of_mean_depth(double depth) {
  if (depth >= 1) return 0;
  // Start: Banerjee et al. 2005, equation 4.4, within 3 %. Then Newton's steps.
  const double mean = 1 - depth;
  double sharpness = mean * (3 - mean * mean) / (depth * (1 + mean));
  if (sharpness < 1e-3) return sharpness;  // where the function below cancels
  for (int step = 0; step < 4; ++step) {
    const double grown = std::expm1(2 * std::min(sharpness, 300.0));
    const double excess = 1 / sharpness - 2 / grown - depth;
    const double slope = -1 / (sharpness * sharpness) + 4 / grown * (1 + 1 / grown);
    sharpness = std::max(sharpness - excess / slope, 1e-4);
  }
  return sharpness;
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
