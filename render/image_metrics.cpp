#include "render/image_metrics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace heddle {

namespace {

bool is_masked(std::span<const std::uint8_t> mask, std::size_t k) {
  return !mask.empty() && mask[k] == 0;
}

}  // namespace

PictureError compare_pictures(std::span<const Rgb> picture, const HalvedReference& reference,
                              std::span<const std::uint8_t> mask) {
  assert(picture.size() == reference.half0.size() && picture.size() == reference.half1.size());
  assert(mask.empty() || mask.size() == picture.size());
  PictureError error;
  for (std::size_t k = 0; k < picture.size(); ++k) {
    if (is_masked(mask, k)) continue;
    const Rgbd value = picture[k].cast<double>();
    const Rgbd half0 = reference.half0[k].cast<double>();
    const Rgbd half1 = reference.half1[k].cast<double>();
    ++error.pixels;
    error.mean_square += ((value - half0) * (value - half1)).mean();
    error.mean_picture += value;
    error.mean_reference += 0.5 * (half0 + half1);
  }
  if (error.pixels == 0) return error;
  const auto n = static_cast<double>(error.pixels);
  error.mean_square /= n;
  error.mean_picture /= n;
  error.mean_reference /= n;
  const double mean = error.mean_reference.mean();
  if (mean > 0) error.relative_rmse = std::sqrt(std::max(0.0, error.mean_square)) / mean;
  for (int c = 0; c < 3; ++c) {
    if (error.mean_reference[c] > 0)
      error.relative_difference[c] = error.mean_picture[c] / error.mean_reference[c] - 1;
  }
  return error;
}

namespace {

/// Sums over one block of pixels, or over many.
struct BlockSums {
  double square = 0;
  Rgbd picture = Rgbd::Zero();
  Rgbd reference = Rgbd::Zero();
  double pixels = 0;

  void add(const BlockSums& other, double sign) {
    square += sign * other.square;
    picture += sign * other.picture;
    reference += sign * other.reference;
    pixels += sign * other.pixels;
  }
  /// (relative RMSE)^2, negative where noise makes it so.
  double relative_mean_square() const {
    const double mean = reference.mean() / pixels;
    return mean > 0 ? square / pixels / (mean * mean) : 0;
  }
  Rgbd color_ratio() const {
    Rgbd ratio = Rgbd::Ones();
    for (int c = 0; c < 3; ++c) {
      if (reference[c] > 0) ratio[c] = picture[c] / reference[c];
    }
    return ratio;
  }
};

/// The value that 99 % do not exceed; reorders.
double percentile99_of(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto place =
      static_cast<std::ptrdiff_t>(std::ceil(0.99 * static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

}  // namespace

PictureErrorEstimate estimate_error(std::span<const Rgb> picture, const HalvedReference& reference,
                                    int width, int height, int edge) {
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  assert(picture.size() == count && reference.half0.size() == count &&
         reference.half1.size() == count && edge > 0);
  const int across = (width + edge - 1) / edge;
  const int down = (height + edge - 1) / edge;
  std::vector<BlockSums> blocks(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  std::vector<double> magnitudes;
  magnitudes.reserve(3 * count);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t k = static_cast<std::size_t>(y) * width + x;
      const Rgbd value = picture[k].cast<double>();
      const Rgbd half0 = reference.half0[k].cast<double>();
      const Rgbd half1 = reference.half1[k].cast<double>();
      blocks[static_cast<std::size_t>(y / edge) * across + x / edge].add(
          {((value - half0) * (value - half1)).mean(), value, 0.5 * (half0 + half1), 1}, 1);
      for (int c = 0; c < 3; ++c)
        magnitudes.push_back(std::abs(value[c] - 0.5 * (half0[c] + half1[c])));
    }
  }
  BlockSums all;
  for (const BlockSums& block : blocks) all.add(block, 1);

  // Each block left out once; the spread of what remains, times (g - 1)^2 / g, is the variance.
  const auto g = static_cast<double>(blocks.size());
  assert(blocks.size() >= 2);
  std::vector<double> squares;
  std::vector<Rgbd> ratios;
  for (const BlockSums& block : blocks) {
    BlockSums rest = all;
    rest.add(block, -1);
    squares.push_back(rest.relative_mean_square());
    ratios.push_back(rest.color_ratio());
  }
  double mean_square = 0;
  Rgbd mean_ratio = Rgbd::Zero();
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    mean_square += squares[k] / g;
    mean_ratio += ratios[k] / g;
  }
  double variance = 0;
  Rgbd ratio_variance = Rgbd::Zero();
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    variance += (g - 1) / g * (squares[k] - mean_square) * (squares[k] - mean_square);
    ratio_variance += (g - 1) / g * (ratios[k] - mean_ratio).square();
  }

  constexpr double kInterval = 1.96;
  const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
  const double square = all.relative_mean_square();
  PictureErrorEstimate estimate;
  estimate.relative_rmse = root(square);
  estimate.rmse_low = root(square - kInterval * std::sqrt(variance));
  estimate.rmse_high = root(square + kInterval * std::sqrt(variance));
  estimate.color_ratio = all.color_ratio();
  estimate.color_ratio_error = ratio_variance.sqrt();
  const double mean = all.reference.mean() / all.pixels;
  estimate.percentile99 = mean > 0 ? percentile99_of(magnitudes) / mean : 0;
  estimate.blocks = static_cast<int>(blocks.size());
  return estimate;
}

ReferenceNoise reference_noise(const HalvedReference& reference) {
  assert(reference.half0.size() == reference.half1.size());
  // The noise of (R0 + R1) / 2 is spread as (R0 - R1) / 2.
  std::vector<double> magnitudes;
  double sum = 0;
  double squares = 0;
  for (std::size_t k = 0; k < reference.half0.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      const auto half0 = static_cast<double>(reference.half0[k][c]);
      const auto half1 = static_cast<double>(reference.half1[k][c]);
      sum += 0.5 * (half0 + half1);
      squares += 0.25 * (half0 - half1) * (half0 - half1);
      magnitudes.push_back(0.5 * std::abs(half0 - half1));
    }
  }
  if (!(sum > 0)) return {};
  const auto n = static_cast<double>(magnitudes.size());
  const double mean = sum / n;
  return {std::sqrt(squares / n) / mean, percentile99_of(magnitudes) / mean};
}

double relative_noise(std::span<const Rgb> variance, std::span<const Rgb> reference,
                      std::span<const std::uint8_t> mask) {
  assert(variance.size() == reference.size());
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < variance.size(); ++k) {
    const double light = reference[k].cast<double>().mean();
    if (is_masked(mask, k) || !(light > 0)) continue;
    sum += variance[k].cast<double>().mean() / (light * light);
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
}

std::vector<std::uint8_t> difference_picture(std::span<const Rgb> picture,
                                             std::span<const Rgb> reference, double scale) {
  assert(picture.size() == reference.size() && scale > 0);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * picture.size());
  for (std::size_t k = 0; k < picture.size(); ++k) {
    const double difference = static_cast<double>((picture[k] - reference[k]).mean()) / scale;
    const double fade = 1.0 - std::min(1.0, std::abs(difference));
    const auto faded = static_cast<std::uint8_t>(std::lround(255.0 * fade));
    bytes.push_back(difference < 0 ? faded : 255);
    bytes.push_back(faded);
    bytes.push_back(difference > 0 ? faded : 255);
  }
  return bytes;
}

}  // namespace heddle
