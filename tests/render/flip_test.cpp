#include "render/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/random.h"

namespace heddle {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 32;
using Picture = std::vector<Rgb>;

Picture uniform_picture(const Rgb& color) {
  return Picture(kWidth * kHeight, color);
}

Picture noise_picture(std::uint64_t seed) {
  RandomStream random(seed, RandomStage::kTest, 0, 0);
  Picture picture(kWidth * kHeight);
  for (Rgb& pixel : picture) {
    for (int c = 0; c < 3; ++c) pixel[c] = random.uniform();
  }
  return picture;
}

double flip(const Picture& a, const Picture& b) {
  return flip_error(a, b, kWidth, kHeight);
}

TEST(FlipLaw, IdenticalPicturesDoNotDiffer) {
  EXPECT_EQ(flip(noise_picture(1), noise_picture(1)), 0);
  EXPECT_EQ(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(0, 0, 0))), 0);
}

TEST(FlipLaw, SymmetricAndWithinZeroAndOne) {
  const Picture a = noise_picture(1);
  const Picture b = noise_picture(2);
  const std::vector<float> forth = flip_map(a, b, kWidth, kHeight);
  const std::vector<float> back = flip_map(b, a, kWidth, kHeight);
  for (std::size_t k = 0; k < forth.size(); ++k) {
    ASSERT_EQ(forth[k], back[k]);
    ASSERT_GE(forth[k], 0.0F);
    ASSERT_LE(forth[k], 1.0F);
  }
  EXPECT_GT(flip(a, b), 0.05);
}

TEST(FlipLaw, MirroredAndTurnedPicturesDifferAsMuch) {
  const Picture a = noise_picture(1);
  const Picture b = noise_picture(2);
  const auto mirrored = [](Picture picture) {
    for (int y = 0; y < kHeight; ++y)
      std::reverse(picture.begin() + y * kWidth, picture.begin() + (y + 1) * kWidth);
    return picture;
  };
  const auto transposed = [](const Picture& picture) {
    Picture result;
    for (int x = 0; x < kWidth; ++x) {
      for (int y = 0; y < kHeight; ++y)
        result.push_back(picture[static_cast<std::size_t>(y) * kWidth + x]);
    }
    return result;
  };
  EXPECT_NEAR(flip(mirrored(a), mirrored(b)), flip(a, b), 1e-6);
  EXPECT_NEAR(flip_error(transposed(a), transposed(b), kHeight, kWidth), flip(a, b), 1e-6);
}

// Green against blue is by definition the largest difference of colours. Black against white is
// HyAB = 100 (L* alone); with green at (L*, a*, b*) = (87.735, -86.18, 83.18) and blue at
// (32.30, 79.19, -107.86), a* and b* times L* / 100, the largest HyAB is 55.43 + hypot(101.19,
// 107.82) = 203.3, and 0.95 + 0.05 (100^0.7 - 0.4 m) / (0.6 m), m = 203.3^0.7, is 0.9675.
TEST(FlipLaw, KnownExtremes) {
  EXPECT_NEAR(flip(uniform_picture(Rgb(0, 1, 0)), uniform_picture(Rgb(0, 0, 1))), 1, 1e-6);
  EXPECT_NEAR(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(1, 1, 1))), 0.9675, 5e-4);
}

TEST(FlipLaw, LightBeyondTheScreenIsClipped) {
  EXPECT_EQ(flip(uniform_picture(Rgb(1, 1, 1)), uniform_picture(Rgb(7, 7, 7))), 0);
  EXPECT_EQ(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(-1, -1, -1))), 0);
}

// Small uniform differences count in proportion to HyAB^0.7 = |dL*|^0.7: L* = 116 cbrt(Y) - 16.
TEST(FlipLaw, GreysFollowTheirLightness) {
  const auto lightness = [](double y) { return 116 * std::cbrt(y) - 16; };
  const double small =
      flip(uniform_picture(Rgb(0.2F, 0.2F, 0.2F)), uniform_picture(Rgb(0.21F, 0.21F, 0.21F)));
  const double large =
      flip(uniform_picture(Rgb(0.2F, 0.2F, 0.2F)), uniform_picture(Rgb(0.25F, 0.25F, 0.25F)));
  const double expected =
      std::pow((lightness(0.25) - lightness(0.2)) / (lightness(0.21) - lightness(0.2)), 0.7);
  EXPECT_NEAR(large / small, expected, 1e-3 * expected);
}

// One white pixel on black is a point where the other picture has none: worse than the same light
// spread out evenly, and worst next to itself.
TEST(FlipLaw, PointsCountWhereTheyAre) {
  const Picture black = uniform_picture(Rgb(0, 0, 0));
  Picture point = black;
  const std::size_t place = 16 * kWidth + 20;
  point[place] = Rgb(1, 1, 1);
  const std::vector<float> map = flip_map(black, point, kWidth, kHeight);
  EXPECT_EQ(std::max_element(map.begin(), map.end()) - map.begin(),
            static_cast<std::ptrdiff_t>(place));
  EXPECT_EQ(map[0], 0.0F);
  const float spread = 1.0F / (kWidth * kHeight);
  EXPECT_GT(map[place], flip(black, uniform_picture(Rgb(spread, spread, spread))));
}

}  // namespace
}  // namespace heddle
