#include "render/pixel_filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/vector.h"

namespace heddle {

double filter_value(FilterShape shape, double x) {
  switch (shape) {
    case FilterShape::kBox:
      return 1;
    case FilterShape::kTriangle:
      return 1 - std::abs(x);
    case FilterShape::kGaussian:
      return std::exp(-2 * x * x);
    case FilterShape::kBlackmanHarris:
      return 0.35875 + 0.48829 * std::cos(kPi * x) + 0.14128 * std::cos(2 * kPi * x) +
             0.01168 * std::cos(3 * kPi * x);
  }
  return 0;
}

PixelFilter::PixelFilter(FilterShape shape, double width_px) : shape_(shape), width_(width_px) {
  if (shape != FilterShape::kGaussian && shape != FilterShape::kBlackmanHarris) return;
  within_.assign(kSteps + 1, 0.0);
  for (int k = 0; k < kSteps; ++k) {
    // Simpson's rule
    const double sum = filter_value(shape, static_cast<double>(k) / kSteps) +
                       4 * filter_value(shape, (k + 0.5) / kSteps) +
                       filter_value(shape, (k + 1.0) / kSteps);
    within_[static_cast<std::size_t>(k) + 1] = within_[static_cast<std::size_t>(k)] + sum;
  }
  for (double& share : within_) share /= within_.back();
}

double PixelFilter::place(double uniform) const {
  if (is_default()) return uniform;
  const double signed_share = 2 * uniform - 1;
  const double share = std::abs(signed_share);
  double distance = share;  // in half widths
  if (shape_ == FilterShape::kTriangle) {
    distance = 1 - std::sqrt(1 - share);
  } else if (!within_.empty()) {
    const auto above = std::upper_bound(within_.begin() + 1, within_.end() - 1, share);
    const double low = *(above - 1);
    distance = (static_cast<double>(above - 1 - within_.begin()) +
                (share - low) / std::max(*above - low, 1e-300)) /
               kSteps;
  }
  return 0.5 + 0.5 * width_ * std::copysign(distance, signed_share);
}

std::string PixelFilter::text() const {
  return fmt::format("{} {} px", kFilterNames[static_cast<std::size_t>(shape_)], width_);
}

}  // namespace heddle
