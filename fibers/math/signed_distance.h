#ifndef HEDDLE_FIBERS_MATH_SIGNED_DISTANCE_H_
#define HEDDLE_FIBERS_MATH_SIGNED_DISTANCE_H_
// Signed geodesic distance on the sphere, in radians, from a direction to the nearest edge between
// open and closed cells of a lat-long map. It is positive where the map is open and negative where
// it is closed. It is +pi or -pi if all cells are alike.
//
// Wang et al. 2009 and Khungurn 2017, section 4.1, measure to the nearest opposite cell *centre*.
// That is biased outward by half a cell and, near the poles, by up to 2 degrees. Here it is the
// distance to the edge itself. Any way from a cell to an opposite one crosses a side shared by two
// cells that differ. So the edge is the union of those sides: arcs of parallels and of meridians.
// Tested in tests/math/signed_distance_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/math/spherical_map.h"
#include "fibers/math/vector.h"

namespace heddle {

/// Slow and exact, for any direction: the minimum over every side, in double precision.
class ExactSignedDistance {
 public:
  explicit ExactSignedDistance(SphericalMap map);
  /// `direction` has unit length.
  double operator()(const Vec3d& direction) const;

 private:
  struct Side {
    bool along_parallel;  // otherwise along a meridian
    double fixed;         // polar angle of the parallel, azimuth of the meridian
    double begin;         // azimuths of a parallel's arc, polar angles of a meridian's
    double end;
  };
  SphericalMap map_;
  std::vector<Side> sides_;
};

/// Fast, at all cell centres. On one parallel the distance grows with the azimuth between. So one
/// scan per parallel finds the nearest corner or side of each column, and the minimum over
/// parallels is a vector loop without branches. Feet of perpendiculars on meridian sides have no
/// such corner, and are searched by rising distance. Nothing is left out: the result differs from
/// ExactSignedDistance by float rounding only.
///
/// Distances are compared as h = 1 - cos d, with a rounding error below 3e-7 of its value. The
/// error is therefore below 3e-7 tan(d / 2) and, near the antipode, below sqrt(6e-7). The inverse
/// cosine adds 2e-7.
class SignedDistanceTransform {
 public:
  static constexpr double kMaxError = 5e-6;              // radians, for distances up to 3
  static constexpr double kMaxErrorNearAntipode = 1e-3;  // radians, beyond

  explicit SignedDistanceTransform(int resolution);
  /// distance: [row][column]
  void operator()(const SphericalMap& map, float* distance) const;

 private:
  // All distances are compared as 1 - cos(distance), sums of terms >= 0: nothing cancels near 0.
  LatLongGrid grid_;
  std::vector<float> polar_;    // [row][parallel] 1 - cos(polar angle between)
  std::vector<float> product_;  // [row][parallel] sin * sin
  std::vector<float> azimuth_;  // [half columns] 1 - cos(azimuth)
  // [row][column offset] 1 - cos(distance to the foot on the meridian)
  std::vector<float> foot_;
  std::vector<int> foot_row_;  // [row][column offset] row of the foot
  // meridians on either side, nearer than a quarter turn, that have a foot
  int foot_offsets_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SIGNED_DISTANCE_H_
