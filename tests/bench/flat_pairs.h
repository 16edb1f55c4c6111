#ifndef HEDDLE_TESTS_BENCH_FLAT_PAIRS_H_
#define HEDDLE_TESTS_BENCH_FLAT_PAIRS_H_
// The 492 pairs of view and light under which flat swatches are compared: 41 views in the plane of
// weft and normal, 12 lights.

#include <array>
#include <cmath>
#include <cstddef>

#include "fibers/math/vector.h"

namespace heddle {

constexpr int kViews = 41;
constexpr int kLights = 12;
constexpr std::array<double, 4> kLightTheta = {10, 30, 50, 70};
constexpr std::array<double, 3> kLightAzimuth = {0, 60, 135};

inline double view_degrees(int view) {
  return -80.0 + 4.0 * view;
}
inline double light_theta(int light) {
  return kLightTheta[static_cast<std::size_t>(light) / kLightAzimuth.size()];
}
inline double light_azimuth(int light) {
  return kLightAzimuth[static_cast<std::size_t>(light) % kLightAzimuth.size()];
}

inline Vec3 direction_of(double theta_degrees, double azimuth_degrees) {
  const double theta = radians(theta_degrees);
  const double azimuth = radians(azimuth_degrees);
  return Vec3d(std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth),
               std::cos(theta))
      .cast<float>();
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_BENCH_FLAT_PAIRS_H_
