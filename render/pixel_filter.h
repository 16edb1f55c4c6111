#ifndef HEDDLE_RENDER_PIXEL_FILTER_H_
#define HEDDLE_RENDER_PIXEL_FILTER_H_
// What a pixel takes of the picture around it. Eye rays are drawn with the filter's own density, so
// that a pixel is the plain mean of its samples (Ernst, Stamminger, Greiner 2006, "Filter
// importance sampling"). Pixels then stay independent of each other, of the crop and of their
// neighbours' number of samples, and shares of samples are filtered coverage. Filters with negative
// parts (Mitchell, Lanczos) have no such form. Tested in tests/render/pixel_filter_test.cpp.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace heddle {

/// All separable, symmetric, and 0 beyond half their width from the pixel's middle. x = distance
/// from it, w = width.
enum class FilterShape : std::uint8_t {
  kBox,             // 1
  kTriangle,        // 1 - 2 |x| / w
  kGaussian,        // exp(-2 (2 x / w)^2)
  kBlackmanHarris,  // the window of four terms of Harris 1978
};
inline constexpr std::string_view kFilterNames[] = {"box", "triangle", "gaussian",
                                                    "blackman-harris"};
/// Pixels; what renderers take where nobody says.
inline constexpr double kFilterWidths[] = {1, 2, 2, 3};

class PixelFilter {
 public:
  /// A box of one pixel.
  PixelFilter() = default;
  PixelFilter(FilterShape shape, double width_px);

  /// Where a uniform draw falls along one axis, in pixels from the pixel's edge: 0.5 is its middle.
  double place(double uniform) const;
  bool is_default() const { return shape_ == FilterShape::kBox && width_ == 1; }
  /// "gaussian 2 px".
  std::string text() const;

 private:
  static constexpr int kSteps = 1024;  // of the table

  FilterShape shape_ = FilterShape::kBox;
  double width_ = 1;
  // [kSteps + 1] share of the upper half of the filter within k / kSteps of its half width; empty
  // where there is a closed form
  std::vector<double> within_;
};

/// The filter at x in units of its half width, [-1, 1], up to a factor.
double filter_value(FilterShape shape, double x);

}  // namespace heddle

#endif  // HEDDLE_RENDER_PIXEL_FILTER_H_
