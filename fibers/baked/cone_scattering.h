#ifndef HEDDLE_FIBERS_BAKED_CONE_SCATTERING_H_
#define HEDDLE_FIBERS_BAKED_CONE_SCATTERING_H_
// What a fiber scatters of indirect light on cones (cone_transfer.h): the Gaussian about the
// light's cone, widened by the light's own, is multiplied by the fiber's lobes, in closed form in
// inclination and by points in azimuth about the bundle. Tested in
// tests/render/multiple_scattering_test.cpp.

#include <array>

#include "fibers/baked/cone_transfer.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"

namespace heddle {

/// Directions in fabric space, unit.
struct ConeView {
  Vec3 bundle_tangent;
  Vec3 tangent;
  Vec3 wo;
};

/// Radiance towards view.wo for light about `axis` (unit, fabric space). cones: what
/// Transfer::incoming_on_cones gave for it, [width][azimuth][rgb]. variance: that the light's own
/// width adds to a cone's, square radians.
Rgb scattered_from_cones(const float* cones, const Vec3& axis, float variance, const ConeView& view,
                         const BcsdfTable& bcsdf);

/// The same, split: what is scattered towards view.wo of light on each cone, for a light at the
/// inclination `theta` to the bundle: [width][azimuth][rgb], to be multiplied by `cones` and
/// summed.
using ConeResponse = std::array<float, ConeTransfer::kWidths * ConeTransfer::kAzimuths * 3>;
ConeResponse cone_response(float theta, float variance, const ConeView& view,
                           const BcsdfTable& bcsdf);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_CONE_SCATTERING_H_
