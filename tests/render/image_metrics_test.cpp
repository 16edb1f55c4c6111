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
  EXPECT_EQ(
      compare_pictures(picture, {reference, reference}, std::vector<std::uint8_t>{0, 0, 0}).pixels,
      0U);
}

// Two noisy halves (uniform noise of amplitude a, variance a^2 / 3) around 1 against a picture that
// is off by 0.05: the product of halves does not see the noise. Its standard error over n values is
// about (a^2 / 3) / sqrt(n).
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
  const double standard_error =
      0.03 / std::sqrt(3.0 * kPixels) + 2 * 0.05 * 0.17 / std::sqrt(3.0 * kPixels);
  std::printf("  mean square %.6f +- %.6f against 0.0025\n", halved.mean_square, standard_error);
  EXPECT_NEAR(halved.mean_square, 0.0025, 4 * standard_error);
  const PictureError single = compare_pictures(picture, {halves[0], halves[0]}, {});
  EXPECT_NEAR(single.mean_square, 0.0025 + 0.03, 0.002);
}

TEST(ImageMetrics, RelativeNoise) {
  const std::vector<Rgb> reference = {Rgb(2, 2, 2), Rgb(1, 1, 1), Rgb(0, 0, 0)};
  const std::vector<Rgb> variance = {Rgb(0.04F, 0.04F, 0.04F), Rgb(0.01F, 0.01F, 0.01F),
                                     Rgb(1, 1, 1)};
  EXPECT_NEAR(relative_noise(variance, reference, {}), 0.1, 1e-6);
}

TEST(ImageMetrics, DifferencePictureColours) {
  const std::vector<Rgb> reference(3, Rgb(1, 1, 1));
  const std::vector<Rgb> picture = {Rgb(1, 1, 1), Rgb(1.5F, 1.5F, 1.5F), Rgb(0, 0, 0)};
  EXPECT_EQ(difference_picture(picture, reference, 0.5),
            (std::vector<std::uint8_t>{255, 255, 255, 255, 0, 0, 0, 0, 255}));
}

// A picture that is off by a factor has no spread: block after block says the same.
TEST(ImageMetrics, EstimateOfAUniformFactor) {
  const std::vector<Rgb> reference(24 * 16, Rgb(0.5F, 1.0F, 1.5F));
  const std::vector<Rgb> picture(24 * 16, Rgb(0.55F, 1.1F, 1.65F));
  const PictureErrorEstimate estimate = estimate_error(picture, {reference, reference}, 24, 16, 8);
  EXPECT_EQ(estimate.blocks, 6);
  EXPECT_NEAR(estimate.color_ratio[1], 1.1, 1e-6);
  EXPECT_NEAR(estimate.color_ratio_error.maxCoeff(), 0, 1e-9);
  EXPECT_NEAR(estimate.relative_rmse, 0.1 * std::sqrt((0.25 + 1 + 2.25) / 3), 1e-6);
  EXPECT_NEAR(estimate.rmse_high, estimate.rmse_low, 1e-6);
  EXPECT_NEAR(estimate.percentile99, 0.15, 1e-6);
}

// The interval of many noisy pictures of known error holds that error in 95 % of them, within 4
// standard errors of that count (sqrt(400 * 0.95 * 0.05) = 4.4), and the same for the mean colour
// at 1.96 standard errors.
TEST(ImageMetricsStatistical, IntervalsHoldTheTruth) {
  constexpr int kPictures = 400;
  constexpr int kEdge = 32;
  constexpr double kNoise = 0.2;  // standard deviation per value of the picture and of each half
  int rmse_held = 0;
  int color_held = 0;
  for (int n = 0; n < kPictures; ++n) {
    RandomStream random(7, RandomStage::kTest, static_cast<std::uint64_t>(n), 0);
    std::vector<Rgb> pictures[3];
    for (std::vector<Rgb>& picture : pictures) {
      for (int k = 0; k < kEdge * kEdge; ++k) {
        Rgb value;
        for (int c = 0; c < 3; ++c) {
          value[c] = static_cast<float>(1 + kNoise * std::sqrt(12.0) *
                                                (static_cast<double>(random.uniform()) - 0.5));
        }
        picture.push_back(value);
      }
    }
    const PictureErrorEstimate estimate =
        estimate_error(pictures[0], {pictures[1], pictures[2]}, kEdge, kEdge, 4);
    rmse_held += estimate.rmse_low <= kNoise && kNoise <= estimate.rmse_high ? 1 : 0;
    color_held +=
        std::abs(estimate.color_ratio[0] - 1) <= 1.96 * estimate.color_ratio_error[0] ? 1 : 0;
  }
  std::printf("  held by the interval: RMSE %d, colour %d of %d\n", rmse_held, color_held,
              kPictures);
  EXPECT_NEAR(rmse_held, 0.95 * kPictures, 4 * 4.4);
  EXPECT_NEAR(color_held, 0.95 * kPictures, 4 * 4.4);
}

TEST(ImageMetrics, NoiseOfAReference) {
  const std::vector<Rgb> half0(100, Rgb(1.1F, 1.1F, 1.1F));
  const std::vector<Rgb> half1(100, Rgb(0.9F, 0.9F, 0.9F));
  EXPECT_NEAR(reference_noise({half0, half1}).rms, 0.1, 1e-6);
  EXPECT_NEAR(reference_noise({half0, half1}).percentile99, 0.1, 1e-6);
  EXPECT_EQ(reference_noise({half0, half0}).rms, 0);
}

}  // namespace
}  // namespace heddle
