#include "pipeline/accuracy/probe.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace heddle {
namespace {

/// A mean over pixels of all blocks from sums over each: [block] sum and number of pixels.
Estimate mean_of(std::span<const double> sums, std::span<const double> pixels) {
  const double count = std::accumulate(pixels.begin(), pixels.end(), 0.0);
  const double mean = std::accumulate(sums.begin(), sums.end(), 0.0) / count;
  if (sums.size() < 2) return {mean, std::abs(mean)};
  double squares = 0;
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const double residual = sums[k] - mean * pixels[k];
    squares += residual * residual;
  }
  const auto g = static_cast<double>(sums.size());
  return {mean, std::sqrt(squares * g / (g - 1)) / count};
}

template <class Value>
Estimate mean_over_pixels(std::span<const FrameBuffers> blocks, Value&& value) {
  std::vector<double> sums;
  std::vector<double> pixels;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    double sum = 0;
    for (std::size_t k = 0; k < blocks[b].pixel_count(); ++k) sum += value(b, k);
    sums.push_back(sum);
    pixels.push_back(static_cast<double>(blocks[b].pixel_count()));
  }
  return mean_of(sums, pixels);
}

}  // namespace

std::vector<PixelRect> spread_blocks(const PixelRect& rectangle, int edge, int pixels) {
  const int across = (rectangle.width + edge - 1) / edge;
  const int down = (rectangle.height + edge - 1) / edge;
  std::vector<int> order(static_cast<std::size_t>(across * down));
  std::iota(order.begin(), order.end(), 0);
  // Additive recurrences with the plastic number spread points evenly over a square, and any share
  // of them too.
  constexpr double kStepX = 0.7548776662466927;
  constexpr double kStepY = 0.5698402909980532;
  const auto rank = [&](int k) {
    const double value = k % across * kStepX + k / across * kStepY;
    return value - std::floor(value);
  };
  const int wanted =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(pixels) / (edge * edge))));
  if (wanted < across * down) {
    std::sort(order.begin(), order.end(), [&](int a, int b) { return rank(a) < rank(b); });
    order.resize(static_cast<std::size_t>(wanted));
    std::sort(order.begin(), order.end());
  }
  std::vector<PixelRect> blocks;
  for (const int k : order) {
    const int left = k % across * edge;
    const int top = k / across * edge;
    blocks.push_back({rectangle.x0 + left, rectangle.y0 + top,
                      std::min(edge, rectangle.width - left),
                      std::min(edge, rectangle.height - top)});
  }
  return blocks;
}

double mean_radiance(std::span<const FrameBuffers> blocks) {
  return mean_over_pixels(blocks,
                          [&](std::size_t b, std::size_t k) {
                            return static_cast<double>(blocks[b].beauty[k].mean());
                          })
      .value;
}

Estimate sample_variance(std::span<const FrameBuffers> blocks) {
  return mean_over_pixels(blocks, [&](std::size_t b, std::size_t k) {
    return blocks[b].spp * static_cast<double>(blocks[b].variance[k].mean());
  });
}

Estimate sample_variance_of_all(const FrameBuffers& frame) {
  const auto variance = [&](std::size_t k) {
    return frame.spp * static_cast<double>(frame.variance[k].mean());
  };
  double sum = 0;
  double squares = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    sum += variance(k);
    if (k % 2 == 0) continue;
    const double difference = variance(k) - variance(k - 1);
    squares += difference * difference;
  }
  const auto count = static_cast<double>(frame.pixel_count());
  return {sum / count, std::sqrt(squares) / count};
}

Estimate squared_bias(std::span<const FrameBuffers> blocks,
                      std::span<const FrameBuffers> reference) {
  assert(blocks.size() == reference.size());
  return mean_over_pixels(blocks, [&](std::size_t b, std::size_t k) {
    const Rgbd d0 = (blocks[b].half0[k] - reference[b].half0[k]).cast<double>();
    const Rgbd d1 = (blocks[b].half1[k] - reference[b].half1[k]).cast<double>();
    return (d0 * d1).mean();
  });
}

}  // namespace heddle
