#ifndef HEDDLE_RENDER_IMAGE_METRICS_H_
#define HEDDLE_RENDER_IMAGE_METRICS_H_
// How far a picture is from a reference. Relative RMSE over n values = sqrt(mean d^2) / mean reference, with
// d^2 = (F - R0)(F - R1) for two independent halves of the reference, so that its noise does not count
// (design of the errors: per-value relative errors explode on dark values). Values are colour channels of
// pixels. Tested in tests/render/image_metrics_test.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// A reference picture in two independent halves; the same picture twice where there is only one, and then
/// its noise counts as error.
struct HalvedReference {
  std::span<const Rgb> half0;  // [pixel]
  std::span<const Rgb> half1;  // [pixel]
};

struct PictureError {
  std::size_t pixels = 0;    // compared
  double relative_rmse = 0;  // 0 where the estimated mean square is negative: less than the noise
  double mean_square = 0;    // mean of (F - R0)(F - R1)
  Rgbd mean_picture = Rgbd::Zero();
  Rgbd mean_reference = Rgbd::Zero();
  Rgbd relative_difference =
      Rgbd::Zero();  // mean_picture / mean_reference - 1, 0 for a channel without light
};

/// Compares the pixels where mask is not 0 (all where it is empty).
PictureError compare_pictures(std::span<const Rgb> picture, const HalvedReference& reference,
                              std::span<const std::uint8_t> mask);

/// Per-pixel relative RMSE of a picture whose only error is noise: root of the mean over pixels of (channel
/// mean of the variance of the pixel's mean) / (channel mean of the reference)^2, where the reference has
/// light.
double relative_noise(std::span<const Rgb> variance, std::span<const Rgb> reference,
                      std::span<const std::uint8_t> mask);

/// Mean over the colour channels of (picture - reference) / `scale`: 0 is white, too bright red, too dark
/// blue, full colour at +-1. [pixel][3] bytes.
std::vector<std::uint8_t> difference_picture(std::span<const Rgb> picture, std::span<const Rgb> reference,
                                             double scale);

}  // namespace heddle

#endif  // HEDDLE_RENDER_IMAGE_METRICS_H_
