#include "fibers/math/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

TEST(QuadratureLaw, GaussLegendreIsExactToDegreeTwiceTheCountLessOne) {
  for (const int count : {1, 2, 3, 7, 20, 64}) {
    const QuadratureRule rule = gauss_legendre(count, -0.5, 2.0);
    for (int degree = 0; degree <= std::min(2 * count - 1, 40); ++degree) {
      const double exact = (std::pow(2.0, degree + 1) - std::pow(-0.5, degree + 1)) / (degree + 1);
      const double value = integrate(rule, [degree](double x) { return std::pow(x, degree); });
      EXPECT_NEAR(value, exact, 1e-13 * std::max(1.0, std::abs(exact)))
          << count << " nodes, degree " << degree;
    }
  }
}

TEST(QuadratureLaw, GaussHermiteGivesTheMomentsOfTheGaussian) {
  for (const int count : {1, 3, 12}) {
    for (int half = 0; 2 * half <= 2 * count - 1; ++half) {
      // integral of x^(2h) exp(-x^2) = Gamma(h + 1/2)
      const double exact = std::tgamma(half + 0.5);
      const double value =
          integrate(gauss_hermite(count), [half](double x) { return std::pow(x, 2 * half); });
      EXPECT_NEAR(value / exact, 1.0, 1e-12) << count << " nodes, degree " << 2 * half;
    }
  }
}

TEST(QuadratureLaw, CutRuleIsExactToDegreeFive) {
  for (const double cut : {-1.0, 0.0, 0.4, 1.3, 3.0, 5.0, 20.0}) {
    const ThreeNodeRule rule = cut_gauss_hermite3(cut);
    const QuadratureRule fine =
        gauss_legendre_panels(40, -7.0, std::min(cut, 7.0), {-3.0, 0.0, 3.0});
    for (int degree = 0; degree <= 5; ++degree) {
      const double exact =
          integrate(fine, [degree](double x) { return std::pow(x, degree) * std::exp(-x * x); });
      double value = 0.0;
      for (std::size_t k = 0; k < 3; ++k)
        value += rule.weights[k] * std::pow(rule.nodes[k], degree);
      EXPECT_NEAR(value, exact, 1e-12) << "cut " << cut << ", degree " << degree;
    }
    EXPECT_LT(rule.nodes[2], cut);
  }
}

TEST(Quadrature, PanelsResolveAPeakMuchNarrowerThanTheInterval) {
  constexpr double kWidth = 1e-5;
  std::vector<double> breaks;
  append_geometric_breaks(0.3, kWidth, 4.0, breaks);
  const QuadratureRule rule = gauss_legendre_panels(16, -1.0, 1.0, breaks);
  const double value =
      integrate(rule, [](double x) { return std::exp(-0.5 * std::pow((x - 0.3) / kWidth, 2)); });
  EXPECT_NEAR(value / (std::sqrt(2.0 * kPi) * kWidth), 1.0, 1e-11);
}

}  // namespace
}  // namespace heddle
