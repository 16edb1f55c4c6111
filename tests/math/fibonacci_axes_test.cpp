#include "fibers/math/fibonacci_axes.h"

#include <gtest/gtest.h>

namespace heddle {
namespace {

TEST(FibonacciAxes, UnitVectorsWithinTheirDomain) {
  for (FibonacciSet set :
       {FibonacciSet::kPrinted, FibonacciSet::kHemisphere, FibonacciSet::kSphere}) {
    const std::vector<Vec3d> axes = fibonacci_axes(set, 48);
    ASSERT_EQ(axes.size(), 48U);
    for (const Vec3d& axis : axes) EXPECT_NEAR(axis.norm(), 1, 1e-15);
  }
  EXPECT_EQ(fibonacci_axes(FibonacciSet::kPrinted, 48).front(), Vec3d(0, 0, 1));
  EXPECT_NEAR(fibonacci_axes(FibonacciSet::kPrinted, 48).back().z(), 1.0 / 48, 1e-15);
  EXPECT_DOUBLE_EQ(fibonacci_axes(FibonacciSet::kHemisphere, 48).front().z(), 1 - 1.0 / 96);
  EXPECT_NEAR(fibonacci_axes(FibonacciSet::kHemisphere, 48).back().z(), 1.0 / 96, 1e-15);
  EXPECT_DOUBLE_EQ(fibonacci_axes(FibonacciSet::kSphere, 48).front().z(), 1 - 1.0 / 48);
  EXPECT_NEAR(fibonacci_axes(FibonacciSet::kSphere, 48).back().z(), -1 + 1.0 / 48, 1e-15);
}

TEST(FibonacciAxes, AzimuthTurnsByTheGoldenAngle) {
  const std::vector<Vec3d> axes = fibonacci_axes(FibonacciSet::kSphere, 10);
  const double turn = 4 * kPi / (1 + std::sqrt(5.0));
  EXPECT_NEAR(std::remainder(std::atan2(axes[0].y(), axes[0].x()) - turn, 2 * kPi), 0, 1e-14);
  EXPECT_NEAR(std::remainder(std::atan2(axes[6].y(), axes[6].x()) - 7 * turn, 2 * kPi), 0, 1e-13);
}

// The centred sets integrate z and z^2 over their domain to second order in 1 / count; the printed
// set is off by 1 / (2 count).
TEST(FibonacciAxesLaw, MomentsOfTheDomain) {
  auto mean = [](FibonacciSet set, int power) {
    double sum = 0;
    for (const Vec3d& axis : fibonacci_axes(set, 48)) sum += std::pow(axis.z(), power);
    return sum / 48;
  };
  EXPECT_NEAR(mean(FibonacciSet::kSphere, 1), 0, 1e-14);
  EXPECT_NEAR(mean(FibonacciSet::kSphere, 2), 1.0 / 3, 1.0 / (48 * 48));
  EXPECT_NEAR(mean(FibonacciSet::kHemisphere, 1), 0.5, 1e-14);
  EXPECT_NEAR(mean(FibonacciSet::kHemisphere, 2), 1.0 / 3, 1.0 / (48 * 48));
  EXPECT_NEAR(mean(FibonacciSet::kPrinted, 1), 0.5 + 1.0 / 96, 1e-14);
}

}  // namespace
}  // namespace heddle
