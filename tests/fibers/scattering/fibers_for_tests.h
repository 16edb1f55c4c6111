#ifndef HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
#define HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
// Fibers that the scattering tests loop over: measured ones (parameters as published for fabrics)
// and the ends of the ranges.

#include <string>
#include <vector>

#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle {

struct NamedFiber {
  std::string name;
  FiberScattering scattering;
};

inline FiberScattering fiber_in_degrees(const Rgbd& color_r, const Rgbd& color_tt, double beta_r,
                                        double beta_tt, double gamma_tt) {
  return {color_r, color_tt, radians(beta_r), radians(beta_tt), radians(gamma_tt)};
}

inline std::vector<NamedFiber> fibers_for_tests() {
  return {
      {"fleece", fiber_in_degrees({.040, .087, .087}, {.452, .725, .948}, 7.238, 10, 25.989)},
      {"gabardine", fiber_in_degrees({.185, .047, .069}, {.999, .330, .354}, 2.141, 10, 23.548)},
      {"silk", fiber_in_degrees({.745, .008, .070}, {.620, .553, .562}, 1, 10, 19.823)},
      {"cotton", fiber_in_degrees({.989, .959, .874}, {.999, .999, .999}, 1, 27.197, 38.269)},
      {"narrow", fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, .1, .1, 1)},
      {"wide", fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, 60, 60, 60)},
      {"narrow R, wide TT", fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, .1, 60, 10)},
      {"wide R, narrow TT", fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, 60, .1, 60)},
      {"black", fiber_in_degrees({0, 0, 0}, {0, 0, 0}, 1, 10, 20)},
      {"mirror", fiber_in_degrees({1, 1, 1}, {1, 1, 1}, 1, 10, 20)},
      {"opposite colours", fiber_in_degrees({1, 0, 0}, {0, 1, 0}, 1, 1, 180)},
  };
}

inline FiberScattering white_isotropic_fiber() {
  FiberScattering fiber;
  fiber.isotropic_white = true;
  return fiber;
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
