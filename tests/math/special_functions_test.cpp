#include "fibers/math/special_functions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

// I_m(x) exp(-x) = (1 / pi) integral over [0, pi] of exp(x (cos t - 1)) cos(m t) dt
double scaled_bessel_by_quadrature(int m, double x) {
  std::vector<double> breaks;
  append_geometric_breaks(0.0, 0.5 / std::sqrt(1.0 + x), 4.0, breaks);
  return integrate(gauss_legendre_panels(24, 0.0, kPi, breaks),
                   [m, x](double t) {
                     const double s = std::sin(0.5 * t);
                     return std::exp(-2.0 * x * s * s) * std::cos(m * t);
                   }) /
         kPi;
}

// i_l(x) exp(-x) = (1/2) integral over [-1, 1] of P_l(c) exp(x (c - 1)) dc
double scaled_spherical_bessel_by_quadrature(int l, double x) {
  std::vector<double> breaks;
  append_geometric_breaks(0.0, 0.5 / (1.0 + x), 4.0, breaks);
  return 0.5 * integrate(gauss_legendre_panels(24, 0.0, 2.0, breaks), [l, x](double drop) {
           const double c = 1.0 - drop;
           double before = 1.0;
           double value = l == 0 ? 1.0 : c;
           for (int n = 2; n <= l; ++n) {
             const double next = ((2 * n - 1) * c * value - (n - 1) * before) / n;
             before = value;
             value = next;
           }
           return value * std::exp(-x * drop);
         });
}

TEST(SpecialFunctionsAgreement, ScaledBesselI0) {
  EXPECT_EQ(scaled_bessel_i0(0.0), 1.0);
  // Known value: I0(1) = 1.2660658777520083356...
  EXPECT_NEAR(scaled_bessel_i0(1.0) * std::exp(1.0), 1.2660658777520083, 1e-14);
  for (double x = 1e-3; x < 1e9; x *= 1.37) {
    EXPECT_NEAR(scaled_bessel_i0(x) / scaled_bessel_by_quadrature(0, x), 1.0, 1e-12) << x;
    const auto single = static_cast<float>(x);
    EXPECT_NEAR(static_cast<double>(scaled_bessel_i0(single)) /
                    scaled_bessel_i0(static_cast<double>(single)),
                1.0, 1e-6)
        << x;
  }
}

TEST(SpecialFunctionsAgreement, BesselRatios) {
  EXPECT_EQ(bessel_ratios(3, 0.0), (std::vector<double>{1.0, 0.0, 0.0, 0.0}));
  for (const double x : {0.01, 0.4, 2.0, 8.35, 60.0, 3283.0, 3.3e5}) {
    const std::vector<double> ratios = bessel_ratios(10, x);
    for (int m = 0; m <= 10; ++m) {
      const double exact = scaled_bessel_by_quadrature(m, x) / scaled_bessel_by_quadrature(0, x);
      EXPECT_NEAR(ratios[static_cast<std::size_t>(m)], exact, 1e-12) << "m " << m << ", x " << x;
    }
  }
}

TEST(SpecialFunctionsAgreement, SphericalBesselRatios) {
  EXPECT_EQ(spherical_bessel_ratios(2, 0.0), (std::vector<double>{1.0, 0.0, 0.0}));
  for (const double x : {1e-6, 0.01, 0.7, 3.0, 30.0, 150.0, 499.0, 501.0, 1e4, 1e6, 1e8}) {
    const std::vector<double> ratios = spherical_bessel_ratios(10, x);
    EXPECT_NEAR(ratios[1], x < 1e-3 ? x / 3.0 : 1.0 / std::tanh(x) - 1.0 / x, 1e-13) << x;
    for (int l = 0; l <= 10; ++l) {
      const double exact =
          scaled_spherical_bessel_by_quadrature(l, x) / scaled_spherical_bessel_by_quadrature(0, x);
      EXPECT_NEAR(ratios[static_cast<std::size_t>(l)], exact, 2e-12) << "l " << l << ", x " << x;
    }
  }
}

