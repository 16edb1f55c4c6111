#include "fibers/math/circular_gaussian.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

VisibilityLine line_at(double distance, double gradient) {
  return {distance, std::cos(gradient), std::sin(gradient)};
}

double exact_mass(const CircularGaussian& gaussian, double begin, double end) {
  std::vector<double> breaks;
  append_geometric_breaks(gaussian.mean, std::min(gaussian.width, 1.0), kPi, breaks);
  return integrate(gauss_legendre_panels(16, begin, end, breaks),
                   [&](double x) { return circular_gaussian(gaussian, x); });
}

double mass(const CircularGaussian& gaussian) {
  return exact_mass(gaussian, -kHalfPi, kHalfPi);
}

TEST(CircularGaussian, WidthsAndSharpnesses) {
  EXPECT_NEAR(sharpness_of_width(0.5), 8, 1e-14);
  EXPECT_NEAR(width_of_sharpness(8), 0.5, 1e-15);
  EXPECT_EQ(width_of_sharpness(0), kInfinity);
  EXPECT_EQ(sharpness_of_width(kInfinity), 0);
  EXPECT_EQ(azimuthal_width(0.1, kHalfPi + 1e-9, 0), kInfinity);
  EXPECT_EQ(circular_gaussian({1, kInfinity}, -2), 1);
}

TEST(CircularGaussianLaw, SphericalGaussianIsAProduct) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  const auto direction = [](double theta, double phi) {
    return Vec3d(std::sin(theta), std::cos(theta) * std::sin(phi), std::cos(theta) * std::cos(phi));
  };
  for (int k = 0; k < 1000; ++k) {
    const double theta = kPi * (random.uniform_double() - 0.5);
    const double theta_k = kPi * (random.uniform_double() - 0.5);
    const double phi = 2 * kPi * random.uniform_double();
    const double phi_k = 2 * kPi * random.uniform_double();
    const double width = std::exp2(-6 * random.uniform_double());
    const double product = circular_gaussian({theta_k, width}, theta) *
                           circular_gaussian({phi_k, azimuthal_width(width, theta, theta_k)}, phi);
    const double value =
        sg_value({direction(theta_k, phi_k), sharpness_of_width(width)}, direction(theta, phi));
    EXPECT_NEAR(product, value, 1e-11);
  }
}

TEST(CircularGaussianLaw, ProductIsPointwise) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 1000; ++k) {
    const CircularGaussian a{2 * kPi * (random.uniform_double() - 0.5),
                             std::exp2(1 - 8 * random.uniform_double())};
    const CircularGaussian b{2 * kPi * (random.uniform_double() - 0.5),
                             std::exp2(1 - 8 * random.uniform_double())};
    const CircularGaussianProduct product = circular_gaussian_product(a, b);
    EXPECT_LE(product.amplitude, 1);
    for (const double x : {-2.0, a.mean, b.mean, product.gaussian.mean, 0.3}) {
      const double expected = circular_gaussian(a, x) * circular_gaussian(b, x);
      // The exponents reach 1e4, and their rounding with them.
      EXPECT_NEAR(product.amplitude * circular_gaussian(product.gaussian, x), expected,
                  1e-11 + 1e-10 * expected);
    }
  }
  const CircularGaussianProduct cancelled = circular_gaussian_product({0, kInfinity}, {1, 0.3});
  EXPECT_NEAR(cancelled.gaussian.mean, 1, 1e-14);
  EXPECT_NEAR(cancelled.gaussian.width, 0.3, 1e-14);
  EXPECT_NEAR(cancelled.amplitude, 1, 1e-14);
  EXPECT_EQ(circular_gaussian_product({0, kInfinity}, {1, kInfinity}).gaussian.width, kInfinity);
}

