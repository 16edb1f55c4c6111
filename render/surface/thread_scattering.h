#ifndef HEDDLE_RENDER_SURFACE_THREAD_SCATTERING_H_
#define HEDDLE_RENDER_SURFACE_THREAD_SCATTERING_H_
// Scattering of one thread: Sadeghi et al. 2013, "A practical microcylinder appearance model for
// cloth rendering", equations 2 to 4, with the angles of its figure 9.
//
// Thread frame: tangent t, local normal n, binormal b = n x t. Directions point away from the
// thread.
//   theta = asin(w.t), phi = atan2(w.b, w.n)
//   theta_h, theta_d = (theta_i +- theta_r) / 2, phi_d = phi_i - phi_r
//   f_s = (Fr cos(phi_d/2) g(gamma_s, theta_h)
//          + A F ((1 - kd) g(gamma_v, theta_h) + kd) / (cos theta_i + cos theta_r)) / cos^2 theta_d
// g is a Gaussian of unit area over radians. Fr is the exact unpolarised reflectance at the angle
// whose cosine is cos theta_d cos(phi_d/2). ThreadConventions names what the text leaves open. f_s
// is reciprocal to the last bit. It is not bounded (1/cos^2 theta_d) and not energy conserving:
// docs/surface-models.md.
//
// No angle is ever subtracted. With v = (cos, sin) of two angles, |v_i + v_r| / 2 and |v_i - v_r| /
// 2 are the cosine and the sine of half their difference. That wraps phi_d to [-pi, pi] and does
// not cancel. N directions are computed at once, in double. The arctangent is exact to 5e-14.
// Tested in tests/render/surface/thread_scattering_test.cpp.

#include <cmath>
#include <cstdint>

#include "fibers/math/vector.h"

namespace heddle {

struct ThreadParameters {
  double ior = 1.5;              // eta, >= 1
  Rgbd albedo = Rgbd::Zero();    // A: colour of what is scattered inside the thread
  double kd = 0;                 // isotropic share of that, 0 to 1
  double gamma_s = radians(10);  // width of the surface lobe
  double gamma_v = radians(20);  // width of the volume lobe
};

/// Readings of what the text leaves open; the defaults are those of every published figure of ours.
struct ThreadConventions {
  /// "Width" of g: its standard deviation (as in Marschner et al. 2003), or w of exp(-x^2 / w^2)
  /// (Iwasaki et al. 2014).
  enum class Width : std::uint8_t { kStandardDeviation, kIwasaki };
  /// Where the two transmissions F of eq. 3 are taken: (1 - Fr)^2 at the angle of eq. 2, or each at
  /// its own angle from n.
  enum class Fresnel : std::uint8_t { kHalf, kNormal };

