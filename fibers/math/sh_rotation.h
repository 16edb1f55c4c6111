#ifndef HEDDLE_FIBERS_MATH_SH_ROTATION_H_
#define HEDDLE_FIBERS_MATH_SH_ROTATION_H_
// Rotation of spherical-harmonic coefficients: D(R) with Y(R w) = D(R) Y(w). Coefficients c of f
// become D(R) c, the coefficients of f(R^T w), which is f turned by R.
//
// D = Z(a) J Z(-b) J Z(g) with R = Rz(a) Ry(b) Rz(g). Z is a rotation about z (pairs +-m mix), J
// the constant matrix of the swap y <-> z. Symmetry leaves about a quarter of J's entries, and only
// those are visited. R must be a proper rotation, orthogonal to 1e-3 (asserted). Cost at order 5:
// 0.4 us for three colours. Tested in tests/math/sh_rotation_test.cpp.

#include <array>
#include <vector>

#include "fibers/math/spherical_harmonics.h"
#include "fibers/math/vector.h"

namespace heddle {

class ShRotation {
 public:
  ShRotation(int order, const Mat3d& rotation);

  int order() const { return order_; }

  /// out = D(R) in, both [sh_count(order)][channels]; T is float or double, channels 1 or 3. in and
  /// out may be the same.
  template <int kChannels = 1, typename T>
  void rotate(const T* in, T* out) const;

 private:
  struct Turn {                                    // multiples of one angle
    std::array<double, kMaxShOrder + 1> cosine{};  // [m]
    std::array<double, kMaxShOrder + 1> sine{};    // [m]
  };
  static Turn multiples(int order, double cosine, double sine);

  int order_;
  Turn first_;   // by g about z
  Turn second_;  // by -b about z
  Turn third_;   // by a about z
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SH_ROTATION_H_
