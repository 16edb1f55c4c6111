#include "tests/support/statistics.h"

#include <gtest/gtest.h>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

TEST(Statistics, TailOfTheChiSquareDistribution) {
  // Two degrees: exp(-x / 2). Published 5 % points of the distribution: 3.841 (1), 18.307 (10),
  // 124.342 (100).
  EXPECT_NEAR(chi_square_tail(3.0, 2), std::exp(-1.5), 1e-14);
  EXPECT_NEAR(chi_square_tail(3.841, 1), 0.05, 1e-4);
  EXPECT_NEAR(chi_square_tail(18.307, 10), 0.05, 1e-5);
  EXPECT_NEAR(chi_square_tail(124.342, 100), 0.05, 1e-5);
}

TEST(Statistics, SidakCorrectionKeepsTheFamily) {
  EXPECT_NEAR(sidak_significance(1), kSignificance, 1e-15);
  EXPECT_NEAR(1.0 - std::pow(1.0 - sidak_significance(30), 30), kSignificance, 1e-12);
}

// A density 2 % too high on one half of the sphere and 2 % too low on the other must be rejected,
// and the true one accepted, by the same call.
TEST(StatisticsStatistical, ChiSquareRejectsADensityWrongByTwoPercent) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  const auto sample = [&] { return Vec3d(sample_sphere(random).cast<double>()); };
  constexpr int kSamples = 1000000;
  EXPECT_TRUE(chi_square_accepts(
      "right", sample, [](const Vec3d&) { return 0.25 / kPi; }, kSamples, 10));
  EXPECT_FALSE(chi_square_accepts(
      "2 % off by halves", sample,
      [](const Vec3d& w) { return (w.z() > 0.0 ? 1.02 : 0.98) * 0.25 / kPi; }, kSamples, 10));
}

// A density that is 2 % too low everywhere does not integrate to 1: the samples land where none is
// expected.
TEST(StatisticsStatistical, ChiSquareRejectsADensityThatIntegratesToLess) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  const auto sample = [&] { return Vec3d(sample_sphere(random).cast<double>()); };
  EXPECT_FALSE(chi_square_accepts(
      "2 % low", sample, [](const Vec3d&) { return 0.98 * 0.25 / kPi; }, 200000, 10));
  EXPECT_FALSE(chi_square_accepts(
      "2 % high", sample, [](const Vec3d&) { return 1.02 * 0.25 / kPi; }, 200000, 10));
}

TEST(StatisticsStatistical, MeansAgreeRejectsAMeanWrongByTwoPercent) {
  RandomStream random(3, RandomStage::kTest, 0, 0);
  RunningMean a;
  RunningMean b;
  for (int k = 0; k < 100000; ++k) {
    a.add(random.uniform_double());
    b.add(random.uniform_double());
  }
  EXPECT_NEAR(a.standard_error(), std::sqrt(1.0 / 12.0 / 100000.0), 1e-5);
  EXPECT_TRUE(means_agree("right", a.mean(), a.standard_error(), b.mean(), b.standard_error(), 10));
  EXPECT_TRUE(means_agree("exact", a.mean(), a.standard_error(), 0.5, 0.0, 10));
  EXPECT_FALSE(means_agree("2 % off", 1.02 * a.mean(), 1.02 * a.standard_error(), b.mean(),
                           b.standard_error(), 10));
}

}  // namespace
}  // namespace heddle