TEST(SpecialFunctionsStability, ErfDifferenceKeepsItsRelativeAccuracyInTheTails) {
  // erf(b) - erf(a) for close a, b is 2 / sqrt(pi) exp(-m^2) (b - a) (1 + O((b - a)^2)).
  for (const double middle : {-12.0, -5.0, -0.3, 0.0, 0.3, 5.0, 12.0}) {
    constexpr double kWidth = 1e-5;
    const double exact = 2.0 / std::sqrt(kPi) * std::exp(-middle * middle) * kWidth;
    EXPECT_NEAR(erf_difference(middle - 0.5 * kWidth, middle + 0.5 * kWidth) / exact, 1.0, 1e-8)
        << middle;
  }
  EXPECT_EQ(erf_difference(-30.0, 30.0), 2.0);
}

TEST(SpecialFunctionsLaw, GaussianCos2MeanInTheOpenIntervalIsTheFullGaussianMean) {
  // Uncut, the mean of cos^2 is (1 + cos(2 mu) exp(-2 beta^2)) / 2; ten deviations from the ends
  // the cut does not show.
  for (const double beta_deg : {0.01, 0.1, 1.0, 5.0}) {
    const double beta = radians(beta_deg);
    for (const double mu : {0.0, 0.3, -0.6}) {
      const double exact = 0.5 * (1.0 + std::cos(2.0 * mu) * std::exp(-2.0 * beta * beta));
      EXPECT_NEAR(gaussian_cos2_mean(mu, beta) / exact, 1.0, 1e-12) << beta_deg << " deg at " << mu;
    }
  }
}

TEST(SpecialFunctionsLaw, GaussianCos2MeanAtTheEndIsHalfTheVariance) {
  for (const double beta_deg : {0.01, 0.1, 0.5}) {
    const double beta = radians(beta_deg);
    EXPECT_NEAR(gaussian_cos2_mean(0.5 * kPi, beta) / (0.5 * beta * beta), 1.0, 2.0 * beta * beta);
    EXPECT_NEAR(gaussian_cos2_mean(-0.5 * kPi, beta) / gaussian_cos2_mean(0.5 * kPi, beta), 1.0,
                1e-14);
  }
}

TEST(SpecialFunctionsAgreement, GaussianCos2MeanAgainstPanels) {
  for (const double beta_deg : {0.1, 1.0, 7.238, 27.197, 60.0, 89.0}) {
    const double beta = radians(beta_deg);
    for (double mu = 0.0; mu <= 0.5 * kPi; mu += kPi / 16.0) {
      std::vector<double> breaks;
      append_geometric_breaks(mu, beta, 4.0, breaks);
      const double exact =
          integrate(gauss_legendre_panels(20, -0.5 * kPi, 0.5 * kPi, breaks), [&](double t) {
            return std::exp(-0.5 * std::pow((t - mu) / beta, 2)) *
                   std::pow(std::sin(0.5 * kPi - std::abs(t)), 2);
          });
      EXPECT_NEAR(gaussian_cos2_mean(mu, beta) * std::sqrt(2.0 * kPi) * beta / exact, 1.0, 1e-12)
          << beta_deg << " deg at " << mu;
    }
  }
}

TEST(SpecialFunctionsAgreement, SineOfAQuarterTurn) {
  Eigen::Array<double, 9, 1> x;
  for (int k = 0; k < 9; ++k) x[k] = 0.5 * kPi * (k - 4) / 4.0;
  const Eigen::Array<double, 9, 1> sines = sine_of_quarter(x);
  for (int k = 0; k < 9; ++k) {
    EXPECT_NEAR(sine_of_quarter(x[k]), std::sin(x[k]), 7e-12);
    EXPECT_NEAR(sines[k], std::sin(x[k]), 7e-12);
  }
}

}  // namespace
}  // namespace heddle
