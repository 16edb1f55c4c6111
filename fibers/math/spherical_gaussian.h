#ifndef HEDDLE_FIBERS_MATH_SPHERICAL_GAUSSIAN_H_
#define HEDDLE_FIBERS_MATH_SPHERICAL_GAUSSIAN_H_
// Spherical Gaussians G(w; axis, sharpness) = exp(sharpness (w . axis - 1)): value 1 on the axis,
// not normalised.
//
// Evaluated as exp(-sharpness |w - axis|^2 / 2), which does not cancel at high sharpness. Sharpness
// >= 0; 0 is the constant 1. Khungurn 2017, section 4. Tested in
// tests/math/spherical_gaussian_test.cpp.

#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

struct SphericalGaussian {
  Vec3d axis;        // unit
  double sharpness;  // >= 0
};

double sg_value(const SphericalGaussian& gaussian, const Vec3d& direction);

/// Integral over the sphere, 2 pi (1 - exp(-2 sharpness)) / sharpness; 4 pi for 0.
double sg_mass(double sharpness);
float sg_mass(float sharpness);

/// Share of the mass that lies within `depth` = 1 - cosine of the axis; depth from 0 to 2.
double sg_share_within(double depth, double sharpness);

/// The inverse: 1 - cosine of the angle within which `share` of the mass lies; share from 0 to 1.
/// Exact to the rounding of `share`, for any sharpness.
double sg_depth_of_share(double share, double sharpness);

/// The sharpness at which the mean of 1 - cosine to the axis is `depth` (> 0): the inverse of 1 -
/// coth(sharpness) + 1 / sharpness. 0 from depth 1 on. Relative error below 1e-6.
double sg_sharpness_of_mean_depth(double depth);

/// a(w) b(w) = exp(log_scale) G(w; gaussian).
struct SgProduct {
  SphericalGaussian gaussian;
  double log_scale;  // <= 0
};

/// Where the two cancel (opposite axes, equal sharpness) the axis is a's.
SgProduct sg_product(const SphericalGaussian& a, const SphericalGaussian& b);

/// [order + 1] coefficients of Y(l, 0) of the *normalised* Gaussian G / mass about +z: sqrt((2 l +
/// 1) / 4 pi) A_l. About another axis the coefficients are A_l Y_lm(axis), with A_l of
/// spherical_bessel_ratios.
std::vector<double> sg_zonal(int order, double sharpness);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SPHERICAL_GAUSSIAN_H_
