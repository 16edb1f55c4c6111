#ifndef HEDDLE_RENDER_LIGHTS_H_
#define HEDDLE_RENDER_LIGHTS_H_
// Lights at infinity: directional ones, and spherical Gaussians L(w) = irradiance G(w; axis, sharpness) /
// M(sharpness). `irradiance` is the integral of L over all directions, measured perpendicular to the axis;
// sharpness 0 is constant light from everywhere with L = irradiance / 4 pi. Tested in
// tests/render/lights_test.cpp.

#include <cstdint>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {

enum class LightType : std::uint8_t { kDirectional, kSphericalGaussian };

struct Light {
  LightType type = LightType::kDirectional;
  Vec3 axis = Vec3(0, 0, 1);  // unit, towards the light
  float sharpness = 0;        // spherical Gaussians only, >= 0
  Rgb irradiance = Rgb(1, 1, 1);

  bool is_directional() const { return type == LightType::kDirectional; }
};

/// How light is found: by shadow rays alone, by directions drawn from what scatters alone (which never meet a
/// directional light), or both, weighted by the power heuristic.
enum class LightEstimator : std::uint8_t { kShadowRays, kEscapes, kCombined };

/// Radiance from `direction`; 0 for directional lights, which no direction drawn otherwise can meet.
Rgb light_radiance(const Light& light, const Vec3& direction);

struct LightSample {
  Vec3 direction;
  Rgb weight;  // radiance / pdf; the irradiance for a directional light
  float pdf;   // 1/sr; 0 for a directional light
};
LightSample sample_light(const Light& light, RandomStream& random);

/// Density (1/sr) with which sample_light draws `direction`; 0 for directional lights.
float light_pdf(const Light& light, const Vec3& direction);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIGHTS_H_