  Width width = Width::kStandardDeviation;
  Fresnel fresnel = Fresnel::kHalf;
  /// Deviation of the Gaussian u that blends shadowing with masking (eq. 9 and 13).
  double blend = radians(20);
};

/// N numbers, one for each thread frame.
template <int N>
using Lanes = Eigen::Array<double, N, 1>;

/// Components of one unit vector in N thread frames, or of N unit vectors.
template <int N>
struct ThreadDirection {
  Lanes<N> tangent, binormal, normal;
};

/// What the equations need of a pair of directions. Symmetric in i and r but for the names.
template <int N>
struct ThreadAngles {
  Lanes<N> cos_theta_i, cos_theta_r;
  Lanes<N> cos_phi_i, cos_phi_r;
  Lanes<N> normal_i, normal_r;  // w.n
  Lanes<N> cos_theta_d;
  Lanes<N> cos_half_phi_d;
  Lanes<N> theta_h_squared, phi_d_squared;
};

/// Angle whose half has the tangent t, 0 <= t <= 1. Error below 5e-14: atan(x) / x as a polynomial
/// in x^2, by Chebyshev interpolation on [0, 1].
template <int N>
Lanes<N> angle_of_half_tangent(const Lanes<N>& t) {
  constexpr double kAtan[] = {
      0.9999999999999593,   -0.33333333331212756,  0.19999999814556513,   -0.14285707840928186,
      0.11110992768470362,  -0.0908958463868057,   0.07682475283093737,   -0.06615504892343438,
      0.05688476438604084,  -0.04712670539674946,  0.035630338154078345,  -0.022988058655755594,
      0.011741425783839077, -0.004342183587141335, 0.0010175546631217003, -0.00011234357953071594};
  const Lanes<N> square = t * t;
  Lanes<N> sum = Lanes<N>::Constant(kAtan[15]);
  for (int k = 14; k >= 0; --k) sum = sum * square + kAtan[k];
  return 2 * t * sum;
}

template <int N>
ThreadAngles<N> thread_angles(const ThreadDirection<N>& wi, const ThreadDirection<N>& wr) {
  ThreadAngles<N> a;
  a.normal_i = wi.normal;
  a.normal_r = wr.normal;
  a.cos_theta_i = (wi.binormal.square() + wi.normal.square()).sqrt();
  a.cos_theta_r = (wr.binormal.square() + wr.normal.square()).sqrt();
  a.cos_phi_i = wi.normal / a.cos_theta_i;
  a.cos_phi_r = wr.normal / a.cos_theta_r;
  const Lanes<N> sin_phi_i = wi.binormal / a.cos_theta_i;
  const Lanes<N> sin_phi_r = wr.binormal / a.cos_theta_r;
  // exp(i theta_i) + exp(i theta_r) = 2 cos theta_d exp(i theta_h); cosines of theta are not
  // negative.
  const Lanes<N> real = a.cos_theta_i + a.cos_theta_r;
  const Lanes<N> imaginary = wi.tangent + wr.tangent;
  const Lanes<N> modulus = (real.square() + imaginary.square()).sqrt();
  a.cos_theta_d = 0.5 * modulus;
  a.theta_h_squared = angle_of_half_tangent<N>(imaginary.abs() / (modulus + real)).square();
  a.cos_half_phi_d =
      0.5 * ((a.cos_phi_i + a.cos_phi_r).square() + (sin_phi_i + sin_phi_r).square()).sqrt();
  const Lanes<N> sin_half_phi_d =
      0.5 * ((a.cos_phi_i - a.cos_phi_r).square() + (sin_phi_i - sin_phi_r).square()).sqrt();
  a.phi_d_squared = 4 * angle_of_half_tangent<N>(sin_half_phi_d / (1 + a.cos_half_phi_d)).square();
  return a;
}

/// Reflectance of a smooth dielectric from outside, unpolarised, for the cosine of the angle to the
/// normal.
template <int N>
Lanes<N> fresnel_reflectance(double ior, const Lanes<N>& cosine) {
  // ior times the cosine inside
  const Lanes<N> refracted = (ior * ior - 1 + cosine.square()).sqrt();
  const Lanes<N> s = (cosine - refracted) / (cosine + refracted);
  const Lanes<N> p = (ior * ior * cosine - refracted) / (ior * ior * cosine + refracted);
  return 0.5 * (s.square() + p.square());
}

/// f_s = surface + albedo * volume, 1/sr.
template <int N>
struct ThreadValue {
  Lanes<N> surface, volume;
};

class ThreadScattering {
 public:
  ThreadScattering(const ThreadParameters& parameters, const ThreadConventions& conventions);

  template <int N>
  ThreadValue<N> value(const ThreadAngles<N>& a) const {
    const Lanes<N> reflected =
        fresnel_reflectance<N>(parameters_.ior, a.cos_theta_d * a.cos_half_phi_d);
    Lanes<N> entering = (1 - reflected).square();
    if (fresnel_ == ThreadConventions::Fresnel::kNormal) {
      entering = (1 - fresnel_reflectance<N>(parameters_.ior, a.normal_i.max(0.0))) *
                 (1 - fresnel_reflectance<N>(parameters_.ior, a.normal_r.max(0.0)));
    }
    const Lanes<N> cone = 1 / a.cos_theta_d.square();
    const Lanes<N> surface_lobe = surface_height_ * (surface_exponent_ * a.theta_h_squared).exp();
    const Lanes<N> volume_lobe = volume_height_ * (volume_exponent_ * a.theta_h_squared).exp();
    return {reflected * a.cos_half_phi_d * surface_lobe * cone,
            entering * (volume_lobe + parameters_.kd) / (a.cos_theta_i + a.cos_theta_r) * cone};
  }

  /// f_s for angles in radians, |theta| <= pi/2.
  Rgbd value(double theta_i, double phi_i, double theta_r, double phi_r) const;

  const ThreadParameters& parameters() const { return parameters_; }
  /// Standard deviations of the Gaussians, radians.
  double surface_deviation() const { return surface_deviation_; }
  double volume_deviation() const { return volume_deviation_; }

 private:
  ThreadParameters parameters_;
  ThreadConventions::Fresnel fresnel_;
  double surface_deviation_, volume_deviation_;
  double surface_height_, surface_exponent_;  // g = height exp(exponent theta_h^2)
  double volume_height_, volume_exponent_;    // times 1 - kd
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_THREAD_SCATTERING_H_
