#ifndef HEDDLE_FIBERS_MATH_FIBONACCI_AXES_H_
#define HEDDLE_FIBERS_MATH_FIBONACCI_AXES_H_
// Spherical Fibonacci point sets: directions spread evenly over the upper hemisphere or the sphere,
// with +z as the pole.
//
// Azimuth 4 pi q / (1 + sqrt 5) for q = 1 .. count. Khungurn 2017, section 4.1, prints z = 1 - (q -
// 1) / count. That covers the upper hemisphere only and puts the first axis on the pole itself.
// Marques et al. 2013 give the full sphere. Tested in tests/math/fibonacci_axes_test.cpp.

#include <algorithm>
#include <cmath>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

enum class FibonacciSet {
  kPrinted,     // z = 1 - (q - 1) / count: upper hemisphere, pole included
  kHemisphere,  // z = 1 - (2q - 1) / (2 count): upper hemisphere, half a step off the pole
  kSphere,      // z = 1 - (2q - 1) / count
};

/// [count] unit vectors, z descending.
inline std::vector<Vec3d> fibonacci_axes(FibonacciSet set, int count) {
  std::vector<Vec3d> axes;
  for (int q = 1; q <= count; ++q) {
    double z = 1 - static_cast<double>(q - 1) / count;
    if (set == FibonacciSet::kHemisphere) z = 1 - (2.0 * q - 1) / (2.0 * count);
    if (set == FibonacciSet::kSphere) z = 1 - (2.0 * q - 1) / count;
    const double radius = std::sqrt(std::max(0.0, 1 - z * z));
    const double azimuth = 4 * kPi * q / (1 + std::sqrt(5.0));
    axes.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  }
  return axes;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_FIBONACCI_AXES_H_
