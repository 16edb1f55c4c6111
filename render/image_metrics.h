#ifndef HEDDLE_RENDER_IMAGE_METRICS_H_
#define HEDDLE_RENDER_IMAGE_METRICS_H_
// How far a picture is from a reference. Relative RMSE over n values = sqrt(mean d^2) / mean
// reference, with d^2 = (F - R0)(F - R1) for two independent halves of the reference. So the noise
// of the reference does not count. Errors relative to each value would explode on dark values.
// Values are colour channels of pixels. Tested in tests/render/image_metrics_test.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// A reference picture in two independent halves; the same picture twice where there is only one,
/// and then its noise counts as error.
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

/// What a chart says of a picture: the errors of compare_pictures with their intervals, and the
/// size of the worst. Intervals are 95 % (1.96 standard errors) from a delete-one jackknife over
/// blocks of pixels. A block holds what neighbours have in common: noise as wide as a kernel, a
/// fold that all get wrong. The jackknife takes the mean square, because its root is far from
/// normal for errors near the noise.
struct PictureErrorEstimate {
  double relative_rmse = 0;
  double rmse_low = 0;  // 0 where the error cannot be told from none
  double rmse_high = 0;
  // mean picture / mean reference; 1 for a channel without light
  Rgbd color_ratio = Rgbd::Ones();
  Rgbd color_ratio_error = Rgbd::Zero();  // one standard error
  // of |picture - mean of both halves| / mean reference; noise counts
  double percentile99 = 0;
  int blocks = 0;
};

/// Blocks are square, `edge` pixels wide (smaller at the rim), and at least two.
PictureErrorEstimate estimate_error(std::span<const Rgb> picture, const HalvedReference& reference,
                                    int width, int height, int edge);

/// The noise of a reference in two halves, relative to its mean. It is that of the mean of both
/// halves: root mean square, and the 99th percentile of its magnitude. A percentile of an error
/// that is no larger says nothing.
struct ReferenceNoise {
  double rms = 0;
  double percentile99 = 0;
};
ReferenceNoise reference_noise(const HalvedReference& reference);

/// Per-pixel relative RMSE of a picture whose only error is noise. It is the root of the mean, over
/// pixels in which the reference has light, of (channel mean of the variance of the pixel's mean) /
/// (channel mean of the reference)^2.
double relative_noise(std::span<const Rgb> variance, std::span<const Rgb> reference,
                      std::span<const std::uint8_t> mask);

/// Mean over the colour channels of (picture - reference) / `scale`: 0 is white, too bright red,
/// too dark blue, full colour at +-1. [pixel][3] bytes.
std::vector<std::uint8_t> difference_picture(std::span<const Rgb> picture,
                                             std::span<const Rgb> reference, double scale);

}  // namespace heddle

#endif  // HEDDLE_RENDER_IMAGE_METRICS_H_
