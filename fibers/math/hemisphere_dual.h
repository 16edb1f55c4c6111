#ifndef HEDDLE_FIBERS_MATH_HEMISPHERE_DUAL_H_
#define HEDDLE_FIBERS_MATH_HEMISPHERE_DUAL_H_
// A function T on the upper hemisphere from its moments against spherical harmonics.
//
// The moments m_j = integral over z > 0 of T Y_j are known. Summing m_j Y_j, as on the whole
// sphere, takes T for 0 below the horizon, and the step rings. On the hemisphere alone the
// harmonics are not orthogonal. With G_jk = integral over z > 0 of Y_j Y_k, the best approximation
// in the mean square is sum_j (G^+ m)_j Y_j. So the weights of the moments are d(w) = G^+ Y(w).
//
// G is close to singular, because harmonics of order 5 hold functions that live almost wholly below
// the horizon. Eigenvalues below kLeastShare are left out of the inverse. They would amplify the
// noise of the moments. 26 of 36 directions are left at order 5; an odd continuation below the
// horizon uses 15. Tested in tests/math/hemisphere_dual_test.cpp.

#include <array>
#include <vector>

#include "fibers/math/spherical_harmonics.h"

namespace heddle {

class HemisphereDual {
 public:
  /// Share of a function's square that must lie above the horizon. At order 5 any value between
  /// 0.011 and 0.09, the eigenvalues nearby, makes the same choice. The figures that chose 0.05:
  /// docs/decisions.md.
  static constexpr double kLeastShare = 0.05;

  /// One object per order, kept. order <= kMaxShOrder.
  static const HemisphereDual& of_order(int order);

  /// G^+ times `values` ([sh_count(order)]), in place.
  void apply(float* values) const;

 private:
  explicit HemisphereDual(int order);
  int order_;
  // [|m|] (order + 1 - |m|)^2, row-major over l = |m| .. order: G couples equal m only, and equally
  // for both signs.
  std::array<std::vector<float>, kMaxShOrder + 1> blocks_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_HEMISPHERE_DUAL_H_
