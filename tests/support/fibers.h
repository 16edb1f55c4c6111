#ifndef HEDDLE_TESTS_SUPPORT_FIBERS_H_
#define HEDDLE_TESTS_SUPPORT_FIBERS_H_
// The scattering of fibers that several tests use.

#include "fibers/math/vector.h"
#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle::test {

/// Longitudinal widths `beta` and the azimuthal width `gamma_tt` in degrees.
inline FiberScattering fiber_in_degrees(const Rgbd& color_r, const Rgbd& color_tt, double beta_r,
                                        double beta_tt, double gamma_tt) {
  return {color_r, color_tt, radians(beta_r), radians(beta_tt), radians(gamma_tt)};
}

/// Scatters all light, alike to all directions.
inline FiberScattering white_fiber() {
  FiberScattering fiber;
  fiber.isotropic_white = true;
  return fiber;
}

/// Smooth enough for coarse quadratures.
inline FiberScattering broad_fiber() {
  return fiber_in_degrees({.3, .2, .1}, {.9, .7, .4}, 10, 20, 30);
}

/// Silk as published for fabrics, with a highlight of one degree.
inline FiberScattering silk_fiber() {
  return fiber_in_degrees({.745, .008, .070}, {.620, .553, .562}, 1, 10, 19.823);
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_FIBERS_H_
