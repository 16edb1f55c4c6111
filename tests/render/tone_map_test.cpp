#include "render/tone_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace heddle {
namespace {

TEST(ToneMap, KnownValuesOfTheStandard) {
  // 255 (1.055 * 0.2^(1 / 2.4) - 0.055) = 123.6; 0.003 lies on the straight part: 255 * 12.92 *
  // 0.003 = 9.9.
  const std::vector<std::uint8_t> bytes = tone_map({{0, 1, 0.2F}, {0.003F, 7, -1}}, {});
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{0, 255, 124, 10, 255, 0}));
}

TEST(ToneMap, ExposureCountsInStops) {
  EXPECT_EQ(tone_map({{0.1F, 0.1F, 0.1F}}, {.exposure_stops = 1}),
            tone_map({{0.2F, 0.2F, 0.2F}}, {}));
}

TEST(ToneMapLaw, FilmicKeepsMiddleGreyAndRollsOff) {
  EXPECT_NEAR(filmic(0.18), 0.18, 1e-6);
  EXPECT_NEAR(filmic(0), 0, 1e-12);
  EXPECT_EQ(filmic(-1), filmic(0));
  EXPECT_LT(filmic(1), 0.7);  // the clip of plain sRGB
  EXPECT_NEAR(filmic(3.8258), 1, 1e-4);
  EXPECT_EQ(filmic(100), 1);
  for (double x = 0; x < 3.8; x += 0.01) EXPECT_LT(filmic(x), filmic(x + 0.01)) << x;
  const ScreenLook look{.exposure_stops = 1.5, .transform = ScreenTransform::kFilmic};
  const auto grey = static_cast<float>(0.18 / std::exp2(1.5));
  EXPECT_EQ(tone_map({{grey, grey, grey}}, look), tone_map({{0.18F, 0.18F, 0.18F}}, {}));
  EXPECT_EQ(look.text().at("heddle.exposure_stops"), "1.5");
  EXPECT_EQ(look.text().at("heddle.transform"), "filmic");
}

}  // namespace
}  // namespace heddle
