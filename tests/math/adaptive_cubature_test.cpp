#include "fibers/math/adaptive_cubature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace heddle {
namespace {

TEST(AdaptiveCubature, PolynomialsAreExact) {
  const Rgbd value = integrate_rectangle(-1, 2, 1, 3, {}, [](double x, double y) {
    return Rgbd(1, x * x * y, std::pow(x, 5) * std::pow(y, 4));
  });
  EXPECT_NEAR(value[0], 6, 1e-13);
  EXPECT_NEAR(value[1], 3 * 4, 1e-12);
  EXPECT_NEAR(value[2], (64 - 1) / 6. * (243 - 1) / 5., 1e-10);
}

// A kink and a root along a line that no cell follows.
TEST(AdaptiveCubatureLaw, ErrorStaysWithinTheTolerance) {
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    CubatureSettings settings;
    settings.tolerance = tolerance;
    const Rgbd value = integrate_rectangle(-1, 1, -1, 1, settings, [](double x, double y) {
      const double square = x * x + y * y;
      return Rgbd(1, std::max(0.0, 1 - square), std::sqrt(std::max(0.0, 1 - square)));
    });
    const Rgbd error = (value - Rgbd(4, kPi / 2, 2 * kPi / 3)).abs();
    EXPECT_LT(error.maxCoeff(), tolerance * 4) << error.transpose();
  }
}

TEST(AdaptiveCubature, FindsAFeatureOfTheSizeOfItsFirstCells) {
  CubatureSettings settings;
  settings.rows = settings.columns = 10;
  const double width = .03;
  const Rgbd value = integrate_rectangle(0, 1, 0, 1, settings, [&](double x, double y) {
    return Rgbd::Constant(
        std::exp(-.5 * (std::pow(x - .412, 2) + std::pow(y - .733, 2)) / (width * width)));
  });
  EXPECT_NEAR(value[0] / (2 * kPi * width * width), 1, 1e-4);
}

TEST(AdaptiveCubature, StopsAtTheMostPoints) {
  CubatureSettings settings;
  settings.tolerance = 0;
  settings.max_points = 5000;
  int calls = 0;
  integrate_rectangle(0, 1, 0, 1, settings, [&](double x, double y) {
    ++calls;
    return Rgbd::Constant(x * x < y ? 1 : 0);
  });
  EXPECT_LT(calls, 5200);
}

}  // namespace
}  // namespace heddle