TEST(CircularGaussianAgreement, MassAgainstPanels) {
  double worst = 0;
  for (const double width : {1e-7, 1e-3, 0.1, 0.3, 0.35, 0.351, 0.5, 1.0, 3.0, 1e4, kInfinity}) {
    for (const double mean : {0.0, 0.7, -1.5, kHalfPi}) {
      for (const double begin : {-kHalfPi, mean - 0.5 * std::min(width, 1.0), 0.4}) {
        for (const double end : {kHalfPi, mean + 0.5 * std::min(width, 1.0), -0.2}) {
          const double lower = std::max(begin, -kHalfPi);
          const double upper = std::min(end, kHalfPi);
          if (lower >= upper) continue;
          const double exact = exact_mass({mean, width}, lower, upper);
          const double whole = exact_mass({mean, width}, mean - kPi, mean + kPi);
          worst = std::max(
              worst, std::abs(circular_gaussian_mass({mean, width}, lower, upper) - exact) / whole);
        }
      }
    }
  }
  std::printf("  largest error of the mass over the whole circle's: %.2g\n", worst);
  EXPECT_LT(worst, 2e-6);
}

// Iwasaki 2014, section 4: visible where theta > 0, so that d = theta_l and its gradient is (1, 0),
// and all integrals are products. The root mean square over uniform means of I against eq. 12, the
// ratio and the unoccluded integral both exact, on `cells` midpoints.
double rms_of_equation_12(double theta_width, double phi_width, int cells) {
  double theta_squares = 0;
  double phi_squares = 0;
  for (int i = 0; i < cells; ++i) {
    const double mean = kPi * ((i + 0.5) / cells - 0.5);
    const double ratio = exact_mass({0, theta_width}, -mean, kHalfPi) / mass({0, theta_width});
    const double error =
        exact_mass({mean, theta_width}, 0, kHalfPi) - mass({mean, theta_width}) * ratio;
    theta_squares += error * error;
    phi_squares += mass({mean, phi_width}) * mass({mean, phi_width});
  }
  return std::sqrt(theta_squares * phi_squares) / cells;
}

TEST(CircularGaussianAgreement, RmseFiguresOfThePaper) {
  // Printed: 1.5514e-4 and 4.0907e-5. 16 midpoints give 1.5509e-4 and 4.0908e-5, and many 1.550e-4
  // and 4.075e-5.
  EXPECT_NEAR(rms_of_equation_12(0.5, 0.5, 16), 1.5509e-4, 1.5e-7);
  EXPECT_NEAR(rms_of_equation_12(0.5, 0.125, 16), 4.0908e-5, 1.5e-7);
  EXPECT_NEAR(rms_of_equation_12(0.5, 0.5, 100), 1.550e-4, 1e-7);
  EXPECT_NEAR(rms_of_equation_12(0.5, 0.125, 100), 4.075e-5, 5e-8);
  EXPECT_NEAR(rms_of_equation_12(0.5, 1.0 / 32, 64), 1.03e-5, 1e-7);
  // The other three printed values (0.0049, 1.7207e-8, 0.0035) are not errors of eq. 12: where
  // theta is narrow it has none.
  EXPECT_LT(rms_of_equation_12(0.125, 0.5, 16), 2e-8);
  EXPECT_LT(rms_of_equation_12(1.0 / 32, 0.5, 16), 2e-8);
}

double rms_with_equation_13(double theta_width, double phi_width) {
  constexpr int kCells = 64;
  double squares = 0;
  for (int i = 0; i < kCells; ++i) {
    const CircularGaussian theta{kPi * ((i + 0.5) / kCells - 0.5), theta_width};
    const VisibilityLine line{theta.mean, 1, 0};
    const double ratio = visible_share(theta_width, phi_width, line);
    for (int j = 0; j < kCells; ++j) {
      const CircularGaussian phi{kPi * ((j + 0.5) / kCells - 0.5), phi_width};
      const double error =
          clipped_gaussians(theta, phi, line) - unoccluded_gaussians_printed(theta, phi) * ratio;
      squares += error * error;
    }
  }
  return std::sqrt(squares) / kCells;
}

