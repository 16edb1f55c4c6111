#ifndef HEDDLE_TESTS_SUPPORT_DIRECTIONS_H_
#define HEDDLE_TESTS_SUPPORT_DIRECTIONS_H_
// Random directions for tests.

#include <cmath>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle::test {

/// Uniform on the upper hemisphere.
inline Vec3d upper_direction(RandomStream& random) {
  return sample_hemisphere(Vec3(0, 0, 1), random).cast<double>().normalized();
}

/// Uniform where z >= min_z.
inline Vec3d direction_above(double min_z, RandomStream& random) {
  const double z = min_z + (1.0 - min_z) * random.uniform_double();
  const double phi = 2.0 * kPi * random.uniform_double();
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_DIRECTIONS_H_
