#ifndef HEDDLE_RENDER_SURFACE_FRESNEL_H_
#define HEDDLE_RENDER_SURFACE_FRESNEL_H_
// Reflectance of a smooth dielectric in air for unpolarised light. Tested in
// tests/render/surface/woven_segment_test.cpp.

#include <cmath>

namespace heddle {

/// cos_incidence in [0, 1]; ior >= 1 (index of the dielectric over that of air).
inline double fresnel_dielectric(double cos_incidence, double ior) {
  const double cos_refraction =
      std::sqrt(1.0 - (1.0 - cos_incidence * cos_incidence) / (ior * ior));
  const double s = (cos_incidence - ior * cos_refraction) / (cos_incidence + ior * cos_refraction);
  const double p = (cos_refraction - ior * cos_incidence) / (cos_refraction + ior * cos_incidence);
  return 0.5 * (s * s + p * p);
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_FRESNEL_H_
