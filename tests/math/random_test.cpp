#include "fibers/math/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/statistics.h"

namespace heddle {
namespace {

TEST(Random, ADrawDependsOnItsAddressOnly) {
  RandomStream first(7, RandomStage::kTest, 3, 5);
  RandomStream second(7, RandomStage::kTest, 3, 5);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(first.bits(), second.bits());
}

TEST(Random, NeighbouringAddressesShareNoDraw) {
  std::set<std::uint64_t> seen;
  std::size_t draws = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    for (const RandomStage stage : {RandomStage::kTest, RandomStage::kTransfer}) {
      for (std::uint64_t item = 0; item < 20; ++item) {
        for (std::uint64_t sample = 0; sample < 20; ++sample) {
          RandomStream random(seed, stage, item, sample);
          for (int k = 0; k < 20; ++k, ++draws) seen.insert(random.bits());
        }
      }
    }
  }
  // 64,000 draws of 64 bits: a chance collision has probability 1e-10
  EXPECT_EQ(seen.size(), draws);
}

TEST(Random, UniformStaysBelowOne) {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 1000000; ++k) {
    const float u = random.uniform();
    ASSERT_TRUE(u >= 0.0F && u < 1.0F);
  }
}

// Pairs of draws fill the square evenly, along the dimension, the sample and the item alike.
TEST(RandomStatistical, PairsOfDrawsAreUniform) {
  constexpr int kCount = 400000;
  constexpr int kSide = 32;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> observed(kSide * kSide, 0.0);
    const std::vector<double> expected(kSide * kSide,
                                       static_cast<double>(kCount) / (kSide * kSide));
    for (int k = 0; k < kCount; ++k) {
      const auto i = static_cast<std::uint64_t>(k);
      RandomStream a(11, RandomStage::kTest, axis == 2 ? i : 0, axis == 1 ? i : 0);
      RandomStream b(11, RandomStage::kTest, axis == 2 ? i + 1 : 0, axis == 1 ? i + 1 : 0);
      if (axis == 0) b = a = RandomStream(11, RandomStage::kTest, i, 9);
      const double u = a.uniform();
      if (axis == 0) b = a;
      const double v = b.uniform_double();
      observed[static_cast<std::size_t>(static_cast<int>(u * kSide) * kSide +
                                        static_cast<int>(v * kSide))] += 1.0;
    }
    const ChiSquareResult result = chi_square(expected, observed);
    std::printf("  pairs along axis %d: chi-square %.1f, %d degrees, p = %.3g\n", axis,
                result.statistic, result.degrees, result.p_value);
    EXPECT_GT(result.p_value, sidak_significance(3));
  }
}

// Of 2^k points, each of the 2^k boxes of 2^-i x 2^-(k - i) holds one, in every pair of draws, for
// even and for odd samples.
TEST(RandomLaw, StratifiedDrawsFillEveryBoxOnce) {
  for (const std::uint64_t parity : {0U, 1U}) {
    for (int pair = 0; pair < 3; ++pair) {
      for (int k = 0; k <= 8; ++k) {
        for (int i = 0; i <= k; ++i) {
          std::set<std::pair<int, int>> boxes;
          for (std::uint64_t n = 0; n < (1U << k); ++n) {
            RandomStream random =
                RandomStream::stratified(5, RandomStage::kTest, 17, 2 * n + parity);
            for (int skipped = 0; skipped < 2 * pair; ++skipped) random.bits();
            const double u = random.uniform_double();
            const double v = random.uniform_double();
            boxes.emplace(static_cast<int>(u * (1 << i)), static_cast<int>(v * (1 << (k - i))));
          }
          ASSERT_EQ(boxes.size(), 1U << k) << "pair " << pair << ", " << i << " of " << k;
        }
      }
    }
  }
}

// Over many items, a sample's draws are uniform, and those of two samples (one even, one odd), of
// two pairs and of two items do not know of each other.
TEST(RandomStatistical, StratifiedDrawsOfDifferentSetsAreIndependent) {
  constexpr int kCount = 200000;
  constexpr int kSide = 16;
  for (int kind = 0; kind < 3; ++kind) {
    std::vector<double> observed(kSide * kSide, 0.0);
    for (std::uint64_t item = 0; item < kCount; ++item) {
      RandomStream a = RandomStream::stratified(3, RandomStage::kTest, item, 6);
      RandomStream b = RandomStream::stratified(3, RandomStage::kTest, item + (kind == 2 ? 1 : 0),
                                                kind == 0 ? 7 : 6);
      if (kind == 1) {
        b.bits();
        b.bits();
      }
      const auto u = static_cast<std::size_t>(a.uniform() * kSide);
      const auto v = static_cast<std::size_t>(b.uniform() * kSide);
      observed[u * kSide + v] += 1;
    }
    const ChiSquareResult result = chi_square(
        std::vector<double>(kSide * kSide, static_cast<double>(kCount) / (kSide * kSide)),
        observed);
    std::printf("  stratified, kind %d: p = %.3g\n", kind, result.p_value);
    EXPECT_GT(result.p_value, sidak_significance(3));
  }
}

TEST(RandomStatistical, IndexIsUniform) {
  RandomStream random(3, RandomStage::kTest, 1, 0);
  std::vector<double> observed(7, 0.0);
  for (int k = 0; k < 70000; ++k) observed[random.index(7)] += 1.0;
  EXPECT_GT(chi_square(std::vector<double>(7, 10000.0), observed).p_value, kSignificance);
}

}  // namespace
}  // namespace heddle
