#ifndef HEDDLE_FIBERS_CLOTH_INTERPENETRATION_H_
#define HEDDLE_FIBERS_CLOTH_INTERPENETRATION_H_
// How far fibers of one yarn run through those of another. Real fibers cannot. Tested in
// tests/fibers/cloth/interpenetration_test.cpp.

#include <cstdint>

#include "fibers/cloth/exemplar.h"

namespace heddle {

struct Interpenetration {
  double share = 0;           // of all segments: those that overlap a fiber of another yarn
  double mean_depth = 0;      // of these, their deepest overlap, in radii of the thinner fiber
  double deepest = 0;         // of all overlaps, likewise
  std::uint32_t segment = 0;  // where the deepest is
};

/// Over all pairs of segments of different yarns on the periodic cloth. A fiber and its own copies
/// belong to one yarn, as do all copies of a yarn in the next tiles.
Interpenetration measure_interpenetration(const Exemplar& exemplar);

/// Smallest distance between the straight pieces from p0 to p1 and from q0 to q1.
float segment_distance(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_INTERPENETRATION_H_