TEST(CircularGaussianAgreement, Equation13SwappedIn) {
  EXPECT_NEAR(rms_with_equation_13(0.5, 0.5), 0.0120, 1e-4);
  EXPECT_NEAR(rms_with_equation_13(0.5, 0.125), 0.0017, 5e-5);
  EXPECT_NEAR(rms_with_equation_13(0.5, 1.0 / 32), 4.0e-4, 5e-6);
  EXPECT_NEAR(rms_with_equation_13(0.125, 0.5), 0.0019, 5e-5);
  EXPECT_NEAR(rms_with_equation_13(1.0 / 32, 0.5), 4.5e-4, 1e-5);
}

TEST(CircularGaussianAgreement, Equation13IsLow) {
  const std::vector<std::pair<double, double>> expected = {
      {1.0, 0.073}, {std::sqrt(0.5), 0.060}, {0.5, 0.033}, {0.25, 0.008}, {0.125, 0.002}};
  for (const auto& [width, deficit] : expected) {
    const double exact = mass({0, width}) * mass({0, width});
    EXPECT_NEAR(1 - unoccluded_gaussians_printed({0, width}, {0, width}) / exact, deficit, 6e-4)
        << width;
  }
}

double largest_error_of_sigmoid(double theta_width, double phi_width, double gradient) {
  const double gain = sigmoid_gain(theta_width, phi_width, std::cos(gradient), std::sin(gradient));
  double worst = 0;
  for (int k = 0; k <= 1200; ++k) {
    const double d = kPi * (k / 1200.0 - 0.5);
    worst = std::max(worst, std::abs(visible_share(theta_width, phi_width, line_at(d, gradient)) -
                                     1 / (1 + std::exp(-gain * d))));
  }
  return worst;
}

// Figure 5 of the paper: 0.0093 and 0.0094.
TEST(CircularGaussianAgreement, SigmoidErrorsOfThePaper) {
  EXPECT_NEAR(largest_error_of_sigmoid(0.25 * std::sqrt(0.5), std::sqrt(0.5), 0), 0.00932, 5e-5);
  EXPECT_NEAR(largest_error_of_sigmoid(1.0 / 16, 0.5 * std::sqrt(0.5), 0), 0.00947, 5e-5);
  for (int k = 1; k <= 6; ++k) {
    EXPECT_NEAR(largest_error_of_sigmoid(1.0 / 16, 0.5 * std::sqrt(0.5), k * kPi / 12), 0.0086,
                0.0010)
        << k;
  }
}

// For narrow Gaussians the share is (1 + erf(d / S)) / 2, whose nearest logistic function has
// gain 2.40 / S.
TEST(CircularGaussianLaw, NarrowGaussiansMakeAnErrorFunction) {
  for (const double gradient : {0.0, 0.4, 1.2, -2.0}) {
    const double spread = std::hypot(0.01 * std::cos(gradient), 0.003 * std::sin(gradient));
    for (const double t : {-1.5, -0.3, 0.0, 0.8}) {
      EXPECT_NEAR(visible_share(0.01, 0.003, line_at(t * spread, gradient)),
                  0.5 * (1 + std::erf(t)), 2e-5);
    }
    EXPECT_NEAR(sigmoid_gain(0.01, 0.003, std::cos(gradient), std::sin(gradient)) * spread, 2.40,
                0.01);
  }
}

struct Case {
  CircularGaussian theta;
  CircularGaussian phi;
  VisibilityLine line;
};

std::vector<Case> many_cases(std::uint64_t seed, int count) {
  RandomStream random(seed, RandomStage::kTest, 0, 0);
  std::vector<Case> cases;
  for (int k = 0; k < count; ++k) {
    Case c;
    c.theta = {kPi * (random.uniform_double() - 0.5), std::exp2(1 - 8 * random.uniform_double())};
    c.phi = {2 * kPi * (random.uniform_double() - 0.5), std::exp2(2 - 9 * random.uniform_double())};
    const double gradient = k % 7 == 0 ? kHalfPi * (k % 5) : 2 * kPi * random.uniform_double();
    const double scale = k % 2 == 0 ? kPi
                                    : std::hypot(c.theta.width * std::cos(gradient),
                                                 c.phi.width * std::sin(gradient));
    c.line = line_at(scale * (2 * random.uniform_double() - 1), gradient);
    if (k % 11 == 0) c.theta.mean = k % 2 == 0 ? kHalfPi : -kHalfPi;
    if (k % 13 == 0) c.phi.width = kInfinity;
    cases.push_back(c);
  }
  return cases;
}

