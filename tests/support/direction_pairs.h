#ifndef HEDDLE_TESTS_SUPPORT_DIRECTION_PAIRS_H_
#define HEDDLE_TESTS_SUPPORT_DIRECTION_PAIRS_H_
// Pairs of directions above a surface where models of cloth go wrong: random, grazing, and opposite
// to each other.

#include <cmath>
#include <utility>

#include "fibers/math/sampling.h"

namespace heddle {

inline Vec3d random_above(RandomStream& random) {
  return sample_hemisphere(Vec3(0, 0, 1), random).cast<double>().normalized();
}

/// The k-th pair wi, wo: of any three, one is uniform, two have wi down to 1e-6 above the horizon,
/// and one of these has wo down to 1e-6 from the mirror image of wi.
inline std::pair<Vec3d, Vec3d> random_pair_above(RandomStream& random, int k) {
  Vec3d wi = random_above(random);
  Vec3d wo = random_above(random);
  if (k % 3 != 0) wi.z() *= std::pow(10, -6 * random.uniform_double());
  wi.normalize();
  if (k % 3 == 2) {
    wo = Vec3d(-wi.x(), -wi.y(), wi.z()) + std::pow(10, -6 * random.uniform_double()) * wo;
    wo.normalize();
  }
  return {wi, wo};
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_SUPPORT_DIRECTION_PAIRS_H_
