#include "render/image_metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/random.h"

namespace heddle {
namespace {

TEST(ImageMetrics, KnownErrorOfAConstantOffset) {
  const std::vector<Rgb> reference(10, Rgb(0.5F, 1.0F, 1.5F));
  const std::vector<Rgb> picture(10, Rgb(0.6F, 1.1F, 1.6F));
  const PictureError error = compare_pictures(picture, {reference, reference}, {});
  EXPECT_EQ(error.pixels, 10U);
  EXPECT_NEAR(error.relative_rmse, 0.1, 1e-6);
  EXPECT_NEAR(error.relative_difference[0], 0.2, 1e-6);
  EXPECT_NEAR(error.relative_difference[2], 0.1 / 1.5, 1e-6);
}

TEST(ImageMetrics, MaskedPixelsDoNotCount) {
  const std::vector<Rgb> reference(3, Rgb(1, 1, 1));
  const std::vector<Rgb> picture = {Rgb(1, 1, 1), Rgb(9, 9, 9), Rgb(1, 1, 1)};
  const std::vector<std::uint8_t> mask = {1, 0, 1};
  const PictureError error = compare_pictures(picture, {reference, reference}, mask);
  EXPECT_EQ(error.pixels, 2U);
  EXPECT_EQ(error.relative_rmse, 0);
  EXPECT_EQ(compare_pictures(picture, {reference, reference}, std::vector<std::uint8_t>{0, 0, 0}).pixels, 0U);
}

// Two noisy halves (uniform noise of amplitude a, variance a^2 / 3) around 1 against a picture that is off by
// 0.05: the product of halves does not see the noise. Its standard error over n values is about (a^2 / 3) /
// sqrt(n).
TEST(ImageMetricsStatistical, NoiseOfTheReferenceDoesNotCount) {
  constexpr std::size_t kPixels = 20000;
  constexpr float kNoise = 0.3F;
  std::vector<Rgb> halves[2];
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (std::vector<Rgb>& half : halves) {
    for (std::size_t k = 0; k < kPixels; ++k) {
      Rgb value;
      for (int c = 0; c < 3; ++c) value[c] = 1 + kNoise * (2 * random.uniform() - 1);
      half.push_back(value);
    }
  }
  const std::vector<Rgb> picture(kPixels, Rgb(1.05F, 1.05F, 1.05F));
  const PictureError halved = compare_pictures(picture, {halves[0], halves[1]}, {});
  const double standard_error = 0.03 / std::sqrt(3.0 * kPixels) + 2 * 0.05 * 0.17 / std::sqrt(3.0 * kPixels);
  std::printf("  mean square %.6f +- %.6f against 0.0025\n", halved.mean_square, standard_error);
  EXPECT_NEAR(halved.mean_square, 0.0025, 4 * standard_error);
  const PictureError single = compare_pictures(picture, {halves[0], halves[0]}, {});
  EXPECT_NEAR(single.mean_square, 0.0025 + 0.03, 0.002);
}

TEST(ImageMetrics, RelativeNoise) {
  const std::vector<Rgb> reference = {Rgb(2, 2, 2), Rgb(1, 1, 1), Rgb(0, 0, 0)};
  const std::vector<Rgb> variance = {Rgb(0.04F, 0.04F, 0.04F), Rgb(0.01F, 0.01F, 0.01F), Rgb(1, 1, 1)};
  EXPECT_NEAR(relative_noise(variance, reference, {}), 0.1, 1e-6);
}

TEST(ImageMetrics, DifferencePictureColours) {
  const std::vector<Rgb> reference(3, Rgb(1, 1, 1));
  const std::vector<Rgb> picture = {Rgb(1, 1, 1), Rgb(1.5F, 1.5F, 1.5F), Rgb(0, 0, 0)};
  EXPECT_EQ(difference_picture(picture, reference, 0.5),
            (std::vector<std::uint8_t>{255, 255, 255, 255, 0, 0, 0, 0, 255}));
}

}  // namespace
}  // namespace heddle
