#include "fibers/math/taut_string.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "fibers/math/random.h"

namespace heddle {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

// What defines the string: it bends only where it touches, upwards over the floor and downwards
// under the ceiling.
void expect_taut(const std::vector<double>& floor, const std::vector<double>& ceiling) {
  const std::vector<double> heights = taut_string(floor, ceiling);
  const std::size_t n = floor.size();
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_GE(heights[i], floor[i] - 1e-12);
    ASSERT_LE(heights[i], ceiling[i] + 1e-12);
    const double bend = heights[(i + n - 1) % n] + heights[(i + 1) % n] - 2 * heights[i];
    if (bend < -1e-9) {
      ASSERT_NEAR(heights[i], floor[i], 1e-9) << i;
    } else if (bend > 1e-9) {
      ASSERT_NEAR(heights[i], ceiling[i], 1e-9) << i;
    }
  }
}

TEST(TautStringLaw, BendsOnlyWhereItTouches) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomStream random(seed, RandomStage::kTest, 0, 0);
    std::vector<double> floor(3 + seed % 60, -kNothing);
    std::vector<double> ceiling(floor.size(), kNothing);
    for (std::size_t i = 0; i < floor.size(); ++i) {
      const double middle = 2 * random.uniform_double();
      if (random.uniform_double() < 0.6) floor[i] = middle - random.uniform_double();
      if (random.uniform_double() < 0.6) ceiling[i] = middle + 0.3 * random.uniform_double();
    }
    expect_taut(floor, ceiling);
  }
}

TEST(TautString, LiesFlatWhereItCan) {
  EXPECT_EQ(taut_string(std::vector<double>{-kNothing, 1, 0}, std::vector<double>(3, kNothing)),
            std::vector<double>(3, 1));
  EXPECT_EQ(taut_string(std::vector<double>(3, -kNothing), std::vector<double>{2, -1, 3}),
            std::vector<double>(3, -1));
}

}  // namespace
}  // namespace heddle
