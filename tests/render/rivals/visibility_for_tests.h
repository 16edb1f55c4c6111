#ifndef HEDDLE_TESTS_RENDER_RIVALS_VISIBILITY_FOR_TESTS_H_
#define HEDDLE_TESTS_RENDER_RIVALS_VISIBILITY_FOR_TESTS_H_
// Signed distances that a test states as functions of direction, one segment each.

#include <cmath>
#include <functional>
#include <vector>

#include "fibers/baked/segment_visibility.h"

namespace heddle {

inline SsdfVisibility uniform_visibility(
    const std::vector<std::function<double(const Vec3d&)>>& distances) {
  SsdfVisibility ssdf;
  const int n = ssdf.resolution;
  ssdf.components = static_cast<int>(distances.size());
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const double polar = kPi * (row + 0.5) / n;
      const double azimuth = 2 * kPi * (column + 0.5) / n;
      const Vec3d w(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                    std::cos(polar));
      ssdf.mean.push_back(0);
      for (const auto& distance : distances) ssdf.basis.push_back(static_cast<float>(distance(w)));
    }
  }
  for (std::size_t s = 0; s < distances.size(); ++s) {
    for (std::size_t k = 0; k < distances.size(); ++k)
      ssdf.coefficients.push_back(half_from_float(s == k ? 1.0F : 0.0F));
  }
  ssdf.sees_nothing.assign(distances.size(), 0);
  return ssdf;
}

inline double all_open(const Vec3d&) {
  return kPi;
}
inline double upper_half_space(const Vec3d& w) {
  return kPi / 2 - std::acos(std::clamp(w.z(), -1.0, 1.0));
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_RENDER_RIVALS_VISIBILITY_FOR_TESTS_H_
