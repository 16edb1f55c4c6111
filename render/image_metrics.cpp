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

std::vector<std::uint8_t> difference_picture(std::span<const Rgb> picture, std::span<const Rgb> reference,
                                             double scale) {
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
