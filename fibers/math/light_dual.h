#ifndef HEDDLE_FIBERS_MATH_LIGHT_DUAL_H_
#define HEDDLE_FIBERS_MATH_LIGHT_DUAL_H_
// A response T(w) to light, from its moments against spherical harmonics: T(w) = sum_j m_j d_j(w).
// The weights d(w) are those by which a light from w enters a stored transfer.
//
// Light from the face. m_j = integral over z > 0 of T Y_j is known. Summing m_j Y_j, as on the
// whole sphere, takes T for 0 below the horizon, and the step rings. On the hemisphere alone the
// harmonics are not orthogonal. With G_jk = integral over z > 0 of Y_j Y_k, the best approximation
// in the mean square is sum_j (G^+ m)_j Y_j. So d(w) = G^+ Y(w). G is close to singular, because
// harmonics of order 5 hold functions that live almost wholly below the horizon. Eigenvalues below
// kLeastShare are left out of the inverse. They would amplify the noise of the moments. 26 of 36
// directions are left at order 5; an odd continuation below the horizon uses 15.
//
// Light from both sides. m_j is the integral over the whole sphere. The plain sum m_j Y_j sees
// light in the cloth's plane from both sides of it, where T falls to 0. So T is estimated by what
// is known of it beforehand: on each side on its own, it is sqrt|z| times a smooth function. With
// the covariance K of such functions, T(w) = m^T G^-1 k(w), k_j(w) = integral of K(w, .) Y_j, and
// G_jk = integral of k_j Y_k (kriging). K(w, w') is, on one side, sqrt(z z') times the sum over l
// of (l + 1)^-6 Y_lm(w) Y_lm(w'), else 0. Tested in tests/math/light_dual_test.cpp.

#include <array>
#include <vector>

#include "fibers/math/spherical_harmonics.h"

namespace heddle {

class LightDual {
 public:
  /// Share of a function's square that must lie above the horizon. At order 5 any value between
  /// 0.011 and 0.09, the eigenvalues nearby, makes the same choice. The figures that chose 0.05:
  /// docs/decisions.md.
  static constexpr double kLeastShare = 0.05;

  /// One object per order and kind, kept. order <= kMaxShOrder.
  static const LightDual& of(int order, bool both_sides);

  /// G^+ times `values` ([sh_count(order)]), in place. Those are the moments of a light: integrals
  /// of Y(w) over its part above the horizon, or from both sides of k(w).
  void apply(float* values) const;

 private:
  LightDual(int order, bool both_sides);
  int order_;
  // [|m|] (order + 1 - |m|)^2, row-major over l = |m| .. order: G couples equal m only, and equally
  // for both signs.
  std::array<std::vector<float>, kMaxShOrder + 1> blocks_;
};

/// k of a light from both sides: [sh_count(order)]. `above` and `below` are the integrals of the
/// light times sqrt|z| Y_j over each side: [sh_count(kMaxShOrder)].
void two_sided_moments(int order, const float* above, const float* below, float* moments);
/// Moments of light from one direction (unit): [sh_count(order)]; 0 for light from below that comes
/// from the face only.
void direction_moments(int order, bool both_sides, const Vec3& direction, float* moments);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_LIGHT_DUAL_H_
