#ifndef HEDDLE_FIBERS_SCATTERING_WO_SPACE_H_
#define HEDDLE_FIBERS_SCATTERING_WO_SPACE_H_
// The frame of BcsdfTable::sh_coefficients.

#include "fibers/math/sampling.h"
#include "fibers/math/vector.h"

namespace heddle {

/// Axes of wo-space as rows: x = tangent, wo = (sin theta_o, cos theta_o, 0). Any y where wo is
/// along the tangent.
inline Mat3 wo_space(const Vec3& tangent, const Vec3& wo) {
  // Below this length of wo's part across the tangent, its direction is rounding error. Then any y
  // will do, since the BCSDF at theta_o = 90 degrees does not depend on it.
  constexpr float kAlong = 1e-5F;
  const Vec3 across = wo - wo.dot(tangent) * tangent;
  const float length = across.norm();
  const Vec3 y = length > kAlong ? Vec3(across / length) : Vec3(frame_about(tangent).col(1));
  Mat3 axes;
  axes.row(0) = tangent;
  axes.row(1) = y;
  axes.row(2) = tangent.cross(y);
  return axes;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_SCATTERING_WO_SPACE_H_
