#ifndef HEDDLE_FIBERS_CLOTH_BUNDLE_TANGENTS_H_
#define HEDDLE_FIBERS_CLOTH_BUNDLE_TANGENTS_H_
// The direction in which the fibers about a segment run together. It is the axis of the cone on
// which light stays while they scatter it. A fiber conserves the light's inclination to its own
// tangent. In a bundle, wander averages out, and the inclination to the bundle's mean is conserved
// best. Tested in tests/fibers/cloth/bundle_tangents_test.cpp.

#include <span>
#include <vector>

#include "fibers/cloth/exemplar.h"

namespace heddle {

/// Per segment the unit mean of the tangents whose midpoints lie within 4 of its radii (about two
/// rows of neighbours) on the periodic cloth. Tangents more than 26 degrees off belong to other
/// yarns and do not count; signs follow the segment's own.
std::vector<Vec3> bundle_tangents(const Exemplar& exemplar);

/// Root mean square of the angle between the segments' tangents and those of their bundles,
/// radians.
double bundle_spread(const Exemplar& exemplar, std::span<const Vec3> bundle_tangent);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_BUNDLE_TANGENTS_H_
