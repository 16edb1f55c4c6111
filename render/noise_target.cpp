#include "render/noise_target.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace heddle {
namespace {

// The darkest radiance that noise is measured against, relative to the picture's mean.
constexpr double kDarkest = 0.1;
// A block at most doubles its samples at a time, since its noise is known from few.
constexpr double kLargestStep = 2;
constexpr int kSmallestStep = 8;

/// Calls visit(block, pixel) for all pixels of a frame.
template <class Visit>
void for_each_pixel(const FrameBuffers& frame, Visit&& visit) {
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      visit(block_of_pixel(x, y, frame.width),
            static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                static_cast<std::size_t>(x));
    }
  }
}

}  // namespace

std::vector<double> noise_of_blocks(const FrameBuffers& frame) {
  assert(!frame.half0.empty());
  const std::size_t blocks = block_of_pixel(frame.width - 1, frame.height - 1, frame.width) + 1;
  std::vector<double> squares(blocks, 0);
  std::vector<double> radiance(blocks, 0);
  std::vector<double> pixels(blocks, 0);
  double mean = 0;
  for_each_pixel(frame, [&](std::size_t block, std::size_t k) {
    // The mean of two independent halves has a quarter of the variance of their difference.
    const Rgbd half = 0.5 * (frame.half0[k] - frame.half1[k]).cast<double>();
    squares[block] += half.square().mean();
    radiance[block] += static_cast<double>(frame.beauty[k].mean());
    pixels[block] += 1;
    mean += static_cast<double>(frame.beauty[k].mean()) / static_cast<double>(frame.pixel_count());
  });
  std::vector<double> noise(blocks, 0);
  for (std::size_t block = 0; block < blocks; ++block) {
    const double scale = std::max(radiance[block] / pixels[block], kDarkest * mean);
    if (scale > 0) noise[block] = std::sqrt(squares[block] / pixels[block]) / scale;
  }
  return noise;
}

MoreSamples until_noise(double relative) {
  return [relative](const FrameBuffers& frame) {
    const std::vector<double> noise = noise_of_blocks(frame);
    std::vector<int> more(noise.size(), 0);
    for_each_pixel(frame, [&](std::size_t block, std::size_t k) {
      const int done = frame.samples_of(k);
      if (noise[block] <= relative || done >= kMostSamplesForNoise) return;
      const double factor = std::min(kLargestStep, std::pow(noise[block] / relative, 2));
      const double wanted = std::max(done * factor, static_cast<double>(done + kSmallestStep));
      more[block] =
          std::min(2 * static_cast<int>(std::ceil(wanted / 2)), kMostSamplesForNoise) - done;
    });
    return more;
  };
}

}  // namespace heddle
