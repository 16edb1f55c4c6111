#ifndef HEDDLE_FIBERS_MATH_CIRCULAR_GAUSSIAN_H_
#define HEDDLE_FIBERS_MATH_CIRCULAR_GAUSSIAN_H_
// Circular Gaussians gc(x; m, s) = exp(2/s^2 (cos(x - m) - 1)) of Iwasaki et al. 2014, and the
// integral of a product of two of them, in theta and phi, over the visible side of a line (section
// 3.2). Angles are in radians. Width s > 0 may be infinite, which is the constant 1.
//
// A spherical Gaussian of sharpness 2/s^2 and axis (theta_k, phi_k) is such a product exactly (eq.
// 11):
//   G(theta, phi) = gc(theta; theta_k, s) gc(phi; phi_k, azimuthal_width(s, theta, theta_k))
// Means lie in [-2 pi, 2 pi]. The domain is always [-pi/2, pi/2] in both angles. Tested, with all
// errors, in tests/math/circular_gaussian_test.cpp.

#include <vector>

#include "fibers/math/float8.h"

namespace heddle {

struct CircularGaussian {
  double mean;
  double width;
};

double circular_gaussian(const CircularGaussian& gaussian, double x);

/// Width in phi of a spherical Gaussian's slice at theta: s / sqrt(cos theta cos theta_k). Infinite
/// at the poles.
double azimuthal_width(double width, double theta, double theta_k);

/// The spherical Gaussian's sharpness and the width s in each other's terms; sharpness 0 is
/// infinite width.
double sharpness_of_width(double width);
double width_of_sharpness(double sharpness);

/// a(x) b(x) = amplitude gc(x; gaussian).
struct CircularGaussianProduct {
  CircularGaussian gaussian;
  double amplitude;  // <= 1
};
CircularGaussianProduct circular_gaussian_product(const CircularGaussian& a,
                                                  const CircularGaussian& b);

/// Integral over [begin, end], |x - mean| <= pi there. Error below 2e-6 of the integral over the
/// circle.
double circular_gaussian_mass(const CircularGaussian& gaussian, double begin, double end);

/// A line in the (theta, phi) plane, with the means (theta_l, phi_k) of the two Gaussians. The
/// gradient has length 1 and points into the visible side, which is
///   theta_gradient (theta - theta_l) + phi_gradient (phi - phi_k) + distance > 0
struct VisibilityLine {
  double distance;
  double theta_gradient;
  double phi_gradient;
};

/// The integral of gc(theta) gc(phi) over the visible part of the domain. One of the two integrals
/// has a closed form. The other is one Gauss-Legendre panel of 20 nodes, between the points where
/// the line enters and leaves what the first covers. Right wherever the means lie, also at +-pi/2:
/// error below 4e-6 of pi min(s, 1) min(s', 1) in all tests. 0.2 to 0.4 us.
double clipped_gaussians(const CircularGaussian& theta, const CircularGaussian& phi,
                         const VisibilityLine& line);

/// The same for eight at a time, in single precision and with fewer nodes. theta means lie within
/// [-pi/2, pi/2] and phi means within [-pi, pi]; widths reach 1000. Error below 1e-3 of pi min(s,
/// 1) min(s', 1), 6e-5 RMS.
struct CircularGaussian8 {
  Float8 mean;
  Float8 width;
};
struct VisibilityLine8 {
  Float8 distance;
  Float8 theta_gradient;
  Float8 phi_gradient;
};
Float8 clipped_gaussians(const CircularGaussian8& theta, const CircularGaussian8& phi,
                         const VisibilityLine8& line);

/// The same by nested panels with breaks at every scale: error below 1e-10. Tens of microseconds.
double clipped_gaussians_quadrature(const CircularGaussian& theta, const CircularGaussian& phi,
                                    const VisibilityLine& line);

/// As printed: eq. 13 (plain Gaussians, erf) times eq. 14 (a logistic function of the distance).
/// Eq. 13 is low by 7 % for widths 1 and by 0.2 % for 1/8. The whole is off by up to 0.23 of pi s
/// s' for means near +-pi/2.
double clipped_gaussians_printed(const CircularGaussian& theta, const CircularGaussian& phi,
                                 const VisibilityLine& line);

/// Eq. 13: the integral without occlusion, of plain Gaussians.
double unoccluded_gaussians_printed(const CircularGaussian& theta, const CircularGaussian& phi);

/// H of eq. 12: the visible share of two Gaussians whose means are 0.
double visible_share(double theta_width, double phi_width, const VisibilityLine& line);

/// Kappa of eq. 14: 1 / (1 + exp(-kappa d)) nearest to visible_share in the least-squares sense
/// over the distances at which the line cuts the domain. About 2.4 / hypot(s theta_gradient, s'
/// phi_gradient) for narrow Gaussians.
double sigmoid_gain(double theta_width, double phi_width, double theta_gradient,
                    double phi_gradient);

/// Kappa of eq. 14 from a table, as the paper keeps it: widths from 0.005 to 3 (beyond, the
/// nearest), gradients of any direction. Within 3 % of sigmoid_gain.
class SigmoidGains {
 public:
  SigmoidGains();
  double gain(double theta_width, double phi_width, double theta_gradient,
              double phi_gradient) const;

 private:
  static constexpr int kWidths = 24;
  static constexpr int kGradients = 17;
  std::vector<double>
      // [theta width][phi width][gradient from 0 to 90 degrees] times the spread of narrow
      // Gaussians
      gains_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_CIRCULAR_GAUSSIAN_H_