TEST(CircularGaussianAgreement, ClippedGaussiansAgainstQuadrature) {
  double worst = 0;
  for (const Case& c : many_cases(3, 4000)) {
    const double exact = clipped_gaussians_quadrature(c.theta, c.phi, c.line);
    const double scale = kPi * std::min(c.theta.width, 1.0) * std::min(c.phi.width, 1.0);
    const double error = std::abs(clipped_gaussians(c.theta, c.phi, c.line) - exact) / scale;
    EXPECT_LT(error, 1e-5) << c.theta.mean << " " << c.theta.width << ", " << c.phi.mean << " "
                           << c.phi.width << ", " << c.line.distance << " " << c.line.theta_gradient
                           << " " << c.line.phi_gradient;
    worst = std::max(worst, error);
  }
  std::printf("  largest error over the product of widths: %.2g\n", worst);
}

// The oracle of the test above against plain midpoints on a fine grid, which know nothing of lines.
TEST(CircularGaussianAgreement, QuadratureAgainstMidpoints) {
  constexpr int kSide = 1500;
  int k = 0;
  for (Case c : many_cases(4, 12)) {
    c.theta.width = std::max(c.theta.width, 0.05);
    c.phi.width = std::max(c.phi.width, 0.05);
    double sum = 0;
    for (int i = 0; i < kSide; ++i) {
      const double theta = kPi * ((i + 0.5) / kSide - 0.5);
      for (int j = 0; j < kSide; ++j) {
        const double phi = kPi * ((j + 0.5) / kSide - 0.5);
        const double side = c.line.theta_gradient * (theta - c.theta.mean) +
                            c.line.phi_gradient * (phi - c.phi.mean) + c.line.distance;
        if (side > 0) sum += circular_gaussian(c.theta, theta) * circular_gaussian(c.phi, phi);
      }
    }
    const double step = kPi / kSide;
    // Cells on the line, about 1500 sqrt(2), each wrong by at most its area, and nearly always much
    // less.
    EXPECT_NEAR(clipped_gaussians_quadrature(c.theta, c.phi, c.line), sum * step * step,
                0.1 * kSide * step * step)
        << k++;
  }
}

TEST(CircularGaussianLaw, BothSidesOfALineMakeTheWhole) {
  for (const Case& c : many_cases(5, 1000)) {
    const VisibilityLine other{-c.line.distance, -c.line.theta_gradient, -c.line.phi_gradient};
    const double whole = clipped_gaussians(c.theta, c.phi, line_at(100, 0.1));
    const double scale = kPi * std::min(c.theta.width, 1.0) * std::min(c.phi.width, 1.0);
    EXPECT_NEAR(
        clipped_gaussians(c.theta, c.phi, c.line) + clipped_gaussians(c.theta, c.phi, other), whole,
        1e-5 * scale);
    EXPECT_EQ(clipped_gaussians(c.theta, c.phi, line_at(-100, 0.1)), 0);
  }
}

