#include "render/lights.h"

#include "fibers/math/sampling.h"

namespace heddle {

float light_pdf(const Light& light, const Vec3& direction) {
  return light.is_directional() ? 0.0F : spherical_gaussian_pdf(light.axis, light.sharpness, direction);
}

// The density of sampling is the shape of the light: G / M for both.
Rgb light_radiance(const Light& light, const Vec3& direction) {
  return light.irradiance * light_pdf(light, direction);
}

LightSample sample_light(const Light& light, RandomStream& random) {
  if (light.is_directional()) return {light.axis, light.irradiance, 0.0F};
  const Vec3 direction = sample_spherical_gaussian(light.axis, light.sharpness, random);
  return {direction, light.irradiance, light_pdf(light, direction)};
}

}  // namespace heddle
