#include "fibers/cloth/flyaways.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/vector.h"
#include "formats/input_error.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

TEST(FlyawaysStatistical, NormalDrawsHaveTheirMeanAndDeviation) {
  const MeanAndDeviation asked{-1.5, 0.3};
  RunningMean values;
  RunningMean squares;
  RandomStream random(3, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 20000; ++k) {
    const double value = asked.draw(random);
    values.add(value);
    squares.add(std::pow(value - asked.mean, 2));
  }
  EXPECT_TRUE(means_agree("mean", values.mean(), values.standard_error(), asked.mean, 0, 2));
  EXPECT_TRUE(means_agree("variance", squares.mean(), squares.standard_error(), 0.09, 0, 2));
}

TEST(FlyawaysStatistical, CountsKeepTheirMean) {
  for (const double expected : {0.1, 0.5, 3.2}) {
    RunningMean counts;
    for (std::uint64_t k = 0; k < 10000; ++k) {
      RandomStream random(4, RandomStage::kTest, 0, k);
      const int count = draw_count(expected, random);
      EXPECT_LE(std::abs(count - expected), 1);
      counts.add(count);
    }
    EXPECT_TRUE(means_agree("count", counts.mean(), counts.standard_error(), expected, 0, 3));
  }
}

TEST(FlyawaysLaw, HairsRiseAndAreNoLongerThanThePeriod) {
  const Hairs hairs{1, {0.1, 0.1}, {0.01, 0.1}, {0, 5}, {0, 3}};
  for (std::uint64_t k = 0; k < 1000; ++k) {
    RandomStream random(5, RandomStage::kTest, 0, k);
    const HairArc arc = draw_hair(hairs, 2, random);
    EXPECT_GT(arc.rise_mm, 0);
    EXPECT_GE(arc.start_mm - arc.buried * arc.rise_mm, -1e-12);
    EXPECT_LE(std::abs(arc.along) * (1 + arc.buried), 1 + 1e-12);
  }
}

TEST(FlyawaysLaw, ThicknessIsPeriodicAndAsAsked) {
  RandomStream random(6, RandomStage::kTest, 0, 0);
  const ThicknessProfile profile({{0.5, {1, 0}, {1.8, 0}}}, 4, random);
  ASSERT_EQ(profile.places().size(), 2U);
  const ThicknessProfile::Place& place = profile.places()[0];
  EXPECT_DOUBLE_EQ(place.half_share, 0.125);
  EXPECT_NEAR(profile.at(-0.3), profile.at(0.7), 1e-12);
  RandomStream other(6, RandomStage::kTest, 0, 1);
  const ThicknessProfile one({{0.25, {1, 0}, {1.8, 0}}}, 4, other);
  const double centre = one.places()[0].centre_share;
  EXPECT_DOUBLE_EQ(one.at(centre), 1.8);
  EXPECT_NEAR(one.at(centre + 0.0625), 1.4, 1e-12);  // half way to its end
  EXPECT_DOUBLE_EQ(one.at(centre + 0.126), 1);
}

TEST(Flyaways, DeviationsBelowZeroAreRefused) {
  const auto document = TomlTable::parse("per_m = 1\nheight_mm = [0.1, -0.1]\n", "yarn.toml");
  EXPECT_THROW(read_loops(document), ConfigError);
}

}  // namespace
}  // namespace heddle
