#include "render/tone_map.h"

#include <gtest/gtest.h>

namespace heddle {
namespace {

TEST(ToneMap, KnownValuesOfTheStandard) {
  // 255 (1.055 * 0.2^(1 / 2.4) - 0.055) = 123.6; 0.003 lies on the straight part: 255 * 12.92 *
  // 0.003 = 9.9.
  const std::vector<std::uint8_t> bytes = tone_map({{0, 1, 0.2F}, {0.003F, 7, -1}}, 0);
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{0, 255, 124, 10, 255, 0}));
}

TEST(ToneMap, ExposureCountsInStops) {
  EXPECT_EQ(tone_map({{0.1F, 0.1F, 0.1F}}, 1), tone_map({{0.2F, 0.2F, 0.2F}}, 0));
}

}  // namespace
}  // namespace heddle
