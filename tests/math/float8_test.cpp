#include "fibers/math/float8.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

/// Largest distance of function(x) from exact(x), over `count` points of [begin, end].
template <class Function, class Exact>
double largest_error(Function&& function, Exact&& exact, double begin, double end,
                     bool relative = false) {
  constexpr int kCount = 80000;
  double worst = 0;
  for (int first = 0; first < kCount; first += kFloat8Lanes) {
    Float8 x;
    for (int k = 0; k < kFloat8Lanes; ++k) {
      x[k] = static_cast<float>(begin + (end - begin) * (first + k) / (kCount - 1.0));
    }
    const Float8 y = function(x);
    for (int k = 0; k < kFloat8Lanes; ++k) {
      const double wanted = exact(static_cast<double>(x[k]));
      worst =
          std::max(worst, std::abs(static_cast<double>(y[k]) - wanted) / (relative ? wanted : 1));
    }
  }
  return worst;
}

TEST(Float8, FunctionsAgainstDoubles) {
  const auto exponential = [](double x) { return std::exp(x); };
  EXPECT_LT(largest_error(exp8, exponential, -86.9, 87.9, true), 3e-7);
  EXPECT_LT(largest_error(exp8, exponential, -1, 1, true), 3e-7);
  EXPECT_LT(largest_error(
                log2_8, [](double x) { return std::log2(x); }, 1e-3, 1e3),
            2e-6);
  EXPECT_LT(largest_error(
                sine8, [](double x) { return std::sin(x); }, -0.75 * kPi, 0.75 * kPi),
            6e-7);
  EXPECT_LT(largest_error(
                cosine8, [](double x) { return std::cos(x); }, -1.5 * kPi, 1.5 * kPi),
            2e-6);
  EXPECT_LT(largest_error(
                sqrt8, [](double x) { return std::sqrt(x); }, 0, 10),
            3e-7);
  for (const double scale : {1e-20, 1.0, 1e10}) {
    const auto y_of = [&](Float8 angle) {
      return atan2_8(static_cast<float>(scale) * sine8(0.5F * angle) * cosine8(0.5F * angle) * 2,
                     static_cast<float>(scale) * cosine8(angle));
    };
    EXPECT_LT(largest_error(
                  y_of, [](double x) { return x; }, -0.999 * kPi, 0.999 * kPi),
              2e-6)
        << scale;
  }
}

TEST(Float8, EndsOfTheRanges) {
  EXPECT_EQ(exp8(splat8(-100))[3], 0);
  EXPECT_EQ(exp8(splat8(-1e30F))[3], 0);
  EXPECT_EQ(exp8(splat8(0))[3], 1);
  EXPECT_EQ(atan2_8(Float8{}, Float8{})[0], 0);
  EXPECT_NEAR(static_cast<double>(atan2_8(Float8{}, splat8(-1))[0]), kPi, 1e-6);
  EXPECT_NEAR(static_cast<double>(atan2_8(splat8(-1), Float8{})[0]), -0.5 * kPi, 1e-6);
  EXPECT_NEAR(static_cast<double>(log2_8(splat8(8))[0]), 3, 2e-6);
}

TEST(Float8, LanesAndSums) {
  const Float8 x = {1, -2, 3, -4, 5, -6, 7, -8};
  float sums[4];
  sums8(x, 2 * x, abs8(x), splat8(0.5F), sums);
  EXPECT_EQ(sums[0], -4);
  EXPECT_EQ(sums[1], -8);
  EXPECT_EQ(sums[2], 36);
  EXPECT_EQ(sums[3], 4);
  EXPECT_EQ(max8(x, splat8(0))[3], 0);
  EXPECT_EQ(min8(x, splat8(0))[3], -4);
  EXPECT_EQ(sign8(x)[1], -1);
  EXPECT_TRUE(any8(x > 6));
  EXPECT_FALSE(any8(x > 7));
  float stored[kFloat8Lanes];
  store8(x, stored);
  EXPECT_EQ(load8(stored)[5], -6);
}

}  // namespace
}  // namespace heddle
