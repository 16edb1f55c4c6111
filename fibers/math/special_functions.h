#ifndef HEDDLE_FIBERS_MATH_SPECIAL_FUNCTIONS_H_
#define HEDDLE_FIBERS_MATH_SPECIAL_FUNCTIONS_H_
// Special functions of the scattering models, in forms that neither overflow nor cancel.
//
// As printed, I0(x), i_l(x) and differences of erf overflow (I0 in float from x = 88) or cancel.
// The forms here are scaled by exp(-x), or are ratios, or are differences taken on the right side.
// Errors are relative. Tested in tests/math/special_functions_test.cpp.

#include <vector>

namespace heddle {

/// I0(x) exp(-x), modified Bessel function of order 0. x >= 0. Error below 1e-14.
double scaled_bessel_i0(double x);

/// The same in float by Abramowitz and Stegun 9.8.1 and 9.8.2. Error below 1e-6.
float scaled_bessel_i0(float x);

/// [order + 1] ratios I_m(x) / I_0(x). x >= 0, order <= 16, error below 1e-13 up to x = 1e7.
std::vector<double> bessel_ratios(int order, double x);

/// [order + 1] ratios A_l(x) = i_l(x) / i_0(x) of modified spherical Bessel functions. x >= 0,
/// order <= 10. Error below 1e-13 up to x = 1e8 and beyond (1 in the limit).
std::vector<double> spherical_bessel_ratios(int order, double x);

/// erf(b) - erf(a) without cancellation where both lie on one side of 0.
double erf_difference(double a, double b);
float erf_difference(float a, float b);

/// sin(x) for |x| <= pi/2 by its series, error 6e-12; for a number or an Eigen array, of which it
/// makes vector code.
template <class T>
T sine_of_quarter(const T& x) {
  const T z = x * x;
  T p = z * (-1.0 / 1307674368000) + 1.0 / 6227020800;
  p = p * z - 1.0 / 39916800;
  p = p * z + 1.0 / 362880;
  p = p * z - 1.0 / 5040;
  p = p * z + 1.0 / 120;
  p = p * z - 1.0 / 6;
  p = p * z + 1.0;
  return p * x;
}

/// Mean of cos^2 over a Gaussian cut to [-pi/2, pi/2]:
///   Gn(mu; beta) = integral over [-pi/2, pi/2] of exp(-(t - mu)^2 / (2 beta^2)) cos^2(t) dt
///                  / (sqrt(2 pi) beta)
/// This is the Gn(mu; lambda) of Khungurn 2015 with lambda = 1 / (2 beta^2). |mu| <= pi/2 and beta
/// > 0 in radians. By quadrature: the closed form with erf of a complex argument gives NaN from
/// beta = 1 degree down. Never 0: about beta^2 / 2 at mu = +-pi/2. Error below 1e-12 for beta from
/// 0.01 to 90 degrees.
double gaussian_cos2_mean(double mu, double beta);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SPECIAL_FUNCTIONS_H_
