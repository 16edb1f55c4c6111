#ifndef HEDDLE_RENDER_SURFACE_TANGENT_CURVE_H_
#define HEDDLE_RENDER_SURFACE_TANGENT_CURVE_H_
// How a thread's tangent is distributed over the smallest patch of a weave: Sadeghi et al. 2013,
// section 5.1 and table II.
//
// A curve is given by control points: the tangent's angle from the cloth at each, and the arc
// length between neighbours. The angle is linear in arc length in between. A segment of no length
// is a jump. Sums over equally spaced samples of a curve converge to an integral over the
// distribution of the angle alone, whatever the order along the curve. The distribution has
// constant density on each ramp and an atom for each flat segment. It is computed here; a few
// samples in its place give wrong highlights. Tested in
// tests/render/surface/tangent_curve_test.cpp.

#include <vector>

namespace heddle {

/// Angles from `begin` to `end` (radians), evenly, with a share of the whole thread; an atom where
/// begin = end.
struct TangentPiece {
  double begin;
  double end;
  double share;
};

/// The distribution of a curve with offsets [n] in radians and lengths [n - 1] >= 0, not all 0.
/// Pieces are sorted, do not overlap, and their shares sum to 1; atoms come before ramps.
std::vector<TangentPiece> tangent_distribution(const std::vector<double>& offsets,
                                               const std::vector<double>& lengths);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_TANGENT_CURVE_H_
