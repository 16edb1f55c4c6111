#include "render/noise_target.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fibers/math/random.h"

namespace heddle {
namespace {

/// A picture of which every sample is `mean` (of a pixel) plus noise, uniform with the deviation
/// `deviation` (of a pixel), made as renderers make it.
template <class Mean, class Deviation>
FrameBuffers noisy_picture(int width, int height, int spp, const MoreSamples& more, Mean&& mean,
                           Deviation&& deviation) {
  FrameBuffers frame(width, height);
  frame.half0.resize(frame.pixel_count());
  frame.half1.resize(frame.pixel_count());
  std::vector<int> wanted(frame.pixel_count(), spp);
  do {
    for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
      const int x = static_cast<int>(k) % width;
      Rgbd half[2] = {Rgbd::Zero(), Rgbd::Zero()};
      for (int s = 0; s < wanted[k]; ++s) {
        RandomStream random(1, RandomStage::kTest, k, static_cast<std::uint64_t>(s));
        half[s % 2] += mean(x) + deviation(x) * std::sqrt(12.0) * (random.uniform_double() - 0.5);
      }
      frame.half0[k] = (half[0] / (wanted[k] / 2)).template cast<float>();
      frame.half1[k] = (half[1] / (wanted[k] / 2)).template cast<float>();
      frame.beauty[k] = 0.5F * (frame.half0[k] + frame.half1[k]);
    }
    set_samples(wanted, frame);
  } while (more && add_samples(more(frame), frame, wanted));
  return frame;
}

// Noise falls with the root of the samples, and is relative to the block's own mean.
TEST(NoiseTargetStatistical, NoiseOfABlockIsThatOfItsPixels) {
  for (const int spp : {4, 16, 64}) {
    const FrameBuffers frame = noisy_picture(
        48, 32, spp, {}, [](int x) { return x < 16 ? 4.0 : 1.0; },
        [](int x) { return x < 16 ? 4.0 : 0.5; });
    const std::vector<double> noise = noise_of_blocks(frame);
    ASSERT_EQ(noise.size(), 6U);
    // The RMS of 256 values has a relative deviation of 1 / sqrt(512).
    for (std::size_t block = 0; block < 6; ++block) {
      const double expected = (block % 3 == 0 ? 1.0 : 0.5) / std::sqrt(spp);
      EXPECT_NEAR(noise[block] / expected, 1, 4 / std::sqrt(512.0)) << block;
    }
  }
}

TEST(NoiseTargetStatistical, BlocksGoOnUntilTheyAreQuiet) {
  constexpr double kNoise = 0.05;
  const FrameBuffers frame = noisy_picture(
      40, 20, 4, until_noise(kNoise), [](int) { return 1.0; },
      [](int x) { return x < 16 ? 1.0 : 0.05; });
  for (const double noise : noise_of_blocks(frame)) EXPECT_LE(noise, kNoise);
  // 400 samples make 5 % of 100 %. Quiet blocks have the samples that they started with.
  const int noisy = frame.samples_of(0);
  EXPECT_NEAR(noisy / 400.0, 1, 0.25);
  EXPECT_EQ(noisy % 2, 0);
  EXPECT_EQ(frame.samples_of(39), 4);
  EXPECT_EQ(frame.spp, std::max(noisy, frame.samples_of(20 * 16 * 40 / 20)));
}

// A dark block is measured against a tenth of the picture's mean, and a black one is quiet.
TEST(NoiseTarget, DarknessHasNoNoise) {
  const FrameBuffers frame = noisy_picture(
      32, 16, 8, {}, [](int x) { return x < 16 ? 0.0 : 1.0; }, [](int) { return 0.0; });
  EXPECT_EQ(noise_of_blocks(frame), (std::vector<double>{0, 0}));
  const FrameBuffers black = noisy_picture(
      16, 16, 2, until_noise(0.01), [](int) { return 0.0; }, [](int) { return 0.0; });
  EXPECT_EQ(black.spp, 2);
}

}  // namespace
}  // namespace heddle