// What eq. 12 gets wrong by up to a quarter of the whole: means at the border of the domain.
TEST(CircularGaussianAgreement, EightAtATimeAreNearTheDoubles) {
  const std::vector<Case> cases = many_cases(5, 40000);
  double worst = 0;
  double squares = 0;
  for (std::size_t first = 0; first + 8 <= cases.size(); first += 8) {
    CircularGaussian8 theta;
    CircularGaussian8 phi;
    VisibilityLine8 line;
    std::array<Case, 8> eight;
    for (std::size_t k = 0; k < 8; ++k) {
      eight[k] = cases[first + k];
      eight[k].theta.mean = std::remainder(eight[k].theta.mean, kPi);
      eight[k].phi.mean = std::remainder(eight[k].phi.mean, 2 * kPi);
      theta.mean[k] = static_cast<float>(eight[k].theta.mean);
      theta.width[k] = static_cast<float>(std::min(eight[k].theta.width, 1e3));
      phi.mean[k] = static_cast<float>(eight[k].phi.mean);
      phi.width[k] = static_cast<float>(std::min(eight[k].phi.width, 1e3));
      line.distance[k] = static_cast<float>(eight[k].line.distance);
      line.theta_gradient[k] = static_cast<float>(eight[k].line.theta_gradient);
      line.phi_gradient[k] = static_cast<float>(eight[k].line.phi_gradient);
    }
    const Float8 values = clipped_gaussians(theta, phi, line);
    for (std::size_t k = 0; k < 8; ++k) {
      const Case& c = eight[k];
      const double exact = clipped_gaussians(c.theta, c.phi, c.line);
      const double scale = kPi * std::min(c.theta.width, 1.0) * std::min(c.phi.width, 1.0);
      const double error = (static_cast<double>(values[k]) - exact) / scale;
      EXPECT_GE(values[k], 0);
      EXPECT_LT(std::abs(error), 1e-3)
          << c.theta.mean << " " << c.theta.width << " | " << c.phi.mean << " " << c.phi.width
          << " | " << c.line.distance << " " << c.line.theta_gradient;
      worst = std::max(worst, std::abs(error));
      squares += error * error;
    }
  }
  std::printf("  eight at a time: largest error %.2g, RMS %.2g\n", worst,
              std::sqrt(squares / static_cast<double>(cases.size())));
}

TEST(CircularGaussianStability, PrintedFormFailsNearTheBorder) {
  const double width = 0.2;
  const double scale = kPi * width * width;
  const auto errors = [&](double theta_l) {
    const CircularGaussian theta{theta_l, width};
    const CircularGaussian phi{0, width};
    double printed = 0;
    double ours = 0;
    for (int k = -20; k <= 20; ++k) {
      for (int g = 0; g < 16; ++g) {
        const VisibilityLine line = line_at(0.04 * k, g * kPi / 8);
        const double exact = clipped_gaussians_quadrature(theta, phi, line);
        printed = std::max(printed,
                           std::abs(clipped_gaussians_printed(theta, phi, line) - exact) / scale);
        ours = std::max(ours, std::abs(clipped_gaussians(theta, phi, line) - exact) / scale);
      }
    }
    std::printf("  theta_l %.1f: printed %.4f, default %.2g of pi s s'\n", theta_l, printed, ours);
    EXPECT_LT(ours, 1e-6);
    return printed;
  };
  EXPECT_LT(errors(0), 0.02);  // the logistic function's 0.0095 and eq. 13's 0.005
  EXPECT_NEAR(errors(1.5), 0.169, 0.03);
}

TEST(CircularGaussianAgreement, GainsFromTheTable) {
  const SigmoidGains gains;
  RandomStream random(8, RandomStage::kTest, 0, 0);
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const double theta_width = 0.005 * std::pow(600, random.uniform_double());
    const double phi_width = 0.005 * std::pow(600, random.uniform_double());
    const double gradient = 2 * kPi * random.uniform_double();
    const double exact =
        sigmoid_gain(theta_width, phi_width, std::cos(gradient), std::sin(gradient));
    const double from_table =
        gains.gain(theta_width, phi_width, std::cos(gradient), std::sin(gradient));
    worst = std::max(worst, std::abs(from_table / exact - 1));
  }
  std::printf("  largest relative error of a gain: %.2g\n", worst);
  EXPECT_LT(worst, 0.03);
}

TEST(CircularGaussianLaw, NothingIsNegativeOrNotFinite) {
  for (const Case& c : many_cases(6, 20000)) {
    const double value = clipped_gaussians(c.theta, c.phi, c.line);
    EXPECT_TRUE(std::isfinite(value));
    EXPECT_GE(value, -1e-15);
  }
}

}  // namespace
}  // namespace heddle
