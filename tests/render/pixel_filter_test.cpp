#include "render/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>

namespace heddle {
namespace {

constexpr FilterShape kShapes[] = {FilterShape::kBox, FilterShape::kTriangle,
                                   FilterShape::kGaussian, FilterShape::kBlackmanHarris};

TEST(PixelFilter, TheDefaultLeavesDrawsAsTheyAre) {
  const PixelFilter filter;
  EXPECT_TRUE(filter.is_default());
  EXPECT_EQ(filter.text(), "box 1 px");
  for (const double u : {0.0, 0.1, 0.7, 1 - 0x1p-53}) EXPECT_EQ(filter.place(u), u);
  EXPECT_FALSE(PixelFilter(FilterShape::kBox, 2).is_default());
  EXPECT_EQ(PixelFilter(FilterShape::kBox, 2).place(0), -0.5);
}

TEST(PixelFilterLaw, PlacesHaveTheFiltersDensity) {
  for (const FilterShape shape : kShapes) {
    const double width = kFilterWidths[static_cast<std::size_t>(shape)] + 0.5;
    const PixelFilter filter(shape, width);
    SCOPED_TRACE(filter.text());
    EXPECT_NEAR(filter.place(0.5), 0.5, 1e-12);
    // Evenly spaced draws: the share of them up to a place is the filter's integral up to there.
    constexpr int kDraws = 20000;
    double before = -1e9;
    double integral = 0;  // by the trapezium rule
    double total = 0;
    const double end = 0.5 * width;
    const auto density = [&](double x) { return filter_value(shape, x / end); };
    for (int k = 0; k < kDraws; ++k) total += density(-end + (k + 0.5) * width / kDraws);
    double next = -end;
    for (int k = 0; k < kDraws; ++k) {
      const double x = filter.place((k + 0.5) / kDraws) - 0.5;
      EXPECT_GT(x, before);
      EXPECT_LE(std::abs(x), end);
      before = x;
      for (; next + 0.5 * width / kDraws < x; next += width / kDraws)
        integral += density(next + 0.5 * width / kDraws) / total;
      // One step of the sum, and the table's: its density is constant over 1 / 1024.
      ASSERT_NEAR(integral, (k + 0.5) / kDraws, 2e-4);
    }
  }
}

TEST(PixelFilterLaw, KnownVariances) {
  // Of a box w^2 / 12, of a triangle w^2 / 24.
  const auto variance = [](FilterShape shape, double width) {
    const PixelFilter filter(shape, width);
    double sum = 0;
    constexpr int kDraws = 100000;
    for (int k = 0; k < kDraws; ++k)
      sum += std::pow(filter.place((k + 0.5) / kDraws) - 0.5, 2) / kDraws;
    return sum;
  };
  EXPECT_NEAR(variance(FilterShape::kBox, 3), 9.0 / 12, 1e-6);
  EXPECT_NEAR(variance(FilterShape::kTriangle, 2), 4.0 / 24, 1e-6);
  // A Gaussian of deviation w / 4, cut at two deviations: 0.7737 of its variance is left.
  EXPECT_NEAR(variance(FilterShape::kGaussian, 2), 0.25 * 0.77374, 1e-4);
}

}  // namespace
}  // namespace heddle
