#ifndef HEDDLE_FIBERS_MATH_TAUT_STRING_H_
#define HEDDLE_FIBERS_MATH_TAUT_STRING_H_
// A string pulled tight between floor and ceiling, on equally spaced points of a periodic line. It
// is the shortest of all curves that fit, and of these the one with the smallest sum of squared
// steps. Found in linear time by the funnel algorithm of shortest paths (Lee and Preparata 1984).
// Tested in tests/math/taut_string_test.cpp.

#include <span>
#include <vector>

namespace heddle {

/// Heights of the string. floor[i] <= ceiling[i]; infinities mean that nothing is there. A string
/// that one height suits everywhere lies at the lowest such height above 0, or the highest below.
std::vector<double> taut_string(std::span<const double> floor, std::span<const double> ceiling);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_TAUT_STRING_H_
