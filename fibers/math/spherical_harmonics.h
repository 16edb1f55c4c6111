#ifndef HEDDLE_FIBERS_MATH_SPHERICAL_HARMONICS_H_
#define HEDDLE_FIBERS_MATH_SPHERICAL_HARMONICS_H_
// Real orthonormal spherical harmonics Y_lm of a unit vector, polar axis z, index l (l + 1) + m,
// without the Condon-Shortley phase. Band 0 is sqrt(1 / 4 pi), band 1 is sqrt(3 / 4 pi) (y, z, x).
//
// m > 0 goes with cos(m phi), m < 0 with sin(|m| phi). Two recurrences compute them: that of the
// normalised associated Legendre functions in l, and that of sin^m(theta) cos(m phi) in x and y.
// Both give polynomials of x, y, z, so nothing is singular at the poles. Orders 0 to kMaxShOrder.
// Error about 1e-14 in double and 2e-6 in float at order 10. Tested in
// tests/math/spherical_harmonics_test.cpp.

#include "fibers/math/vector.h"

namespace heddle {

inline constexpr int kMaxShOrder = 10;

/// Number of coefficients up to and including band `order`.
constexpr int sh_count(int order) {
  return (order + 1) * (order + 1);
}

/// Y_j(direction) for all j < sh_count(order). out: [sh_count(order)].
void evaluate_sh(int order, const Vec3d& direction, double* out);
void evaluate_sh(int order, const Vec3& direction, float* out);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SPHERICAL_HARMONICS_H_
