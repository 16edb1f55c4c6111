#include "fibers/cloth/yarn_section.h"

#include <algorithm>
#include <cmath>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

// Radii at which the cumulative density is kept. Between them it is taken as a power of the radius
// that is linear in the area, which is exact at the axis.
constexpr std::size_t kRadialSteps = 1024;

}  // namespace

PlyShape touching_plies(int plies) {
  if (plies == 1) return {0, 1, 1};
  if (plies == 2) return {0.5, 0.5, std::sqrt(0.5)};
  const double s = std::sin(kPi / plies);
  const double radius = s / (1 + s);
  return {1 - radius, radius, radius};
}

double reach_of(const PlyShape& shape) {
  // A point (centre + radial cos t, tangential sin t): its squared distance is quadratic in cos t.
  const double bulge = shape.tangential * shape.tangential - shape.radial * shape.radial;
  const double at = shape.centre * shape.radial;
  const double cosine = bulge > at ? at / bulge : 1;
  return std::hypot(shape.centre + shape.radial * cosine,
                    shape.tangential * std::sqrt(1 - cosine * cosine));
}

double RadialDensity::at(double radius) const {
  const double e = std::exp(1.0);
  const double inside = std::max(0.0, (e - std::exp(radius)) / (e - 1));
  return (1 - 2 * epsilon) * std::pow(inside, beta) + epsilon;
}

RadialPlaces::RadialPlaces(const RadialDensity& density) {
  if (density.beta == 0) return;
  // Midpoints: the density may rise steeply at the edge.
  cumulative_.assign(kRadialSteps + 1, 0);
  for (std::size_t k = 0; k < kRadialSteps; ++k) {
    const double radius = (static_cast<double>(k) + 0.5) / kRadialSteps;
    cumulative_[k + 1] = cumulative_[k] + density.at(radius) * radius;
  }
  for (double& share : cumulative_) share /= cumulative_.back();
}

double RadialPlaces::radius(double share) const {
  if (cumulative_.empty()) return std::sqrt(share);
  const auto above = std::upper_bound(cumulative_.begin() + 1, cumulative_.end() - 1, share);
  const auto k = static_cast<double>(above - cumulative_.begin());
  const double part = (share - *(above - 1)) / (*above - *(above - 1));
  // From radius (k - 1) / steps to k / steps, linear in the square.
  return std::sqrt((k - 1) * (k - 1) + part * (2 * k - 1)) / kRadialSteps;
}

double RadialPlaces::share(double radius) const {
  if (cumulative_.empty()) return radius * radius;
  const double place = std::clamp(radius, 0.0, 1.0) * kRadialSteps;
  const double k = std::min(std::floor(place), kRadialSteps - 1.0);
  const double part = (place * place - k * k) / (2 * k + 1);
  const auto below = static_cast<std::size_t>(k);
  return cumulative_[below] + part * (cumulative_[below + 1] - cumulative_[below]);
}

}  // namespace heddle
