#ifndef HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
#define HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
// Fibers that the scattering tests loop over: measured ones (parameters as published for fabrics)
// and the ends of the ranges.

#include <string>
#include <vector>

#include "tests/support/fibers.h"

namespace heddle {

struct NamedFiber {
  std::string name;
  FiberScattering scattering;
};

inline std::vector<NamedFiber> fibers_for_tests() {
  return {
      {"fleece", test::fiber_in_degrees({.040, .087, .087}, {.452, .725, .948}, 7.238, 10, 25.989)},
      {"gabardine",
       test::fiber_in_degrees({.185, .047, .069}, {.999, .330, .354}, 2.141, 10, 23.548)},
      {"silk", test::silk_fiber()},
      {"cotton", test::fiber_in_degrees({.989, .959, .874}, {.999, .999, .999}, 1, 27.197, 38.269)},
      {"narrow", test::fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, .1, .1, 1)},
      {"wide", test::fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, 60, 60, 60)},
      {"narrow R, wide TT", test::fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, .1, 60, 10)},
      {"wide R, narrow TT", test::fiber_in_degrees({.3, .1, 0}, {.9, .5, .1}, 60, .1, 60)},
      {"black", test::fiber_in_degrees({0, 0, 0}, {0, 0, 0}, 1, 10, 20)},
      {"mirror", test::fiber_in_degrees({1, 1, 1}, {1, 1, 1}, 1, 10, 20)},
      {"opposite colours", test::fiber_in_degrees({1, 0, 0}, {0, 1, 0}, 1, 1, 180)},
  };
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_FIBERS_SCATTERING_FIBERS_FOR_TESTS_H_
