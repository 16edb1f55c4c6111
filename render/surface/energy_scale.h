#ifndef HEDDLE_RENDER_SURFACE_ENERGY_SCALE_H_
#define HEDDLE_RENDER_SURFACE_ENERGY_SCALE_H_
// A factor g(w) for the highlights of the woven models that keeps energy and reciprocity.
// Highlights are multiplied by g(wi) g(wo), with g = min(1, room / highlights' directional albedo).
// Both factors are at most 1, and either is enough, so no direction returns more than arrives from
// it. The albedo is tabulated over directions. Tested in
// tests/render/surface/energy_scale_test.cpp.

#include <functional>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// Share of the room that is used: the rest is what the table and its interpolation may fall short
/// by.
inline constexpr double kEnergyMargin = 0.95;

/// Diffuse light of an energy-safe fabric returns this much at most.
inline constexpr double kMostDiffuse = 0.95;

/// A point of a three-dimensional lattice in the unit cube, of which any first `n` are spread
/// evenly.
Vec3d lattice_point(int n);

class EnergyScale {
 public:
  /// load(w): the highlights' directional albedo over what diffuse light leaves of 1, the largest
  /// channel; w above the horizon.
  explicit EnergyScale(const std::function<double(const Vec3d& w)>& load);

  double operator()(const Vec3d& w) const;

 private:
  static constexpr int kRows = 10;     // elevations, denser towards the horizon
  static constexpr int kColumns = 24;  // azimuths
  std::vector<double> load_;           // [row][column]
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_ENERGY_SCALE_H_
