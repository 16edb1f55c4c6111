#ifndef HEDDLE_FIBERS_CLOTH_YARN_SECTION_H_
#define HEDDLE_FIBERS_CLOTH_YARN_SECTION_H_
// Where plies lie in a yarn's cross-section and fibers in their ply's. After Zhao, Luan, Bala 2016
// (section 3): a ply is an ellipse whose short axis points to the yarn's axis, and the distance of
// fibers from the ply's axis has a two-parameter density. Tested in
// tests/fibers/cloth/yarn_section_test.cpp.

#include <vector>

namespace heddle {

/// The ellipse that the fibers of a ply fill, and its place. All in one unit of length.
struct PlyShape {
  double centre = 0;      // distance of the ply's axis from the yarn's axis
  double radial = 1;      // semi-axis towards the yarn's axis
  double tangential = 1;  // semi-axis across
};

/// Circles that touch each other and the edge of the unit disc. Two plies are stretched across the
/// line of their centres as far as the disc allows (semi-axis sqrt(1/2)).
PlyShape touching_plies(int plies);

/// Largest distance of a point of the ply's ellipse from the yarn's axis.
double reach_of(const PlyShape& shape);

/// p(R) = (1 - 2 epsilon) ((e - e^R) / (e - 1))^beta + epsilon, per area of the ply's unit disc,
/// not normalised (Zhao et al. 2016, equation 3). beta = 0 spreads fibers evenly.
struct RadialDensity {
  double epsilon = 0;  // 0 .. 0.5
  double beta = 0;

  double at(double radius) const;
};

/// Distances from the ply's axis with a radial density, by inversion.
class RadialPlaces {
 public:
  explicit RadialPlaces(const RadialDensity& density);

  /// The radius, 0 .. 1, within which this share of the fibers lies. Where they lie evenly it is
  /// the root of the share.
  double radius(double share) const;
  /// The share of the fibers within a radius.
  double share(double radius) const;

 private:
  std::vector<double> cumulative_;  // [step of the radius], 0 .. 1; empty where they lie evenly
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_SECTION_H_
